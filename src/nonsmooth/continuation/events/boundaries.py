"""The ways in which an orbit can reach a boundary of its signature, as events of its branch."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from nonsmooth.continuation.events.change import (
    Change,
    gained,
    inserted,
    is_tolerance,
    past_the_section,
    rest_after,
    without,
)
from nonsmooth.continuation.march.event import Event, Met, Step, first_beyond, locate
from nonsmooth.continuation.problems.orbits import OrbitPoint
from nonsmooth.continuation.problems.path import NOTHING
from nonsmooth.continuation.problems.shooting import ON

ENDS = 1e-4  # of the period: a maximum as near to a crossing belongs to it
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

    def number(self, point: Any) -> float:
        """The margin."""
        return float(point.curve.margins(point)[self.place])

    def met(self, step: Step) -> Met | None:
        """The boundary on a step; a march that begins beyond it, by what an orbit is solved for, begins at it."""
        if step.first and self.number(step.a) < 0.0:
            return Met(self, 0.0, step.a, self.name)
        return super().met(step)

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the boundary is passed on the step, or lies at the beginning of the march.

        A branch that goes straight on stops at a section that a crossing passes, and nowhere else."""
        if step.virtual and not self.at_section(step.b):
            return False
        return now < 0.0 and (was >= 0.0 or (step.first and not step.virtual))

    def at_section(self, point: Any) -> bool:
        """Return whether a crossing passes the section of a forced orbit here, and nothing else happens."""
        return False

    def contacts(self, point: Any) -> list[Change]:
        """Contacts that may begin or end here; none where it is about something else."""
        return []

    def counts(self, point: Any) -> bool:
        """Return whether a branch that goes straight on passes the boundary here."""
        return True

    @abstractmethod
    def surface(self, point: Any, beyond: Any = None) -> int:
        """The indicator of the surface that is reached (-1: of none).

        ``beyond`` is the curve on which the branch goes on."""


class Crossed(Boundary):
    """A margin of a crossing, or of a visit that begins or ends with one: its row nearest to zero tells the surface."""

    @abstractmethod
    def visit(self, point: Any) -> int:
        """The visit whose crossing it is."""

    def crossing(self, point: Any, visit: int) -> tuple[Sequence[int], float, Any, int]:
        """Transitions, instant, state, and the indicator that fires (-1: any): those at the end of the visit."""
        return [point.signature.visits[visit].transition], *_end(point, visit), -1

    def surface(self, point: Any, beyond: Any = None) -> int:
        """The indicator of the row that is nearest to zero (-1: of none)."""
        visit, shooting = self.visit(point), point.shooting
        transitions, t, z, fires = self.crossing(point, visit)
        near: list[tuple[float, int, int]] = []  # of several that are zero the first
        for k in transitions:
            for r, row in enumerate(shooting.system.traced.transitions[k].rows):
                one = shooting.flow.jump(point.values, k, t, z, r)
                size = max(float(np.abs(one.h_z) @ point.curve.size), 1e-300)
                near.append((max(abs(one.h) / size, ON), len(near), row.indicator))
        return min((one for one in near if one[-1] != fires), default=(0.0, -1, -1))[-1]


def _end(point: Any, visit: int) -> tuple[float, Any]:
    """Instant and state at the end of a visit."""
    return float(point.solved.times[visit + 1]), point.solved.segments.z[visit]


class Short(Crossed):
    """A visit shrinks to nothing."""

    def located(self, step: Step) -> tuple[float, Any] | None:
        """A visit that has no length as the step begins, between what two masses do at once, is none that vanishes."""
        lasts = np.abs(step.a.path.tau) > NOTHING * step.a.period
        lasts[[0, -1]] = True
        return locate(step, lambda point: float(point.path.tau[lasts].min()))

    def at_section(self, point: Any) -> bool:
        """Return whether the visit begins or ends at the section of a forced orbit."""
        return point.shooting.forced and self.visit(point) in (0, point.shooting.m)

    def contacts(self, point: Any) -> list[Change]:
        """The orbit without a visit between two visits of one mode, where it shrinks without speed."""
        visits, slopes, i = point.signature.visits, point.path.slope, self.visit(point)
        if i in (0, len(visits) - 1) or visits[i - 1].mode != visits[i + 1].mode or visits[i - 1].row < 0:
            return []
        slope = slopes[point.curve.walk.conditional.tolist().index(i - 1)]
        slow = slope < NO_SPEED * max(float(np.abs(slopes).max()), 1e-300) or len(slopes) < 3
        return without(point, i - 1, 2) if slow else []

    def visit(self, point: Any) -> int:
        """The visit itself; that at the section where others with which it passes there are as short."""
        tau = point.path.tau
        end = min((0, point.shooting.m), key=lambda i: float(tau[i]))
        return end if tau[end] <= tau.min() + NOTHING * point.period else int(tau.argmin())


class Slow(Crossed):
    """A crossing becomes a touch."""

    name = "grazing"

    def contacts(self, point: Any) -> list[Change]:
        """The orbit without an impact of no speed."""
        return without(point, self.visit(point), 1)

    def visit(self, point: Any) -> int:
        """The visit before the slowest crossing."""
        return int(point.curve.walk.conditional[int(point.path.slope.argmin())])


class Own(Crossed):
    """Two rows of the condition that fires vanish together."""

    def contacts(self, point: Any) -> list[Change]:
        """At a tolerance: the same orbit, which may be one a little further on, and that without the impact or without
        the last before rest."""
        i, surface = self.visit(point), self.surface(point)
        if not is_tolerance(point, surface):
            return []
        same, count = Change(point, point.once, point.once, i, 0, surface, True), rest_after(point, i)
        return [same] if count == 0 else [same, *without(point, i, count or 1)]

    def visit(self, point: Any) -> int:
        """The visit before the crossing with the least other row."""
        return int(point.curve.walk.conditional[int(point.path.own.argmin())])

    def crossing(self, point: Any, visit: int) -> tuple[Sequence[int], float, Any, int]:
        """All that decide whether the transition is taken as its row fires; that row is known."""
        own = point.signature.visits[visit]
        deciding = point.curve.walk.deciding.get(visit, [(own.transition, True)])
        fires = point.shooting.system.traced.transitions[own.transition].rows[own.row].indicator
        return [k for k, _ in deciding], *_end(point, visit), fires


class Grazing(Boundary):
    """A transition that does not happen is touched within a visit."""

    name = "grazing"

    def contacts(self, point: Any) -> list[Change]:
        """The orbit with the transition, and if it leads to another mode with each of the ways back."""
        return inserted(point)

    def counts(self, point: Any) -> bool:
        """Return whether the touch lies within its visit; at its end it is the other side of an impact of no speed."""
        (visit, k), times = point.path.touched, point.solved.times
        ends = np.abs(times[visit : visit + 2] - point.path.place[visit, k])
        return float(ends.min()) >= ENDS * float(times[-1])

    def surface(self, point: Any, beyond: Any = None) -> int:
        """The indicator that is touched."""
        return int(point.curve.walk.net.rows[point.path.which[point.path.touched], 0])


class Others(Crossed):
    """The condition of another transition holds too at the end of a visit."""

    def visit(self, point: Any) -> int:
        """The visit at whose end it does."""
        return int(point.path.others.argmax())

    def crossing(self, point: Any, visit: int) -> tuple[Sequence[int], float, Any, int]:
        """The other transition."""
        return [int(point.path.other[visit])], *_end(point, visit), -1


class Landed(Crossed):
    """A reset leads onto the boundary of another transition."""

    ending = "landing"

    def counts(self, point: Any) -> bool:
        """Return whether a reset led there, and not the section, which passes behind a boundary."""
        return int(point.path.landed.argmax()) != 0

    def visit(self, point: Any) -> int:
        """The visit that begins there."""
        return int(point.path.landed.argmax())

    def crossing(self, point: Any, visit: int) -> tuple[Sequence[int], float, Any, int]:
        """The transition that is reached, where the visit begins."""
        return (
            [int(point.path.landing[visit])],
            float(point.solved.times[visit]),
            point.shooting.split(point.X)[1][visit],
            -1,
        )


class Unseen(Boundary):
    """A simulated round takes other transitions than the signature, and no margin tells."""

    name = "grazing"

    def located(self, step: Step) -> tuple[float, Any] | None:
        """The first place on the step where a simulated round shows it.

        Margins are looked at in parts of a step: of two extremes within a part none shows. A simulation isolates them.
        """
        return first_beyond(step, step.curve.shows, UNSEEN)

    def surface(self, point: Any, beyond: Any = None) -> int:
        """The indicator of the first transition that the signature beyond has more often."""
        return -1 if beyond is None else gained(point, beyond)


def section_passed(met: list[Met]) -> OrbitPoint | None:
    """The same orbit where a crossing has passed the section, if nothing else is met."""
    first = met[0]
    if len(met) > 1 or not first.kind.at_section(first.point):
        return None
    after = past_the_section(first.point)
    return after if after is not None and (after.curve.margins(after)[1:] >= 0.0).all() else None


def contacts_of(met: list[Met]) -> list[Change]:
    """The contacts that may begin or end with what is met."""
    return [change for one in met for change in one.kind.contacts(one.point)]


#: In the order of ``Path.margins``: what explains the others first.
BOUNDARIES = (Short(0), Slow(1), Own(2), Grazing(3), Others(4), Landed(5))
