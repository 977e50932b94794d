"""Bands and intervals of drawn predictions, and halves of clouds, beside what a count by hand gives."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.identification.compare.draws import intervals
from nonsmooth.identification.compare.orbits import cloud_distance
from nonsmooth.identification.compare.response import AmplitudeJump, match_jumps

MODEL = ns.models.discontinuous_support()


def test_a_band_follows_the_draws_whichever_of_three_periods_they_begin_with() -> None:
    """Parameters drawn so near to each other that the band is one curve: the orbit itself, after 301 periods too."""
    run = {"rho": 0.33, "omega": 11.15, "g": 0.0014}
    system = MODEL.with_parameters(run)
    motion = ns.simulate(system, periods=60, transient=300, samples=60 * 50 + 1)
    once = np.concatenate([[True], np.diff(motion["time"].values) > 0])
    time = motion["time"].values[once]
    record = xr.Dataset(
        {"u": (("time", "state"), motion["u"].values[once]), "phase": ("time", time * 11.15 / (2 * np.pi))},
        {"time": time, "state": ["x", "v"], "state_unit": ("state", ["m", "m/s"])},
    )
    for transient in (300, 301, 302):
        found = ns.compare(
            record,
            MODEL,
            settings={**run, "k": (8.47, 1e-7)},
            noise={"x": 1e-6, "v": 1e-6},
            draws=4,
            grid=32,
            splits=20,
            transient=transient,
        )
        assert int(found["theory_period_number"]) == 3 and float(found["band_share"]) == 1.0
        size = np.ptp(found["theory_orbit"].values, axis=0)
        for word in ("low", "median", "high"):
            away = np.abs(found[f"theory_{word}"].values - found["theory_orbit"].values) / size
            assert away.max() < 1e-3
        assert (found["draw_orbit_distance"] < 1e-3).all()


def energy(a: np.ndarray, b: np.ndarray) -> float:
    """The energy distance by its definition, over all pairs of points."""
    between, within, beyond = (np.hypot(*(x[:, None] - y[None, :]).T).mean() for x, y in ((a, b), (a, a), (b, b)))
    return float(np.sqrt(2 * between - within - beyond))


def draw(cloud: np.ndarray, block: int, count: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Two parts of a cloud that share no block, each of ``count`` blocks."""
    blocks = cloud.reshape(-1, block, 2)
    order = rng.permutation(len(blocks))
    return [blocks[some].reshape(-1, 2) for some in (order[:count], order[count : 2 * count])]


@pytest.mark.parametrize(("spread", "mean"), [(1.0, 0.0), (3.0, 0.5)])
def test_halves_and_ratio_by_brute_force(spread: float, mean: float) -> None:
    """Clouds of 60 and 300 points of one law or two, in blocks of five: all parts have thirty points."""
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(60, 2)), rng.normal(size=(300, 2)) * spread + mean
    found = cloud_distance(a, b, block=5, splits=1500, seed=1)
    assert (found.block, found.points) == (5, 30)
    parts = [(draw(a, 5, 6, rng), draw(b, 5, 6, rng)) for _ in range(400)]
    halves = [energy(*first) for first, _ in parts]
    others = [energy(*second) for _, second in parts]
    matched = [energy(first[0], second[0]) for first, second in parts]
    assert np.median(found.halves) == pytest.approx(np.median(halves), rel=0.05)
    assert np.median(found.other_halves) == pytest.approx(np.median(others), rel=0.05)
    assert found.matched == pytest.approx(np.median(matched), rel=0.05)
    assert found.distance == pytest.approx(energy(a, b), rel=1e-12)
    assert found.ratio == pytest.approx(np.median(matched) / np.quantile(halves, 0.95), rel=0.08)


@pytest.mark.parametrize(("having", "known"), [(2, False), (4, False), (5, True), (8, True)])
def test_an_interval_takes_half_of_the_draws(having: int, known: bool) -> None:
    """Ten draws of which some have the jump, at 5.0, 5.1, ...: its interval is that of those, or there is none."""
    fall = (2.0, 1.0)
    measured, theory = {"up": [AmplitudeJump(5.2, 0.1, *fall)]}, {"up": [AmplitudeJump(5.2, 0.0, *fall)]}
    drawn = [{"up": [AmplitudeJump(5.0 + 0.1 * k, 0.0, *fall)] if k < having else []} for k in range(10)]
    found = match_jumps(measured, theory, drawn, "rad/s", 0.5)
    ends = [float(found[f"theory_jump_{word}"][1][0]) for word in ("low", "high")]
    expected = [5.0 + 0.1 * (having - 1) * share for share in (0.25, 0.75)] if known else [np.nan, np.nan]
    assert ends == pytest.approx(expected, nan_ok=True)


def test_where_nothing_flips_the_intervals_are_empty_however_many_draws_there_are() -> None:
    """Neither record nor theory has a flip: a table of draws without a column, whose quantiles NumPy gives no rows."""
    assert intervals("theory_flip", "flip", [], "m", 0.95) == {}
    empty = intervals("theory_flip", "flip", [[], [], []], "m", 0.95)
    assert {name: column[1].shape for name, column in empty.items()} == {
        "theory_flip_low": (0,),
        "theory_flip_high": (0,),
    }
    drawn = [[0.1, np.nan], [0.3, np.nan], [np.nan, 0.2]]
    low, high = (column[1] for column in intervals("theory_flip", "flip", drawn, "m", 0.5).values())
    np.testing.assert_allclose([low, high], [[0.15, np.nan], [0.25, np.nan]])  # one draw of three is no interval
