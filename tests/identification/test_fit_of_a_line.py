"""Fits of x' = a to straight lines with noise: each number of the result is one of linear regression."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics
NOISE = 0.1


def line(unit: str = "") -> ns.System:
    states = {"x": unit} if unit else ["x"]
    return ns.System(states=states, parameters={"a": 1.5}, modes={"m": lambda t, u, p: (p.a,)})


def readings(seed: int = 2, n: int = 60, x0: float = 1.0, a: float = 2.0) -> xr.Dataset:
    t = np.linspace(0.0, 3.0, n)
    return xr.Dataset({"x": ("time", x0 + a * t + NOISE * np.random.default_rng(seed).standard_normal(n))}, {"time": t})


def regression(data: xr.Dataset) -> tuple[np.ndarray, np.ndarray, float]:
    """Slope and start, their covariance over that of a reading, and the scatter about the line."""
    t, x = data["time"].values, data["x"].values
    A = np.column_stack([t, np.ones_like(t)])
    found, left, *_ = np.linalg.lstsq(A, x, rcond=None)
    return found, np.linalg.inv(A.T @ A), float(np.sqrt(left[0] / (len(t) - 2)))


@cache
def plain(seed: int = 2) -> Any:
    return ns.fit(line(), readings(seed), ["a"], progress=False)


def test_slope_start_and_noise_are_those_of_regression() -> None:
    (a, x0), _, scatter = regression(readings())
    found = plain()
    assert found["a"] == pytest.approx(a, rel=1e-7) and "readings of x" in found.identifiability["a"]
    assert found.extra["x(0)"].value == pytest.approx(x0, rel=1e-6)
    assert found.extra["x.noise"].value == pytest.approx(scatter, rel=1e-6)


def test_uncertainties_cover_over_seeds() -> None:
    """Means over records whose scatter differs: those of regression; of the noise, its size over the root of 2 n."""
    rows = []
    for seed in range(8):
        found, (_, C, _) = plain(seed), regression(readings(seed))
        stated = [found.estimate("a"), found.extra["x(0)"], found.extra["x.noise"]]
        exact = [NOISE * np.sqrt(C[0, 0]), NOISE * np.sqrt(C[1, 1]), NOISE / np.sqrt(2 * 60)]
        rows.append([one.uncertainty / size for one, size in zip(stated, exact, strict=True)])
    assert np.median(rows, axis=0) == pytest.approx(1.0, abs=0.25)


def test_the_scatter_of_the_record_is_the_uncertainty_whatever_noise_is_stated() -> None:
    stated = [
        ns.fit(line(), readings(), ["a"], measured={"x": ns.Sensor("x", noise=k * NOISE)}, progress=False)
        for k in (1, 5)
    ]
    for name in ("a", "x(0)"):
        sizes = [one.estimate(name).uncertainty for one in (*stated, plain())]
        assert sizes == pytest.approx([sizes[-1]] * 3, rel=0.05)
    assert not any("x.noise" in one.extra for one in stated)


@pytest.mark.parametrize(("centre", "error"), [(2.5, 0.05), (2.05, 0.01)])
def test_a_value_known_before_is_weighed_by_its_precision(centre: float, error: float) -> None:
    """The mean of both values by the inverses of their variances."""
    (a, _), C, _ = regression(readings())
    weight = np.array([1 / (NOISE**2 * C[0, 0]), 1 / error**2])
    found = ns.fit(
        line(),
        readings(),
        ["a"],
        measured={"x": ns.Sensor("x", noise=NOISE)},
        priors={"a": (centre, error)},
        progress=False,
    )
    assert found["a"] == pytest.approx(weight @ [a, centre] / weight.sum(), rel=1e-6)
    assert found.estimate("a").uncertainty == pytest.approx(weight.sum() ** -0.5, rel=0.3)


@pytest.mark.parametrize(("bounds", "end"), [((2.3, 3.0), 2.3), ((1.0, 1.7), 1.7), ((None, 1.7), 1.7)])
def test_beside_an_unknown_at_its_bound_the_other_is_the_best_there(bounds: tuple[Any, float], end: float) -> None:
    """x' = a and y' = a + b: with a held, b is the slope of y less it, as if x had not been read."""
    modes = {"m": lambda t, u, p: (p.a, p.a + p.b)}
    guess = 2.5 if end == bounds[0] else 1.5
    system = ns.System(states=["x", "y"], parameters={"a": guess, "b": 1.0}, modes=modes)
    y = readings(seed=3, x0=0.0, a=2.5)
    (slope, _), _, _ = regression(y)
    both = readings().assign(y=y["x"])
    found = ns.fit(system, both, {"a": bounds, "b": None}, measured=["x", "y"], progress=False)
    assert found["a"] == end and "at its bound" in found.identifiability["a"]
    assert found["b"] == pytest.approx(slope - end, abs=1e-6)


def test_a_sensor_shows_gain_times_the_state_and_an_offset() -> None:
    """3 (x - ...) + 0.5: slope and start of the state are those of the reading over the gain, less the offset."""
    data = readings()
    shown = data.assign(x=3.0 * data["x"] + 0.5)
    found = ns.fit(line(), shown, ["a"], measured={"x": ns.Sensor("x", gain=3.0, offset=0.5)}, progress=False)
    assert found["a"] == pytest.approx(plain()["a"], rel=1e-8)
    assert found.extra["x(0)"].value == pytest.approx(plain().extra["x(0)"].value, rel=1e-7)
    assert found.estimate("a").uncertainty == pytest.approx(plain().estimate("a").uncertainty, rel=1e-4)


def test_limits_of_a_profile_are_those_of_chi_squared() -> None:
    """The rise of chi^2, over the residuals' own correlation, is a parabola here: limits 1.96 uncertainties off."""
    found = ns.fit(line(), readings(0), ["a"], profile=["a"], progress=False)
    [profile] = [one.data for one in found.findings if one.plot == "profile"]
    away = 1.9600 * found.estimate("a").uncertainty
    assert float(profile["low"]) == pytest.approx(found["a"] - away, abs=0.02 * away)
    assert float(profile["high"]) == pytest.approx(found["a"] + away, abs=0.02 * away)


def test_noise_that_correlates_is_found_with_its_correlation() -> None:
    """An autoregressive process with 0.7 from reading to reading; of white noise nothing is said."""
    n, rho, rng = 400, 0.7, np.random.default_rng(5)
    e = np.zeros(n)
    for k, shock in enumerate(rng.standard_normal(n)):
        e[k] = (rho * e[k - 1] if k else 0.0) + shock
    t = np.linspace(0, 3, n)
    data = xr.Dataset({"x": ("time", 1 + 2 * t + NOISE * e)}, {"time": t})
    notes = [one for one in ns.fit(line(), data, ["a"], progress=False).notes if "correlates by" in one]
    assert len(notes) == 1
    assert float(notes[0].split("correlates by ")[1][:4]) == pytest.approx(rho, abs=0.1)
    assert not any("correlates by" in one for seed in range(8) for one in plain(seed).notes)


def test_two_records_share_the_slope_and_have_starts_of_their_own() -> None:
    """Regression with one slope and two constants."""
    first, second = readings(1), readings(7, 40, x0=-2.0)
    t, x = (np.concatenate([one[name].values for one in (first, second)]) for name in ("time", "x"))
    own = np.repeat(np.eye(2), [60, 40], axis=0)
    (a, b0, b1), *_ = np.linalg.lstsq(np.column_stack([t, own]), x, rcond=None)
    found = ns.fit(line(), [first, second], ["a"], progress=False)
    assert found["a"] == pytest.approx(a, rel=1e-6)
    starts = [one.value for name, one in found.extra.items() if name.startswith("x(0)")]
    assert starts == pytest.approx([b0, b1], rel=1e-6)


def test_readings_without_noise_have_the_uncertainty_of_rounding_and_no_notes_on_noise() -> None:
    """Regression with the standard deviation of a count, d / sqrt(12), where one is given; else of the arithmetic."""
    t = np.linspace(0.0, 3.0, 60)
    data = xr.Dataset({"x": ("time", 1.0 + 2.0 * t)}, {"time": t})
    _, C, _ = regression(data)
    for sensor, least in (ns.Sensor(resolution=0.01), 0.01 / np.sqrt(12.0)), (ns.Sensor(), 1e-13 * 7.0):
        found = ns.fit(line(), data, ["a"], measured={"x": sensor}, progress=False)
        assert found.extra["x.noise"].value == pytest.approx(least, rel=1e-9)
        assert found.estimate("a").uncertainty == pytest.approx(least * np.sqrt(C[0, 0]), rel=0.02)
        assert abs(found["a"] - 2.0) < found.uncertainty["a"]
        assert not [note for note in found.notes if "outliers" in note or "correlates by" in note]


def test_the_gain_of_a_state_without_a_unit_has_none() -> None:
    """Readings 3 x: slope and start known, the gain is that of regression through the state."""
    data = readings(x0=1.0, a=1.5)
    known = {"free_start": False, "start": {"x": 1.0}}
    shown = data.assign(x=3.0 * data["x"])
    sensor = {"x": ns.Sensor("x", gain=2.5)}
    gain = ns.fit(line(), shown, ["x.gain"], measured=sensor, progress=False, **known).extra["x.gain"]
    state = 1.0 + 1.5 * data["time"].values
    assert gain.unit == "" and gain.value == pytest.approx(shown["x"].values @ state / (state @ state), rel=1e-9)
    of_metres = ns.fit(line("m"), shown, ["x.gain"], measured=sensor, progress=False, **known).extra["x.gain"]
    assert of_metres.unit == "1/(m)"


def test_an_error_counts_in_the_fold_that_holds_it_out() -> None:
    """The last reading but one is 50 noise deviations off: its block alone has that error, about 1 have the others."""
    data = readings(n=200)
    data["x"][-2] += 50 * NOISE
    decay = ns.System(states=["x"], parameters={"b": -0.5}, modes={"m": lambda t, u, p: (-p.b * u.x,)})
    found = ns.select_model({"line": (line(), ["a"]), "growth": (decay, ["b"])}, data, folds=3, progress=False)
    small, large = np.sort(found["squared_error"].sel(model="line").values)[[-2, -1]]
    assert small < 3.0 and large > 20.0
