"""A mass with dry friction touches a stop where it turns: Den Hartog's steady motion tells where, and how it moves.

J. P. Den Hartog, Trans. ASME 53 (1931): with m = k = 1 and b = 1 / w the amplitude of motion without sticking is
a = sqrt((F V)^2 - (mu S)^2), V = 1 / (1 - w^2), S = b sin(pi b) / (1 + cos(pi b)).
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics
E = ns.elements
STOPS = {
    "soft": {"stiffness": 4.0, "damping": 0.2},
    "hard": {"stiffness": 4.0},
}


@cache
def rubbing(stop: str) -> ns.System:
    return ns.mechanical(
        1.0,
        0.0,
        1.0,
        parameters={"F": 1.0, "w": 1.5, "mu": 0.2, "d": 9.0},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
        elements={"rub": E.Coulomb(at="q", friction="mu"), "wall": E.ElasticStop(at="q", position="d", **STOPS[stop])},
    )


def amplitude(F: float, w: float, mu: float) -> float:
    b = 1.0 / w
    V, S = 1.0 / (1.0 - w**2), b * np.sin(np.pi * b) / (1.0 + np.cos(np.pi * b))
    return float(np.sqrt((F * V) ** 2 - (mu * S) ** 2))


def orbit(stop: str, w: float, mu: float, room: float = 1.05) -> ns.Orbit:
    """The slipping motion, begun where it turns: above resonance it goes against the force."""
    a = amplitude(1.0, w, mu)
    system = rubbing(stop).with_parameters(w=w, mu=mu, d=room * a)
    return ns.find_orbit(system, start={"q": -a}, transient=30, period_number=1, progress=False)


@pytest.mark.parametrize(
    ("stop", "w", "mu"),
    [("soft", 1.5, 0.2), ("hard", 1.8, 0.15), pytest.param("hard", 1.3, 0.3, marks=pytest.mark.slow)],
)
def test_it_is_a_graze_whatever_the_step_and_the_parameter(stop: str, w: float, mu: float) -> None:
    begun, a = orbit(stop, w, mu), amplitude(1.0, w, mu)
    free = amplitude(1.0, w, 0.0)
    force = np.hypot(1.05 * a, np.sqrt(free**2 - a**2)) / free  # (F V)^2 = d^2 + (mu S)^2
    for name, ends, there in (("d", (0.9 * a, 1.1 * a), a), ("F", (0.98, 1.02 * force), force)):
        for step in (0.05, 0.021):
            row = ns.special_points(ns.continue_orbit(begun, name, ends, step=step))
            row = row.isel(special=np.abs(row[name].values - there) < 1e-6)
            assert (row["kind"].values.tolist(), row["touched"].values.tolist()) == (["grazing"], ["wall_gap"])
            assert row[name].values == pytest.approx([there], rel=1e-8)


@pytest.mark.parametrize(
    ("stop", "room"), [("soft", 0.95), ("hard", 1.05), pytest.param("soft", 1.05, marks=pytest.mark.slow)]
)
def test_it_moves_with_the_parameters_as_the_amplitude_does(stop: str, room: float) -> None:
    """d = a: dd/dF = F V^2 / a, dd/dmu = -mu S^2 / a; from either side, and along its curve."""
    begun, a = orbit(stop, 1.5, 0.2, room), amplitude(1.0, 1.5, 0.2)
    settings = {"F": (1.0, 0.01), "mu": (0.2, 0.01)}
    ends = (0.93 * a, 1.07 * a)
    branch = ns.propagate(
        {}, ns.continue_orbit, begun, "d", ends, settings=settings, draws=0, first_order=True, progress=False
    )
    i = int(np.abs(branch["special_value"].values - a).argmin())
    V, S = amplitude(1.0, 1.5, 0.0), np.sqrt(amplitude(1.0, 1.5, 0.0) ** 2 - a**2) / 0.2
    slopes = V**2 / a, -0.2 * S**2 / a
    assert branch["special_slope"].values[i] == pytest.approx(slopes, rel=1e-6)
    assert float(branch["special_first_order"][i]) == pytest.approx(0.01 * np.hypot(*slopes), rel=1e-6)
    row = ns.special_points(ns.continue_orbit(begun, "d", ends)).isel(special=i)
    curve = ns.continue_curve(row, {"d": ends, "mu": (0.05, 0.3)})
    words = str(curve["ended"].attrs["flag_meanings"]).split()
    assert {words[int(k)] for k in curve["ended"].values} == {"range"}
    assert curve["d"].values == pytest.approx([amplitude(1.0, 1.5, mu) for mu in curve["mu"].values], abs=1e-9)


@pytest.mark.parametrize(("w", "mu"), [(1.8, 0.15), (1.3, 0.3)])
def test_each_turn_is_one_touch(w: float, mu: float) -> None:
    """One per period by either method, with the clearance d - a; that of the orbit is the same."""
    a, found = amplitude(1.0, w, mu), orbit("hard", w, mu)
    assert found.clearance["wall_gap"] == pytest.approx(0.05 * a, abs=1e-9)
    for method in ("exact", "taylor"):
        run = ns.simulate(found.system, start=found.u, periods=20, method=method)
        walls = run["touch_indicator"].values == list(found.system.indicators).index("wall_gap")
        assert int(walls.sum()) == 20
        assert run["touch_clearance"].values[walls] == pytest.approx(0.05 * a, abs=1e-7)


@pytest.mark.parametrize(
    ("w", "mu", "step"),
    [
        (1.6, 0.1, 0.05),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((1.3, 0.05, 0.05), (1.6, 0.05, 0.013))),
    ],
)
def test_a_graze_of_two_stops_at_once_stands_once(w: float, mu: float, step: float) -> None:
    """Behind it both impacts are as slow as rounding: no simulation follows them, and the branch goes on.

    Orbits with both impacts are on the side that the branch came from."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"F": 0.6 * (w**2 - 1), "w": w, "mu": mu},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
        elements={
            "rub": E.Coulomb(at="q", friction="mu"),
            "right": E.Stop(at="q", position=2.0, restitution=0.6),
            "left": E.Stop(at="q", position=-2.0, side=-1, restitution=0.6),
        },
    )
    orbit = ns.find_orbit(system, progress=False)
    branch = ns.continue_orbit(orbit, "F", (0.1, 2.5 * (w**2 - 1)), step=step, points=round(6 / step) // 2)
    far = np.flatnonzero(branch["special_value"].values > 1.0)
    assert branch["special_kind"].values[far].tolist() == ["grazing"]
    behind = branch["F"].values[int(branch["special_point"][far[0]]) :]
    assert len(behind) > 10 and (behind[1:11] < behind[0]).all()
