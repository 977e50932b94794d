"""Whole diagrams in one call: the special points of the paper's figures, the branches and what they leave."""

from __future__ import annotations

import time
from functools import cache
from pathlib import Path
from typing import Any

import closed_form_support as closed
import numpy as np
import pytest
import reference_values as known
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

support = ns.models.discontinuous_support
#: Parameters, range, kinds of special points with their numbers on branches of period 1, and closed or known values.
FIGURES: dict[str, tuple[dict[str, float], str, tuple[float, float], dict[str, int], list[float]]] = {
    "9": (
        {"rho": 0.14, "g": 0.02},
        "omega",
        (3.0, 7.0),
        {"fold": 2, "flip": 2, "grazing": 2},
        [known.FOLDS["figure 9 upper"], known.FOLDS["figure 9 rising"], known.FLIPS_NEAR_GRAZING["figure 9 lower"]],
    ),
    "10": (
        {"rho": 0.16, "g": 0.0145},
        "omega",
        (2.4, 7.4),
        {"fold": 4, "grazing": 2},
        [known.FOLDS[f"figure 10 {word}"] for word in ("upper", "small", "rising")],
    ),
    "11": ({"omega": 3.69, "g": -0.0045}, "rho", (0.2, 0.5), {"flip": 1}, []),
    "13": ({"omega": 11.15, "rho": 0.33}, "g", (-0.0015, 0.002), {"flip": 1}, []),
    "17": (
        {"rho": 0.23, "g": 0.0036},
        "omega",
        (8.4, 10.4),
        {"flip": 2, "grazing": 1},
        [known.FLIPS_NEAR_GRAZING["figure 17"]],
    ),
}


def truth(row: Any, name: str) -> float:
    """The same fold or flip from the closed form of one contact in a round, begun at ours."""
    X = row["unknowns"].values
    X = X[~np.isnan(X)]
    p = {key: float(row[key]) for key in ("g", "rho", "omega")}
    n, contact = int(row["period_number"]), int(row["mode"]) == 1
    return closed.special(str(row["kind"].values), p, name, n, X[:2], X[2:-1:3], contact)


@cache
def diagram_of(figure: str) -> xr.Dataset:
    parameters, name, limits, *_ = FIGURES[figure]
    return ns.bifurcation_diagram(support(**parameters), name, limits, progress=False)


@pytest.mark.parametrize(
    "figure", ["13", *(pytest.param(one, marks=pytest.mark.slow) for one in ("9", "10", "11", "17"))]
)
def test_figures_of_the_paper(figure: str) -> None:
    parameters, name, limits, kinds, values = FIGURES[figure]
    diagram = diagram_of(figure)
    table = ns.special_points(diagram)
    assert int(diagram["complete"]) == 1
    first = table.isel(special=np.flatnonzero(table["branch"].values == 0))
    assert int(diagram["period_number"][0]) == 1 and int(diagram["parent"][0]) == -1
    assert {kind: int((first["kind"] == kind).sum()) for kind in np.unique(first["kind"])} == kinds
    for value in values:
        assert np.abs(first[name].values - value).min() < 2e-9
    if name == "omega":
        exact = [w for w in known.grazing_frequencies(parameters["rho"], parameters["g"]) if limits[0] < w < limits[1]]
        grazes = first[name].values[first["kind"].values == "grazing"]
        assert sorted(grazes) == pytest.approx(exact, abs=1e-10)
    # Folds and flips in closed form; each flip is left once, by its doubled branch.
    for i in np.flatnonzero(np.isin(first["kind"].values, ["fold", "flip"])):
        row = first.isel(special=i)
        assert float(row[name]) == pytest.approx(truth(row, name), abs=1e-10)
        if str(row["kind"].values) == "flip":
            same = (table["period_number"] == 2) & (np.abs(table[name] - row[name]) < 1e-9)
            assert int(same.sum()) == 1
    doubled = diagram["period_number"].values
    for k in np.flatnonzero(diagram["parent"].values >= 0):
        assert doubled[k] == 2 * doubled[int(diagram["parent"][k])]
    # Every section point of an orbit of period n is one of a return.
    assert np.isfinite(diagram["returns"].values[diagram["branch"].values == 0][:, 0]).all()


def test_cascade_down_to_period_eight(tmp_path: Path) -> None:
    """Fig. 13: periods 1, 2, 4, 8 one from the other; the diagram is saved, read, drawn and gone on from."""
    diagram = diagram_of("13")
    assert diagram["period_number"].values.tolist() == [1, 2, 4, 8]
    assert diagram["parent"].values.tolist() == [-1, 0, 1, 2]
    assert all(one.attrs["long_name"] for one in diagram.data_vars.values())
    table = ns.special_points(diagram)
    flips = np.unique(table["g"].values[table["kind"].values == "flip"].round(12))
    ratios = np.diff(flips)[:-1] / np.diff(flips)[1:]
    assert ratios == pytest.approx(4.669, rel=0.25)
    # All returns of an orbit of period 4, by simulation.
    at = int(np.flatnonzero(diagram["branch"].values == 2)[5])
    point = diagram.isel(point=at)
    system = support(omega=11.15, rho=0.33, g=float(point["g"]))
    run = ns.poincare(system, n=4, start=point["section"].values)
    assert np.roll(run["section"].values, 1, axis=0)[:1] == pytest.approx(point["returns"].values[:1], abs=1e-9)
    assert run["section"].values[:3] == pytest.approx(point["returns"].values[1:4], abs=1e-9)
    ns.save(diagram, tmp_path / "diagram.nc")
    again = ns.load(tmp_path / "diagram.nc")
    row = ns.special_points(again).isel(special=0)
    assert int(ns.continue_orbit(row)["period_number"]) == 2
    ax = ns.plot.bifurcation_diagram(again, y="v")
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words == ["sweeps", "stable branch", "unstable branch", "flip"]


@pytest.mark.slow
def test_a_diagram_takes_seconds_and_is_the_same_again() -> None:
    diagram = diagram_of("13")
    begun = time.process_time()  # all is compiled now
    assert diagram_of.__wrapped__("13").identical(diagram)
    assert time.process_time() - begun < 5.0


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match="has no forcing: follow its equilibria"):
        ns.bifurcation_diagram(ns.models.relief_valve(q=9.0), "q", (5.0, 10.0))
    with pytest.raises(ns.SolveError, match=r"the budget of 1e-09 s was spent before"):
        ns.bifurcation_diagram(support(rho=0.14, g=0.02), "omega", (3.0, 7.0), budget=1e-9, n=5, progress=False)


def test_a_bubble_of_period_doubling_is_one_branch_from_flip_to_flip() -> None:
    """x' = a - x^2 has period 2 where a > 3/4 and period 4 from 5/4 on: with a = 1 - mu^2 from mu = -1/2 to 1/2."""
    hump = ns.Map(states=["x"], parameters={"mu": 0.0}, branches=[ns.Branch(lambda u, p: (1.0 - p.mu**2 - u.x**2,))])
    found, again = (
        ns.bifurcation_diagram(hump, "mu", (-0.9, 0.8), n=21, transient=50, progress=False) for _ in range(2)
    )
    assert again.identical(found)
    assert found["period_number"].values.tolist() == [1, 2]
    assert found["special_kind"].values.tolist() == ["flip"] * 4
    assert sorted(found["special_value"].values) == pytest.approx([-0.5, -0.5, 0.5, 0.5], abs=1e-9)


def test_periods_1_2_and_4_of_a_wall_with_rest_come_from_one_graze() -> None:
    """Motion without impact touches the wall where F / |k - w^2 + i c w| - load / k is its distance.

    At a graze whose orbit without the wall has complex multipliers all periods may begin."""
    c, k, F, load, gap = (
        0.336710350008993,
        2.317730213602326,
        0.24714281584229258,
        0.14154672482822026,
        0.4081310259118447,
    )
    system = ns.mechanical(
        1.0,
        c,
        k,
        coordinates="q",
        forcing={"q": lambda t, p: F * np.cos(p.w * t + 4.894847285602623) - load},
        parameters={"w": 1.45},
        elements={"wall": ns.elements.Stop(at="q", position=gap, restitution=0.2)},
    )
    found = ns.bifurcation_diagram(system, "w", (1.4, 1.5), n=8, transient=150, depth=2, max_period=4, progress=False)
    assert found["period_number"].values[:3].tolist() == [1, 2, 4] and int(found["complete"])
    amplitude = F / (gap + load / k)  # (k - x)^2 + c^2 x = amplitude^2, x = w^2
    touched = np.sqrt(np.roots([1.0, c * c - 2 * k, k * k - amplitude**2]).min())
    kinds, at = found["special_kind"].values, found["w"].values[found["special_point"].values]
    for branch in range(3):
        grazes = at[(kinds == "grazing") & (found["special_branch"].values == branch)]
        assert np.abs(grazes - touched).min() < 1e-9


def test_every_branch_has_its_modes_where_elements_decide_together(tmp_path: Path) -> None:
    """Modes and transitions are numbered as they are found, and each branch found its own: its orbits come back in a
    simulation from the mode that stands there, and the flip leads on."""
    stop = ns.elements.Stop
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        coordinates=["x"],
        forcing={"x": lambda t, p: np.cos(p.w * t)},
        parameters={"w": 1.85},
        elements={
            "stop": stop(at="x", position=0.2, restitution=0.7),
            "low": stop(at="x", side=-1, position=-0.9, restitution=0.6),
            "rub": ns.elements.Coulomb(at="x", friction=0.05),
        },
        impacts="sequential",
    )
    whole = ns.bifurcation_diagram(
        system, "w", (1.75, 1.85), n=4, depth=1, max_period=4, points=60, transient=200, progress=False
    )
    found = ns.load(ns.save(whole, tmp_path / "diagram.nc"))
    assert found["period_number"].values.tolist() == [1, 2]
    names = found["mode"].attrs["flag_meanings"].split()
    for k in (0, 1):
        on = np.flatnonzero(found["branch"].values == k)
        for i in on[:: max(len(on) // 4, 1)]:
            point = found.isel(point=int(i))
            run = ns.simulate(
                system.with_parameters(w=float(point["w"])),
                duration=float(point["period"]),
                start=point["section"].values,
                mode=names[int(point["mode"])],
            )
            assert run["u"].values[-1] == pytest.approx(point["section"].values, abs=1e-8)
    flip = ns.special_points(found).isel(special=0)
    assert int(ns.continue_orbit(flip, "w", (1.81, 1.82), points=8)["period_number"]) == 2


@pytest.mark.slow
def test_flips_of_all_branches_lead_on_where_elements_decide_together(tmp_path: Path) -> None:
    """Modes and transitions are numbered as they are found, and each branch found its own: orbits of twice the period
    come back in a simulation, from flips of branches that leave others too."""
    stop = ns.elements.Stop
    system = ns.mechanical(
        np.eye(2),
        0.1 * np.eye(2),
        [[2.0, -1.0], [-1.0, 2.0]],
        coordinates=["x", "y"],
        forcing={"x": lambda t, p: np.cos(p.w * t)},
        parameters={"w": 2.3},
        elements={
            "stop": stop(at="x", position=0.5, restitution=0.7),
            "rub": ns.elements.Coulomb(at="y", friction=0.1),
            "low": stop(at="y", side=-1, position=-0.6, restitution=0.6),
        },
    )
    whole = ns.bifurcation_diagram(
        system, "w", (2.0, 2.45), n=12, depth=1, max_period=4, points=110, transient=200, progress=False
    )
    found = ns.load(ns.save(whole, tmp_path / "diagram.nc"))
    special, seen = ns.special_points(found), set()
    for i in np.flatnonzero(special["kind"].values == "flip"):
        row = special.isel(special=int(i))
        w, parent = float(row["w"]), int(found["special_branch"][i])
        if any(abs(w - other) < 1e-6 for other in seen) or (parent == 0 and len(seen) > 1):  # where a branch begins
            continue
        seen.add(w)
        branch = ns.continue_orbit(row, "w", (w - 0.002, w + 0.002), points=8)
        assert int(branch["period_number"]) == 2 * int(found["period_number"][parent])
        point = branch.isel(point=branch.sizes["point"] // 2)
        run = ns.simulate(
            system.with_parameters(w=float(point["w"])),
            duration=float(point["period"]),
            start=point["section"].values,
            mode=point["mode"].attrs["flag_meanings"].split()[int(point["mode"])],
        )
        assert run["u"].values[-1] == pytest.approx(point["section"].values, abs=1e-8)
    assert len(seen) > 1


def test_an_orbit_is_passed_once_whichever_forcing_period_its_section_lies_in() -> None:
    """Orbits of periods 2 and 4 come to the graze of that of period 1: each special point stands once.

    The four sections of an orbit of period 4 are one orbit."""
    load, drive = [0.4371315138602859, -0.06688842597629152], [0.48892271, 1.47254339]
    system = ns.mechanical(
        np.diag([1.6933635910736706, 0.6133068347971444]),
        [[0.4397375863947991, -0.3381872521013181], [-0.3381872521013181, 0.5166167700680909]],
        [[3.7624513737049705, -2.893573646205747], [-2.893573646205747, 4.4202395618658965]],
        coordinates=["a", "b"],
        forcing={
            q: lambda t, p, i=i: load[i] + drive[i] * np.cos(p.w * t + 5.464143150850392) for i, q in enumerate("ab")
        },
        parameters={"w": 0.847222},
        elements={
            "between": ns.elements.Stop(at={"a": 1.0, "b": -1.0}, position=0.6364550129610025, restitution=0.2),
            "rail": ns.elements.Coulomb(at="b", friction=0.2039125456, static=0.315881816),
        },
    )
    orbit = ns.find_orbit(system, start=[0.9038, 0.80097, 2.5446, 2.095], transient=0, period_number=2)
    doubled = ns.special_points(ns.continue_orbit(orbit, "w", (0.8465, 0.848)))
    at = {kind: doubled["w"].values[doubled["kind"].values == kind] for kind in ("flip", "grazing")}
    row = doubled.isel(special=int(np.flatnonzero(doubled["w"].values == at["flip"].min())[0]))
    special = ns.special_points(ns.continue_orbit(row, "w", (0.8465, 0.848)))
    inner = special["w"].values[np.abs(special["w"].values - at["grazing"].min()) > 1e-10]
    assert np.diff(np.sort(inner)).min() > 1e-9
    assert np.abs(special["w"].values - at["grazing"].min()).min() < 1e-9


@pytest.mark.parametrize("low", [0.02, 0.03])
def test_a_branch_stands_once_though_its_ends_are_rounded(low: float) -> None:
    """An affine map has one fixed point; a branch ends at the edge of the range to rounding, on either side of it."""
    affine = ns.Map(
        states=["x", "y"],
        parameters={"a": 0.3},
        branches=[ns.Branch(lambda u, p: (p.a * u.x - 0.3 * u.y + 1.0, u.x))],
    )
    found = ns.bifurcation_diagram(affine, "a", (low, 0.6), n=5, depth=0)
    assert found["period_number"].values.tolist() == [1]


def test_a_branch_of_a_doubled_motion_has_both_section_points() -> None:
    """By simulation; a part of the branch that is taken on has them too."""
    system = support(omega=11.15, rho=0.33, g=-0.001)
    single = ns.continue_orbit(ns.find_orbit(system), "g", (-0.0015, 0.001))
    assert single["returns"].sizes["return"] == 1
    flips = ns.special_points(single)
    doubled = ns.continue_orbit(flips.isel(special=int(np.flatnonzero(flips["kind"] == "flip")[0])))
    assert doubled["returns"].sizes["return"] == 2 == int(doubled["period_number"])
    for point in (doubled.isel(point=i) for i in (3, 9)):
        run = ns.poincare(system.with_parameters(g=float(point["g"])), n=2, start=point["section"].values)
        assert run["section"].values == pytest.approx(np.roll(point["returns"].values, -1, axis=0), abs=1e-9)
    again = ns.continue_orbit(doubled.isel(point=slice(None, 10)), range=(-0.0015, 0.001))
    assert again["returns"].values[:5] == pytest.approx(doubled["returns"].values[:5], abs=1e-9)
