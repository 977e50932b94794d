"""Numbers that the report reads off the virtual rig's records, against responses and numbers made up by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth_savi2007.claims.diagrams import f16
from nonsmooth_savi2007.claims.portraits import at_gap
from nonsmooth_savi2007.claims.response import between_cell, doubled_cell, grazing_cell, no_doubled_cell
from nonsmooth_savi2007.claims.verdicts import Cell, Statement, Verdict, printed_cell
from nonsmooth_savi2007.figures.motions import chosen, measured_periods_at, said
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.laboratory import found_in, kept, the_finding
from nonsmooth_savi2007.measure import Interval, jumps, main_jump, measured_periods
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_14, NUMBERS, TABLE_1

STEP = 0.05


def _response(jumps: dict[str, float], doubled: tuple[float, float] = (3.6, 4.0)) -> dict[str, xr.Dataset]:
    """Amplitudes that fall evenly, and by half of them at a jump; period 2 within ``doubled``."""
    omega = np.round(np.arange(3.0, 6.5, STEP), 6)
    columns: dict[str, list[np.ndarray]] = {"omega": [], "amplitude": [], "direction": [], "period_number": []}
    met: dict[str, list[Any]] = {"direction": [], "value": [], "step": [], "before": [], "after": []}
    for direction, jump in jumps.items():
        columns["omega"].append(omega)
        columns["amplitude"].append(0.02 - 1e-3 * (omega - 3.0) - np.where(omega > jump, 0.01, 0.0))
        columns["direction"].append(np.full(len(omega), direction))
        columns["period_number"].append(np.where((omega >= doubled[0]) & (omega <= doubled[1]), 2, 1))
        if jump < omega[-1]:
            step = np.searchsorted(omega, jump) + np.arange(-1, 1)
            ends = columns["amplitude"][-1][step]
            row = (direction, omega[step].mean(), STEP, *(ends if direction == "up" else ends[::-1]))
            for cells, value in zip(met.values(), row, strict=True):
                cells.append(value)
    runs = xr.Dataset({name: ("run", np.concatenate(parts)) for name, parts in columns.items()})
    runs = runs.assign({f"jump_{name}": ("jump", np.array(cells)) for name, cells in met.items()})
    return {"runs": runs}


def test_jumps_and_periods_of_a_response_made_by_hand() -> None:
    runs = _response({"up": 5.81, "down": 5.16})["runs"]
    (up,), (down,) = (jumps(runs, direction) for direction in ("up", "down"))
    assert (up.low, up.high) == pytest.approx((5.80, 5.85))
    assert (down.low, down.high) == pytest.approx((5.15, 5.20))
    omega, number = measured_periods(runs, "up")
    assert omega[number == 2][[0, -1]] == pytest.approx((3.6, 4.0))


def test_the_cells_of_figure_9_are_those_of_the_response() -> None:
    region_at, rising, jump = (NUMBERS[key] for key in ("period 2 near", "jump rising", "jump falling"))
    runs = _response({"up": 5.86, "down": 5.26})["runs"]
    region = doubled_cell(runs, "up", region_at.value)
    assert region == Cell("period 2 from 3.600 to 4.000 rad/s (9 runs)", Verdict.AGREES)  # 3.63 lies within
    assert printed_cell(rising, main_jump(runs, "up")).verdict == "agrees"  # 5.88 lies in the step 5.85 ... 5.90
    falling = main_jump(runs, "down")
    assert printed_cell(jump, falling).verdict == "agrees"  # 5.29 in 5.25 ... 5.30, by its rounding
    # 5.275, known to 0.025, against grazing at 5.15986: 1.7 to 2.7 %
    assert grazing_cell(falling, FIGURE_9, -1).verdict == "undecided"
    assert doubled_cell(runs, "down").verdict == "agrees"
    assert between_cell(runs).verdict == "agrees in part"
    missing = printed_cell(rising, main_jump(_response({"up": 9.0, "down": 9.0})["runs"], "up"))
    assert missing.verdict == "undecided" and "not found" in missing.text
    near, outside = (_response({"up": 5.86, "down": 5.26}, doubled=(low, 4.0))["runs"] for low in (3.65, 3.75))
    assert doubled_cell(near, "up", region_at.value).verdict == "undecided"  # runs at 3.60 and 3.65
    assert doubled_cell(outside, "up", region_at.value).verdict == "differs"


def _steady(numbers: dict[str, int]) -> dict[str, xr.Dataset]:
    return {
        key: xr.Dataset({"measured_period_number": number, "coexisting_period_number": ("attractor", [1, 3])})
        for key, number in numbers.items()
    }


def test_motions_at_a_gap_are_a_set_over_its_starts() -> None:
    data = _steady({"-0.0012": 1, "0.0009": 0, "0.0014": 4, "0.0018": 0, "0.0009_2": 2, "0.0014_2": 4, "0.0018_2": 0})
    assert measured_periods_at(data, 0.0009) == {0: 1, 2: 1}
    assert chosen(data, 0.0009, 2) is data["0.0009_2"]
    assert chosen(data, 0.0014, 3) is data["0.0014"]  # none has it: the first
    verdicts = [at_gap(data, g, period).verdict for g, period in FIGURE_14.items()]
    assert verdicts == ["agrees", "agrees", "differs", "agrees"]
    assert "0.9 mm: no period and period 2 (model: period 1, period 3)" in said(data, FIGURE_14, "m")


def test_the_sections_of_figure_16_agree_below_twice_the_halves() -> None:
    far = xr.Dataset(
        {
            "energy_distance_matched": ("section_phase", [0.1, 0.1]),
            "measured_halves_p95": ("section_phase", [0.1, 0.06]),
            "measured_period_number": 0,
            "measured_section": (("section_phase", "measured_iterate"), np.zeros((2, 7))),
        }
    )
    (row,) = f16({"fig16": {"attractor": far}})
    assert (row.rig, row.rig_verdict) == ("no period, 7 turns", "agrees")
    worse = far.assign(measured_halves_p95=("section_phase", [0.1, 0.04]))
    assert next(f16({"fig16": {"attractor": worse}})).rig_verdict == "differs"


def test_a_cell_beside_a_printed_number() -> None:
    cell = printed_cell(TABLE_1["k"], Interval(8.40, 8.50))
    assert (cell.text, cell.verdict) == ("8.450 ± 0.029 N/m; -0.2 % (0.0 to 0.8)", "agrees")  # 0.1 / sqrt(12) = 0.029
    assert printed_cell(NUMBERS["jump falling"], None).text == "not found"
    answer = Cell("c", Verdict.DIFFERS, "Rig.")
    row = Statement("here", "5.29", "a", "b", "none", Verdict.AGREES, "Model.").measured(answer)
    assert (row.rig, row.rig_verdict, row.verdict, row.why) == ("c", "differs", "agrees", "Model. Rig.")


def test_a_finding_is_kept_with_its_numbers(tmp_path) -> None:
    picture = xr.Dataset({"x": ("time", [1.0, 2.0])}, {"time": [0.0, 0.1]}, {"synthetic": "yes"})
    finding = Finding(
        "slope",
        Estimate(16.94, 0.04, "N/m"),
        "by hand",
        200,
        ("Run #1", "Run #2"),
        ("a note",),
        {"slope_a": Estimate(16.94, 0.01, "N/m")},
        data=picture,
    )
    back = ns.load(ns.save(kept(finding), tmp_path / "finding.nc"))
    found = found_in(back)
    assert back["x"].identical(picture["x"])
    assert (found.name, found.samples_used, len(found.runs), *found.notes) == ("slope", 200, 2, "a note")
    assert found.interval() == pytest.approx((16.94 - 1.959964 * 0.04, 16.94 + 1.959964 * 0.04))
    assert found.others["slope_a"].uncertainty == 0.01
    half = found.estimate.times(0.5)
    assert (half.value, half.uncertainty) == (8.47, 0.02)
    assert Estimate(2.0, 0.5, "m", logarithmic=True).expanded == pytest.approx(
        2 * (np.exp(0.49) - 1), rel=1e-4
    )  # the wider side


def test_what_is_not_there_is_said() -> None:
    nothing = SimpleNamespace(findings=())
    with pytest.raises(ValueError, match="made no finding 'crank_force'"):
        the_finding(nothing, "crank_force")
    with pytest.raises(ValueError, match="measured in a laboratory"):
        _ = Settings().bench


def test_single_runs_with_period_two_make_no_range() -> None:
    cell = no_doubled_cell(_response({"up": 5.81, "down": 5.16}, doubled=(3.6, 3.6))["runs"])
    assert (cell.text, cell.verdict) == ("2 of 140 runs with period 2, no two neighbours", "agrees")
    assert no_doubled_cell(_response({"up": 5.81, "down": 5.16})["runs"]).verdict == "differs"
