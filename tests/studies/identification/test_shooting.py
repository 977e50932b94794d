"""Fits of recordings whose motion is a closed form or SciPy's: the truth lies within the stated uncertainty."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nonsmooth.errors import SolveError
from nonsmooth.identification.arrow import Unsettled
from nonsmooth.identification.pieces import State
from nonsmooth.studies.savi2007.identification import shooting
from nonsmooth.studies.savi2007.identification.free_decay import free_decay, swing
from nonsmooth.studies.savi2007.identification.motion import march
from nonsmooth.studies.savi2007.identification.pieces import Piece, start_state
from nonsmooth.studies.savi2007.identification.shooting import _jitter, shoot

COUNT = 0.0789 / 1440


def viscous(w, b, height, rng):
    """A tap's decay, counted, with a clock that jitters by 50 microseconds."""
    time = np.arange(0, 12, 0.01)
    at = time + 5e-5 * rng.standard_normal(len(time)) - 0.5
    wd = np.sqrt(w**2 - b**2 / 4)
    x = np.where(at > 0, height * np.exp(-b / 2 * at) * np.sin(wd * at), 0.0)
    return time, COUNT * np.rint(x / COUNT)


def test_free_decay_finds_frequency_and_damping_of_the_closed_form():
    rng, w, b = np.random.default_rng(0), 4.5, 1.04
    found = free_decay([viscous(w, b, h, rng) for h in (0.11, -0.11, 0.08, -0.08)], resolution=COUNT)
    error = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(found.values - [w, b, 0.0, 0.0]) < 3.5 * error)
    assert error[0] < 1e-3 and error[1] < 1e-3
    assert found.fit.jitter == pytest.approx(5e-5, rel=0.5)


def test_free_decay_tells_viscous_damping_from_dry_friction():
    rng, w, b, f = np.random.default_rng(1), 4.5, 1.04, 0.015

    def rate(t, u):
        return u[1], -(w**2) * u[0] - b * u[1] - f * np.tanh(u[1] / 1e-3)

    runs = []
    for speed in (0.5, -0.5, 0.3, -0.3):
        time = np.arange(0, 10, 0.01)
        at = time + 5e-5 * rng.standard_normal(len(time)) - 0.5
        solved = solve_ivp(
            rate, (0, 10), (0.0, speed), "LSODA", dense_output=True, rtol=1e-9, atol=1e-11, max_step=0.02
        )
        x = np.where(at > 0, solved.sol(np.maximum(at, 0))[0], 0.0)
        runs.append((time, COUNT * np.rint(x / COUNT)))
    found = free_decay(runs, resolution=COUNT)
    error = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(found.values - [w, b, f, 0.0]) < 3.5 * error)
    assert error[1] < 0.002 * b and error[2] < 0.02 * f
    # without friction in the law the damper would take it over
    assert free_decay(runs, resolution=COUNT, friction=False).values[1] > 1.03 * b


def test_a_fit_that_does_not_settle_is_refused():
    rng, w, b = np.random.default_rng(0), 4.5, 1.04
    time, x = viscous(w, b, 0.11, rng)
    begin, end = swing(time, x, resolution=COUNT)
    local, x = time[begin:end] - time[begin], x[begin:end]

    def law(p):
        return np.array([p[0], p[1], 0.0, p[2]]), np.zeros(4), np.array([0.0, 0.0, np.inf])

    piece = Piece(local, x, np.zeros_like(local), np.arange(3), law, start_state(local, x))
    first, steps = np.array([4.0, 0.8, 0.0]), np.array([1e-4, 1e-4, 1e-6])
    good = shoot([piece], first, steps, resolution=COUNT)
    assert np.all(np.abs(good.values - [w, b, 0.0]) < 3.5 * np.sqrt(np.diag(good.covariance)))
    with pytest.raises(SolveError, match="did not settle in 1 iterations"):
        shoot([piece], first, steps, resolution=COUNT, iterations=1)
    # derivatives over a step of 3 rad/s point nowhere: that no step lowers the sum of squares is no convergence
    with pytest.raises(SolveError, match="did not settle"):
        shoot([piece], first, np.array([3.0, 1e-4, 1e-6]), resolution=COUNT)


def test_a_piece_of_another_motion_does_not_keep_the_others_from_settling(monkeypatch):
    """Pieces that stand out of the residuals are left out, and counted, before a fit that stops is refused."""
    rng, w, b = np.random.default_rng(1), 4.5, 1.04

    def law(p):
        return np.array([p[0], p[1], 0.0, 0.0]), np.zeros(4), np.array([0.0, 0.0, np.inf])

    pieces = []
    for other in (w, w, w, 1.3 * w, w):
        time, x = viscous(other, b, 0.11, rng)
        begin, end = swing(time, x, resolution=COUNT)
        local, x = time[begin:end] - time[begin], x[begin:end]
        pieces.append(Piece(local, x, np.zeros_like(local), np.arange(2), law, start_state(local, x)))
    real = shooting.settle

    def settle(problem, theta, starts, spread, used, centre, prior, iterations, rough):
        found = real(problem, theta, starts, spread, used, centre, prior, iterations, True)
        if used.all():
            raise Unsettled("no step leads on", np.ones(6), np.zeros(2), found[0], found[1])
        return real(problem, found[0], found[1], spread, used, centre, prior, iterations, rough)

    monkeypatch.setattr(shooting, "settle", settle)
    given = (pieces, np.array([4.4, 1.0]), np.array([1e-4, 1e-4]))
    found = shoot(*given, resolution=COUNT, outliers=6.0)
    assert found.used.tolist() == [True, True, True, False, True]
    assert np.all(np.abs(found.values - [w, b]) < 3.5 * np.sqrt(np.diag(found.covariance)))
    with pytest.raises(Unsettled):
        shoot(*given, resolution=COUNT)


def test_a_step_with_endless_switches_is_no_motion():
    # a spring of 5e5 rad/s under friction turns four hundred times within 2.5 ms
    out = np.empty((3, 2))
    march(np.array([0.0, 0.01, 0.02]), np.zeros(3), 0.1, 0.0, False, np.array([5e5, 0.0, 1.0, 0.0]), np.zeros(4),
          np.array([0.0, 0.0, np.inf]), out)  # fmt: skip
    assert np.isfinite(out[0]).all() and np.isnan(out[1:]).all()


def test_the_clocks_jitter_is_the_likeliest():
    rng, n = np.random.default_rng(0), 20_000
    v = rng.uniform(-0.5, 0.5, n)
    r = COUNT / np.sqrt(12) * rng.standard_normal(n) + 5e-5 * v * rng.standard_normal(n)
    state = State([np.column_stack([v, v])], [r], [], [])
    assert _jitter(state, [True], COUNT) == pytest.approx(5e-5, rel=0.05)
    quiet = State([np.column_stack([v, v])], [0.5 * COUNT / np.sqrt(12) * rng.standard_normal(n)], [], [])
    assert _jitter(quiet, [True], COUNT) == 0.0


def test_a_record_without_a_tap_is_refused():
    time = np.arange(0, 5, 0.01)
    with pytest.raises(ValueError, match="tap it harder"):
        swing(time, np.zeros(len(time)), resolution=COUNT)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [101])
def test_identify_finds_a_rig_from_its_files(tmp_path, seed):
    from nonsmooth.models import discontinuous_support
    from nonsmooth.studies.savi2007.identification import identify
    from nonsmooth.studies.savi2007.rig import VirtualRig
    from nonsmooth.studies.savi2007.rig.truth import load_truth

    session = VirtualRig(seed).write_session(tmp_path / "session", truth=tmp_path / "truth.toml")
    found = identify(session, discontinuous_support())
    truth = load_truth(tmp_path / "truth.toml")
    for name in ("m", "k", "k_s", "c", "c_s", "friction"):
        estimate = found.estimate(name)
        assert abs(estimate.value - truth[name]) < 4 * estimate.uncertainty, name
    assert abs(found.estimate("gap_at_rest").value - truth["g"]) < 1e-4
    assert {"c_viscous_only", "c_response", "omega_0", "c_s_contact"} <= {f.name for f in found.findings}
    assert found.synthetic
