"""Period numbers of noisy points, flips, jumps and draws: known answers."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.identification.compare.draws import draw_systems, read_settings
from nonsmooth.identification.compare.orbits import fold
from nonsmooth.identification.compare.periods import flips, measured_period, period_numbers
from nonsmooth.identification.compare.response import AmplitudeJump, match_jumps

NOISE = np.array([1e-3, 1e-2])


def noisy(points: np.ndarray, seed: int = 0, noise: np.ndarray = NOISE) -> np.ndarray:
    return points + noise * np.random.default_rng(seed).normal(size=points.shape)


@pytest.mark.parametrize("p", [1, 2, 3, 4, 6, 12])
def test_periodic_points(p: int) -> None:
    cycle = np.random.default_rng(p).uniform(-1, 1, size=(p, 2))
    found = measured_period(noisy(np.resize(cycle, (120, 2))), NOISE)
    assert found.number == p
    assert found.returns[p - 1] == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("p", [1, 2, 3])
@pytest.mark.parametrize("rate", [20.2, 20.25, 31.3])
def test_a_section_at_an_impact_takes_no_period_from_the_samples(p: int, rate: float) -> None:
    """Flights y = h s (1 - s), one a period, of heights that return after p: samples return after others."""
    turns = np.arange(int(60 * rate)) / rate
    heights = np.array([1.0, 0.6, 0.3])[:p]

    def motion(at: np.ndarray) -> np.ndarray:
        s, h = at % 1.0, heights[np.floor(at).astype(int) % p]
        return np.column_stack([h * s * (1.0 - s), h * (1.0 - 2.0 * s)])

    noise = np.full(2, 1e-4)
    u = noisy(motion(turns), noise=noise)
    for at in (0.0, 0.3 / rate, -0.7 / rate, 0.4):  # the section lies that far behind an impact
        folded = fold(turns - at, u, 64)
        assert measured_period(folded, noise).number == p
    assert measured_period(fold(turns, u, 64)[:, 0], noise).number != p  # the section alone does not tell


def test_chaos_has_none() -> None:
    """The logistic map at 4."""
    x = np.empty(500)
    x[0] = 0.3
    for i in range(1, 500):
        x[i] = 4 * x[i - 1] * (1 - x[i - 1])
    points = np.column_stack([x, 10 * x])
    assert measured_period(noisy(points), NOISE).number == 0


def test_a_splitting_below_the_noise_is_not_seen() -> None:
    """r_1^2 = 1 + d^2 / (2 sigma^2) for points d apart in each state: seen from d = sqrt(6) sigma on."""
    for factor, number in ((2.0, 1), (3.0, 2)):
        cycle = np.array([[0.0, 0.0], factor * NOISE])
        found = measured_period(noisy(np.resize(cycle, (4000, 2))), NOISE)
        assert found.number == number
        assert found.returns[0] == pytest.approx(np.sqrt(1 + factor**2 / 2), rel=0.03)


def test_flips_of_the_logistic_map() -> None:
    """They are at r = 3 and 1 + sqrt(6); a steady series at each r, so that there is no delay."""
    rates = np.linspace(2.8, 3.52, 721)
    rows = []
    for r in rates:
        x = 0.4
        for _ in range(4000):
            x = r * x * (1 - x)
        row = []
        for _ in range(24):
            x = r * x * (1 - x)
            row.append(x)
        rows.append(row)
    noise = np.array([1e-4])
    numbers = [measured_period(noisy(np.array(row)[:, None], i, noise), noise).number for i, row in enumerate(rows)]
    found = flips(rates, numbers)
    first, second = found
    # Beyond the flip the points part as sqrt(r - 3): noise hides the first of them.
    assert first == ("1-2", True, pytest.approx(3.0, abs=0.003))
    assert second == ("2-4", True, pytest.approx(1 + np.sqrt(6), abs=0.003))
    assert flips(rates[::-1], numbers[::-1]) == found


def test_flips_are_found_from_either_side_and_through_gaps() -> None:
    values = np.arange(20.0)
    numbers = np.array([0, 0, 4, 4, 4, 0, 2, 2, 2, 2, 2, 0, 0, 1, 1, 1, 1, 2, 1, 1])
    assert flips(values, numbers) == [("1-2", False, pytest.approx(11.5)), ("2-4", False, pytest.approx(5.0))]
    assert flips(values, np.ones(20)) == []


def test_window_along_a_slow_rise() -> None:
    points = np.concatenate([np.zeros(60), np.resize([0.5, -0.5], 60)])[:, None]
    numbers = period_numbers(noisy(points, 1, NOISE[:1]), NOISE[:1], window=20)
    assert len(numbers) == 120
    assert (numbers[:50] == 1).all() and (numbers[70:] == 2).all()


def test_short_clouds_and_bad_noise() -> None:
    with pytest.raises(ValueError, match="too few"):
        measured_period(np.zeros((4, 2)), NOISE)
    with pytest.raises(ValueError, match="positive standard error"):
        measured_period(np.zeros((40, 2)), [0.0, 1.0])
    with pytest.raises(ValueError, match="fewer than one window"):
        period_numbers(np.zeros((5, 2)), NOISE)


def test_jumps_are_paired_within_their_direction() -> None:
    measured = {"up": [AmplitudeJump(2.72, 0.02), AmplitudeJump(5.68, 0.02)], "down": [AmplitudeJump(5.15, 0.02)]}
    theory = {"up": [AmplitudeJump(5.66, 0.001)], "down": [AmplitudeJump(5.16, 0.001), AmplitudeJump(2.0, 0.001)]}
    drawn = [{"up": [AmplitudeJump(5.60 + 0.01 * i)], "down": []} for i in range(11)]
    found = match_jumps(measured, theory, drawn, "rad/s", 0.8)
    words = found["jump_direction"][1].tolist()
    seen, expected = found["measured_jump"][1], found["theory_jump"][1]
    assert words == ["up", "up", "down", "down"]
    np.testing.assert_array_equal(seen, [2.72, 5.68, 5.15, np.nan])
    np.testing.assert_array_equal(expected, [np.nan, 5.66, 5.16, 2.0])
    assert found["jump_difference"][1][1] == pytest.approx(-0.02)
    assert found["jump_tolerance"][1][1] == pytest.approx(0.0105)
    assert (found["theory_jump_low"][1][1], found["theory_jump_high"][1][1]) == pytest.approx((5.61, 5.69))
    assert np.isnan(found["theory_jump_low"][1][2])  # no draw has a falling jump


class Known(dict):
    """Values with a covariance, as a ParameterSet has them."""

    def __init__(self, values: dict[str, float], matrix: np.ndarray) -> None:
        super().__init__(values)
        names = list(values)
        self.covariance = xr.DataArray(matrix, dims=["parameter", "parameter_"], coords={"parameter": names})


def test_draws_have_the_covariance_that_was_stated() -> None:
    model = ns.models.discontinuous_support()
    matrix = np.array([[0.04**2, 0.6 * 0.04 * 8], [0.6 * 0.04 * 8, 8.0**2]])
    known = Known({"k": 8.5, "k_s": 1200.0}, matrix)
    systems, drawn = draw_systems(model, known, read_settings({"rho": (0.3, 0.01)}, model), 4000, 5)
    table = np.array([drawn["k"], drawn["k_s"]])
    np.testing.assert_allclose(np.cov(table), matrix, rtol=0.08)
    assert drawn["rho"].std() == pytest.approx(0.01, rel=0.06)
    assert abs(np.corrcoef(drawn["rho"], drawn["k"])[0, 1]) < 0.05
    assert systems[7].values["k"] == drawn["k"][7] and systems[7].values["m"] == model.values["m"]
    again = draw_systems(model, known, read_settings({"rho": (0.3, 0.01)}, model), 4000, 5)[1]
    assert (again["k"] == drawn["k"]).all()


def test_a_parameter_known_to_a_factor_stays_positive() -> None:
    model = ns.models.discontinuous_support()
    _, drawn = draw_systems(model, Known({"c_s": 0.6}, np.array([[0.6**2]])), {}, 300, 0)
    assert (drawn["c_s"] > 0).all()


def test_settings_are_checked() -> None:
    model = ns.models.discontinuous_support()
    assert read_settings({"g": 0.001, "rho": {"value": 0.3, "uncertainty": 0.01}}, model) == {
        "g": (0.001, 0.0),
        "rho": (0.3, 0.01),
    }
    with pytest.raises(ValueError, match="`gap` is not a parameter.*nearest: g"):
        read_settings({"gap": 0.0}, model)
    with pytest.raises(ValueError, match="zero or more"):
        read_settings({"g": (0.0, -1.0)}, model)
    with pytest.raises(ValueError, match="write \\{value"):
        read_settings({"g": {"val": 0.0}}, model)


@pytest.mark.parametrize("drifting", [False, True])
def test_a_missing_point_does_not_end_a_period(drifting: bool) -> None:
    """Of period 3 with white noise: the returns of 3 that are there stay at 1."""
    rng = np.random.default_rng(3)
    points = np.tile([[1.0, 0.0], [0.2, 0.5], [-0.7, 0.1]], (40, 1)) + 1e-3 * rng.standard_normal((120, 2))
    points[[50, 51, 52, 53, 77]] = np.nan
    found = measured_period(points, [1e-3, 1e-3], drifting=drifting)
    assert found.number == 3 and found.returns[2] == pytest.approx(1.0, abs=0.2)
    with pytest.raises(ValueError, match="4 section points are too few"):
        measured_period(np.where(np.arange(120)[:, None] < 4, points, np.nan), [1e-3, 1e-3])
