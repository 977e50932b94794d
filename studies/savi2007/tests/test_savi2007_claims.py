"""The closed forms and the reading of sweeps behind the report, against cases that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth_savi2007 import grazing_frequencies
from nonsmooth_savi2007.claims.response import main_jump, small_jump
from nonsmooth_savi2007.measure import (
    UNSETTLED,
    Interval,
    changes,
    free_amplitude,
    regimes,
    separation_rate,
    steady_state,
)
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_10, FIGURE_17

TABLE_1 = {"m": 0.838, "k": 8.47, "c": 0.87}

# Roots of (2k/m - w^2)^2 + (c w/m)^2 = (rho/(m g))^2, by a bisection of the amplitude outside this package.
GRAZING = {"fig09": (FIGURE_9, (3.56758, 5.15986)), "fig10": (FIGURE_10, (2.71137, 5.65687))}


@pytest.mark.parametrize("name", GRAZING)
def test_grazing_frequencies_are_the_published_roots(name: str) -> None:
    figure, expected = GRAZING[name]
    found = grazing_frequencies(TABLE_1 | figure)
    assert found == pytest.approx(expected, abs=5e-6)
    for omega in found:
        assert free_amplitude(TABLE_1 | figure | {"omega": omega}) == pytest.approx(figure["g"], rel=1e-13)


def test_grazing_has_one_root_in_a_narrow_gap_and_none_in_a_wide_one() -> None:
    assert len(grazing_frequencies(TABLE_1 | FIGURE_17)) == 1  # already in contact at rest, rho / 2k > g
    assert grazing_frequencies(TABLE_1 | {"rho": 0.01, "g": 1.0}) == []
    with pytest.raises(ValueError, match="gap g > 0"):
        grazing_frequencies(TABLE_1 | {"rho": 0.1, "g": -0.001})


def test_steady_state_returns_after_a_period() -> None:
    system = ns.models.discontinuous_support(rho=0.14, g=0.02, omega=6.5)
    begin = steady_state(system.values)
    end = ns.poincare(system, start=begin, n=1)["section"].values[-1]
    assert end == pytest.approx([begin["x"], begin["v"]], rel=1e-12)


@pytest.mark.parametrize("method", ["exact", "rkf45"])
@pytest.mark.parametrize(
    ("figure", "window", "direction", "which"),
    [(FIGURE_9, (5.10, 5.22), "down", 1), (FIGURE_10, (5.60, 5.72), "down", 1), (FIGURE_10, (2.66, 2.76), "up", 0)],
)
def test_a_jump_lies_within_one_step_of_the_closed_form(
    figure: dict[str, float], window: tuple[float, float], direction: str, which: int, method: str
) -> None:
    step, eta = 0.005, 1e-5
    values = np.arange(*window, step)
    sharp = ns.models.discontinuous_support(**figure)
    system, options = (sharp, {}) if method == "exact" else (sharp.smoothed(eta), {"method": "rkf45", "rtol": 1e-6})
    first = values[-1] if direction == "down" else values[0]
    begin = steady_state(TABLE_1 | figure | {"omega": first})  # from rest another motion may be met
    response = ns.frequency_response(
        system, values, direction=direction, start=begin, transient=150, keep=8, max_period=4, progress=False, **options
    )
    found = main_jump(response, direction)
    gap = figure["g"] - (0.0 if method == "exact" else eta)
    assert found is not None
    assert abs(found.value - grazing_frequencies(TABLE_1 | figure | {"g": gap})[which]) <= step


def test_regimes_and_changes_read_a_sweep_by_rising_values() -> None:
    swept = _swept([4, 3, 2, 1, 0], [1, 1, 2, 0, 0], [0, 1, 0, 0, 2])  # the value 3 is slow, 1 is "ok" without a period
    values, regime = regimes(swept)
    assert values.tolist() == [0, 1, 2, 3, 4]
    assert regime.tolist() == [0, 0, 2, UNSETTLED, 1]
    assert changes(swept, 1, 2) == [Interval(2, 4)]  # the slow point lies inside
    assert changes(swept, 2, 0) == [Interval(1, 2)]
    assert changes(swept, 1, 4) == []


FLAGS = {"flag_values": np.arange(3), "flag_meanings": "ok slow not_periodic"}


def _swept(values: list[float], period: list[int], status: list[int]) -> xr.Dataset:
    return xr.Dataset(
        {
            "maximum": (("rho", "state"), np.zeros((len(values), 2))),
            "period_number": ("rho", period),
            "status": ("rho", np.array(status, dtype=np.int8), FLAGS),
        },
        {"rho": np.array(values, dtype=float), "state": ["x", "v"]},
    )


def test_the_separation_rate_is_the_largest_exponent_times_the_period() -> None:
    """The exponent 0.7 of a drive of frequency 4 pi: distances grow by exp(0.35) in its period of 0.5."""
    numbers = {"exponents": ("exponent", [0.7, -1.0]), "standard_error": ("exponent", [0.02, 0.03])}
    found = xr.Dataset(numbers, {"omega": 4 * np.pi})
    assert separation_rate(found) == pytest.approx((0.35, 0.01))


def test_a_single_jump_is_not_a_small_one() -> None:
    jump = {"jump_value": 5.0, "jump_step": 0.1, "jump_before": 1.0, "jump_after": 2.0}
    response = xr.Dataset({name: ("jump", [value]) for name, value in jump.items()})
    response["jump_direction"] = ("jump", ["up"])
    assert main_jump(response, "up")[:2] == (4.95, 5.05)
    assert small_jump(response, "up") is None
    assert main_jump(response, "down") is None
