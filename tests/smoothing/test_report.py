"""The smoothing report against SciPy on the smoothed equations, and against what is known of the order in eta."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nonsmooth as ns
from nonsmooth.smoothing.report import FoundAttractor, matched

ETA = 1e-2
SHARES = {
    "linear": lambda s: np.clip((1 + s) / 2, 0, 1),
    "tanh": lambda s: (1 + np.tanh(s)) / 2,
    "arctan": lambda s: 0.5 + np.arctan(s) / np.pi,
}


def friction() -> ns.System:
    return ns.models.dry_friction_oscillator(omega=0.4, zeta=0.05)


@pytest.fixture(scope="module")
def report() -> Any:
    return ns.smoothing_report(friction(), [ETA, 1e-4, 1e-3], band=list(SHARES), n_starts=3, progress=False)


def end_of_period(u: np.ndarray, band: str, rtol: float = 1e-10) -> np.ndarray:
    """x'' = cos(0.4 t) - x - 0.1 x' - 0.3 (2 q(x') - 1), by SciPy."""

    def field(t: float, u: np.ndarray) -> list[float]:
        return [u[1], np.cos(0.4 * t) - u[0] - 0.1 * u[1] - 0.3 * (2 * SHARES[band](u[1] / ETA) - 1)]

    return solve_ivp(
        field, (0, 2 * np.pi / 0.4), u, "DOP853", rtol=rtol, atol=1e-2 * rtol, max_step=0.02 if rtol < 1e-8 else 0.05
    ).y[:, -1]


@pytest.mark.parametrize("band", SHARES)
def test_the_smoothed_orbit_and_its_multiplier_against_scipy(report: Any, band: str) -> None:
    one = report.sel(band=band, eta=ETA)
    u = one.section.values
    assert end_of_period(u, band) == pytest.approx(u, abs=1e-7)
    largest = one.floquet_multipliers.values[0].real
    ends = [[end_of_period(u + sign * d, band, 1e-7) for sign in (1, -1)] for d in 1e-3 * np.eye(2)]
    slopes = [(one - other) / 2e-3 for one, other in ends]
    assert np.linalg.eigvals(np.array(slopes).T).max() == pytest.approx(largest, abs=2e-4)
    sharp = ns.find_orbit(friction())
    assert float(one.state_difference) == pytest.approx(np.abs(u - sharp.u).max(), rel=1e-6)
    assert float(one.multiplier_difference) == pytest.approx(sharp.floquet_multipliers[0].real - largest, rel=1e-6)
    assert one.exponents.values[0] == pytest.approx(np.log(largest) / (2 * np.pi / 0.4), rel=1e-9)


def test_with_friction_a_linear_band_converges_like_eta_and_an_arctan_slower(report: Any) -> None:
    at = report.sel(eta=1e-3)
    assert float(at.state_order.sel(band="linear")) == pytest.approx(1, abs=0.01)
    assert float(at.multiplier_order.sel(band="linear")) == pytest.approx(1, abs=0.02)
    assert 0.8 < float(at.multiplier_order.sel(band="tanh")) < 0.95
    assert float(at.multiplier_order.sel(band="arctan")) == pytest.approx(2 / 3, abs=0.05)
    assert np.isnan(report.state_order.values[:, 0]).all()
    assert report.eta.values.tolist() == [1e-4, 1e-3, 1e-2]
    assert (report.n_attractors == 1).all() and (report.missing == 0).all() and (report.spurious == 0).all()


def test_where_forces_are_continuous_a_band_costs_eta_squared_and_tails_eta() -> None:
    """The paper's support: eta^2 on transversal orbits; an arctan's tail is a force of order eta far from the gap."""
    system = ns.models.discontinuous_support(rho=0.45, g=-0.0045, omega=3.69)
    heard: list[float] = []
    report = ns.smoothing_report(system, [1e-5, 1e-4], band=["linear", "arctan"], progress=heard.append).sel(eta=1e-4)
    assert heard == [0.0, 0.25, 0.5, 0.75, 1.0]
    for key in ("state_order", "multiplier_order"):
        assert report[key].values == pytest.approx([2, 1], abs=0.06)


def test_a_wide_band_kills_the_relays_limit_cycle(tmp_path: Path) -> None:
    """In the band the relay is the gain 1 / eta; its equilibrium is stable where A - b c / eta is."""
    A = np.array([[-(2 * 0.05 * 25 + 1), 1, 0], [-(2 * 0.05 * 25 + 625), 0, 1], [-625.0, 0, 0]])
    b = np.array([1.0, -2.0, 1.0])
    rests = [np.linalg.eigvals(A - np.outer(b, [1, 0, 0]) / eta).real.max() < 0 for eta in (1e-3, 1e-2)]
    assert rests == [False, True]
    system = ns.models.relay_feedback()
    orbit = ns.find_orbit(system, start=[0.1, -0.4, 0.3], transient=50)
    report = ns.smoothing_report(system, [1e-3, 1e-2], orbit=orbit, transient=5, progress=False).isel(band=0)
    assert report.status.values.tolist() == [0, ns_code("no_convergence")]
    assert "stable equilibrium" in str(report.note[1].item())
    assert float(report.period_difference[0]) > 0.1
    ns.save(report, tmp_path / "report.nc")
    assert ns.load(tmp_path / "report.nc").identical(report)
    drawn = ns.plot.smoothing_report(ns.load(tmp_path / "report.nc").expand_dims("band"), y="period")
    assert {line.get_label() for line in drawn.get_lines()} >= {"linear", "no such orbit"}
    assert ns.system_of(report) == system


def ns_code(name: str) -> int:
    from nonsmooth.results.labels import by_name

    return by_name(name).code


def test_exponents_of_chaos_are_those_of_long_runs() -> None:
    """The sum is the divergence: -(c + c_s f) / m with the share f of time in contact, in both systems alike."""
    system = ns.models.discontinuous_support(rho=0.33, g=0.0018, omega=11.15)
    report = ns.smoothing_report(system, [1e-5], periods=4000, progress=False).isel(band=0, eta=0)
    for exponents in (report.exponents.values, report.reference_exponents.values):
        assert exponents[0] > 0.5
        assert -0.87 / 0.838 - 0.6 / 0.838 < exponents.sum() < -0.87 / 0.838
    assert float(report.exponent_difference) < 0.05
    assert np.isnan(report.state_difference)


@pytest.mark.parametrize(("border", "number"), [(8.5, 2), (7.5, 1)])
def test_starts_lie_in_the_orbits_range_twice_as_wide(border: float, number: int) -> None:
    """x' = c - x + sqrt(2) cos t with c = 10 above a border and 0 below it: 10 + cos(t - pi / 4) has the range 9 to 11,
    and of starts between 8 and 12 those below the border go to the motion about 0."""

    def motion(c: float) -> Any:
        return lambda t, u, p: (c - u.x + np.sqrt(2.0) * np.cos(t),)

    system = ns.System(
        states=["x"],
        parameters={"border": border},
        modes={"above": motion(10.0), "below": motion(0.0)},
        indicators={"side": lambda t, u, p: u.x - p.border},
        transitions=[
            ns.Transition("above", "below", when="side < 0"),
            ns.Transition("below", "above", when="side > 0"),
        ],
    )
    report = ns.smoothing_report(system, [1e-3], start=[10.7], n_starts=40, transient=5, progress=False)
    assert report.reference_n_attractors == report.n_attractors.item() == number


def test_counterparts_are_the_nearest_of_the_same_period() -> None:
    def found(number: int, high: float, low: float = -1.0) -> FoundAttractor:
        return FoundAttractor(number, np.array([[high, 1.0], [low, -1.0]]))

    def apart(own: list[FoundAttractor], others: list[FoundAttractor]) -> tuple[int, int]:
        return matched(own, others, np.array([1e-3, 1.0]))

    assert apart([found(1, 1.0), found(2, 2.0)], [found(2, 2.01), found(1, 1.02)]) == (0, 0)
    assert apart([found(1, 1.0)], [found(1, 1.5)]) == (1, 1)
    assert apart([found(1, 1.0)], [found(2, 1.0)]) == (1, 1)
    assert apart([found(1, 1.0), found(1, 1.05)], [found(1, 1.04)]) == (1, 0)
    assert apart([], [found(1, 1.0)]) == (0, 1)
    # the first state at rest: in the size that it has in its system
    assert apart([found(1, 2e-3, 2e-3)], [found(1, 2.05e-3, 2.05e-3)]) == (0, 0)
    assert apart([found(1, 2e-3, 2e-3)], [found(1, 4e-3, 4e-3)]) == (1, 1)


def test_what_cannot_be_reported_is_refused() -> None:
    system = friction()
    with pytest.raises(ValueError, match="give it without smoothed"):
        ns.smoothing_report(system.smoothed(0.1), [1e-3])
    with pytest.raises(ValueError, match="linear, tanh, arctan, not 'cubic'"):
        ns.smoothing_report(system, [1e-3], band="cubic")
    with pytest.raises(ValueError, match="positive numbers, each there once"):
        ns.smoothing_report(system, [1e-3, 0.0])
    with pytest.raises(ValueError, match="belongs to another system"):
        ns.smoothing_report(system.with_parameters(f_0=0.9), [1e-3], orbit=ns.find_orbit(system))
    with pytest.raises(ns.SystemDefinitionError, match="give a rigid stop a stiffness"):
        ns.smoothing_report(ns.models.impact_oscillator(), [1e-3])
