"""The references themselves: heyoka against SciPy, closed forms and published numbers. Nothing of ours is used."""

from __future__ import annotations

import heyoka_shooting as shooting
import heyoka_support as hs
import heyoka_valve as hv
import numpy as np
import pytest
import reference_values as known
import scipy_support

pytestmark = pytest.mark.physics

CASES = {
    "figure 9": dict(known.TABLE_1, rho=0.14, g=0.02, omega=4.8),
    "figure 11": dict(known.TABLE_1, rho=0.29, g=-0.0045, omega=3.69),
    "figure 13": dict(known.TABLE_1, rho=0.33, g=0.0014, omega=11.15),
    "figure 17": dict(known.TABLE_1, rho=0.23, g=0.0036, omega=9.55),
}


@pytest.mark.parametrize("name", CASES)
def test_heyoka_agrees_with_scipy_on_a_short_stretch(name: str) -> None:
    p = CASES[name]
    ours = hs.run(p, 4)
    states, crossings = scipy_support.run_oscillator(p, 4, (0.0, 0.0))
    assert ours.n_contacts >= 2
    assert [c.kind for c in ours.crossings] == [kind for _, kind in crossings]
    assert np.max(np.abs(ours.states - states)) < 1e-11  # SciPy's rtol 1e-12, amplified by the contacts
    assert max(abs(c.time - t) for c, (t, _) in zip(ours.crossings, crossings, strict=True)) < 1e-10


@pytest.mark.parametrize("name", CASES)
def test_the_mode_is_the_region_of_the_state(name: str) -> None:
    run = hs.run(CASES[name], 20, per_period=37)
    assert all(hs.region(CASES[name], *u) == mode for u, mode in zip(run.states, run.modes, strict=True))


def test_contact_can_begin_through_the_second_indicator_beyond_the_gap() -> None:
    """Released at x > g and pushed back at once: h_b falls through zero with x > g."""
    p = dict(known.TABLE_1, c_s=60.0, rho=1e-3, g=-0.05, omega=5.0)
    start = (p["g"] + 1e-4, -0.01)  # h_b = 4e-4 > 0: free, moving back, accelerated forward by 1 m/s^2
    run = hs.run(p, 1, start)
    states, crossings = scipy_support.run_oscillator(p, 1, start)
    assert run.modes[0] == 0
    assert run.crossings[0].kind == "enter_b"
    assert [c.kind for c in run.crossings] == [kind for _, kind in crossings]
    assert np.max(np.abs(run.states - states)) < 1e-11


@pytest.mark.parametrize("clearance", [1e-12, -1e-12])
def test_a_graze_is_decided_to_a_picometre(clearance: float) -> None:
    p = dict(known.TABLE_1, rho=0.14, g=0.0, omega=5.3)
    p["g"] = known.amplitude(p) + clearance
    run = hs.run(p, 1, known.steady_state(p))
    assert run.n_contacts == (0 if clearance > 0 else 1)
    if clearance > 0:
        (touch,) = (e for e in run.extrema if e.indicator == "penetration")
        assert abs(touch.value + clearance) < 1e-16


def test_the_steady_motion_without_contact_is_a_fixed_point() -> None:
    p = dict(known.TABLE_1, rho=0.14, g=0.02, omega=5.3)
    u = known.steady_state(p)
    assert np.max(np.abs(hs.run(p, 10, u).states - u)) < 1e-15


@pytest.mark.parametrize(
    ("n", "start", "to"),
    [
        (1, 0.41, 0.395),
        (2, 0.28, 0.268),
        pytest.param(4, 0.25, 0.243, marks=pytest.mark.slow),
        pytest.param(8, 0.2415, 0.2397, marks=pytest.mark.slow),
    ],
)
def test_flips_of_figure_11(n: int, start: float, to: float) -> None:
    p = dict(known.TABLE_1, rho=start, g=-0.0045, omega=3.69)
    found = shooting.flip(p, "rho", n, shooting.settle(p, 3000), to, n_steps=8)
    assert found == pytest.approx(known.FLIPS_FIGURE_11[n], abs=1e-8)


@pytest.mark.parametrize(
    ("name", "rho", "g", "which", "offset"),
    [
        ("figure 9 upper", 0.14, 0.02, 1, -1e-5),
        ("figure 10 upper", 0.16, 0.0145, 1, -2e-5),
        ("figure 10 small", 0.16, 0.0145, 0, 1e-4),
    ],
)
def test_folds_beside_the_grazing_points(name: str, rho: float, g: float, which: int, offset: float) -> None:
    graze = known.grazing_frequencies(rho, g)[which]
    p = dict(known.TABLE_1, rho=rho, g=g, omega=graze)
    u = known.steady_state(p)
    near, far = (shooting.solve_orbit(dict(p, omega=graze + d), 1, u, 1e-7) for d in (offset / 2, offset))
    arc = 1e-4 * float(np.sign((far - near)[0]))
    found = shooting.fold(dict(p, omega=graze + offset), "omega", 1, far, arc=arc, step=1e-6)
    assert found == pytest.approx(known.FOLDS[name], abs=1e-9)
    assert 2e-5 < abs(found - graze) < 3.4e-4


@pytest.mark.parametrize(
    ("name", "rho", "g", "omega"), [("figure 9 rising", 0.14, 0.02, 5.7), ("figure 10 rising", 0.16, 0.0145, 6.4)]
)
def test_folds_where_the_orbit_with_contact_ends(name: str, rho: float, g: float, omega: float) -> None:
    p = dict(known.TABLE_1, rho=rho, g=g, omega=4.5)
    u = shooting.solve_orbit(p, 1, shooting.settle(p, 300))
    for w in np.arange(4.55, omega + 1e-9, 0.05):
        before, u = u, shooting.solve_orbit(dict(p, omega=w), 1, u)
    arc = 0.2 * float(np.sign((u - before)[0]))
    assert shooting.fold(dict(p, omega=w), "omega", 1, u, arc=arc) == pytest.approx(known.FOLDS[name], abs=1e-9)


def test_flips_just_beyond_grazing() -> None:
    (lower, _), (high,) = known.grazing_frequencies(0.14, 0.02), known.grazing_frequencies(0.23, 0.0036)
    for name, rho, g, graze, first, to in (
        ("figure 9 lower", 0.14, 0.02, lower, 1e-4, 8e-4),
        ("figure 17", 0.23, 0.0036, high, -5e-5, -4e-4),
    ):
        p = dict(known.TABLE_1, rho=rho, g=g, omega=graze)
        u = shooting.solve_orbit(dict(p, omega=graze + first), 1, known.steady_state(p), 1e-7)
        found = shooting.flip(dict(p, omega=graze + first), "omega", 1, u, graze + to, n_steps=10, step=1e-6)
        assert found == pytest.approx(known.FLIPS_NEAR_GRAZING[name], abs=1e-9)


def test_printed_grazing_frequencies() -> None:
    """The three values the project states: 5.15986, 5.65687 and 2.71137 rad/s."""
    assert known.grazing_frequencies(0.14, 0.02)[1] == pytest.approx(5.15986, abs=5e-6)
    assert known.grazing_frequencies(0.16, 0.0145) == pytest.approx([2.71137, 5.65687], abs=5e-6)


# ---------------------------------------------------------------------------------------------------------- the valve


def test_valve_hopf_value() -> None:
    def growth_rate(q: float) -> float:
        return max(z.real for z in np.linalg.eigvals(hv.linearisation({"q": q})) if abs(z.imag) > 1)

    assert growth_rate(known.VALVE_HOPF - 1e-6) > 0 > growth_rate(known.VALVE_HOPF + 1e-6)
    assert abs(growth_rate(known.VALVE_HOPF)) < 1e-10


@pytest.mark.parametrize("tolerance", [1e-10, 1e-14])
def test_valve_cycle_without_impacts(tolerance: float) -> None:
    run = hv.run({"q": 8.0}, np.array([1.0, 0.0, 11.0]), 1200.0, tolerance=tolerance)
    assert run.section[-1, 0] == pytest.approx(known.VALVE_CYCLE["maximum"], abs=2e-9)
    assert run.minima[-1] == pytest.approx(known.VALVE_CYCLE["minimum"], abs=2e-9)
    assert np.diff(run.section_time)[-1] == pytest.approx(known.VALVE_CYCLE["period"], abs=2e-9)


@pytest.mark.parametrize("q", [5.0, 2.0])
def test_valve_with_impacts_agrees_with_scipy(q: float) -> None:
    start = np.array([1.0, 0.0, 11.0])
    run = hv.run({"q": q}, start, 15.0, tolerance=1e-14)
    end, impacts, maxima = scipy_support.run_valve({"q": q}, start, 15.0)
    assert len(impacts) >= 4
    assert len(run.impact_time) == len(impacts)
    assert np.max(np.abs(np.array(run.impact_time) - impacts)) < 1e-9
    # The run starts at a maximum or minimum (y2 = 0): only tops after the start are compared.
    tops = [t for t in maxima if t > 1e-9]
    assert np.max(np.abs(run.section_time[run.section_time > 1e-9] - tops)) < 1e-9
    assert np.max(np.abs(run.end - end)) < 1e-8
