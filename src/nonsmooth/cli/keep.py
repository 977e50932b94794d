"""Results that a command has computed are never lost: where the place asked for takes none, another one does."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from nonsmooth.cli.tables import with_folder

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["keep", "keep_elsewhere", "kept_whatever_comes"]


def keep(result: xr.Dataset, path: Path) -> Path:
    """Save a result; where that fails, elsewhere.

    Raises
    ------
    DataFileError
        It is not where it was asked for; the message says why, and where it is.
    """
    from nonsmooth.errors import DataFileError
    from nonsmooth.results.store import save

    try:
        return save(result, with_folder(path))
    except Exception as error:
        raise DataFileError(f"{error}\n{keep_elsewhere(result, path)}") from error


@contextmanager
def kept_whatever_comes(result: xr.Dataset, saved: list[Path], name: Path) -> Iterator[None]:
    """Make an error in further work on a result end with where the result is.

    Parameters
    ----------
    saved : list of Path
        Where the result is saved already; empty if it is not.
    name : Path
        What to call it where it must be kept elsewhere.

    Raises
    ------
    DataFileError
        In place of any error.
    """
    from nonsmooth.errors import DataFileError

    try:
        yield
    except Exception as error:
        where = f"the result is in {saved[0]}" if saved else keep_elsewhere(result, name)
        raise DataFileError(f"{error}\n{where}") from error


def keep_elsewhere(result: xr.Dataset, path: Path) -> str:
    """Save a result under a name of its own in the current folder, at home, or among temporary files; say where."""
    from nonsmooth.results.store import save

    name = f"{path.stem}-{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.nc"
    for folder in (Path.cwd(), Path(os.path.expanduser("~")), Path(tempfile.gettempdir())):
        try:
            return f"the result is kept in {save(result, folder / name)}"
        except (OSError, ValueError):
            continue
    return "the result could not be kept anywhere"
