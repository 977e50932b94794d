"""A sweep's histograms against ``numpy.histogram`` of the points that the same sweep stores."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

RANGES = {"x": (-0.02, 0.01), "v": (-0.05, 0.05)}
QUIET = {"progress": False, "transient": 60, "keep": 50}


def histograms(points: np.ndarray, low: float, high: float, bins: int) -> np.ndarray:
    flat = points.reshape(-1, points.shape[-1])
    counted = [np.histogram(row[np.isfinite(row)], bins, (low, high))[0] for row in flat]
    return np.array(counted).reshape(*points.shape[:-1], bins)


@pytest.mark.parametrize("direction", ["up", "both", None])
def test_density_equals_the_histogram_of_stored_points(direction: str | None) -> None:
    system = ns.models.discontinuous_support(omega=3.69, g=-0.0045)
    values = np.linspace(0.2, 0.5, 70)  # more than one buffer of 64
    stored = ns.sweep(system, "rho", values, direction=direction, **QUIET)
    counted = ns.sweep(system, "rho", values, direction=direction, density=RANGES, bins=40, threads=1, **QUIET)
    assert "section" not in counted
    for name, (low, high) in RANGES.items():
        points = stored["section"].sel(state=name)
        expected = histograms(points.transpose(..., "iterate").values, low, high, 40)
        found = counted["density"].sel(state=name)
        assert found.dims == (*points.transpose(..., "iterate").dims[:-1], "bin")
        np.testing.assert_array_equal(found.values, expected)
        np.testing.assert_array_equal(counted["outside"].sel(state=name).values, 50 - expected.sum(axis=-1))
        np.testing.assert_allclose(counted["bin_edge"].sel(state=name), np.linspace(low, high, 41), rtol=1e-15)
    for name in ("maximum", "minimum", "period_number", "crossings_per_period", "clearance", "status"):
        np.testing.assert_array_equal(counted[name].values, stored[name].values)


def test_range_from_a_coarse_run_holds_the_points_and_threads_do_not_matter() -> None:
    system = ns.models.discontinuous_support(omega=3.69, g=-0.0045)
    values = np.linspace(0.5, 0.2, 90)  # falling: the result keeps the order given
    one, two = (
        ns.sweep(system, "rho", values, direction=None, density=True, bins=64, threads=n, **QUIET) for n in (1, 2)
    )
    assert one.identical(two)
    assert one["density"].dims == ("rho", "state", "bin")
    assert one["density"].dtype == np.int32
    np.testing.assert_array_equal(one["density"].sum("bin") + one["outside"], 50)
    assert float(one["outside"].sum()) < 0.02 * 50 * 90 * 2  # a coarse run sees nearly all of the motion


def test_edges_belong_to_bins_as_in_numpy_and_nothing_is_lost() -> None:
    from nonsmooth.kernels.histogram import count

    rng = np.random.default_rng(5)
    edges = np.array([np.linspace(-0.3, 0.7, 11)])
    x = np.concatenate([rng.uniform(-0.5, 1.0, 500), edges[0], np.nextafter(edges[0], -1), [np.nan]])
    counts, outside = np.zeros((1, 10), dtype=np.int32), np.zeros(1, dtype=np.int64)
    count(x.reshape(1, -1, 1), 0, edges, counts, outside)
    np.testing.assert_array_equal(counts[0], np.histogram(x[:-1], edges[0])[0])
    assert counts.sum() + outside.sum() == len(x)


def test_points_that_fail_are_counted_nowhere() -> None:
    system = ns.models.relief_valve()
    result = ns.sweep(
        system,
        "q",
        [8.0, 9.5],
        direction=None,
        start={"y1": 1.0, "y2": 0.0, "y3": 11.0},
        transient=60,
        keep=20,
        section=ns.Poincare("lift_velocity", rising=False, t_max=50.0),
        density={"y1": (0, 10)},
        bins=5,
        progress=False,
    )
    assert result["density"].sel(q=8.0, state="y1").sum() == 20
    if int(result["status"].sel(q=9.5)) == 7:
        assert result["density"].sel(q=9.5).sum() == 0


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({"density": {"z": (0, 1)}}, ValueError, "not a state; states: x, v"),
        ({"density": {"x": 3}}, ValueError, "write density=True"),
        ({"density": {"x": (1, 0)}}, ValueError, "must be below the second"),
        ({"density": "x"}, TypeError, "write density=True"),
        ({"density": True, "bins": 0}, ValueError, "bins"),
    ],
)
def test_wrong_input_is_named(options: dict[str, object], error: type[Exception], match: str) -> None:
    with pytest.raises(error, match=match):
        ns.sweep(ns.models.discontinuous_support(), "rho", [0.3, 0.4], progress=False, **options)


def test_saved_and_loaded_with_nothing_lost(tmp_path: object) -> None:
    from pathlib import Path

    path = Path(str(tmp_path)) / "density.nc"
    result = ns.sweep(ns.models.discontinuous_support(), "rho", [0.3, 0.4], density=True, bins=8, **QUIET)
    ns.save(result, path)
    assert ns.load(path).identical(result)
