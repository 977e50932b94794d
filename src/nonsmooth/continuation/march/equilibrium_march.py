"""Marching along a branch of equilibria: steps, what is met on the way, the mode beyond a boundary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from nonsmooth.continuation.march.marches import INTERRUPTED, march_until
from nonsmooth.continuation.march.roots import zero_on
from nonsmooth.continuation.problems.equilibrium import Equilibria, Rest, hopf_number

__all__ = ["ENDS", "RestMarch", "march_rest"]

ENDS = {
    "range": "The branch reached the edge of the range.",
    "points": "The largest number of points was reached.",
    "no_convergence": "Newton's method did not converge, however small the step.",
    "boundary": (
        "The equilibrium meets the boundary of its mode, and no equilibrium of the mode beyond continues it: on the "
        "other side it is virtual."
    ),
    "interrupted": f"{INTERRUPTED}.",
}
FIRST, LEAST, COSINE = 1e-3, 1e-9, 0.98


@dataclass
class RestMarch:
    """Equilibria in the order of the march, special points with their places, and the ending (a key of ``ENDS``)."""

    rests: list[tuple[Equilibria, Rest]] = field(default_factory=list)
    special: list[tuple[str, int]] = field(default_factory=list)
    ending: str = "points"


def _numbers(rest: Rest) -> dict[str, float]:
    return {
        "fold": float(rest.tangent[-1]), "branch_point": rest.orientation, "hopf": hopf_number(rest.eigenvalues),
        "boundary": -float(rest.margins.max(initial=-np.inf)),
    }  # fmt: skip


def march_rest(curve: Equilibria, rest: Rest, bounds: tuple[float, float], largest: float, most: int) -> RestMarch:
    """Follow an equilibrium along its tangent until the branch ends."""
    return march_until(RestMarch(), _follow, curve, rest, bounds, largest, most)


def _follow(
    found: RestMarch, curve: Equilibria, rest: Rest, bounds: tuple[float, float], largest: float, most: int
) -> None:
    """March on, point by point, into ``found``."""
    ds = min(FIRST, largest)
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
            hopf = "focus_centre" if curve.linear else "hopf"
            name = {"boundary": "boundary_equilibrium", "hopf": hopf}.get(kind, kind)
            found.special.append((name, len(found.rests) - 1))
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
    """Return whether a pair +-i omega makes the sum of two eigenvalues vanish, and not two real ones."""
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
    """The zero of ``number`` between two points of the branch, its distance from the first, and the point."""
    return zero_on(lambda s: a if s == 0.0 else b if s == ds else curve.step(a, s), ds, number)
