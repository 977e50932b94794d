"""Unstable motions held on a rig that is not the paper's: a hardening spring with an elastic stop, noisy readings."""

import numpy as np
import pytest

import nonsmooth as ns


def stopped_duffing(**parameters):
    def smooth(t, u, p):
        return p.A * np.cos(p.w * t) - p.c * u.v - p.k * u.x - p.k_3 * u.x**3

    return ns.System(
        name="Duffing with an elastic stop", states={"x": "m", "v": "m/s"},
        parameters={"M": 2.0, "c": 0.16, "k": 2.0, "k_3": 0.6, "K": 6.0, "d": 0.9, "A": 0.22, "w": 0.9},
        modes={
            "free": lambda t, u, p: (u.v, smooth(t, u, p) / p.M),
            "stop": lambda t, u, p: (u.v, (smooth(t, u, p) - p.K * (u.x - p.d)) / p.M),
        },
        indicators={"depth": lambda t, u, p: u.x - p.d},
        transitions=[
            ns.Transition("free", "stop", when="depth > 0"), ns.Transition("stop", "free", when="depth < 0"),
        ],
        period=lambda p: 2 * np.pi / p.w,
    ).with_parameters(parameters)  # fmt: skip


@pytest.fixture(scope="module")
def theory():
    """Folds, and frequency and amplitude of the unstable motions between them, by the equations."""
    branch = ns.continue_orbit(ns.find_orbit(stopped_duffing(), progress=False), "w", (0.8, 1.5), step=0.01)
    upper, lower = branch["special_point"].values[branch["special_kind"].values == "fold"]
    half = 0.5 * (branch["maximum"] - branch["minimum"]).sel(state="x").values
    between = slice(int(lower), int(upper), -1)  # the frequency rises
    return branch["w"].values[[upper, lower]], branch["w"].values[between], half[between]


def held(noise, seed):
    rig = ns.SimulatedRig(
        stopped_duffing(), mass="M", frequency="w", amplitude="A", rate=12.0, noise=noise, seed=seed
    )  # fmt: skip
    return ns.control_based_continuation(
        rig, "w", (1.0, 1.35), frequency=1.06, amplitude=0.22, step=0.15, release=0, progress=False
    )


def judge(found, theory):
    folds, frequency, amplitude = theory
    assert found["special_kind"].values.tolist() == ["fold", "fold"]  # and none that noise has made
    np.testing.assert_allclose(found["special_value"], folds, rtol=0.01)
    first, last = found["special_point"].values
    unstable = found.isel(point=slice(first + 1, last))
    w, u = unstable["w"].values, unstable["amplitude_uncertainty"].values
    clear = (w > folds[1] + 0.003) & (w < folds[0] - 0.003)  # at a fold the amplitude has no value of its own
    assert clear.sum() >= 6
    away = (unstable["amplitude"].values - np.interp(w, frequency, amplitude))[clear]
    assert np.abs(away / u[clear]).max() < 4
    assert np.abs(away / np.interp(w, frequency, amplitude)[clear]).max() < 0.01
    assert (unstable["control_effort"] < 2 * unstable["control_effort_noise"]).all()
    return away / u[clear]


def test_folds_and_unstable_motions_are_those_of_the_equations(theory):
    judge(held(1e-3, seed=3), theory)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-3, 5e-3])
def test_noise_makes_no_folds(theory, noise):
    """Ten runs: the two folds of the equations and no other, whatever the noise."""
    away = np.concatenate([judge(held(noise, seed), theory) for seed in range(10)])
    print(f"noise {noise:g}: {len(away)} unstable motions, rms of normalised differences {np.sqrt(np.mean(away**2)):.2f}")
