"""Unstable motions held on a rig that is not the paper's: a hardening spring with an elastic stop, noisy readings."""

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def stopped_duffing(**parameters):
    def smooth(t, u, p):
        return p.A * np.cos(p.w * t) - p.c * u.v - p.k * u.x - p.k_3 * u.x**3

    return ns.System(
        name="Duffing with an elastic stop",
        states={"x": "m", "v": "m/s"},
        parameters={"M": 2.0, "c": 0.16, "k": 2.0, "k_3": 0.6, "K": 6.0, "d": 0.9, "A": 0.22, "w": 0.9},
        modes={
            "free": lambda t, u, p: (u.v, smooth(t, u, p) / p.M),
            "stop": lambda t, u, p: (u.v, (smooth(t, u, p) - p.K * (u.x - p.d)) / p.M),
        },
        indicators={"depth": lambda t, u, p: u.x - p.d},
        transitions=[
            ns.Transition("free", "stop", when="depth > 0"),
            ns.Transition("stop", "free", when="depth < 0"),
        ],
        period=lambda p: 2 * np.pi / p.w,
    ).with_parameters(parameters)


@pytest.fixture(scope="module")
def theory():
    """Folds, and frequency and amplitude of the unstable motions between them, by the equations."""
    branch = ns.continue_orbit(ns.find_orbit(stopped_duffing(), progress=False), "w", (0.8, 1.5), step=0.01)
    upper, lower = branch["special_point"].values[branch["special_kind"].values == "fold"]
    half = 0.5 * (branch["maximum"] - branch["minimum"]).sel(state="x").values
    between = slice(int(lower), int(upper), -1)  # the frequency rises
    return branch["w"].values[[upper, lower]], branch["w"].values[between], half[between]


def held(noise, seed):
    rig = ns.SimulatedRig(stopped_duffing(), mass="M", frequency="w", amplitude="A", rate=12.0, noise=noise, seed=seed)
    return ns.control_based_continuation(
        rig, "w", (1.0, 1.35), frequency=1.06, amplitude=0.22, step=0.15, holding=ns.Holding(release=0), progress=False
    )


def judge(found, theory):
    """Assert both folds and no other; return amplitudes of unstable motions, their differences and uncertainties."""
    folds, frequency, amplitude = theory
    assert found["special_kind"].values.tolist() == ["fold", "fold"]  # and none that noise has made
    np.testing.assert_allclose(found["special_value"], folds, rtol=0.01)
    assert (found["control_effort"] < 2 * found["control_effort_noise"]).all()
    first, last = found["special_point"].values
    unstable = found.isel(point=slice(first + 1, last))
    w = unstable["w"].values
    unstable = unstable.isel(point=(w > folds[1] + 0.003) & (w < folds[0] - 0.003))  # at a fold it has no value
    true = np.interp(unstable["w"].values, frequency, amplitude)
    return true, unstable["amplitude"].values - true, unstable["amplitude_uncertainty"].values


@pytest.mark.slow
def test_folds_and_unstable_motions_are_those_of_the_equations(theory):
    # The outermost point of this run lies where the curve is level: its frequency at given amplitude is known to 0.046.
    true, away, u = judge(held(1e-3, seed=5), theory)
    assert len(away) >= 6
    assert np.abs(away / true).max() < 0.01 and np.abs(away / u).max() < 4


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-3, 5e-3])
def test_noise_makes_no_folds_and_hides_none(theory, noise):
    spread = []
    for seed in range(10):
        _, away, u = judge(held(noise, seed), theory)
        spread.extend(away / u)
    rms, most = np.sqrt(np.mean(np.square(spread))), np.abs(spread).max()
    print(f"noise {noise:g}: {len(spread)} unstable motions, normalised differences: rms {rms:.2f}, largest {most:.2f}")
    assert rms < 1.3 and most < 4
