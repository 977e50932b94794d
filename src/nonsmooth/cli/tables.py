"""Files of TOML tables that a user wrote, read and checked, and places for what a command writes."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nonsmooth.system.names import check_keys

__all__ = ["read_tables", "with_folder"]


def read_tables(path: Path, allowed: Iterable[str], what: str = "study file") -> dict[str, dict[str, Any]]:
    """The tables of a TOML file.

    Raises
    ------
    ValueError
        No such file, not TOML, an unknown table, or something that is no table; the message names the file.
    """
    if path.suffix in (".nc", ".zarr") and path.exists():
        raise ValueError(f"{path}: is a saved result and no {what}; `nonsmooth show {path}` shows it")
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(f"{path}: no such {what}") from None
    except (ValueError, RecursionError) as error:  # TOML's and Unicode's own errors, thousands of digits or brackets
        raise ValueError(f"{path}: is not a TOML file: {error}") from None
    check_keys(document, allowed, str(path), "a table")
    for name, table in document.items():
        if not isinstance(table, dict):
            raise ValueError(f"{path}: `{name}` must be a table: write [{name}] and its keys below it")
    return document


def with_folder(path: Path) -> Path:
    """The path, its folder made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
