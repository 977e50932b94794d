"""Prediction of the theory for one setting: the attractors that starts lead to, their orbits and section clouds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.attractors.mapper import Mapper
from nonsmooth.attractors.settled import Settled, usable
from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import Kept, Section, State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.failure import solve_error
from nonsmooth.flow.options import longest_period
from nonsmooth.flow.sections import Stroboscopic, section_plan
from nonsmooth.flow.simulate import check_complete
from nonsmooth.identification.compare.fold import fold
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.statuses import by_code

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Attractor", "Motions"]


SAME = 1e-6  # orbits whose points are nearer to each other than this part of the motion are one


@dataclass(frozen=True)
class Attractor:
    """A steady motion: period number (0: none found), a section point on it at phase 0, the start that led to it."""

    period_number: int
    point: FloatArray
    start: int


class Motions:
    """Steady motions of systems that differ in their parameters only: one engine, tables for all, no labels.

    Parameters
    ----------
    systems : sequence of System
    transient, keep, max_period : int
        See :func:`nonsmooth.sweep`.
    options : mapping
        ``method``, ``rtol``, ``atol``.
    phase : float
        Of the stroboscopic section, in forcing periods.
    places : list of int, optional
        The states that `cloud`, `orbit` and `carried` return; all where not given.

    Raises
    ------
    ValueError
        Systems that are not forced.
    """

    def __init__(
        self, systems: Sequence[System], *, transient: int, keep: int, max_period: int, options: Mapping[str, Any],
        phase: float = 0.0, places: list[int] | None = None,
    ) -> None:  # fmt: skip
        self.system = systems[0]
        if self.system.period() is None:
            raise ValueError(f"{self.system.name!r} has no forcing period; compare takes forced systems")
        self.places = list(range(len(self.system.states))) if places is None else places
        self.periods = [float(one.period() or np.nan) for one in systems]
        self.engine = engine_for(self.system, **options)
        self.points = np.array([one.parameter_vector() for one in systems])
        keep = max(keep, max_period + 1)
        self.settler = Settler(
            self.system, self.engine, self._plan(phase), transient, keep, longest_period(keep, max_period), False,
        )  # fmt: skip

    def _plan(self, phase: float) -> Section:
        return section_plan(self.system, Stroboscopic(phase))[1]

    def _state(self, start: FloatArray) -> State:
        return State(start.copy(), self.system.memory_vector())

    def _alone(self, i: int) -> Any:
        return self.engine.prepare(self.points[i : i + 1])

    def carried(self, order: Iterable[int]) -> tuple[FloatArray, NDArray[np.int64]]:
        """Section points and period numbers of all systems, the state carried from one to the next, from rest."""
        rows, periods = np.array([*order], dtype=np.int64), np.zeros(len(self.periods), dtype=np.int64)
        sections = self.engine.kept(len(periods), self.settler.keep).section
        kept, found = self._settled(rows, np.zeros((len(rows), sections.shape[2])), 2)
        periods[rows], good = found.period_number, usable(found.status)
        sections[rows[good]] = kept.section[good]
        return sections[..., self.places], periods

    def _settled(self, rows: NDArray[np.int64], starts: FloatArray, carried: int) -> tuple[Kept, Settled]:
        """The kept returns of jobs, and what is known of them."""
        kept, into = self.engine.kept(len(rows), self.settler.keep), np.arange(len(rows))
        mapper = Mapper(self.settler, self.engine.prepare(self.points), rows, starts, kept=kept, into=into)
        mapper.settle(self.settler.rules(), carried, False)(len(rows))
        return kept, mapper.settled()

    def attractors(self, i: int, starts: Any) -> list[Attractor]:
        """The different motions of system i that the starts settle on, in the order of the starts.

        All motions without a period number count as one. A start that diverges leads to none.

        Raises
        ------
        ValueError
            No start leads to a motion.
        """
        found: list[Attractor] = []
        orbits: list[FloatArray] = []
        statuses = set()
        begin = np.atleast_2d(np.asarray(starts, dtype=float))
        kept, runs = self._settled(np.full(len(begin), i), begin, 0)
        for k, (points, number) in enumerate(zip(kept.section, runs.period_number, strict=True)):
            statuses.add(int(runs.status[k]))
            if not usable(runs.status[k]) or not np.isfinite(points).all():
                continue
            size = np.maximum(np.ptp(points, axis=0), 1e-3 * self.system.scale_vector())
            cycle = points[-max(int(number), 1) :]
            if any(
                one.period_number == number and (number == 0 or _apart(cycle[-1], other, size) < SAME)
                for one, other in zip(found, orbits, strict=True)
            ):
                continue
            found.append(Attractor(int(number), points[-1].copy(), k))
            orbits.append(cycle)
        if not found:
            words = "; ".join(by_code(code).sentence for code in sorted(statuses))
            raise ValueError(f"no start of {self.system.name!r} leads to a motion that can be compared: {words}")
        return found

    def cloud(self, i: int, attractor: Attractor, phase: float, n: int) -> FloatArray:
        """Successive points of the section at ``phase``: (n, states); those of a periodic motion come round again."""
        count = attractor.period_number or n
        out = self.engine.kept(1, count)
        plan = self._plan(phase)._replace(extremes=False)
        start = attractor.point[None, :]
        self.engine.chain(self._alone(i), 0, 1, self._state(start[0]), start, plan, 0, count, out)
        if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
            raise solve_error(int(out.status[0]))
        points = out.section[0][:, self.places]
        return np.resize(points, (n, points.shape[1])) if count < n else points

    def orbit(self, i: int, attractor: Attractor, grid: int, periods: int) -> FloatArray:
        """The motion from phase 0 over whole forcing periods: (periods * grid, states)."""
        end = periods * self.periods[i]
        instants = np.linspace(0.0, end, periods * grid + 1)
        state = self._state(attractor.point)
        log = self.engine.record(self._alone(i), state, end, instants)
        check_complete(log, self.system, state, self.periods[i])
        u = log.sample_u[:, self.places]
        return fold(instants / self.periods[i], u, grid)[:periods].reshape(periods * grid, -1)


def _apart(point: FloatArray, cycle: FloatArray, size: FloatArray) -> float:
    return float(np.abs((cycle - point) / size).max(axis=1).min())
