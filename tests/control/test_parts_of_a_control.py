"""Controller, guard, holder and release on rigs whose answers are written down: each number by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.arrays import ComplexArray
from nonsmooth.control.continuation import course_of
from nonsmooth.control.holding import (
    STABLE,
    UNKNOWN,
    UNSTABLE,
    Controller,
    FourierSeries,
    Held,
    Holder,
    Holding,
    Samples,
    release,
)
from nonsmooth.control.outcome import Names, _beside_folds, _folds
from nonsmooth.control.rig import Guard

PER_TURN = 16  # so that phases are exact


class Told:
    """A rig that reads what it was told, and notes the forces it is asked for."""

    def __init__(self, positions: Any, per_turn: int = PER_TURN) -> None:
        self.positions, self.per_turn = list(positions), per_turn
        self.forces: list[float] = []
        self.readings = 0

    def set_drive(self, frequency: float, amplitude: float) -> tuple[float, float]:
        return frequency, amplitude

    def apply_force(self, force: float) -> None:
        self.forces.append(force)

    def read(self) -> tuple[float, float]:
        self.readings += 1
        return self.readings / self.per_turn, self.positions[self.readings - 1]


def test_the_force_is_that_of_the_filtered_difference() -> None:
    """K_p e + K_d d with d_k = alpha d_(k-1) + (1 - alpha) (e_k - e_(k-1)) / h: here with numbers in a loop."""
    rng, frequency, tau = np.random.default_rng(0), 1.7, 0.3
    positions = rng.standard_normal(2 * PER_TURN + 5)
    rig = Told(positions)
    reference = np.array([0.1, 0.4 - 0.2j, 0.05j])
    samples = Controller(rig, 2.0, 0.6, tau).run(reference, frequency, 2)
    h = 2 * math.pi / PER_TURN / frequency
    alpha = math.exp(-h / tau)
    expected, slope, before = [0.0], 0.0, None
    for k in range(2 * PER_TURN):
        angle = 2 * math.pi * (k + 1) / PER_TURN
        error = 0.1 + 0.4 * math.cos(angle) + 0.2 * math.sin(angle) - 0.05 * math.sin(2 * angle) - positions[k]
        if before is not None:
            slope = alpha * slope + (1 - alpha) * (error - before) / h
            expected.append(2.0 * error + 0.6 * slope)
        before = error
    assert rig.forces == pytest.approx(expected, abs=1e-12)
    assert samples.force == pytest.approx(expected, abs=1e-12)
    assert samples.position == pytest.approx(positions[: 2 * PER_TURN]) and len(samples.phase) == 2 * PER_TURN


@pytest.mark.parametrize("force", [0.31, -0.31, math.nan, math.inf])
def test_no_force_beyond_its_limit_on_either_side(force: float) -> None:
    rig = Told([])
    guard = Guard(rig, force=0.3)
    guard.apply_force(0.3)
    guard.apply_force(-0.3)
    with pytest.raises(ns.SolveError, match="beyond its limit"):
        guard.apply_force(force)
    assert rig.forces == [0.3, -0.3, 0.0]


@pytest.mark.parametrize("position", [-0.6, 1.2])
def test_no_position_beyond_its_limits(position: float) -> None:
    rig = Told([-0.5, 1.1, position])
    guard = Guard(rig, low=-0.5, high=1.1)
    assert [guard.read()[1], guard.read()[1]] == [-0.5, 1.1]
    with pytest.raises(ns.SolveError, match="beyond its limit"):
        guard.read()
    assert rig.forces == [0.0]


def test_a_sensor_that_stands_still_for_a_turn_is_told() -> None:
    """The same reading from 1 / 16 of a turn on: a whole turn of it is reached at reading 17, and no earlier."""
    rig = Told([0.25] * 40)
    guard = Guard(rig)
    for _ in range(PER_TURN):
        guard.read()
    with pytest.raises(ns.SolveError, match="for a whole turn"):
        guard.read()
    guard.set_drive(1.0, 1.0)
    assert guard.read()[1] == 0.25  # a new setting of the drive begins anew


class Free(Told):
    """A motion cos(angle) that is held for some runs; then its size is off by d g^k in turn k."""

    def __init__(self, factor: float, push: float, *held: int) -> None:
        self.begins = sum(PER_TURN * turns + 1 for turns in held)  # a run ends with the reading behind its last turn
        i = np.arange(self.begins + 40 * (PER_TURN + 1))
        turn = (i - self.begins) // (PER_TURN + 1)
        off = np.where(turn < 0, 0.0, push * factor ** (turn + 1.0))
        super().__init__((1 + off) * np.cos(2 * np.pi * (i + 1) / PER_TURN))


@pytest.mark.parametrize(
    ("factor", "kind"), [(0.5, STABLE), (0.8, STABLE), (1.4, UNSTABLE), (0.97, UNKNOWN), (1.02, UNKNOWN)]
)
def test_a_motion_that_is_let_go_comes_back_or_leaves(factor: float, kind: int) -> None:
    holding = ns.Holding(settle=2, record=5, gains=(0.0, 1.0), greatest_force=1e9)
    rig = Free(factor, 0.01, 2 + 5, 2)
    holder = Holder(Guard(rig), holding, 1.0)
    held = holder.hold(1.0, 0.1, np.array([0.0, 1.0, 0.0, 0.0], dtype=complex))
    assert abs(held.position.c[1]) == pytest.approx(1.0, abs=1e-9) and held.repeats
    found, mean = release(holder, held, 12)
    assert found == kind
    assert mean == pytest.approx(factor, rel=1e-3)


def test_only_what_comes_after_settling_is_recorded() -> None:
    """Four turns at twice the size, then six at 1: the record is that of the six."""
    size = np.where(np.arange(11 * PER_TURN) < 4 * PER_TURN, 2.0, 1.0)
    angle = 2 * np.pi * (np.arange(len(size)) + 1) / PER_TURN
    rig = Told(size * np.cos(angle))
    holding = ns.Holding(settle=4, record=6, gains=(0.5, 1.0), greatest_force=1e9)
    holder = Holder(Guard(rig), holding, 1.0)
    held = holder.hold(2.0, 0.1, None)
    assert held.position.c[1] == pytest.approx(1.0, abs=1e-9)
    assert held.position.u == pytest.approx(0.0, abs=1e-9)
    assert holder.turns == 10 and rig.forces == [0.0]
    assert holder.stiffness(2.0) == pytest.approx(math.hypot(0.5, 2.0))
    assert Holder(Guard(rig), ns.Holding(), 0.7).gains_at(2.0) == (0.0, pytest.approx(1.4))


def test_a_course_varies_one_setting_and_keeps_the_other() -> None:
    names = Names("omega", "rho")
    course = course_of(names, "rho", (0.1, 0.5), 2.0, 0.3, "down")
    assert (course.parameter, course.rising, course.setting(0.4)) == ("amplitude", False, (2.0, 0.4))
    course = course_of(names, "frequency", (1.0, 3.0), 2.0, 0.3, "up")
    assert (course.parameter, course.rising, course.setting(2.5)) == ("frequency", True, (2.5, 0.3))
    assert [course.inside(value) for value in (0.9, 1.0, 3.0, 3.1)] == [False, True, True, False]


def test_a_motion_is_let_go_a_hundredth_away() -> None:
    """The first harmonic of what it is held to grows by 1 %, or by six times the noise of a turn where that is more."""

    class Rig:
        """A motion that comes back to half of its distance within a turn."""

        harmonics, holding = 3, Holding(settle=4, record=4)
        asked: ComplexArray | None = None
        away = 0.0

        def run(self, frequency: float, reference: ComplexArray | None, turns: int) -> Samples:
            if reference is not None:
                self.asked, self.away = reference, float(reference[1].real) - 1.0
            phase = np.linspace(0.0, turns, 64 * turns, endpoint=False)
            self.away *= 0.5 if reference is None else 1.0
            x = (1.0 + self.away) * np.cos(2.0 * np.pi * phase)
            return Samples(phase, x, 0.0 * x)

    for noise, push in ((0.0, 0.01), (0.001, 6.0 * 0.001 * np.sqrt(8.0))):
        rig = Rig()
        c, u = np.array([0.0, 1.0, 0.0, 0.0], dtype=complex), np.array([0.0, noise, 0.0, 0.0])
        held = Held(1.0, 1.0, c, FourierSeries(c, u), FourierSeries(0.0 * c, u), 0.0)
        found, factor = release(rig, held, 6)  # type: ignore[arg-type]
        assert rig.asked is not None and rig.asked == pytest.approx([0.0, 1.0 + push, 0.0, 0.0], abs=1e-12)
        assert found == STABLE and factor == pytest.approx(0.5, abs=1e-9)


def folds_of(places: Any, across: float) -> list[tuple[float, float, int]]:
    """Those of points in a plane of the frequency, in units of 2 rad/s, and two more coordinates."""
    march: Any = SimpleNamespace(plane=np.eye(3), scale=2.0)
    points: Any = [SimpleNamespace(y=one) for one in places]
    return _folds(march, points, 2.0 * np.asarray(places)[:, 0], np.full(len(places), across))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_branch_turns_at_its_corner_or_at_the_vertex_of_its_parabola(sign: float) -> None:
    """Both lie between points. The corner is as uncertain as it is far from the outermost point, with half of how far
    the next one lies from that."""
    corner, before, after = np.array([0.7, 0.3, 0.2]), np.array([0.8, 0.5, 0.0]), np.array([-0.9, 0.7, 0.1])
    lines = [*(corner - k * before for k in (2.5, 1.5, 0.5)), *(corner + k * after for k in (0.3, 1.3, 2.3))]
    for places in lines, lines[::-1]:
        ((value, error, i),) = folds_of(sign * np.array(places), 1e-9)
        assert value == pytest.approx(sign * 1.4, abs=1e-12)
        assert error == pytest.approx(np.hypot(0.54, 0.13)) and np.allclose(places[i], corner + 0.3 * after)
    s = np.array([-2.0, -1.2, -0.3, 0.4, 1.4, 2.1])
    ((value, error, i),) = folds_of(sign * np.column_stack([0.7 - 1e-3 * s**2, s, 0.0 * s]), 1e-5)
    assert value == pytest.approx(sign * 1.4, abs=1e-6)
    assert 1e-6 < error < 1e-5 and i == 2
    assert not folds_of(np.column_stack([0.7 - 1e-3 * s**2, s, 0.0 * s]), 0.01)  # what goes back may be noise


def test_the_amplitude_beside_a_fold_is_uncertain_by_its_slope_and_at_it_by_its_curvature() -> None:
    """On omega = 1 - (A - 2)^2 an error d of omega is one of d / (2 |A - 2|) in A, and of sqrt(d) at A = 2."""
    size = np.array([1.5, 1.8, 2.0, 2.3])
    found = _beside_folds(size, 1.0 - (size - 2.0) ** 2, np.full(4, 0.01))
    np.testing.assert_allclose(found, [0.01, 0.025, 0.1, 0.01 / 0.6], rtol=1e-12)
    assert not _beside_folds(size[:2], size[:2], np.full(2, 0.01)).any()
