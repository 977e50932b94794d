"""Fits of recordings whose motion is a closed form or SciPy's: the truth lies within the stated uncertainty."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from studies.savi2007.tests.identification.made import run

from nonsmooth_savi2007.identification.free_decay import free_decay, swing

COUNT = 0.0789 / 1440


def viscous(w, b, height, rng):
    """A tap's decay, counted, with a clock that jitters by 50 microseconds."""
    time = np.arange(0, 12, 0.01)
    at = time + 5e-5 * rng.standard_normal(len(time)) - 0.5
    wd = np.sqrt(w**2 - b**2 / 4)
    x = np.where(at > 0, height * np.exp(-b / 2 * at) * np.sin(wd * at), 0.0)
    return run("impulse", time, COUNT * np.rint(x / COUNT))


def test_free_decay_finds_frequency_and_damping_of_the_closed_form():
    rng, w, b = np.random.default_rng(0), 4.5, 1.04
    found = free_decay([viscous(w, b, h, rng) for h in (0.11, -0.11, 0.08, -0.08)])
    error = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(found.values - [w, b, 0.0, 0.0]) < 3.5 * error)
    assert error[0] < 1e-3 and error[1] < 1e-3


def test_free_decay_tells_viscous_damping_from_dry_friction():
    rng, w, b, f = np.random.default_rng(1), 4.5, 1.04, 0.015

    def rate(t, u):
        return u[1], -(w**2) * u[0] - b * u[1] - f * np.tanh(u[1] / 1e-3)

    runs = []
    for speed in (0.5, -0.4, 0.3):
        solved = solve_ivp(
            rate, (0, 7), (0.0, abs(speed)), "LSODA", dense_output=True, rtol=1e-9, atol=1e-11, max_step=0.02
        )
        time = np.arange(0, 7, 0.01)
        at = time + 5e-5 * rng.standard_normal(len(time)) - 0.5
        x = np.sign(speed) * np.where(at > 0, solved.sol(np.maximum(at, 0))[0], 0.0)  # the law is odd
        runs.append(run("impulse", time, COUNT * np.rint(x / COUNT)))
    found = free_decay(runs)
    error = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(found.values - [w, b, f, 0.0]) < 3.5 * error)
    assert error[1] < 0.002 * b and error[2] < 0.02 * f
    # without friction in the law the damper would take it over
    assert free_decay(runs[:2], friction=False).values[1] > 1.03 * b


def test_a_record_without_a_tap_is_refused():
    time = np.arange(0, 5, 0.01)
    with pytest.raises(ValueError, match="tap it harder"):
        swing(run("impulse", time, np.zeros(len(time))))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [101])
def test_identify_finds_a_rig_from_its_files(tmp_path, seed):
    from nonsmooth.models import discontinuous_support
    from nonsmooth_savi2007.identification import identify
    from nonsmooth_savi2007.rig import VirtualRig
    from nonsmooth_savi2007.rig.truth import load_truth

    session = VirtualRig(seed).write_session(tmp_path / "session", truth=tmp_path / "truth.toml")
    found = identify(session, discontinuous_support())
    truth = load_truth(tmp_path / "truth.toml")
    for name in ("m", "k", "k_s", "c", "c_s", "friction"):
        estimate = found.estimate(name)
        assert abs(estimate.value - truth[name]) < 4 * estimate.uncertainty, name
    assert abs(found.estimate("gap_at_rest").value - truth["g"]) < 1e-4
    assert {"c_viscous_only", "c_response", "omega_0", "c_s_contact"} <= {f.name for f in found.findings}
    assert found.synthetic
