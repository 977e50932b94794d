"""Reproductions of published papers: distributions of their own, found by the entry points ``nonsmooth.studies``.

Each names a package with ``reproduce(out, figures, quick, full, progress)``. ``savi2007`` is that of the paper this
package began with: its virtual rig, ``nonsmooth.identify``, and its records laid over the model.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from nonsmooth.errors import unknown

__all__ = ["installed", "study"]


def installed() -> dict[str, EntryPoint]:
    """The studies that are installed, by name."""
    return {entry.name: entry for entry in entry_points(group="nonsmooth.studies")}


def study(name: str, part: str = "") -> Any:
    """Return the package of a study, or a module of it.

    Raises
    ------
    ValueError
        No study of this name is installed.
    """
    found = installed()
    if name not in found:
        text = unknown(name, "a study", "this installation", list(found))
        raise ValueError(f"{text}. In a clone of nonsmooth: python -m pip install ./studies/savi2007")
    return import_module(f"{found[name].value}.{part}" if part else found[name].value)
