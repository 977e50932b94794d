"""Equilibria: states from which nothing moves, their eigenvalues, and what a verb says of one.

A state is an equilibrium of a mode where its vector field vanishes, at every time, and no transition leads out. Beside
it neighbours separate like exp(Re(lambda) t), lambda the eigenvalues of the field's Jacobian (under a forcing: the
multipliers of one period, lambda = log(mu) / T).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.flow.mode_fields import ModeField, mode_field
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from nonsmooth.flow.engines.engine import State
    from nonsmooth.system.symbolic.traced import Traced
    from nonsmooth.system.system import System

AT_REST = 1e-7  # of a state's size: nearer to an equilibrium than this is at it
ROUNDING = 1e-14  # and nearer than this nothing but rounding leads away
VANISHING = 1e-9  # of an eigenvalue's size, of an indicator's: zero
STEPS = 256  # of a forcing period, over which the Jacobian is taken as constant
SURE = 1e-3  # of a multiplier found so


@dataclass(frozen=True)
class Equilibrium:
    """A state from which nothing moves.

    ``eigenvalues`` stand largest real part first; under a forcing log|mu| / T stands in their place. ``kind`` is
    "stable", "unstable", or "undecided" where a real part is zero, the state lies on a boundary of its mode, or the
    eigenvalues are not known (transitions at phases).
    """

    u: FloatArray
    mode: str
    eigenvalues: ComplexArray
    kind: str
    forced: bool

    def words(self, states: Sequence[str]) -> str:
        """The equilibrium as part of a sentence."""
        place = ", ".join(f"{name} = {value:.6g}" for name, value in zip(states, self.u, strict=True))
        kind = {"stable": "a stable equilibrium", "unstable": "an unstable equilibrium"}.get(
            self.kind, "an equilibrium whose eigenvalues do not decide its stability"
        )
        told = "exponents" if self.forced else "eigenvalues"
        numbers = ", ".join(_number(one) for one in self.eigenvalues)
        return f"{place} (mode {self.mode!r}) is {kind}" + (f", {told} {numbers}" if numbers else "")


def equilibrium_at(
    system: System,
    u: FloatArray,
    mode: int,
    *,
    values: FloatArray | None = None,
    memory: FloatArray | None = None,
    near: float = AT_REST,
) -> Equilibrium | None:
    """The equilibrium of a mode at the state u, or nearer to it than ``near`` of its size; None where there is none."""
    traced = system.traced
    values = system.parameter_vector() if values is None else values
    memory = system.memory_vector() if memory is None else memory
    field, scale = mode_field(traced, mode), system.scale_vector()
    u = np.where(np.array(traced.lacking[mode], dtype=bool), 0.0, np.nan_to_num(u))
    size = (scale + np.abs(u))[field.own]
    f, J, _ = field.evaluate(u, values, memory)
    if not (np.isfinite(f).all() and np.isfinite(J).all()) or (np.abs(f) > near * (np.abs(J) @ size)).any():
        return None
    if not system.depends_on_time:
        step = np.linalg.lstsq(J * size, -f, rcond=None)[0]
        if np.abs(step).max(initial=0.0) > near:
            return None
        u[field.own] += step * size
        f, J, _ = field.evaluate(u, values, memory)
        if (np.abs(f) > VANISHING * (np.abs(J) @ size)).any():
            return None
        eigenvalues = sorted_eigenvalues(J)
    else:
        found = _under_forcing(system, field, u, values, memory)
        if found is None:
            return None
        eigenvalues = found
    u[np.abs(u) <= ROUNDING * scale] = 0.0
    h, h_u = field.indicators(u, values, memory)
    edge = VANISHING * (np.abs(h_u) @ (scale + np.abs(u)))
    margins = field.margins(h, edge)
    for k in np.flatnonzero(margins > 0.0):
        if not _rests_behind(system, int(k), u, values, memory, h, edge):
            return None  # a transition leads away
    kind = "undecided" if (margins >= 0.0).any() else _kind(eigenvalues, system.period_at(values))
    return Equilibrium(u, traced.mode_names[mode], eigenvalues, kind, system.depends_on_time)


def _rests_behind(
    system: System, k: int, u: FloatArray, values: FloatArray, memory: FloatArray, h: FloatArray, edge: FloatArray
) -> bool:
    """Return whether a condition holds only in part (some of its rows are zero), and the state rests beyond it too."""
    traced, jump = system.traced, system.traced.transitions[k]
    if all(abs(h[row.indicator]) > edge[row.indicator] for row in jump.rows):
        return False
    if jump.reset is not None and not _fixed(traced, jump.reset, u, values, memory):
        return False
    field = mode_field(traced, jump.target)
    f, J, _ = field.evaluate(u, values, memory)
    return bool((np.abs(f) <= AT_REST * (np.abs(J) @ (system.scale_vector() + np.abs(u))[field.own])).all())


def refuse_resting(system: System, starts: Sequence[State], points: FloatArray, verb: str) -> None:
    """ValueError where a system without forcing begins at an equilibrium, whatever the parameters: it never returns.

    Parameters
    ----------
    starts : sequence of State
    points : array (P, n_parameters)
        The first, the last and some between are looked at.
    """
    if system.depends_on_time:
        return
    some = np.unique(np.linspace(0, len(points) - 1, 8).astype(int))
    at: Equilibrium | None = None
    for start in starts:
        for i in some:
            mode = int(start.counters[0])
            at = equilibrium_at(system, start.u, mode, values=points[i], memory=start.memory, near=ROUNDING)
            if at is None:
                return
    if at is not None:
        raise ValueError(
            f"{verb} of {system.name!r} from an equilibrium: {at.words(list(system.states))}; from there no motion "
            "ever meets the section. Give start=, a state beside it"
        )


def sorted_eigenvalues(J: FloatArray) -> ComplexArray:
    """Eigenvalues (n,) of a Jacobian, largest real part first."""
    found = np.linalg.eigvals(J).astype(complex)
    return np.asarray(found[np.lexsort((-found.imag, -found.real))])


def _under_forcing(
    system: System, field: ModeField, u: FloatArray, values: FloatArray, memory: FloatArray
) -> ComplexArray | None:
    """log|mu| / T at a state that the forcing leaves alone; empty where unknown, None where it moves."""
    traced, period = system.traced, system.period_at(values)
    span = 1.0 if period is None else period
    n = len(field.own)
    M: NDArray[np.floating[Any]] = np.eye(n)
    for k in range(STEPS):
        f, J, _ = field.evaluate(u, values, memory, (k + 0.5) * span / STEPS)
        size = np.abs(J) @ (system.scale_vector() + np.abs(u))[field.own]
        if not np.isfinite(J).all() or (np.abs(f) > 1e-12 * size).any():
            return None
        half = 0.5 * span / STEPS * J
        M = np.linalg.solve(np.eye(n) - half, (np.eye(n) + half) @ M)
    timed = [jump for jump in traced.transitions if jump.at is not None and jump.source == field.mode]
    for jump in timed:
        if jump.target != field.mode or (jump.reset is not None and not _fixed(traced, jump.reset, u, values, memory)):
            return None
    if period is None or timed:
        return np.empty(0, dtype=complex)
    with np.errstate(divide="ignore"):
        return np.sort(np.log(np.abs(np.linalg.eigvals(M))) / period)[::-1].astype(complex)


def _fixed(traced: Traced, reset: Sequence[Any], u: FloatArray, values: FloatArray, memory: FloatArray) -> bool:
    """Return whether a reset leaves the state alone."""
    moved = np.abs(numeric(traced, tuple(reset))(values, 0.0, u, memory) - u)
    return bool((moved <= 1e-12 * np.maximum(np.abs(u), 1e-3)).all())


def _kind(eigenvalues: ComplexArray, period: float | None) -> str:
    if not len(eigenvalues):
        return "undecided"
    zero = VANISHING * np.abs(eigenvalues).max() if period is None else SURE / period
    growth = eigenvalues.real.max()
    return "unstable" if growth > zero else "stable" if growth < -zero else "undecided"


def _number(value: complex) -> str:
    if not value.imag:
        return f"{value.real:.6g}"
    return f"{value.real:.6g}{value.imag:+.6g}i"
