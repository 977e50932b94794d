"""Orbits beside the end of a signature, whatever signature they have.

Beyond a boundary one simulated round tells which transitions happen, in which order: it gives a signature and a first
guess, Newton's method the orbit, and a simulated round of that orbit whether the signature was the right one; if not,
the signature that it shows is tried next. So corners, several events at one instant and segments that vanish or appear
need no rules of their own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.events.change import Change, Common, common_orbit, completes
from nonsmooth.continuation.problems.curve import passing
from nonsmooth.continuation.problems.orbits import OrbitPoint
from nonsmooth.continuation.problems.signature import Round
from nonsmooth.continuation.searches.settled import touching

ASIDE = 1e-9  # of the range: how far beyond the boundary orbits are looked for, and at ten times this and so on
FARTHEST = 3e-4  # of the range, or of the parameter's value where that is larger: no farther
NEARER = 0.1  # once more at this part of it: an orbit that the branch goes on with comes nearer
SHRINKS = 0.5  # by at least this factor (a square root: 0.32)
LINEAR = 0.2  # by at least this factor, orbits of other signatures
CHAIN = 3  # distances over which orbits of other signatures are seen to come nearer
NEAR = 0.05  # of the orbit's size
PERTURBED = 12  # rounds from about the orbit, on each side
POWERS = (2.0, 1.0, 0.5)  # of the distance in the parameter: how far from it, beside a square root as beside a kink
ROUNDS = 6  # signatures tried in a row
STEEP = 1e-3  # of a tangent: its parameter
ALONG = (1e-7, 1e-6, 1e-5)  # along the curve of a contact from the orbit where it has no speed
BACK = 1e-3  # of its distance: an orbit nearer than this to the branch that has come here is on it
NOISE = 1e-11  # of the orbit's size: a margin smaller than this is zero
EXACT = 1e-9  # of the orbit's size: orbits that meet are as near as this
STEPS = (1e-6, 1e-7, 1e-8)  # along a branch, each way: to the boundary beside which it was found, beyond rounding
JUMP = 1e-6  # of the orbit's size: as far it jumps where an impact becomes slow enough to be completed as rest
ROUNDING = 1e-12  # of an orbit's size: extremes of two orbits as near as this are the same
AGAIN = 3  # times that Newton's method is begun with one signature
MOST = 2000  # visits of a signature that is tried: Newton's method on more takes minutes


def beside(
    point: OrbitPoint, contacts: Sequence[Change] = (), passed: Sequence[OrbitPoint] = (), onward: bool = False
) -> OrbitPoint | None:
    """The orbit with which a branch goes on at ``point``, where its signature ends, on a curve of its own.

    ``contacts`` are those that may begin or end there, ``passed`` the points of the branch so far; ``onward``: the
    parameter does not turn there. Its tangent leads away from there. None where there is none, or no simulated round
    shows it.
    """
    common = [end for change in contacts if (end := common_orbit(change)) is not None]
    forward = float(np.sign(point.tangent[-1])) or 1.0
    sides = (forward,) if onward else (forward, -forward)
    nearest: dict[float, list[float]] = {side: [] for side in sides}  # of those found, at each distance
    ahead: tuple[float, OrbitPoint] | None = None  # one to which the branch jumps, and how far
    aside, farthest = ASIDE, FARTHEST * max(1.0, abs(point.value) / point.curve.width)
    while aside < farthest and (ahead is None or aside <= ahead[0]):  # farther off no orbit could be nearer
        for side, before in nearest.items():
            least = np.inf
            for found in _found(point, common, side, aside):
                apart, left = _apart(point, found), _left(point, found)
                arrives = left <= SHRINKS * apart + EXACT or _shrink([*before, apart])
                jumps = side == forward and left <= JUMP and _may_jump(point, found)
                if (arrives or jumps) and not (_is_own(point, found) or _came_by(point, found, passed)):
                    again = found.signature.cycle == point.signature.cycle  # of others, the last
                    found = _leading_away(found, side, side != forward and left <= EXACT)
                    if arrives and not again and (ahead is None or left < NEARER * ahead[0]):
                        return found
                    ahead = ahead or (aside if again else left, found)
                least = min(least, apart)
            before.append(least)
        aside *= 10.0
    if ahead is not None:
        return ahead[1]
    if not point.shooting.forced:  # behind a centre orbits of any size are closed
        return None
    others = (one for one in _along(common) if not (_is_own(point, one) or _came_by(point, one, passed)))
    return next(others, None)


def _along(common: list[Common]) -> Iterator[OrbitPoint]:
    """Orbits on the curves of contacts that leave their common orbits as square roots: by the speed of the contact."""
    for curve, solved, tangent in common:
        Y = solved.X / curve.scale
        for ds in ALONG if abs(float(tangent[-1])) < STEEP else ():
            for way in (tangent, -tangent):
                found = curve.near(Y + ds * way, way)
                if found is None or found.virtual or np.abs(found.Y - Y).max() > 2.0 * ds:
                    continue
                if curve.shows(found):
                    yield found


def _found(point: OrbitPoint, common: list[Common], side: float, aside: float) -> Iterator[OrbitPoint]:
    """Orbits at one distance on one side of the parameter that simulated rounds show, on curves of their own."""
    shooting, curve = point.shooting, point.curve
    values = point.values.copy()
    values[shooting.places] = there = np.array([point.value + side * aside * curve.width])
    tried = Counter({shooting.signature.cycle: AGAIN})
    tried -= Counter({other.shooting.signature.cycle: AGAIN for other, _, _ in common})
    for guess in _guesses(point, common, values, side * aside):
        for _ in range(ROUNDS):
            if guess is None or len(guess.times) > MOST or tried[guess.signature.cycle] >= AGAIN:
                break
            tried[guess.signature.cycle] += 1
            other, X = curve.around(guess, there)
            found = other.at_parameter(X / other.scale, float(there[0]))
            if found is None or not _apart(point, found) < NEAR:
                break
            if not found.virtual and curve.rounds.shows(other.shooting, found.X, values):
                yield found
                break
            # No orbit of the system: what its round shows is next.
            guess = curve.rounds.read(other.shooting, found.X, values)


def _guesses(point: OrbitPoint, common: list[Common], values: FloatArray, ahead: float) -> Iterator[Round | None]:
    """Rounds along the branch, from the end of the signature itself, and about it; that end without its touches.

    First the common orbits of contacts, along their tangents: beyond an impact without speed a round shows none nearby.
    """
    for other, there, tangent in common:
        if abs(float(tangent[-1])) > STEEP:
            yield other.shooting.once(there.X + ahead / float(tangent[-1]) * tangent * other.scale)
    shooting, curve, slope = point.shooting, point.curve, point.rise
    rounds = curve.rounds
    if abs(slope) > STEEP:
        yield rounds.read(shooting, point.X + ahead / slope * point.tangent * curve.scale, values)
    yield rounds.read(shooting, point.X, values)
    yield from touching(point.once, shooting.system)
    random = np.random.default_rng(0)
    for i in range(PERTURBED):
        change = abs(ahead) ** POWERS[i % 3] * random.uniform(-1.0, 1.0, shooting.n) * curve.size
        yield rounds.read(shooting, point.X, values, change)


def _apart(a: OrbitPoint, b: OrbitPoint) -> float:
    """Largest difference of extremes, in units of the states' sizes, and of the periods."""
    size = a.curve.size[: len(a.path.maximum)]
    extremes = np.concatenate([(a.path.maximum - b.path.maximum) / size, (a.path.minimum - b.path.minimum) / size])
    period = abs(float(a.solved.times[-1] - b.solved.times[-1])) / a.curve.period
    return max(float(np.nanmax(np.abs(extremes), initial=0.0)), period)


def _left(point: OrbitPoint, found: OrbitPoint) -> float:
    """Distance of an orbit from ``point`` as the parameter has all but come back to it."""
    nearer = found.curve.at_parameter(found.Y, point.value + NEARER * (found.value - point.value))
    return np.inf if nearer is None else _apart(point, nearer)


def _leading_away(found: OrbitPoint, side: float, doubtful: bool) -> OrbitPoint:
    """An orbit on one side of the parameter with the tangent that leads away from where it came from.

    Back where the branch has come from, as near as a boundary is located, the side may be rounding: then it leads to
    where orbits of the system are."""
    found = found if side * found.rise >= 0.0 else found.turned()
    for ds in STEPS if doubtful else ():
        ahead, behind = (one.curve.step(one, ds) for one in (found, found.turned()))
        if ahead is not None and behind is not None and ahead.virtual != behind.virtual:
            return found.turned() if ahead.virtual else found
    return found


def _may_jump(*sides: OrbitPoint) -> bool:
    """Return whether one of two orbits completes an impact as rest: it jumps there."""
    return any(completes(side, visit) for side in sides for visit in side.signature.crossings)


def _shrink(distances: list[float]) -> bool:
    """Return whether orbits of whatever signature come nearer and nearer: the last one belongs to the branch.

    Where impacts accumulate no signature lasts from one distance to the next."""
    last = distances[-CHAIN:]
    return len(last) == CHAIN and all(a <= LINEAR * b for a, b in pairwise(last))


def _is_own(point: OrbitPoint, found: OrbitPoint) -> bool:
    """Return whether an orbit lies on the branch that has come to ``point``: back from there, or so near to the
    boundary that only rounding says that it is not beyond."""
    ahead = (found.value - point.value) * point.rise > 0.0
    if ahead and found.signature.cycle != point.signature.cycle:
        return False
    own = point.curve.at_parameter(point.Y, found.value)
    if own is None or not _is_same(point, own, found):
        return False
    met = int(point.path.margins.argmin())  # the boundary
    return not ahead or bool(found.path.margins[met] < NOISE * point.curve.size.max())


def _came_by(point: OrbitPoint, found: OrbitPoint, passed: Sequence[OrbitPoint]) -> bool:
    """Return whether an orbit is one of those between the points of the branch so far, in whichever forcing period its
    section lies."""
    cycle, seen = found.signature.cycle, found.curve.seen(found)
    for a, b in pairwise(passed):
        if a.curve is b.curve and a.signature.cycle == cycle:
            x = passing(seen, a.curve.seen(a), b.curve.seen(b), -BACK)  # where the part begins too
            own = None if x is None else a.curve.at_parameter(a.Y + x * (b.Y - a.Y), found.value)
            if own is not None and _is_same(point, own, found):
                return True
    return False


def _is_same(point: OrbitPoint, own: OrbitPoint, found: OrbitPoint) -> bool:
    """Return whether two orbits near ``point`` are one."""
    return _apart(own, found) < BACK * _apart(point, found) + ROUNDING
