"""Warnings of motions that are too small for the scales of a system."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.system import System

LEAST = 1e-3  # the least size of a motion, in units of the states' scales
RESTING = 5e-7  # in the same units: a smaller state is rounding beside a motion
NOTHING = 1e-15  # and where nothing moves more


def warn_if_small(system: System, *sizes: FloatArray) -> None:
    """Warn of states that never leave the size below which a motion counts as rest.

    Parameters
    ----------
    *sizes : array (..., n)
        Values of the states on attractors: starts, extremes.
    """
    _warn(system, sizes, RESTING, "where a motion counts as rest, so attractors may not be told apart or found")


def warn_if_slow(system: System, *sizes: FloatArray) -> None:
    """Warn of a run of a system with elements in which no state leaves that size: rest at a contact is told by scales.

    Parameters
    ----------
    *sizes : array (..., n)
        Values of the states on the run.
    """
    loads = system._description.loads
    if loads is not None and loads.elements:
        _warn(system, sizes, np.inf, "by which impacts are told from rest and contact from none, so both may be wrong")


def _warn(system: System, sizes: tuple[FloatArray, ...], resting: float, what: str) -> None:
    """Warn of small states, in a sentence; beside larger ones only of those above ``resting``."""
    scale = system.scale_vector()
    largest = np.max([np.nanmax(np.abs(one).reshape(-1, len(scale)), axis=0, initial=0.0) for one in sizes], axis=0)
    low = largest < LEAST * scale
    small = np.flatnonzero(low & (largest > (NOTHING if low.all() else resting) * scale))
    if small.size:
        names = list(system.states)
        told = ", ".join(f"{names[j]!r}: {largest[j]:.2g}" for j in small)
        warnings.warn(
            f"{system.name!r}: these states stay below {LEAST:g} of their scale, {what}; give System(scale={{{told}}})",
            stacklevel=5,
        )
