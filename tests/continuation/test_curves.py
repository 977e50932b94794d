"""Loci in two parameters, against closed forms and against branches in one parameter."""

from __future__ import annotations

from typing import Any

import closed_form_support as closed
import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics


def row(branch: xr.Dataset, kind: str, i: int = 0) -> xr.Dataset:
    special = ns.special_points(branch)
    return special.isel(special=int(np.flatnonzero(special["kind"].values == kind)[i]))


@pytest.fixture(scope="module")
def impact() -> xr.Dataset:
    return ns.continue_orbit(ns.find_orbit(ns.models.impact_oscillator(A=0.05)), "A", (0.02, 1.2))


@pytest.fixture(scope="module")
def figure_9() -> xr.Dataset:
    system = ns.models.discontinuous_support(rho=0.14, g=0.02, omega=3.3)
    return ns.continue_orbit(ns.find_orbit(system), "omega", (3.0, 7.0))


@pytest.mark.parametrize("box", [{"omega": (0.9, 1.2), "A": (0.01, 1.0)}, {"d": (0.5, 1.5), "c": (0.02, 0.5)}])
def test_grazing_curve_of_the_impact_oscillator(impact: xr.Dataset, box: dict[str, Any]) -> None:
    """Test problem A: A = d sqrt((k - omega^2)^2 + (c omega)^2), to 1e-10 along the whole curve."""
    curve = ns.continue_curve(row(impact, "grazing"), box)
    value = {name: curve[name].values for name in ("A", "d", "k", "c", "omega")}
    if "A" not in box:  # the amplitude is held at the graze
        value["A"] = np.float64(row(impact, "grazing")["A"])
    exact = value["d"] * np.hypot(value["k"] - value["omega"] ** 2, value["c"] * value["omega"])
    print(f"\ngrazing curve over {', '.join(box)}: largest difference {np.abs(value['A'] - exact).max():.1e}")
    assert np.abs(value["A"] - exact).max() < 1e-10
    assert list(curve["ended"].values) == [0, 0] and curve.sizes["point"] > 20


@pytest.mark.parametrize(("kind", "i"), [("flip", 1), pytest.param("fold", 0, marks=pytest.mark.slow)])
def test_curves_of_folds_and_flips_against_the_closed_form(figure_9: xr.Dataset, kind: str, i: int) -> None:
    """Points of the curve are folds and flips of the 40-digit closed form."""
    curve = ns.continue_curve(row(figure_9, kind, i), {"omega": (3.3, 6.0), "rho": (0.12, 0.16)})
    mu = curve["floquet_multipliers"].values
    assert np.abs(mu - (1.0 if kind == "fold" else -1.0)).min(axis=1).max() < 1e-7
    for k in (len(mu) // 4, 3 * len(mu) // 4):
        at = curve.isel(point=k)
        p = {"g": 0.02, "rho": float(at["rho"]), "omega": float(at["omega"])}
        orbit = (
            ns.find_orbit(
                ns.models.discontinuous_support(**p), start=at["section"].values, period_number=1, transient=0
            )
            if kind == "flip"
            else None
        )
        if orbit is None:
            continue
        found = closed.special(kind, p, "omega", 1, orbit.u, orbit.crossing_times, False)
        assert found == pytest.approx(p["omega"], abs=1e-8)


@pytest.mark.slow
def test_two_folds_meet_in_a_cusp(figure_9: xr.Dataset) -> None:
    """The two folds of Fig. 9 lie on one curve; from either the same cusp is found, and beyond it there is no fold."""
    box = {"omega": (4.0, 6.5), "rho": (0.06, 0.16)}
    cusps = []
    for i in (0, 1):
        curve = ns.continue_curve(row(figure_9, "fold", i), box)
        assert list(curve["special_kind"].values) == ["cusp"]
        at = int(curve["special_point"][0])
        cusps.append((float(curve["omega"][at]), float(curve["rho"][at])))
        assert float(curve["rho"].min()) == pytest.approx(cusps[-1][1], abs=1e-12)
    assert cusps[0] == pytest.approx(cusps[1], abs=1e-8)
    omega, rho = cusps[0]
    for change, folds in ((0.002, 2), (-0.002, 0)):
        system = ns.models.discontinuous_support(rho=rho + change, g=0.02, omega=omega + 0.3)
        orbit = ns.find_orbit(system, period_number=1)
        branch = ns.continue_orbit(orbit, "omega", (omega - 0.15, omega + 0.4))
        assert int((ns.special_points(branch)["kind"] == "fold").sum()) == folds


@pytest.mark.parametrize(
    ("damping", "low"), [(0.2, 0.85), *(pytest.param(c, 0.55, marks=pytest.mark.slow) for c in (0.2, 0.15))]
)
def test_grazing_curve_while_its_touch_and_a_crossing_pass_the_section(damping: float, low: float) -> None:
    """x touches a wall, on which it may rest, for A = sqrt((1 - w^2)^2 + (0.2 w)^2), whatever a second mass does.

    The phases of the touch and of the second mass's crossings pass the section, and are no ends; with equal dampings
    all multipliers have one modulus. At w = 0.94 the touch passes it: there x lags by 1."""
    stops = ns.elements
    system = ns.mechanical(
        np.eye(2),
        np.diag([0.2, damping]),
        np.eye(2),
        coordinates=["x", "y"],
        forcing={"x": lambda t, p: p.A * np.cos(p.w * t + 1.0), "y": lambda t, p: np.cos(p.w * t + 2.2)},
        parameters={"A": 0.15, "w": low + 0.05},
        elements={
            "wall": stops.Stop(at="x", position=1.0, restitution=0.5),
            "pad": stops.ElasticStop(at="y", position=0.3, stiffness=0.5),
        },
    )
    branch = ns.continue_orbit(ns.find_orbit(system), "A", (0.1, 0.68))
    curve = ns.continue_curve(row(branch, "grazing"), {"w": (low, 1.0), "A": (0.1, 2.0)}, step=0.1)
    A, w = curve["A"].values, curve["w"].values
    assert np.abs(A - np.hypot(1 - w**2, 0.2 * w)).max() < 1e-10
    assert list(curve["ended"].values) == [0, 0] and [w.min(), w.max()] == pytest.approx([low, 1.0])


def test_fold_curve_while_an_impact_passes_the_section() -> None:
    """With cos(w t + phase) the fold lies at the same w for all phases, and its impacts at any."""
    system = ns.mechanical(
        1.0,
        0.05,
        1.0,
        coordinates="x",
        forcing={"x": lambda t, p: p.A * np.cos(p.w * t + p.phase)},
        parameters={"A": 0.5, "w": 0.7, "phase": 0.0},
        elements={"pad": ns.elements.ElasticStop(at="x", position=0.7, stiffness=4.0)},
    )
    branch = ns.continue_orbit(ns.find_orbit(system), "w", (0.6, 2.0))
    fold = row(branch, "fold")
    curve = ns.continue_curve(fold, {"phase": (0.0, 6.5), "w": (0.6, 2.0)}, step=0.1)
    assert curve["w"].values == pytest.approx(float(fold["w"]), abs=1e-9)
    assert sorted(curve["phase"].values[[0, -1]]) == pytest.approx([0.0, 6.5])


def test_curve_saves_and_loads(impact: xr.Dataset, tmp_path: Any) -> None:
    curve = ns.continue_curve(row(impact, "grazing"), {"omega": (0.8, 1.2), "A": (0.01, 1.0)}, points=10)
    path = ns.save(curve, tmp_path / "curve.nc")
    assert ns.load(path).identical(curve)


def test_wrong_arguments(impact: xr.Dataset) -> None:
    graze = row(impact, "grazing")
    with pytest.raises(ValueError, match="two parameters"):
        ns.continue_curve(graze, {"A": (0.0, 1.0)})
    with pytest.raises(ValueError, match="parameter"):
        ns.continue_curve(graze, {"A": (0.0, 1.0), "omga": (0.5, 1.5)})
    with pytest.raises(ValueError, match="outside"):
        ns.continue_curve(graze, {"A": (0.5, 1.0), "omega": (0.5, 1.5)})
    with pytest.raises(TypeError, match="special_points"):
        ns.continue_curve(3, {"A": (0.5, 1.0), "omega": (0.5, 1.5)})
