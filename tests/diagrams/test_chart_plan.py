"""Plan of a chart on a GPU: the arithmetic, with a chart whose cost is known; no GPU and no simulator."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.diagrams import chart_plan
from nonsmooth.diagrams.chart import plan_chart


def planned(monkeypatch: pytest.MonkeyPatch, side: int, launch: int) -> tuple[chart_plan.GpuPlan, list[Any]]:
    """A chart whose point k of n costs 2 k / n milliseconds; launches take so many points."""
    grid = {"omega": np.linspace(3.0, 7.0, side), "rho": np.linspace(0.1, 0.3, side)}
    work = plan_chart(ns.models.discontinuous_support(), grid).work
    seen: list[Any] = []

    def took(_: Any, places: Any) -> float:
        seen.append(places)
        return float((2e-3 * places / side**2).sum())

    monkeypatch.setattr(chart_plan, "_took", took)
    monkeypatch.setattr(chart_plan, "batch_size", lambda: launch)
    monkeypatch.setattr(chart_plan, "gpu_name", lambda: "a GPU")
    return chart_plan.plan_on_gpu(work, seconds=5.0), seen[1:]  # the first one is not counted


def test_a_sample_knows_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """A million points that take 1000 s, from two launches of 4096."""
    found, seen = planned(monkeypatch, 1000, 4096)
    assert found.places == 1_000_000
    assert found.sampled == sum(map(len, seen)) < 20_000
    assert abs(found.seconds - 1000.0) < 10.0
    assert found.text().startswith(f"gpu         {found.seconds / 60:.3g} min on a GPU (+- ")
    for places in seen:
        assert len(np.unique(places)) == len(places) > 4000
        assert (np.diff(places) == 1).mean() > 0.9  # neighbours stay together, as in the chart itself
        assert np.histogram(places, bins=10, range=(0, 1e6))[0].min() > 300


def test_a_chart_that_fits_into_a_launch_is_run_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    found, seen = planned(monkeypatch, 10, 4096)
    assert [places.tolist() for places in seen] == [list(range(100))]
    assert found.error == 0.0
    assert found.seconds == pytest.approx(2e-3 * 49.5)
    assert found.text() == "gpu         0.099 s on a GPU (all 100 points were run)"


def test_carried_rows_by_a_few_of_their_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each point of a row costs 10 ms whatever the number of rows: 100 points in one chunk, 1 s."""
    grid = {"omega": np.linspace(3.0, 7.0, 100), "rho": np.linspace(0.1, 0.3, 30)}
    work = plan_chart(ns.models.discontinuous_support(), grid, carry={"omega": "up"}).work
    monkeypatch.setattr(chart_plan, "_took", lambda work, places: 1e-2 * len(work.grid["omega"]))
    monkeypatch.setattr(chart_plan, "gpu_name", lambda: "a GPU")
    work = replace(work, settler=replace(work.settler, device="cuda"), chunk=65536)
    assert work.n_chunks() == 1
    found = chart_plan.plan_on_gpu(work)
    assert found.seconds == pytest.approx(1.0)
    assert found.sampled == 16 * 30
    assert found.text() == "gpu         1 s on a GPU (sampled 480 points)"
