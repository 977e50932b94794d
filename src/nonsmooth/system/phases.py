"""Phases of time-triggered transitions: numbers, or functions of the parameters."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced


def phases(traced: Traced) -> NDArray[np.float64]:
    """One for each transition: -1 where it has a condition, 0 where the phase depends on the parameters."""
    given = [-1.0 if at is None else at for at in _expressions(traced)]
    return np.array([0.0 if hasattr(at, "free_symbols") else at for at in given], dtype=float)


@lru_cache(maxsize=32)
def varying_phases(traced: Traced) -> Callable[[Any], NDArray[np.float64]] | None:
    """The same as a function of the parameters' values; None where no phase depends on them."""
    found = _expressions(traced)
    if not any(hasattr(at, "free_symbols") for at in found):
        return None
    import sympy as sp

    function = sp.lambdify(traced.p, [-1.0 if at is None else at for at in found], modules="math")
    return lambda values: np.array(function(*np.asarray(values, dtype=float).tolist()), dtype=float)


@lru_cache(maxsize=32)
def phase_slopes(traced: Traced, places: tuple[int, ...]) -> Callable[[Any], NDArray[np.float64]]:
    """Derivatives (transitions, parameters) of the phases in the parameters at ``places``."""
    import sympy as sp

    rows = [[sp.diff(at, traced.p[i]) if hasattr(at, "diff") else 0 for i in places] for at in _expressions(traced)]
    shape = len(rows), len(places)
    function = sp.lambdify(traced.p, [entry for row in rows for entry in row], modules="math")
    return lambda values: np.array(function(*np.asarray(values, dtype=float).tolist()), dtype=float).reshape(shape)


def _expressions(traced: Traced) -> list[Any]:
    return [jump.at for jump in traced.transitions]
