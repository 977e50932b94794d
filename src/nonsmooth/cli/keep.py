"""Results that a command has computed are never lost: where the place asked for takes none, another one does."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonsmooth.cli.tables import with_folder

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["keep", "without_screen", "write"]


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
        raise DataFileError(f"{error}\n{_elsewhere(result, path)}") from error


def write(
    result: xr.Dataset, output: Mapping[str, str], folder: Path, name: Path, draw: Callable[[Any], Any]
) -> list[Path]:
    """Save the data and the figure that ``[output]`` asks for; returns what was written.

    Parameters
    ----------
    name : Path
        What to call the result where it must be kept elsewhere, because it was not saved and its figure fails.
    draw : function
        Draws the figure with ``nonsmooth.plot``, which it is given.

    Raises
    ------
    DataFileError
        In place of any error; it ends with where the result is.
    """
    from nonsmooth.errors import DataFileError

    written = [keep(result, folder / output["data"])] if "data" in output else []
    if "figure" in output:
        try:
            plot = without_screen()
            written.append(plot.save_figure(draw(plot), with_folder(folder / output["figure"])))
        except Exception as error:
            where = f"the result is in {written[0]}" if written else _elsewhere(result, name)
            raise DataFileError(f"{error}\n{where}") from error
    return written


def without_screen() -> Any:
    """``nonsmooth.plot``, for a process that shows no windows."""
    import matplotlib as mpl

    mpl.use("Agg")
    from nonsmooth import plot

    return plot


def _elsewhere(result: xr.Dataset, path: Path) -> str:
    """Save a result under a name of its own in the current folder, at home, or among temporary files; say where."""
    from nonsmooth.results.store import save

    name = f"{path.stem}-{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.nc"
    for folder in (Path.cwd(), Path(os.path.expanduser("~")), Path(tempfile.gettempdir())):
        try:
            return f"the result is kept in {save(result, folder / name)}"
        except (OSError, ValueError):
            continue
    return "the result could not be kept anywhere"
