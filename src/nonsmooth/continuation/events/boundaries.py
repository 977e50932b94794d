"""The ways in which an orbit can reach a boundary of its signature, as events of its branch."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np

from nonsmooth.continuation.events.change import Change, by_others, gained, inserted, is_tolerance, rest_after, without
from nonsmooth.continuation.march.event import BESIDE, Event, Met, Step
from nonsmooth.continuation.problems.signature import AT_ONCE

__all__ = ["BOUNDARIES", "Boundary", "Unseen", "passed_by"]

ENDS = 1e-4  # of the period: a maximum as near to a crossing belongs to it
JUMP = 1e-3  # of the numbers at both ends: one larger than this at its root has jumped there
LARGEST = 1e3
NO_SPEED = 1e-3  # of the steepest crossing: slower than this is a touch
UNSEEN = 1e-10  # along the branch: as near as an event is located that only simulations show


class Boundary(Event):
    """A margin of the path that vanishes (``Path.margins``): beyond it the signature is another one.

    Attributes
    ----------
    place : int
        Of the margin.
    ending : str, optional
        The end of a branch that does not go on behind it; its name where not given.
    """

    name = "corner"
    ending: str | None = None

    def __init__(self, place: int = -1) -> None:
        self.place = place

    def number(self, curve: Any, point: Any) -> float:
        """The margin."""
        return float(curve.margins(point)[self.place])

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the boundary is passed on the step, or lies at the beginning of the march.

        A branch that goes straight on stops at a section that a crossing passes, and nowhere else."""
        if step.virtual and not self.at_section(step.curve, step.b):
            return False
        return now < 0.0 and (was >= 0.0 or (step.first and not step.virtual))

    def at_section(self, curve: Any, point: Any) -> bool:
        """Return whether a crossing passes the section of a forced orbit here, and nothing else happens."""
        return False

    def contacts(self, curve: Any, point: Any) -> list[Change]:
        """Contacts that may begin or end here; none where it is about something else."""
        return []

    def counts(self, point: Any) -> bool:
        """Return whether a branch that goes straight on passes the boundary here."""
        return True

    @abstractmethod
    def surface(self, curve: Any, point: Any, beyond: Any = None) -> int:
        """The indicator of the surface that is reached (-1: of none).

        ``beyond`` is the curve on which the branch goes on."""


class Crossed(Boundary):
    """A margin of a crossing, or of a visit that begins or ends with one: its row nearest to zero tells the surface."""

    @abstractmethod
    def crossing(self, curve: Any, point: Any) -> tuple[int, int, Any, int]:
        """Visit, transition, state, and the row that fires: where the surface is that is reached."""

    def surface(self, curve: Any, point: Any, beyond: Any = None) -> int:
        """The indicator of the row that is nearest to zero (-1: of none)."""
        visit, k, z, fires = self.crossing(curve, point)
        times, _ = curve.shooting.split(point.X)
        t = float(times[min(visit, len(times) - 1)])
        rows = curve.shooting.system.traced.transitions[k].rows
        near = [(abs(curve.shooting.flow.jump(point.solved.values, k, t, z, r).h), row.indicator)
                for r, row in enumerate(rows) if r != fires]  # fmt: skip
        return min(near)[1] if near else -1


class Short(Crossed):
    """A visit shrinks to nothing."""

    def at_section(self, curve: Any, point: Any) -> bool:
        """Return whether the visit begins or ends at the section of a forced orbit."""
        return curve.shooting.forced and int(point.path.tau.argmin()) in (0, curve.shooting.m)

    def contacts(self, curve: Any, point: Any) -> list[Change]:
        """The orbit without a visit between two visits of one mode, where it shrinks without speed."""
        visits, path = curve.shooting.signature.visits, point.path
        i = int(path.tau.argmin())
        if i in (0, len(visits) - 1) or visits[i - 1].mode != visits[i + 1].mode or visits[i - 1].row < 0:
            return []
        slope = path.slope[curve.walk.conditional.tolist().index(i - 1)]
        steepest = float(np.abs(path.slope).max())
        if not (slope < NO_SPEED * max(steepest, 1e-300) or len(path.slope) < 3):
            return []
        return [without(curve, point, i - 1, 2)]

    def crossing(self, curve: Any, point: Any) -> tuple[int, int, Any, int]:
        """The end of the visit."""
        visit = int(point.path.tau.argmin())
        return visit, curve.shooting.signature.visits[visit].transition, point.solved.segments.z[visit], -1


class Slow(Crossed):
    """A crossing becomes a touch."""

    name = "grazing"

    def contacts(self, curve: Any, point: Any) -> list[Change]:
        """The orbit without an impact of no speed."""
        visits = curve.shooting.signature.visits
        i = self.crossing(curve, point)[0]
        count = 1
        while visits[i + count].row == AT_ONCE:  # an impact made of several transitions
            count += 1
        return [without(curve, point, i, count)] if visits[i + count].mode == visits[i].mode else []

    def crossing(self, curve: Any, point: Any) -> tuple[int, int, Any, int]:
        """The slowest crossing."""
        visit = int(curve.walk.conditional[int(point.path.slope.argmin())])
        return visit, curve.shooting.signature.visits[visit].transition, point.solved.segments.z[visit], -1


class Own(Crossed):
    """Two rows of the condition that fires vanish together."""

    def contacts(self, curve: Any, point: Any) -> list[Change]:
        """At a tolerance: the same impact by the other transition, and the orbit without it or the last before rest."""
        i, surface = self.crossing(curve, point)[0], self.surface(curve, point)
        if not is_tolerance(curve, surface):
            return []
        found, count = by_others(curve, point, i, surface), rest_after(curve, point, i)
        return found if count == 0 else [*found, without(curve, point, i, count or 1)]

    def crossing(self, curve: Any, point: Any) -> tuple[int, int, Any, int]:
        """The crossing with the least other row."""
        visit = int(curve.walk.conditional[int(point.path.own.argmin())])
        fires = curve.shooting.signature.visits[visit]
        return visit, fires.transition, point.solved.segments.z[visit], fires.row


class Touch(Boundary):
    """A transition that does not happen is touched within a visit."""

    name = "grazing"

    def contacts(self, curve: Any, point: Any) -> list[Change]:
        """The orbit with the transition, and if it leads to another mode with each of the ways back."""
        return inserted(curve, point)

    def counts(self, point: Any) -> bool:
        """Return whether the touch lies within its visit; at its end it is the other side of an impact of no speed."""
        visit, k = point.path.touched
        times = point.solved.times
        ends = np.abs(times[visit : visit + 2] - point.path.place[visit, k])
        return float(ends.min()) >= ENDS * float(times[-1])

    def surface(self, curve: Any, point: Any, beyond: Any = None) -> int:
        """The indicator that is touched."""
        return int(curve.walk.net.rows[point.path.which[point.path.touched], 0])


class Others(Crossed):
    """The condition of another transition holds too at the end of a visit."""

    def crossing(self, curve: Any, point: Any) -> tuple[int, int, Any, int]:
        """The end of the visit, and the other transition."""
        visit = int(point.path.others.argmax())
        return visit, int(point.path.other[visit]), point.solved.segments.z[visit], -1


class Landed(Crossed):
    """A reset leads onto the boundary of another transition."""

    ending = "landing"

    def counts(self, point: Any) -> bool:
        """Return whether a reset led there, and not the section, which passes behind a boundary."""
        return int(point.path.landed.argmax()) != 0

    def crossing(self, curve: Any, point: Any) -> tuple[int, int, Any, int]:
        """The beginning of the visit, and the transition that is reached."""
        visit = int(point.path.landed.argmax())
        return visit, int(point.path.landing[visit]), curve.shooting.split(point.X)[1][visit], -1


class Unseen(Boundary):
    """A simulated round takes other transitions than the signature, and no margin tells."""

    name = "grazing"

    def located(self, step: Step) -> tuple[float, Any] | None:
        """The first place on the step where a simulated round shows it.

        Margins are looked at in parts of a step: of two extremes within a part none shows. A simulation isolates them.
        """
        curve, low, high, there = step.curve, 0.0, step.end, step.b
        while high - low > UNSEEN:
            middle = 0.5 * (low + high)
            point = curve.between(step.a, step.b, middle)
            if point is None:
                return None
            if curve.shows(point):
                low = middle
            else:
                high, there = middle, point
        return high, there

    def surface(self, curve: Any, point: Any, beyond: Any = None) -> int:
        """The indicator of the first transition that the signature beyond has more often."""
        return gained(curve, beyond)


#: In the order of ``Path.margins``: what explains the others first.
BOUNDARIES = (Short(0), Slow(1), Own(2), Touch(3), Others(4), Landed(5))


def passed_by(step: Step) -> list[Met]:
    """Boundaries that a branch passes with its signature, either way; of those met together the best explained.

    Left out are those where the march begins, and what turns the section."""
    found: list[Met] = []
    begun = BESIDE if step.first else 0.0
    for kind, was, now in zip(BOUNDARIES, *step.margins, strict=True):
        there = kind.located(step) if was * now < 0.0 else None
        if there is None or there[0] > step.stop:
            continue
        jumped = abs(kind.number(step.curve, there[1])) > JUMP * min(max(abs(was), abs(now)), LARGEST)
        if jumped or not kind.counts(there[1]) or any(abs(there[0] - met.s) <= BESIDE for met in found):
            continue
        if there[0] > begun and not (step.cause == "change" and abs(there[0] - step.stop) <= BESIDE):
            found.append(Met(kind, *there, kind.name))
    return found
