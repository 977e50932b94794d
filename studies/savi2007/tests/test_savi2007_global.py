"""Basins and charts of the study: shares in the report, curves in closed form."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth_savi2007 import reproduce
from nonsmooth_savi2007.claims.diagrams import attractors
from nonsmooth_savi2007.figures import charts
from nonsmooth_savi2007.figures.charts import CHARTS, curves, grid_of, names_of
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.study import figures_of_the_study

QUICK = Settings(quick=True, progress=False)
FULL = {figure.name: figure for figure in figures_of_the_study(full=True)}


@pytest.fixture(scope="module")
def basins() -> dict[str, dict]:
    return {name: FULL[name].compute(QUICK) for name in ("basins13", "basins17")}


def test_charts_belong_to_a_full_run_only() -> None:
    usual = {figure.name for figure in figures_of_the_study()}
    assert set(FULL) - usual == set(CHARTS) == {"chart09", "chart13"}
    assert {"basins13", "basins17"} <= usual
    for plane in CHARTS.values():
        assert [len(values) for values in grid_of(plane, 1000).values()] == [1000, 1000]


def test_the_coexisting_attractors_stand_in_the_report(basins: dict[str, dict]) -> None:
    """Periods 3 and 4 at g = 0.0014 m, chaos and period 3 at 9.55 rad/s; errors sqrt(f (1 - f) / n)."""
    for name, periods in (("basins13", [3, 4]), ("basins17", [0, 3])):
        found = basins[name]["basins"]
        assert sorted(found["period_number"].values.tolist()) == periods
        (row,) = attractors(basins, name)
        assert row.verdict == "agrees in part" and "1600 starts" in row.exact and "none reached by 0" in row.exact
        for k, words in enumerate(names_of(found)):
            share = float((found["label"] == k).mean())
            error = np.sqrt(share * (1 - share) / 1600)
            assert f"{100 * share:.2f} ± {100 * error:.2f} %" in words and words in row.exact
        assert sum(float(re.search(r"([\d.]+) ±", one)[1]) for one in names_of(found)) == pytest.approx(100, abs=0.02)


def test_attractors_are_drawn_where_runs_from_their_basins_end(basins: dict[str, dict]) -> None:
    found = basins["basins13"]["basins"]
    for k in range(2):
        i, j = np.argwhere(found["label"].values == k)[0]
        start = [float(found["x"][i]), float(found["v"][j])]
        period = int(found["period_number"][k])
        system = ns.models.discontinuous_support(omega=11.15, rho=0.33, g=0.0014)
        ends = ns.poincare(system, start=start, transient=2000, n=period)["section"].values
        orbit = basins["basins13"][f"orbit_{k}"]
        begin = orbit["u"].transpose("time", "state").values[0]
        assert np.abs(ends - begin).max(axis=1).min() < 1e-8
    assert FULL["basins13"].draw(basins["basins13"]).axes[1].get_title() == "(b) attractors"
    assert "67" in FULL["basins13"].caption(basins["basins13"])


@pytest.mark.parametrize("kinds", [["grazing"], pytest.param(["fold", "flip", "grazing"], marks=pytest.mark.slow)])
def test_curves_of_the_chart_over_the_frequency(kinds: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Motion without contact grazes where g = (rho/m) / sqrt((2k/m - w^2)^2 + (c w/m)^2), all along the curves."""
    monkeypatch.setattr(charts, "_FOLLOWED", kinds)
    plane = CHARTS["chart09"]
    found = curves(plane._replace(ranges={**plane.ranges, "rho": (0.137, 0.143)}))  # a part of the picture
    m, k, c = 0.838, 8.47, 0.87
    met = 0
    for one in found:
        if str(one["kind"].values) == "grazing" and int(one["period_number"]) == 1:
            w, rho = one["omega"].values, one["rho"].values
            assert (rho / m) / np.sqrt((2 * k / m - w**2) ** 2 + (c * w / m) ** 2) == pytest.approx(0.02, rel=1e-9)
            met += 1
    assert met == 2
    assert {str(one["kind"].values) for one in found} == set(kinds)


@pytest.mark.slow
def test_a_full_run_goes_on_from_its_store(tmp_path: Path) -> None:
    """Over (g, rho) every boundary is a ray, because the system is piecewise linear; stores are gone on with."""
    figure = FULL["chart13"]
    settings = Settings(quick=True, full=True, progress=False, folder=tmp_path)
    data = figure.compute(settings)
    marks = {file: file.read_bytes() for file in (tmp_path / "chart13_store.zarr" / "run").glob("*.json")}
    rays = [one for key, one in data.items() if key.startswith("curve")]
    assert len(rays) > 8
    for one in rays:
        ratio = one["g"].values / one["rho"].values
        assert ratio == pytest.approx(ratio[0], rel=1e-6)
    ratios = [
        (str(one["kind"].values), int(one["period_number"]), round(float(one["g"][0] / one["rho"][0]), 9))
        for one in rays
    ]
    assert len(set(ratios)) == len(ratios)  # each curve once
    assert figure.compute(settings)["chart"].identical(data["chart"])
    assert {file: file.read_bytes() for file in marks} == marks
    canvas = figure.draw(data)
    assert [text.get_text() for text in canvas.axes[1].get_legend().get_texts()] == ["flip", "fold", "grazing"]
    assert "every boundary is a straight line" in figure.caption(data)


@pytest.mark.slow
def test_what_the_paper_has_not_goes_by_its_name(tmp_path: Path) -> None:
    made = reproduce(tmp_path, figures=["basins13", "chart13"], quick=True, full=True, progress=False)
    assert {"basins13", "chart13"} == {figure.name for figure in made.figures}
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "(not in the paper; beside Fig. 13)" in text
