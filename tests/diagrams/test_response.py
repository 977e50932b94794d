"""`frequency_response`: amplitudes by formula, jumps where they were put."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.diagrams.response import jumps_in


def test_the_amplitude_of_the_linear_oscillator() -> None:
    """a = rho / |2 k - m w^2 + i c w|, half the true range, up and down alike; no jump."""
    system = ns.models.discontinuous_support(g=1.0, rho=0.2)
    omega = np.linspace(3.5, 5.5, 21)
    response = ns.frequency_response(system, omega, transient=150, keep=4, max_period=3, progress=False)
    p = system.values
    a = p["rho"] / np.hypot(2 * p["k"] - p["m"] * omega**2, p["c"] * omega)
    assert response["amplitude"].dims == ("omega", "direction", "state")
    assert response["direction"].values.tolist() == ["up", "down"]
    assert np.allclose(response["amplitude"].sel(state="x"), a[:, None], rtol=1e-9)
    assert np.allclose(response["amplitude"].sel(state="v"), (a * omega)[:, None], rtol=1e-9)
    assert response.sizes["jump"] == 0


def test_jumps_of_a_bistable_motion() -> None:
    """x' = x - x^3 + a (1 + cos(w t) / 100): going up it leaves the lower branch at the fold, 2 / (3 sqrt 3) shifted
    by less than one percent; going down it is the mirror image. Half the range of x jumps there."""
    system = ns.System(
        states=["x"],
        parameters={"a": (0.0, "N"), "w": 20.0},
        modes={"only": lambda t, u, p: u.x - u.x**3 + p.a + 0.01 * np.cos(p.w * t)},
    )
    a = np.linspace(-0.6, 0.6, 61)
    response = ns.frequency_response(
        system, a, parameter="a", start={"x": -1.2}, transient=200, keep=4, max_period=3, rtol=1e-10, progress=False
    )
    assert response["jump_direction"].values.tolist() == ["up", "down"]
    fold = 2 / (3 * np.sqrt(3))
    width = a[1] - a[0]
    assert np.allclose(response["jump_step"], width)
    assert response["jump_step"].attrs["units"] == response["jump_value"].attrs["units"] == "N"
    assert abs(response["jump_value"].values[0] - fold) <= 0.5 * width + 0.01 * fold
    assert abs(response["jump_value"].values[1] + fold) <= 0.5 * width + 0.01 * fold
    assert (response["jump_before"].values > response["jump_after"].values).all()


@pytest.mark.parametrize(
    ("amplitude", "found"),
    [
        (np.linspace(1.0, 2.0, 20), []),
        (np.r_[np.linspace(1.0, 2.0, 10), np.linspace(0.5, 0.4, 10)], [9]),
        (np.r_[np.linspace(1.0, 2.0, 10), 2.0 + 4e-3 + np.zeros(10)], []),
        (np.r_[1.0, 1.0, 5.0, 5.0, 1.0, 1.0], [1, 3]),
        (np.array([1.0]), []),
        (np.array([1.0, 2.0]), []),
        (np.r_[1.0, 1.01, np.nan, 1.03, 1.04, 3.0, 3.01], [4]),
        (np.r_[1.0, 1.01, 1.02, np.nan, np.nan, 3.0, 3.01, 3.02], [2]),  # as much as over three steps
        (np.r_[1.0, 1.01, np.nan, np.nan, np.nan, np.nan, 1.06, 1.07], []),
    ],
)
def test_jumps_stand_out_from_their_neighbours(amplitude: np.ndarray, found: list[int]) -> None:
    assert [i for i, _ in jumps_in(np.arange(float(len(amplitude))), amplitude)] == found


def test_a_jump_beside_a_point_that_failed() -> None:
    """Points without an amplitude are passed over: the jump is as wide as they leave it."""
    x = np.array([1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6])
    assert jumps_in(x, np.array([1.0, 1.01, 1.02, np.nan, 0.3, 0.29, 0.28])) == [(2, 4)]
    assert jumps_in(np.array([1.0, 1.1, 1.2, 2.2, 2.3, 2.4]), np.array([1.0, 1.1, 1.2, 2.2, 2.3, 2.4])) == []


def test_directions_and_starts_of_a_response() -> None:
    system = ns.models.discontinuous_support(g=1.0, rho=0.2)
    one = ns.frequency_response(system, [3.0, 3.5], direction="up", transient=50, keep=4, max_period=3, progress=False)
    assert one["amplitude"].dims == ("omega", "state")
    starts = [{"x": 0.0}, {"x": 0.01}]
    many = ns.frequency_response(system, [3.0, 3.5], start=starts, transient=150, keep=4, max_period=3, progress=False)
    assert many["amplitude"].dims == ("omega", "direction", "start", "state")
    p = system.values
    a = p["rho"] / np.hypot(2 * p["k"] - p["m"] * 9.0, p["c"] * 3.0)
    assert np.allclose(many["amplitude"].sel(omega=3.0, state="x"), a, rtol=1e-8)


def test_the_parameter_is_the_one_that_sets_the_period() -> None:
    """a = P / |k - w^2 + i c w| over the frequency, whatever its name; of two, or none, one says which."""

    def driven(force, **parameters):
        return ns.mechanical(1.0, 0.1, 1.0, parameters=parameters, forcing={"q": force})

    w, options = np.array([0.5, 0.9, 1.4]), {"transient": 300, "keep": 4, "max_period": 3, "progress": False}
    response = ns.frequency_response(driven(lambda t, p: p.P * np.sin(2 * p.w * t), P=0.3, w=1.0), w / 2, **options)
    a = 0.3 / np.hypot(1 - w**2, 0.1 * w)
    assert response["amplitude"].dims[0] == "w"
    np.testing.assert_allclose(response["amplitude"].sel(state="q"), np.stack([a, a], axis=1), rtol=1e-9)
    for two in (driven(lambda t, p: np.sin((p.w - p.b) * t), w=1.0, b=0.1), driven(lambda t, p: p.P, P=0.1)):
        with pytest.raises(ValueError, match=r"`omega` is not a parameter of .*; choose one with parameter="):
            ns.frequency_response(two, w, **options)


def test_jumps_are_those_of_every_state_and_output_and_a_plot_draws_its_own() -> None:
    """Three bistable cells x_i' = x_i - x_i^3 + s_i a, of which the second and the third are met at other values of a.

    Each leaves its lower branch where s_i a is the fold 2 / (3 sqrt 3); the first, with s = 0, never does.
    """
    import matplotlib

    matplotlib.use("Agg")

    def field(t, u, p):
        ripple = 0.01 * np.cos(p.w * t)
        return tuple(x - x**3 + s * p.a + ripple for x, s in ((u.x, 0.0), (u.y, 1.0), (u.z, 2.0)))

    system = ns.System(
        states=["x", "y", "z"],
        parameters={"a": 0.0, "w": 20.0},
        modes={"only": field},
        outputs={"square": lambda t, u, p: u.z * u.z},
    )
    a = np.linspace(0.0, 0.6, 61)
    response = ns.frequency_response(
        system,
        a,
        parameter="a",
        direction="up",
        start={"x": -1.2, "y": -1.2, "z": -1.2},
        transient=200,
        keep=4,
        max_period=3,
        rtol=1e-10,
        progress=False,
    )
    fold, names = 2 / (3 * np.sqrt(3)), response["jump_variable"].values.astype(str)
    assert set(names) == {"y", "z", "square"} and names.tolist() == sorted(names, key=["y", "z", "square"].index)
    for name, place in (("y", fold), ("z", fold / 2), ("square", fold / 2)):
        values = response["jump_value"].values[names == name]
        assert np.min(np.abs(values - place)) <= 0.5 * (a[1] - a[0]) + 0.01 * fold
    for name, others in (("y", fold / 2), ("z", fold)):
        texts = [float(one.get_text()) for one in ns.plot.frequency_response(response, y=name).texts if one.get_text()]
        assert len(texts) == (names == name).sum() and np.min(np.abs(np.array(texts) - others)) > 0.02
    assert not [one for one in ns.plot.frequency_response(response, y="x").texts if one.get_text()]


def test_amplitudes_are_those_of_extremes() -> None:
    with pytest.raises(ValueError, match="leave extremes=False out"):
        ns.frequency_response(ns.models.impact_oscillator(), [0.8, 0.9], judge=False, extremes=False)
