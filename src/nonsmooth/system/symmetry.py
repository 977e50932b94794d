"""A symmetry: a map of the state (and of the modes) together with a shift of the forcing's phase."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError, unknown
from nonsmooth.system.kinds import real_number
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.traced import Traced
from nonsmooth.system.symbolic.tracing import call_vector

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.tracing import Symbols


@dataclass(frozen=True)
class Symmetry:
    """``u(t) -> map(u(t + shift * T))`` takes solutions to solutions; ``modes[i]`` is the mode mode i becomes."""

    map: tuple[sp.Expr, ...]
    shift: float
    modes: tuple[int, ...]


def trace_symmetry(given: Any, traced: Traced, symbols: Symbols, values: Mapping[sp.Symbol, float]) -> Symmetry:
    """Trace ``(map, shift)`` or ``(map, shift, {mode: mode})`` and check it on the vector fields, at some ``values``:
    ``map(u)`` or ``map(t, u, p)``, the shift in periods, modes that change places."""
    if not isinstance(given, (tuple, list)) or len(given) not in (2, 3) or not callable(given[0]):
        raise SystemDefinitionError(f"`symmetry` is (map, shift) or (map, shift, modes), not {given!r}")
    try:
        short = len(inspect.signature(given[0]).parameters) == 1
    except (TypeError, ValueError):
        short = False
    arguments = (symbols.states(),) if short else symbols.arguments()
    image = call_vector(given[0], arguments, traced.state_names, "the map of `symmetry`")
    shift = real_number(given[1], "the shift of `symmetry`")
    if shift and traced.period is None:
        raise SystemDefinitionError("`symmetry` shifts the phase of the forcing, but the system has no forcing period")
    names, swap = traced.mode_names, dict(given[2]) if len(given) == 3 else {}
    for mode in (*swap, *swap.values()):
        if mode not in names:
            raise SystemDefinitionError(f"symmetry: {unknown(mode, 'a mode', 'this system', names)}")
    modes = tuple(names.index(swap.get(mode, mode)) for mode in names)
    if sorted(modes) != list(range(len(names))):
        raise SystemDefinitionError(f"symmetry: the modes {swap} must change places with one another")
    symmetry = Symmetry(image, shift, modes)
    _check(symmetry, traced, values)
    return symmetry


def _check(symmetry: Symmetry, traced: Traced, values: Mapping[sp.Symbol, float]) -> None:
    """Compare D map . f_i(t, u) with f_j(t + shift T, map(u)) at fixed pseudo-random points."""
    random = np.random.default_rng(3)
    later = traced.t + symmetry.shift * (traced.period if traced.period is not None else 0)
    moved = dict(zip(traced.u, symmetry.map, strict=True)) | {traced.t: later}
    jacobian = sp.Matrix(symmetry.map).jacobian(traced.u)
    point = [random.uniform(0.1, 0.9, (5, *size)) for size in ((), (len(traced.u),), (len(traced.m),))]
    for i, j in enumerate(symmetry.modes):
        pushed = jacobian * sp.Matrix(traced.fields[i])
        there = sp.Matrix(traced.fields[j]).subs(moved, simultaneous=True)
        found = numeric(traced, (*pushed, *there))([*values.values()], *point).reshape(5, 2, -1)
        for one, other in found[np.isfinite(found).all(axis=(1, 2))]:
            if not np.allclose(one, other, rtol=1e-8, atol=1e-9):
                raise SystemDefinitionError(
                    f"`symmetry` does not take mode {traced.mode_names[i]!r} to {traced.mode_names[j]!r}: "
                    f"the mapped field differs from the field at the mapped state "
                    f"(modes that change places are given as a third entry, {{'left': 'right', 'right': 'left'}})"
                )
