"""Libraries that only some formats need, and what to do where one is missing."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from nonsmooth.errors import not_installed
from nonsmooth.recordings.reading import Source

__all__ = ["needed"]


def needed(module: str, package: str, source: Source, extra: str = "experiment") -> ModuleType:
    """Import ``module``; where it is missing, a DataFileError that says how to get it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise source.error("", f"reading it needs {not_installed(package, extra)}") from error
