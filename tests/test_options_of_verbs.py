"""Options that are seldom given: each does what its sentence says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns

SUPPORT = ns.models.discontinuous_support(g=1.0)  # out of reach: linear
P = SUPPORT.values


def linear(omega: float = P["omega"]) -> complex:
    """x of the motion without contact, its real part that at phase 0."""
    return complex(P["rho"] / (2 * P["k"] - P["m"] * omega**2 + 1j * P["c"] * omega))


# recordings: a file is read as it says, options only where it does not


def test_a_table_in_a_dialect_of_its_own(tmp_path: Path) -> None:
    """Fields between bars, a comma for the point, blanks between thousands, units below names, remarks, two fillers."""
    file = tmp_path / "log.txt"
    file.write_text(
        "the third of May\nrig 7\nname|t|pos\n---|s|mm\n1|0,0|1 234,5\n# lamp\n2|0,1|none\n3|0,2|-1\n4|0,3|?\n",
        encoding="utf-8",
    )
    dialect = {"delimiter": "|", "decimal": ",", "thousands": " ", "header": 3, "units_row": 4}
    found = ns.load_recording(
        file, format="csv", skip="#", na=["none", "?"], columns={"time": "t", "x": "pos"}, **dialect
    )
    x = found.channel("x")
    assert found.units["x"] == "mm" and x["time"].values == pytest.approx([0.0, 0.2])
    assert x.values == pytest.approx([1234.5, -1.0])  # what is missing has no sample


def test_lines_are_left_out_by_their_number(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("9,9\n8,8\ntime,x\n0,1\n1,2\n2,4\n", encoding="utf-8")
    assert ns.load_recording(file, skip=2).channel("x").values.tolist() == [1, 2, 4]


def test_a_counter_that_begins_anew(tmp_path: Path) -> None:
    """Counts modulo 100, 30 more each time, and a clock that passes midnight."""
    file = tmp_path / "count.csv"
    counts = 30 * np.arange(9)
    clock = (86390 + 2 * np.arange(9)) % 86400
    rows = [f"{t},{n % 100}" for t, n in zip(clock, counts, strict=True)]
    file.write_text("time (s),turns\n" + "\n".join(rows) + "\n", encoding="utf-8")
    found = ns.load_recording(file, wraps={"turns": 100, "time": 86400}).channel("turns")
    assert found.values == pytest.approx(counts)
    assert np.diff(found["time"].values) == pytest.approx(np.full(8, 2.0))


# tables


def test_columns_and_units_of_a_table() -> None:
    run = ns.simulate(SUPPORT, periods=1, samples=5)
    whole, some = ns.table(run), ns.table(run, ["v"], units=False)
    assert "v (m/s)" in whole.columns and len(whole.columns) > len(some.columns)
    assert list(some.columns)[-1] == "v" and not any("(" in name for name in some.columns)
    assert some["v"].to_numpy() == pytest.approx(run["u"].sel(state="v").values)
    assert list(ns.table(run, columns=["v", "x"]).columns)[-2:] == ["v (m/s)", "x (m)"]


# sweeps and what goes with them


def test_a_response_over_another_section_and_without_a_judge() -> None:
    """At a quarter of a period x = Re(H i); amplitudes are the same wherever the section lies."""
    omega = np.array([3.0, 3.5, 4.0])
    quick = {"transient": 400, "progress": False}
    for phase in (0.0, 0.25):
        found = ns.frequency_response(SUPPORT, omega, section=ns.Stroboscopic(phase=phase), threads=1, **quick)
        H = np.array([linear(one) for one in omega])
        assert found["amplitude"].sel(direction="up", state="x").values == pytest.approx(np.abs(H), rel=1e-4)
        last = found["section"].sel(direction="up", state="x").isel(iterate=-1).values
        assert last == pytest.approx((H * np.exp(2j * np.pi * phase)).real, abs=1e-6)
        assert (found["period_number"].values == 1).all()
    plain = ns.frequency_response(SUPPORT, omega, judge=False, method="taylor", atol=1e-12, **quick)
    assert "period_number" not in plain or not (plain["period_number"].values > 0).any()
    assert plain["amplitude"].sel(direction="up", state="x").values == pytest.approx(np.abs(H), rel=1e-4)


def test_frequencies_and_seed_of_the_zero_one_test() -> None:
    """One seed gives one K, another one its own, both near 1 in chaos; one frequency is not the median of fifty."""
    x = np.empty(400)
    x[0] = 0.3
    for k in range(399):
        x[k + 1] = 3.97 * x[k] * (1 - x[k])
    many = [float(ns.zero_one_test(x, n_frequencies=50, seed=seed)) for seed in (0, 0, 1)]
    assert many[0] == many[1] != many[2] and min(many) > 0.8
    few = float(ns.zero_one_test(x, n_frequencies=1, seed=0))
    assert few != many[0]


def test_edges_of_bands() -> None:
    """F is normal about 1 with 0.1, and a linear amplitude goes with it."""
    s = ns.mechanical(1.0, 0.1, 1.0, parameters={"F": 1.0, "w": 2.0}, forcing={"q": lambda t, p: p.F * np.cos(p.w * t)})
    band = ns.propagate(
        {}, ns.sweep, s, "w", [2.0], settings={"F": (1.0, 0.1)}, draws=40, quantiles=[0.1, 0.9], progress=False
    )
    assert band["quantile"].values.tolist() == [0.1, 0.9]
    amplitude = band["maximum_quantiles"].sel(state="q").values[:, 0]
    assert amplitude == pytest.approx(np.quantile(band["drawn_F"], [0.1, 0.9]) / np.hypot(3.0, 0.2), rel=1e-4)


# runs


@pytest.mark.parametrize(("method", "options"), [("rkf45", {"step": 0.01}), ("taylor", {"order": 8})])
def test_a_step_and_an_order_that_are_given(method: str, options: dict[str, float]) -> None:
    """The motion is the same; what was asked for stands in its record."""
    start = {"x": 0.01, "v": 0.0}
    plain = ns.simulate(SUPPORT, periods=2, samples=9, start=start)
    found = ns.simulate(SUPPORT, periods=2, samples=9, start=start, method=method, **options)
    assert found["u"].values == pytest.approx(plain["u"].values, abs=1e-7)
    assert found.attrs["nonsmooth"] != plain.attrs["nonsmooth"]
    ((name, value),) = options.items()
    assert f'"{name}": {value}' in found.attrs["nonsmooth"]


# continuation


def test_steps_and_points_of_a_diagram() -> None:
    """No two neighbours of a branch lie further apart than the step allows, and no branch is longer than its points."""
    system = ns.Map(states=["x"], parameters={"r": 2.95}, branches=[ns.Branch(lambda u, p: (p.r * u.x * (1 - u.x),))])
    quick = {"n": 5, "start": {"x": 0.6}, "progress": False}
    sizes = {
        step: ns.bifurcation_diagram(system, "r", (2.5, 2.9), step=step, **quick).sizes["point"] for step in (0.1, 0.01)
    }
    assert sizes[0.01] > 4 * sizes[0.1]
    few = ns.bifurcation_diagram(system, "r", (2.5, 2.9), step=0.01, points=7, **quick)
    assert np.bincount(few["branch"].values).max() == 2 * 7 + 1  # to both sides
    assert "points was reached" in few["ended_because"].values[0, 0]


def test_a_branch_by_the_name_of_its_parameter() -> None:
    orbit = ns.find_orbit(SUPPORT)
    by_name = ns.continue_orbit(orbit, parameter="rho", range=(0.4, 0.5))
    assert by_name["rho"].values == pytest.approx(ns.continue_orbit(orbit, "rho", (0.4, 0.5))["rho"].values)
    assert by_name["section"].values[:, 0] == pytest.approx(linear().real / P["rho"] * by_name["rho"].values)


def test_absolute_tolerances_by_name_in_any_order() -> None:
    """A coarse one of x and a fine one of v, by name or in the order of the states, are one run; exchanged another."""
    system = ns.models.relief_valve()
    names = list(system.states)
    tolerances = dict(zip(names, 10.0 ** -np.arange(3, 3 + 4 * len(names), 4), strict=True))
    start = dict.fromkeys(names, 0.3)
    length = {"duration": 3.0, "samples": 5, "start": start, "method": "rkf45", "rtol": 1e-14}
    one, other, mirrored = (
        ns.simulate(system, **length, atol=atol)["u"].values
        for atol in (dict(reversed(tolerances.items())), [*tolerances.values()], [*tolerances.values()][::-1])
    )
    assert (one == other).all() and (one != mirrored).any()
    with pytest.raises(ValueError, match="atol must name each state of"):
        ns.simulate(system, **length, atol={names[0]: 1e-9})
    with pytest.raises(ValueError, match="one number or one for each of"):
        ns.simulate(system, **length, atol=[1e-9] * (len(names) + 1))
