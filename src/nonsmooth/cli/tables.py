"""Files of TOML tables that a user wrote, read and checked, and places for what a command writes."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nonsmooth.errors import shortened
from nonsmooth.system.names import check_keys

__all__ = ["ANY", "LENGTH", "NAMES", "QUANTITIES", "TEXT", "read_tables", "with_folder"]

#: What a value must be: a check, and words.
Kind = tuple[Callable[[Any], bool], str]
ANY: Kind = lambda value: True, "anything"
TEXT: Kind = lambda value: isinstance(value, str), "a text, a name in quotes"
NAMES: Kind = (
    lambda value: isinstance(value, list) and all(isinstance(one, str) for one in value),
    'a list of names, as ["k", "c", "g"]',
)
LENGTH: Kind = lambda value: isinstance(value, int | float) and not isinstance(value, bool), "a length in m"
QUANTITIES: Kind = (
    lambda value: isinstance(value, dict), "a table of numbers or of { value = ..., uncertainty = ... }"
)  # fmt: skip


def read_tables(
    path: Path, known: Mapping[str, Mapping[str, Kind] | None], what: str = "study file",
    needed: Mapping[str, tuple[str, ...]] | None = None,
) -> dict[str, dict[str, Any]]:  # fmt: skip
    """The tables of a TOML file.

    Parameters
    ----------
    known : mapping
        The keys of each table and what their values must be; None where the caller checks them.
    needed : mapping, optional
        Keys that must be there, by table.

    Raises
    ------
    ValueError
        No such file, not TOML, an unknown table or key, a value of another kind; the message names the file.
    """
    if path.suffix in (".nc", ".zarr") and path.exists():
        raise ValueError(f"{path}: is a saved result and no {what}; `nonsmooth show {path}` shows it")
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
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
            fits, words = kinds[key]
            if not fits(value):
                raise ValueError(f"{place}: {key} = {shortened(value)} must be {words}")
    for name, keys in (needed or {}).items():
        if missing := [key for key in keys if key not in document.get(name, {})]:
            wanted = " and ".join(f'{key} = "..."' for key in missing)
            raise ValueError(f"{path}: needs a table [{name}] with {wanted}")
    return document


def with_folder(path: Path) -> Path:
    """The path, its folder made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
