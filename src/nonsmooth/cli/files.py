"""Files of a command: TOML tables that a user wrote, read and checked; results, which are never lost."""

from __future__ import annotations

import os
import tempfile
import time
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from nonsmooth.errors import check_keys

if TYPE_CHECKING:
    import xarray as xr

TEXT = Annotated[str, "write a name in quotes"]


def read_tables(
    path: Path,
    known: Mapping[str, Mapping[str, Any] | None],
    what: str = "study file",
    needed: Mapping[str, tuple[str, ...]] | None = None,
) -> dict[str, dict[str, Any]]:
    """The tables of a TOML file.

    Parameters
    ----------
    known : mapping
        The keys of each table and what they may be, declared as arguments of verbs are (``nonsmooth.system.kinds``);
        None where the caller checks them.
    needed : mapping, optional
        Keys that must be there, by table.

    Raises
    ------
    ValueError
        No such file, not TOML, an unknown table or key, a value of another kind; the message names the file.
    """
    from nonsmooth.system.kinds import reader_of

    if path.suffix in (".nc", ".zarr") and path.exists():
        raise ValueError(f"{path}: is a saved result and no {what}; `nonsmooth show {path}` shows it")
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ValueError(f"{path}: no such {what}") from None
    except (ValueError, RecursionError) as error:  # TOML's and Unicode's own errors, thousands of digits or brackets
        raise ValueError(f"{path}: is not a TOML file: {error}") from None
    check_keys(document, known, str(path), "a table")
    for name, table in document.items():
        if not isinstance(table, dict):
            raise ValueError(f"{path}: `{name}` must be a table: write [{name}] and its keys below it")
        kinds = known[name]
        if kinds is None:
            continue
        place = f"{path}, table [{name}]"
        check_keys(table, kinds, place, "a key")
        for key, value in table.items():
            try:
                table[key] = reader_of(kinds[key])(value, key)
            except (TypeError, ValueError) as error:
                raise ValueError(f"{place}: {error}") from None
    for name, keys in (needed or {}).items():
        if missing := [key for key in keys if key not in document.get(name, {})]:
            wanted = " and ".join(f'{key} = "..."' for key in missing)
            raise ValueError(f"{path}: needs a table [{name}] with {wanted}")
    return document


def with_folder(path: Path) -> Path:
    """The path, its folder made if need be."""
    from nonsmooth.results.whole import REMEDY, WRITTEN, told

    with told(path, REMEDY, WRITTEN):
        path.parent.mkdir(parents=True, exist_ok=True)
    return path


def put_text(path: Path, text: str) -> Path:
    """Write a text file, or leave what stands there."""
    from nonsmooth.results.whole import placed

    with placed(with_folder(path)) as fresh:
        fresh.write_text(text, encoding="utf-8")
    return path


def keep(result: xr.Dataset, path: Path) -> Path:
    """Save a result; where that fails, elsewhere.

    DataFileError: it is not where it was asked for; the message says why, and where it is."""
    from nonsmooth.errors import DataFileError
    from nonsmooth.results.store import save

    try:
        return save(result, with_folder(path))
    except Exception as error:
        raise DataFileError(f"{error}\n{_elsewhere(result)}") from error


def write(result: xr.Dataset, output: Mapping[str, str], folder: Path, draw: Callable[[Any], Any]) -> list[Path]:
    """Save the data and the figure that ``[output]`` asks for; returns what was written.

    Parameters
    ----------
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
            where = f"the result is in {written[0]}" if written else _elsewhere(result)
            raise DataFileError(f"{error}\n{where}") from error
    return written


def without_screen() -> Any:
    """``nonsmooth.plot``, for a process that shows no windows."""
    import matplotlib as mpl

    mpl.use("Agg")
    from nonsmooth import plot

    return plot


def _elsewhere(result: xr.Dataset) -> str:
    """Save a result in the current folder, at home, or among temporary files, by a name that none refuses; say it."""
    from nonsmooth.results.store import save

    name = f"nonsmooth-{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.nc"
    for folder in (Path.cwd(), Path(os.path.expanduser("~")), Path(tempfile.gettempdir())):
        try:
            return f"the result is kept in {save(result, folder / name)}"
        except (OSError, ValueError):
            continue
    return "the result could not be kept anywhere"
