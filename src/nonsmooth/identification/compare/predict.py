"""Prediction of the theory for one setting: the attractors that starts lead to, their orbits and section clouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from threading import Event
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.attractors.settled import usable
from nonsmooth.attractors.settler import Settler
from nonsmooth.diagrams.sweep_pieces import Slot
from nonsmooth.errors import SolveError
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.options import longest_period
from nonsmooth.flow.sections import Stroboscopic, section_plan
from nonsmooth.flow.simulate import check_complete
from nonsmooth.flow.starts import first_state
from nonsmooth.identification.compare.draws import Model
from nonsmooth.identification.compare.orbits import common_length, energy_distance, fold, mean_orbit
from nonsmooth.identification.compare.periods import measured_period
from nonsmooth.results.labels import by_code
from nonsmooth.system.system import System

KEEP = 64  # section points by which a predicted motion is judged
SAME = 1e-6  # orbits whose points are nearer to each other than this part of the motion are one


class SteadyState(NamedTuple):
    """A steady motion: period number (0: none found), and a section point on it at phase 0 with its mode."""

    period_number: int
    point: FloatArray
    mode: int


MOST_SHOWN = 20_000  # samples, the last ones, at whose phases a predicted orbit is laid beside the measured one


class Motions:
    """Steady motions of forced systems that differ in their parameters only: one attractor mapper, no labels.

    ``cloud``, ``orbit`` and ``shown`` return the states of the model that are compared; ``phase`` is that of the
    section.
    """

    def __init__(self, systems: Sequence[System], model: Model, phase: float = 0.0) -> None:
        self.system = systems[0].as_solved_by(model.solver)
        if self.system.period() is None:
            raise ValueError(f"{self.system.name!r} has no forcing period; compare takes forced systems")
        self.places, self.grid, keep = model.places, model.grid, max(KEEP, model.max_period + 1)
        self.periods = [float(one.period() or np.nan) for one in systems]
        self.points = np.array([one.parameter_vector() for one in systems])
        self.settler = Settler(
            self.system,
            engine_for(self.system, **model.solver),
            section_plan(self.system, Stroboscopic(phase))[1],
            model.transient,
            keep,
            longest_period(keep, model.max_period),
            False,
        )

    def attractors(self, i: int, starts: Any) -> list[SteadyState]:
        """The different motions of system i that the starts settle on, in the order of the starts.

        All motions without a period number count as one. A start that diverges leads to none; ValueError where all do.
        """
        found: list[SteadyState] = []
        orbits: list[FloatArray] = []
        point, begin = self.points[i : i + 1], np.atleast_2d(np.asarray(starts, float))
        runs = self.settler.run(point, np.zeros(len(begin)), begin)
        size = np.maximum(runs.maximum - runs.minimum, 1e-3 * self.system.scale_vector())
        lasts = runs.last[:, : begin.shape[1]]
        for j in np.flatnonzero(usable(runs.status) & np.isfinite(lasts).all(axis=1)):
            one = SteadyState(int(runs.period_number[j]), lasts[j], int(runs.mode[j]))
            alike = [orbit for other, orbit in zip(found, orbits, strict=True) if other[0] == one[0]]
            away = (np.abs((orbit - one.point) / size[j]).max(axis=1).min() for orbit in alike)
            if not any(one.period_number == 0 or far < SAME for far in away):
                found.append(one)
                returns = max(one.period_number, 1)
                orbits.append(self.settler.trace(point, runs.last[j], one.mode, 0, returns).points)
        if not found:
            words = "; ".join(by_code(code).sentence for code in np.unique(runs.status).tolist())
            raise ValueError(f"no start of {self.system.name!r} leads to a motion that can be compared: {words}")
        return found

    def cloud(self, i: int, attractor: SteadyState, phase: float, n: int) -> FloatArray:
        """Successive points of the section at ``phase``: (n, states); those of a periodic motion come round again."""
        settler = replace(self.settler, plan=section_plan(self.system, Stroboscopic(phase))[1])
        place, count = np.r_[attractor.point, self.system.memory_vector(), 0.0], attractor.period_number or n
        points = settler.trace(self.points[i : i + 1], place, attractor.mode, 0, count).points[:, self.places]
        if not len(points):
            raise SolveError(f"a motion of {self.system.name!r} cannot be followed from {attractor.point.tolist()}")
        return np.resize(points, (n, points.shape[1])) if count < n else points

    def orbit(self, i: int, start: FloatArray, periods: int) -> FloatArray:
        """The motion from phase 0 over whole forcing periods: (periods * grid, states)."""
        turns = np.linspace(0.0, periods, periods * self.grid + 1)
        return fold(turns, self._at(i, start, periods, turns), self.grid).reshape(periods * self.grid, -1)

    def shown(self, i: int, one: SteadyState, length: int, turns: FloatArray) -> FloatArray:
        """A periodic motion over ``length`` forcing periods, a multiple of its own, as a recording at these phases
        shows it: what lies between two samples about an impact is lost. As it is where the recording is too short."""
        turns = turns[min(max(len(turns) - MOST_SHOWN, 0), int(np.searchsorted(turns, turns[-1] - length - 2))) :]
        at, back = np.unique(turns % one.period_number, return_inverse=True)
        folded = fold(turns, self._at(i, one.point, one.period_number, at)[back], self.grid)
        try:
            mean, _ = mean_orbit(folded, length)
        except ValueError:
            return common_length(self.orbit(i, one.point, one.period_number), one.period_number, length)
        return np.roll(mean, int(np.ceil(turns[0] - 1e-9)) % length * self.grid, axis=0)

    def _at(self, i: int, start: FloatArray, periods: int, turns: FloatArray) -> FloatArray:
        """States at rising phases."""
        end, state = periods * self.periods[i], State(start.copy(), self.system.memory_vector())
        instants, tables = turns * self.periods[i], self.settler.engine.prepare(self.points[i : i + 1])
        log = self.settler.engine.record(tables, state, end, instants)
        check_complete(log, self.system, state, self.periods[i])
        return log.sample_u[:, self.places]


def carried(
    system: System, model: Model, name: str, values: FloatArray, words: Sequence[str], phase: float = 0.0
) -> list[Slot]:
    """Steady motions along a parameter, the state carried along, one slot for each direction; NaN where a run failed.

    Settings that follow from the parameter change with it.
    """
    rules = {key: setting for key, setting in model.settings.items() if setting.follows and key != name}
    # A drawn system is off its rule by an error that stays the same along the parameter.
    beside = {key: system.values[key] - rule.at(system.values) for key, rule in rules.items()}
    systems = []
    for value in values:
        here = {**system.values, name: float(value)}
        systems.append(system.with_parameters(here | {k: rule.at(here) + beside[k] for k, rule in rules.items()}))
    motions, rising = Motions(systems, model, phase), np.argsort(values, kind="stable").tolist()
    tables, rest = motions.settler.engine.prepare(motions.points), first_state(system, None)
    slots = [Slot(motions.settler, motions.points, None, ()) for _ in words]
    for word, slot in zip(words, slots, strict=True):
        slot.march(tables, rising if word == "up" else rising[::-1], rest, True, lambda _: None, Event())
        for kept in (slot.kept.section, slot.kept.high, slot.kept.low):
            kept[~usable(slot.status)] = np.nan
    return slots


EXACT = 1e-6  # noise of a computed section point, in parts of the motion's size
SHOWN = 16  # forcing periods of a motion without a period number that are kept for the overlays


class Prediction(NamedTuple):
    """One motion as the theory has it.

    Attributes
    ----------
    period_number : int
    sections : list of array (n, states)
        Section points, one cloud for each phase asked for.
    orbit : array (periods * grid, states), optional
        Over ``period_number`` forcing periods, or an interval of a motion without one; from phase 0.
    coexisting : array of int
        Period numbers of all motions found.
    attractor : SteadyState, optional
        Where it came from a System.
    """

    period_number: int
    sections: list[FloatArray]
    orbit: FloatArray | None
    coexisting: IntArray
    attractor: SteadyState | None = None


def predict(
    motions: Motions,
    measured: list[FloatArray],
    phases: list[float],
    scale: FloatArray,
    *,
    starts: Any,
    n: int,
) -> Prediction:
    """Of all motions that the starts lead to the one whose section clouds lie nearest to the measured ones."""
    found = motions.attractors(0, starts)
    best: tuple[float, SteadyState, list[FloatArray]] | None = None
    for one in found:
        sections = [motions.cloud(0, one, phase, n) for phase in phases]
        away = sum(energy_distance(a[-400:] / scale, b[-400:] / scale) for a, b in zip(measured, sections, strict=True))
        if best is None or away < best[0]:
            best = (away, one, sections)
    assert best is not None  # `attractors` raises where there is none
    _, one, sections = best
    motion = motions.orbit(0, one.point, one.period_number or SHOWN)
    numbers = np.array([item.period_number for item in found], np.int64)
    return Prediction(one.period_number, sections, motion, numbers, one)


def from_result(model: Model, phases: list[float]) -> Prediction:
    """Theory read from a result of ``simulate``, ``poincare`` or ``sweep`` at one setting."""
    result = model.theory.sel(state=model.states)
    if "u" in result:
        if "phase" not in result and "omega" not in result.coords:
            raise ValueError(
                "the phase of the drive is not known: give `phase` (in forcing periods) over time, or omega"
            )
        phase = result["phase"] if "phase" in result else result["time"] * float(result["omega"]) / (2 * np.pi)
        turns = phase.values
        whole = fold(turns, result["u"].values, model.grid)
        sections = [fold(turns - phase, result["u"].values, 8)[:, 0] for phase in phases]
        number = _number(whole, model.max_period)
        motion = mean_orbit(whole, number)[0] if number else whole[-SHOWN:].reshape(-1, whole.shape[2])
        return Prediction(number, sections, motion, np.array([number]))
    if "section" in result:
        if len(phases) > 1:
            raise ValueError("a result with one section has one phase: give section_phase as one number, or a System")
        points = result["section"].squeeze()
        if points.dims != ("iterate", "state"):
            raise ValueError(f"the theory's section has dims {points.dims}; choose one setting, start and direction")
        told = result.get("period_number")
        number = _number(points.values, model.max_period) if told is None else int(told.squeeze())
        return Prediction(number, [points.values], None, np.array([number]))
    raise ValueError(
        f"this Dataset holds neither `u` nor `section` ({', '.join(map(str, result.data_vars))}); give a System, or a "
        "result of simulate, poincare or sweep"
    )


def _number(points: FloatArray, max_period: int) -> int:
    size = np.ptp(points.reshape(-1, points.shape[-1]), axis=0)
    return measured_period(points, EXACT * np.where(size > 0, size, 1.0), max_period=max_period).number
