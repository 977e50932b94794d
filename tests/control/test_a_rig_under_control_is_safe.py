"""A rig that fails, or on which control fails: the force is off at once, a sentence says why, no point is lost.

The whole campaign: python -m pytest -m slow -s tests/control/test_a_rig_under_control_is_safe.py
"""

import numpy as np
import pytest
from tests.control.own_rig import DRIVE, OwnRig, true_frequency

import nonsmooth as ns
from nonsmooth.control.holding import FORCE

FAULTS = {
    "NaN": (float("nan"), "not two finite numbers"),
    "constant": ("constant", "whole turn"),
    "OSError": (OSError("the cable is out"), "OSError: the cable is out"),
}
LIMITED = {"greatest_force": 0.3, "greatest_position": 0.9}
NARROW = {"greatest_position": 0.4}  # beyond which the unstable motions lie


def held(rig, points=12, release=0, **limits):
    """The branch (None: there is none), the sentence, and the reading at which each point was there."""
    there = []
    try:
        branch = ns.control_based_continuation(
            rig,
            "frequency",
            (1.15, 1.4),
            frequency=1.3,
            amplitude=DRIVE,
            direction="down",
            step=0.2,
            points=points,
            holding=ns.Holding(transient=20, release=release, **limits),
            progress=lambda done: there.append(rig.readings) if done else None,
        )
    except ns.SolveError as error:
        return None, str(error), there
    return branch, str(branch["ended_because"].values), there


def safe(rig, force=np.inf, position=np.inf):
    """Assert the rules on what was commanded; return by how much the position exceeded its limit."""
    _, true, shown, commanded = np.array(rig.log, dtype=float).T
    assert rig.force == 0.0 and commanded[-1] == 0.0
    assert np.nanmax(np.abs(commanded)) <= force
    # a reading beyond the limit, or none, is the last; the force commanded behind it is zero
    beyond = np.flatnonzero(~(np.abs(shown) <= position))
    assert beyond.size == 0 or beyond[0] == len(rig.log) - 1
    return np.abs(true).max() / position - 1


def right(branch):
    """Assert that the frequencies of the branch are those of the equations; the largest normalised difference."""
    far = []
    for k in range(branch.sizes["point"]):
        one = branch.isel(point=k)
        w = float(one["drive_frequency"])
        true = true_frequency(float(one["amplitude"]), one["section"].values, w)
        far.append(abs(w - true) / float(one["parameter_uncertainty"]))
    assert max(far) < 4.5
    return max(far)


@pytest.fixture(scope="module")
def whole():
    """A branch without a fault: the result, the sentence, the readings at its points, and how many there were."""
    rig = OwnRig(per_turn=20)
    return (*held(rig, points=6), rig.readings)


def test_without_a_fault_the_branch_is_that_of_the_equations(whole):
    branch, sentence, there, _ = whole
    assert branch.sizes["point"] == len(there) == 6 and "largest number of points" in sentence
    right(branch)


def broken(name, at, whole, **limits):
    """A fault at a reading: what was measured until then stands, to the last bit."""
    fault, words = FAULTS[name]
    rig = OwnRig(per_turn=20, fault=fault, fault_at=at)
    branch, sentence, there = held(rig, points=6, **limits)
    safe(rig)
    assert sentence.startswith("stopped: ") and words in sentence
    assert rig.readings <= at + (42 if name == "constant" else 0)  # a turn, and one more where the drive is set anew
    done = sum(reading < at for reading in whole[2])
    assert len(there) == done + sum(at <= reading <= rig.readings for reading in whole[2])
    assert (branch is None) == (len(there) == 0)
    if branch is not None:
        assert branch.sizes["point"] == len(there)
        np.testing.assert_array_equal(branch["amplitude"][:done], whole[0]["amplitude"][:done])


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("part", [0.02, 0.08, 0.6])
def test_a_fault_ends_it_at_once_and_keeps_the_points(name, part, whole):
    broken(name, int(part * whole[3]), whole)


@pytest.mark.slow
def test_a_fault_at_a_hundred_readings(whole):
    for at in np.random.default_rng(0).integers(1, whole[3], 100):
        broken("OSError", int(at), whole)


@pytest.mark.parametrize(("per_turn", "delay"), [(9, 1), (9, 3), (5, 1), (20, 4)])
@pytest.mark.parametrize("limits", [{}, LIMITED])
def test_a_rate_too_low_for_the_delay_is_said(per_turn, delay, limits):
    rig = OwnRig(per_turn, delay)
    branch, sentence, _ = held(rig, **limits)
    safe(rig, limits.get("greatest_force", np.inf), limits.get("greatest_position", np.inf))
    assert branch is None and (
        "the controlled motion grows" in sentence
        or "the controller shakes it" in sentence
        or "beyond its limit" in sentence
    )


def test_the_wrong_sign_of_an_actuator_is_said():
    rig = OwnRig(sign=-1.0)
    branch, sentence, _ = held(rig)
    safe(rig)
    assert branch is None and "wrong sign" in sentence
    # no force was larger than a few times that which answers to the motion's own size (0.23)
    assert np.nanmax(np.abs([row[3] for row in rig.log if row[3] is not None])) < FORCE * 1.3 * 1.3**2 * 0.25


def test_a_position_beyond_its_limit_ends_it_within_that_reading():
    rig = OwnRig(sign=-1.0)
    branch, sentence, _ = held(rig, greatest_position=(-0.4, 0.4))
    assert branch is None and "is beyond its limit, -0.4 to 0.4" in sentence
    assert 0 < safe(rig, position=0.4) < 0.05  # of the limit


def test_a_force_that_cannot_be_set_to_zero_is_said():
    class Stuck(OwnRig):
        def apply_force(self, force):
            if self.readings > 1000:
                raise OSError("no answer")
            super().apply_force(force)

    with pytest.warns(RuntimeWarning, match="switch the actuator off"):
        branch, sentence, _ = held(Stuck())
    assert branch is None and "could not be set to zero (OSError: no answer)" in sentence


def test_a_phase_that_stands_is_said():
    class Standing(OwnRig):
        def read(self):
            phase, position = super().read()
            return min(phase, 30.0), position

    branch, sentence, _ = held(Standing())
    assert branch is None and "must count on" in sentence


def test_readings_that_are_missing_are_said(whole):
    """From a reading of the third point on: the point that was there is kept, and the force is off."""

    class Gap(OwnRig):
        def read(self):
            phase, position = super().read()
            return phase + 5 * (self.readings >= at), position

    at = whole[2][2] - 7
    rig = Gap(per_turn=20)
    branch, sentence, there = held(rig)
    assert branch.sizes["point"] == len(there) >= 1 and rig.force == 0.0
    assert "between two readings, a turn or more: some are missing" in sentence


@pytest.mark.slow
def test_delays_and_rates(capsys):
    rows = []
    for per_turn in (5, 6, 7, 9, 12, 20, 35, 50, 100, 200):
        for delay in range(6):
            for limits in ({}, LIMITED, NARROW):
                rig = OwnRig(per_turn, delay, seed=per_turn + delay)
                branch, sentence, _ = held(rig, **limits)
                over = safe(rig, limits.get("greatest_force", np.inf), limits.get("greatest_position", np.inf))
                far = right(branch) if branch is not None else np.nan
                n = 0 if branch is None else branch.sizes["point"]
                given = (limits.get(name, "-") for name in LIMITED)
                rows.append((per_turn, delay, *given, n, far, max(over, 0), sentence[:40]))
    with capsys.disabled():
        print("\nreadings a turn, delay, greatest force, position, points, largest normalised difference, overshoot")
        for row in rows:
            print(*(f"{one:.2g}" if isinstance(one, float) else one for one in row), sep="; ")
    assert sum(row[4] == 12 for row in rows) >= 60


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"greatest_force": 0.0}, "greatest_force"),
        ({"greatest_position": 0.0}, "positive"),
        ({"greatest_position": (2, 1)}, "first end must be below"),
        ({"greatest_position": "far"}, "low, high"),
    ],
)
def test_limits_that_are_none_are_answered(given, message):
    with pytest.raises(ValueError, match=message):
        ns.Holding(**given)


SEEDS = pytest.mark.parametrize("seeds", [range(1), pytest.param(range(4), marks=pytest.mark.slow)])


@SEEDS
def test_under_noise_no_stable_motion_is_called_unstable_nor_the_reverse(seeds):
    for seed in seeds:
        branch, _, _ = held(OwnRig(20, 1, noise=3e-3, seed=seed), release=12)
        amplitude, seen = branch["amplitude"].values, branch["stability"].values
        # the fold, by the equations: 1.16305 rad/s at an amplitude of 0.6314
        assert (seen[amplitude < 0.53] != 0).all() and (seen[amplitude > 0.73] != 1).all()


@SEEDS
def test_the_amplitude_beside_a_fold_is_as_uncertain_as_it_says(seeds):
    far, curve = [], None
    for seed in seeds:
        branch, _, _ = held(OwnRig(20, 1, seed=seed))
        beside = branch.isel(point=np.abs(branch["amplitude"].values - 0.6314) < 0.1)
        if curve is None:  # frequency over amplitude beside the fold, by the equations
            near = beside.isel(point=0)
            sizes = np.linspace(0.52, 0.74, 9)
            frequency = [true_frequency(a, near["section"].values, float(near["drive_frequency"])) for a in sizes]
            curve = np.polynomial.Polynomial.fit(sizes, frequency, 5)
            fold = next(x.real for x in curve.deriv().roots() if abs(x.imag) < 1e-9 and 0.6 < x.real < 0.66)
        for k in range(beside.sizes["point"]):
            one = beside.isel(point=k)
            a, u = float(one["amplitude"]), float(one["amplitude_uncertainty"])
            roots = (curve - float(one["drive_frequency"])).roots()
            known = [x.real for x in roots if abs(x.imag) < 1e-9 and (x.real - fold) * (a - fold) > 0]
            far.append((a - min([*known, fold], key=lambda x, a=a: abs(a - x))) / u)  # where it has no value, the fold
    print(np.round(far, 1))
    assert len(far) >= 3 * len(seeds) and np.sqrt(np.mean(np.square(far))) < 1.5 and np.max(np.abs(far)) < 4
