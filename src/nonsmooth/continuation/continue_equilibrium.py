"""``continue_equilibrium``: follow an equilibrium of an autonomous system, to where cycles are born."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.continuation.equilibrium import Equilibria, Rest, hopf_number
from nonsmooth.continuation.physical import allowed_range
from nonsmooth.errors import SolveError
from nonsmooth.flow.arguments import check_system, real_number, whole_number
from nonsmooth.flow.starts import first_state

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["ENDS", "continue_equilibrium"]

ENDS = {
    "range": "The branch reached the edge of the range.",
    "points": "The largest number of points was reached.",
    "no_convergence": "Newton's method did not converge, however small the step.",
    "boundary": (
        "The equilibrium meets the boundary of its mode, and no equilibrium of the mode beyond continues it: on the "
        "other side it is virtual."
    ),
}
FIRST, LEAST, COSINE = 1e-3, 1e-9, 0.98


@dataclass
class _March:
    rests: list[tuple[Equilibria, Rest]] = field(default_factory=list)
    special: list[tuple[str, int]] = field(default_factory=list)
    ending: str = "points"


def continue_equilibrium(
    system: System,
    parameter: str,
    range: tuple[float, float],
    *,
    start: Any = None,
    mode: str | None = None,
    step: float = 0.02,
    points: int = 1000,
) -> xr.Dataset:
    """Follow an equilibrium of an autonomous system in a parameter.

    Parameters
    ----------
    system : System
    parameter : str
    range : (low, high)
        From the system's own value it goes both ways.
    start : state, optional
        A guess; zeros where not given.
    mode : str, optional
        The mode it lies in; the first one with an admissible equilibrium near the guess where not given.
    step : float
        The largest step, in units of the range and of the states' scales.
    points : int
        The largest number of points each way.

    Returns
    -------
    xarray.Dataset
        Over ``point``: the parameter, ``u(point, state)``, ``eigenvalues``, ``stable``, ``mode``; special points as in
        :func:`nonsmooth.special_points`: ``fold``, ``branch_point``, ``hopf`` (a row given to ``continue_orbit`` gives
        the cycles born there), ``boundary_equilibrium``.

    Raises
    ------
    ValueError, TypeError
        A system with time in its equations, arguments that do not fit.
    SolveError
        No equilibrium was found near the guess.
    """
    check_system(system, "continue_equilibrium")
    if system.depends_on_time:
        raise ValueError(f"{system.name!r} depends on time: it has no equilibria; find_orbit finds its periodic orbits")
    if parameter not in system.values:
        system.with_parameters({str(parameter): 0.0})  # raises with the names there are
    low, high = (real_number(x, "an end of the range") for x in range)
    here = system.values[parameter]
    if not low < high or not low <= here <= high:
        raise ValueError(f"range = {range!r} must rise and hold the present value {parameter} = {here!r}")
    largest, most = real_number(step, "step"), whole_number(points, "points", 1)
    state = first_state(system, start, mode)
    curves = {
        i: Equilibria(system, i, parameter, high - low)
        for i, name in enumerate(system.modes) if mode is None or name == mode
    }  # fmt: skip
    first = None
    for curve in curves.values():
        found = curve.at(np.nan_to_num(state.u), here)
        if found is not None and (found.margins <= 0.0).all():
            first = (curve, found)
            break
    if first is None:
        raise SolveError(
            "no equilibrium was found from this start: Newton's method did not converge in any mode, or what it found "
            "lies outside its mode. Give a nearer start",
            status="no_convergence",
        )
    bounds = allowed_range(system, parameter, low, high)
    curve, rest = first
    rest = _facing(rest, 1.0)
    up = _march(curve, rest, bounds, largest, most)
    down = _march(curve, _facing(rest, -1.0), bounds, largest, most)
    n = len(down.rests)
    rests = [*down.rests[::-1], (curve, rest), *up.rests]
    special = [(kind, n - 1 - i) for kind, i in down.special[::-1]] + [(kind, n + 1 + i) for kind, i in up.special]
    return _dataset(system, parameter, rests, special, (down.ending, up.ending), {
        "parameter": parameter, "range": (low, high), "step": largest, "points": most, "mode": mode,
        "start": [float(x) for x in state.u],
    })  # fmt: skip


def _facing(rest: Rest, sign: float) -> Rest:
    if rest.tangent[-1] * sign >= 0:
        return rest
    return replace(rest, tangent=-rest.tangent, orientation=-rest.orientation)


def _numbers(rest: Rest) -> dict[str, float]:
    return {
        "fold": float(rest.tangent[-1]), "branch_point": rest.orientation, "hopf": hopf_number(rest.eigenvalues),
        "boundary": -float(rest.margins.max(initial=-np.inf)),
    }  # fmt: skip


def _march(curve: Equilibria, rest: Rest, bounds: tuple[float, float], largest: float, most: int) -> _March:
    found, ds = _March(), min(FIRST, largest)
    while len(found.rests) < most:
        new = curve.step(rest, ds)
        if new is None or (ds > LEAST and float(new.tangent @ rest.tangent) < COSINE):
            ds *= 0.5
            if ds < LEAST:
                found.ending = "no_convergence"
                break
            continue
        before, after = _numbers(rest), _numbers(new)
        events: list[tuple[float, str, Rest]] = []
        for kind, was in before.items():
            if was * after[kind] < 0.0 or (np.isinf(was) and after[kind] < 0.0):
                there = _root(curve, rest, new, ds, _Number(kind))
                if there is not None and (kind != "hopf" or _oscillates(there[1])):
                    events.append((there[0], kind, there[1]))
        edge = bounds[0] if new.value < bounds[0] else bounds[1]
        if not bounds[0] <= new.value <= bounds[1]:
            there = _root(curve, rest, new, ds, _Edge(edge))
            if there is not None:
                events.append((there[0], "range", there[1]))
        folds = [s for s, kind, _ in events if kind == "branch_point"]
        ended = False
        for s, kind, place in sorted(events, key=lambda event: event[0]):
            if kind == "fold" and any(abs(s - other) < 1e-6 for other in folds):
                continue
            found.rests.append((curve, place))
            if kind == "range":
                found.ending, ended = "range", True
                break
            found.special.append(("boundary_equilibrium" if kind == "boundary" else kind, len(found.rests) - 1))
            if kind == "boundary":
                beyond = _beyond(curve, place)
                if beyond is None:
                    found.ending, ended = "boundary", True
                    break
                curve, new = beyond
                found.rests.append((curve, new))
                break
        else:
            found.rests.append((curve, new))
        if ended:
            break
        rest, ds = new, min(1.5 * ds, largest)
    return found


@dataclass
class _Number:
    """One of the numbers that are watched."""

    kind: str

    def __call__(self, rest: Rest) -> float:
        return float(np.clip(_numbers(rest)[self.kind], -1e3, 1e3))


@dataclass
class _Edge:
    """The parameter's distance from the edge of its range."""

    edge: float

    def __call__(self, rest: Rest) -> float:
        return rest.value - self.edge


def _oscillates(rest: Rest) -> bool:
    """Whether a pair +-i omega makes the sum of two eigenvalues vanish, and not two real ones."""
    nearest = rest.eigenvalues[np.argmin(np.abs(rest.eigenvalues.real))]
    return bool(abs(nearest.imag) > 1e-9)


def _beyond(curve: Equilibria, rest: Rest) -> tuple[Equilibria, Rest] | None:
    """The equilibrium of the mode behind the boundary, where the two meet; None where there is none."""
    jump = curve.system.transitions[int(rest.margins.argmax())]
    if jump.reset is not None or jump.target == curve.mode:
        return None
    width = float(curve.scale[-1])
    other = Equilibria(curve.system, jump.target, curve.parameter, width)
    common = other.at(rest.u, rest.value)
    if common is None or np.abs((common.u - rest.u) / curve.system.scale_vector()).max() > 1e-8:
        return None
    for sign in (1.0, -1.0):
        first = other.step(replace(common, tangent=sign * common.tangent), 1e-6)
        if first is not None and (first.margins <= 0.0).all():
            return other, first
    return None


def _root(curve: Equilibria, a: Rest, b: Rest, ds: float, number: Callable[[Rest], float]) -> tuple[float, Rest] | None:
    """The zero of ``number`` between two points of the branch."""
    from scipy.optimize import brentq

    known: dict[float, Rest] = {}

    def value(s: float) -> float:
        rest = a if s == 0.0 else b if s == ds else curve.step(a, s)
        if rest is None:
            raise ArithmeticError
        known[s] = rest
        return number(rest)

    try:
        s = float(brentq(value, 0.0, ds, xtol=1e-16, rtol=1e-15))
    except (ArithmeticError, ValueError, RuntimeError):
        return None
    return s, known[s]


def _dataset(
    system: System, parameter: str, rests: list[tuple[Equilibria, Rest]], special: list[tuple[str, int]],
    ended: tuple[str, str], options: dict[str, Any],
) -> xr.Dataset:  # fmt: skip
    from nonsmooth.results.branches import equilibria
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    labels = labels_of(system)
    n = max(curve.n for curve, _ in rests)
    eigenvalues = np.full((len(rests), n), np.nan + 0j)
    for row, (curve, rest) in zip(eigenvalues, rests, strict=True):
        row[: curve.n] = rest.eigenvalues
    attrs: dict[str, Any] = dict(provenance(labels, "continue_equilibrium", options, method="pseudo-arclength"))
    attrs["parameter"] = parameter
    arrays = {
        "u": np.array([rest.u for _, rest in rests]),
        "eigenvalues": eigenvalues,
        "stable": np.array([bool((rest.eigenvalues.real < 0).all()) for _, rest in rests]),
        "mode": np.array([curve.mode for curve, _ in rests]),
    }
    values = np.array([rest.value for _, rest in rests])
    return equilibria(labels, attrs, parameter, values, arrays, special, endings=ENDS, ended=ended)
