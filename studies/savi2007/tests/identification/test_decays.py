"""Decays of the car and of the support with a test mass: closed forms of their heights."""

import numpy as np
import pytest
from studies.savi2007.tests.identification.made import COUNT, counted, run

from nonsmooth.errors import SolveError
from nonsmooth.recordings.session import Quantity
from nonsmooth_savi2007.identification.decay_findings import (
    decay_damping,
    envelope,
    log_decrement,
    support_damping,
)
from nonsmooth_savi2007.identification.free_decay import Decay, free_decay

MASS, STIFF, C_S = 1.33, 1210.0, 0.60


def drops(heights=(0.011, 0.009, 0.008, 0.007), c=C_S, seed=0, duration=12):
    rng, found = np.random.default_rng(seed), []
    w, b = np.sqrt(STIFF / MASS), c / MASS
    wd = np.sqrt(w**2 - b**2 / 4)
    for i, h in enumerate(heights):
        t = np.arange(0, duration, 0.01)
        at = np.maximum(t + 5e-5 * rng.standard_normal(len(t)) - 0.5, 0.0)
        x = -h * np.exp(-b / 2 * at) * (np.cos(wd * at) + b / (2 * wd) * np.sin(wd * at))
        found.append(run("drop", t, counted(x), name=f"Run #{i + 1}"))
    return found


def test_the_supports_damping_by_decrement_and_by_fit():
    found, decay = support_damping(drops((0.011, 0.009), duration=8), test_mass=Quantity(MASS, 1e-4))
    assert found.estimate.logarithmic
    assert abs(found.value - C_S) < 3.5 * found.uncertainty < 0.02
    ratio = found.others["damping_ratio"]
    assert ratio.value == pytest.approx(C_S / (2 * np.sqrt(STIFF * MASS)), abs=3.5 * ratio.uncertainty)
    assert ratio.value == pytest.approx(0.0075, abs=1e-4)  # the paper's xi_s
    assert abs(decay.values[0] - np.sqrt(STIFF / MASS)) < 3.5 * decay.error("omega_0")
    assert abs(found.others["c_s_fit"].value - C_S) < 3.5 * found.others["c_s_fit"].uncertainty


def test_the_test_masss_uncertainty_is_in_it():
    wide = support_damping(drops((0.011, 0.009), duration=5), test_mass=Quantity(MASS, 0.05 * MASS))[0]
    assert wide.uncertainty / wide.value == pytest.approx(0.05, rel=0.02)


def test_the_decrements_error_is_that_of_a_mean_where_drops_differ():
    """Three supports that differ by more than their noise: standard deviation over the root of their number."""
    damped = np.array([0.56, 0.62, 0.66])
    runs = [drops([0.011], c=c, seed=i, duration=5)[0] for i, c in enumerate(damped)]
    found, decay = support_damping(runs, test_mass=Quantity(MASS, 0.0))
    assert decay.runs == tuple(run.name for run in runs) and any("no majority" in note for note in found.notes)
    assert found.uncertainty == pytest.approx(damped.std(ddof=1) / np.sqrt(3), rel=0.05)


def test_turning_points_lie_on_their_envelope():
    b, w = C_S / MASS, np.sqrt(STIFF / MASS)
    one = drops([0.011])[0]
    t, height, error = log_decrement(Decay(one, 60, len(one.time)), 0.0)
    # at a turning point the envelope is the height itself, but for (b/2w)^2
    expected = 0.011 * np.exp(-b / 2 * (t - 0.5))
    assert len(t) > 60 and np.allclose(np.diff(t[:60]), np.pi / w, atol=1e-3)
    assert np.std(height - expected) < 2 * error[0]
    assert np.all(height > 9 * COUNT)


def test_a_drop_that_hardly_moves_is_refused():
    with pytest.raises(ValueError, match="drop it from higher|tap it harder"):
        support_damping(drops([3e-4]), test_mass=Quantity(MASS, 1e-3))


def test_heights_with_friction_follow_the_recursion():
    w, b, f, h = 4.5, 1.04, 0.015, 0.1
    wd = np.sqrt(w**2 - b**2 / 4)
    q, delta = np.exp(-np.pi * b / (2 * wd)), f / w**2
    heights = [h]
    for _ in range(5):  # a half swing about the displaced middle
        heights.append(q * (heights[-1] - delta) - delta)
    assert envelope(np.arange(6) * np.pi / wd, h, w, b, f) == pytest.approx(heights, rel=1e-12)
    assert envelope(np.array([100.0]), h, w, b, f)[0] == 0.0
    assert envelope(np.array([2.0]), h, w, b, 0.0)[0] == pytest.approx(h * np.exp(-b))


def taps(heights=(0.1, -0.09, 0.06, -0.05), w=4.5, b=1.04, f=0.012, seed=3):
    """Half swings about +-f/w^2 from turning point to turning point, after Den Hartog; let go from each height."""
    wd, rng, runs = np.sqrt(w**2 - b**2 / 4), np.random.default_rng(seed), []
    for i, h in enumerate(heights):
        t = np.arange(0, 7, 0.01)
        at = np.maximum(t + 5e-5 * rng.standard_normal(len(t)) - 0.5, 0.0)
        k = np.floor(at * wd / np.pi).astype(int)
        turned = np.array([envelope(np.array([j * np.pi / wd]), abs(h), w, b, f)[0] for j in range(k.max() + 1)])
        s, local = np.sign(h) * (-1.0) ** k, at - k * np.pi / wd
        swing = np.exp(-b / 2 * local) * (np.cos(wd * local) + b / (2 * wd) * np.sin(wd * local))
        x = s * (f / w**2 + (turned[k] - f / w**2) * swing)
        stopped = turned[k] <= f / w**2
        x[stopped] = x[np.argmax(stopped) - 1] if stopped.any() else 0.0
        runs.append(run("impulse", t, counted(x), name=f"Run #{i + 1}"))
    return runs


def slipped(one, counts, at=2.0):
    """The run with a string that slips on the wheel by so many counts at an instant (s)."""
    x = one.positions + COUNT * counts * (one.time > at)
    return run("impulse", one.time, x, name=one.name)


def fitted(runs, **options):
    return free_decay(runs, **options)


@pytest.mark.parametrize("counts", [1, pytest.param(20, marks=pytest.mark.slow)])
def test_a_tap_that_slipped_is_named_and_left_out(counts):
    runs = taps((0.1, -0.09, 0.08, -0.07))
    runs[2] = slipped(runs[2], counts)
    decay = fitted(runs)
    assert decay.runs == tuple(f"Run #{i}" for i in (1, 2, 4))
    (note,) = decay.notes
    assert "'Run #3'" in note and "left out" in note and "slipped" in note
    assert np.all(np.abs(decay.values - [4.5, 1.04, 0.012, 0.0]) < 4 * np.sqrt(np.diag(decay.covariance)))
    assert decay.error("omega_0") < 2e-4


def test_taps_that_disagree_without_a_majority_are_all_used_and_widened():
    runs = [r if i < 3 else slipped(r, 4, -1.0) for i, r in enumerate(taps((0.1, -0.09, 0.08, -0.07, 0.06, -0.05)))]
    decay = fitted(runs)
    assert decay.runs == tuple(run.name for run in runs)
    (note,) = decay.notes
    assert "disagree" in note and "no majority" in note
    # half of the runs count from a place that is 4 counts off: the standard deviation of 0 0 0 4 4 4 is 2 root(6/5)
    assert decay.values[3] == pytest.approx(2 * COUNT, abs=0.5 * COUNT)
    assert decay.error("x_e") == pytest.approx(2 * np.sqrt(6 / 5) * COUNT, rel=0.1)
    assert abs(decay.values[0] - 4.5) < 3 * decay.error("omega_0")


def test_one_tap_needs_no_other():
    assert fitted(taps((0.1,))).notes == ()


def test_viscous_and_dry_are_told_apart():
    w, b, f, m = 4.5, 1.04, 0.012, 0.84
    runs = taps(w=w, b=b, f=f)
    decay = free_decay(runs)
    found = decay_damping(decay, Quantity(m))
    assert abs(found.value - m * b) < 3.5 * found.uncertainty < 0.01
    assert abs(found.others["friction"].value - m * f) < 3.5 * found.others["friction"].uncertainty < 1e-3
    assert found.others["c_viscous_only"].value > 1.02 * m * b
    assert found.covariance[0, 1] < 0  # what the one takes the other loses
    data = found.data
    at_peaks = np.interp(data["peak_time"], data["fine_time"], data["envelope_both"])
    assert np.all(np.abs(at_peaks - data["peak_height"]) < COUNT)


def test_what_fails_in_a_fit_names_the_procedure() -> None:
    """Whatever the kind of failure: one with facts of its own too."""
    from nonsmooth_savi2007.identification.chain import _of

    for failure in (SolveError("did not settle", status="slow"), SolveError("did not end"), ValueError("is empty")):
        kind = SolveError if isinstance(failure, SolveError) else ValueError
        with pytest.raises(kind, match=f"^impulse: {failure}. Are these the recordings of 'impulse'"), _of("impulse"):
            raise failure
