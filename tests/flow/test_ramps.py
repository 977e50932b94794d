"""Parameters as functions of time within a run."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nonsmooth as ns

METHODS = {"taylor": {"rtol": 1e-13}, "rkf45": {"rtol": 1e-12}}


@pytest.fixture(scope="module")
def relaxation() -> ns.System:
    return ns.System(states=["x"], parameters={"f": 1.0, "a": 1.0}, modes={"only": lambda t, u, p: p.f - p.a * u.x})


@pytest.mark.parametrize("method", METHODS)
def test_a_linear_ramp_by_formula(method: str, relaxation: ns.System) -> None:
    """x' = s t - x from 0: x = s (t - 1 + exp(-t))."""
    run = ns.simulate(relaxation, duration=4.0, ramps={"f": (0.0, 2.0)}, method=method, **METHODS[method])
    t = run["time"].values
    assert np.max(np.abs(run["u"].values[:, 0] - 0.5 * (t - 1 + np.exp(-t)))) < 1e-11


@pytest.mark.parametrize("method", METHODS)
def test_a_ramp_given_as_a_function(method: str, relaxation: ns.System) -> None:
    """x' = sin t - x from 0: x = (sin t - cos t + exp(-t)) / 2; a = 2 t, f = 0 from 1: x = exp(-t^2)."""
    run = ns.simulate(relaxation, duration=5.0, ramps={"f": np.sin}, method=method, **METHODS[method])
    t = run["time"].values
    assert np.max(np.abs(run["u"].values[:, 0] - 0.5 * (np.sin(t) - np.cos(t) + np.exp(-t)))) < 1e-11
    two = {"f": lambda t: 0 * t, "a": lambda t: 2 * t}
    run = ns.simulate(relaxation, duration=3.0, start=[1.0], ramps=two, method=method, **METHODS[method])
    assert np.max(np.abs(run["u"].values[:, 0] - np.exp(-(run["time"].values ** 2)))) < 1e-11


def test_a_ramp_covers_the_recorded_time(relaxation: ns.System) -> None:
    """Its line goes through both ends of that time, and on before it, during the transient."""
    run = ns.simulate(relaxation, duration=2.0, transient=3.0, ramps={"f": (1.0, 5.0)}, rtol=1e-13)
    t = run["time"].values
    # f = 2 t - 5 for all t >= 0: x = 2 (t - 1) - 5 + 7 exp(-t)
    assert t[0] == 3.0
    assert np.max(np.abs(run["u"].values[:, 0] - (2 * (t - 1) - 5 + 7 * np.exp(-t)))) < 1e-11


def test_an_impulse_is_that_of_the_mass_at_its_instant() -> None:
    """A ball of mass m = t falls from 1 and meets the floor at t = sqrt 2 with the speed sqrt 2: restitution 0.8."""
    ball = ns.mechanical(
        lambda p: p.m,
        0.0,
        0.0,
        coordinates=["q"],
        parameters={"m": 1.0},
        forcing={"q": lambda t, p: -p.m},
        elements={"floor": ns.elements.Stop(at="q", side=-1, position=0.0, restitution=0.8)},
    )
    run = ns.simulate(ball, start={"q": 1.0}, transient=1.0, duration=2.0, ramps={"m": (1.0, 3.0)})
    assert run["crossing_time"].values == pytest.approx([np.sqrt(2)])
    assert run["floor_impulse"].values == pytest.approx([np.sqrt(2) * 1.8 * np.sqrt(2)])
    assert run["floor_energy_lost"].values == pytest.approx([np.sqrt(2) * (1 - 0.8**2)])


@pytest.mark.parametrize("method", METHODS)
def test_the_support_under_a_slow_ramp_of_the_force(method: str) -> None:
    """Against DOP853 at rtol 1e-12 with the contacts as terminal events: a slow pass through Fig. 11."""
    system = ns.models.discontinuous_support(rho=0.2)
    p, periods = system.values, 12
    end = periods * system.period()
    run = ns.simulate(system, periods=periods, ramps={"rho": (0.2, 0.5)}, method=method, **METHODS[method])

    def field(mode):
        def f(t, u):
            rho = 0.2 + 0.3 * t / end
            support = (p["k_s"] * (u[0] - p["g"]) + p["c_s"] * u[1]) if mode else 0.0
            force = rho * np.cos(p["omega"] * t) - 2 * p["k"] * u[0] - p["c"] * u[1] - support
            return [u[1], force / p["m"]]

        return f

    def enter(t, u):
        return u[0] - p["g"]

    def leave(t, u):
        return -(u[0] - p["g"]) - p["c_s"] / p["k_s"] * u[1]

    for event in (enter, leave):
        event.terminal, event.direction = True, 1
    t, u, mode, crossings = 0.0, np.zeros(2), 1, []  # g < 0: the start is in contact
    while t < end:
        step = solve_ivp(
            field(mode),
            (t, end),
            u,
            method="DOP853",
            rtol=1e-12,
            atol=1e-16,
            events=leave if mode else enter,
            max_step=0.01,
        )
        t, u = step.t[-1], step.y[:, -1]
        if step.status == 1:
            crossings.append(t)
            mode = 1 - mode
    assert len(crossings) >= 20
    assert len(run["crossing_time"]) == len(crossings)
    assert np.max(np.abs(run["crossing_time"].values - crossings)) < 1e-8
    assert np.max(np.abs((run["u"].values[-1] - u) / [1e-3, 1e-2])) < 1e-6


def test_a_ramp_of_a_frequency_is_put_in_as_it_stands() -> None:
    """x' = cos(w(t) t), w = t: x is the Fresnel integral of cos(t^2)."""
    from scipy.special import fresnel

    system = ns.System(states=["x"], parameters={"w": 1.0}, modes={"only": lambda t, u, p: np.cos(p.w * t) + 0 * u.x})
    run = ns.simulate(system, duration=3.0, ramps={"w": lambda t: t}, rtol=1e-12)
    t = run["time"].values
    scale = np.sqrt(np.pi / 2)
    assert np.max(np.abs(run["u"].values[:, 0] - scale * fresnel(t / scale)[1])) < 1e-10


def test_ramps_are_recorded(relaxation: ns.System) -> None:
    from nonsmooth.results.provenance import read_provenance

    run = ns.simulate(relaxation, duration=1.0, ramps={"f": (0.0, 2.0)})
    assert read_provenance(run)["options"]["ramps"] == {"f": [0.0, 2.0]}


@pytest.mark.parametrize(
    "element",
    [
        ns.elements.Stop(at="q", position="place"),
        ns.elements.ElasticStop(at="q", position="place", stiffness=4.0, damping=0.5),
        ns.elements.Coulomb(at="q", friction=0.5, belt="place"),
    ],
)
def test_a_ramp_that_moves_an_element_is_refused(element: ns.elements.Stop) -> None:
    """The equations of elements hold the speed of a stop and of a belt; that of a ramp they would leave out."""
    system = ns.mechanical(1.0, 0.0, 0.0, parameters={"place": 1.0}, elements={"one": element})
    with pytest.raises(ValueError, match="a ramp moves element 'one'"):
        ns.simulate(system, duration=20.0, ramps={"place": (1.0, -1.0)})


def test_a_spring_whose_place_is_ramped() -> None:
    """x'' = -k (x - 1 + t / 10) from t = 10 on: x = (s - sin(w s) / w) times -1 / 10, s = t - 10, w = 2."""
    spring = ns.elements.ElasticStop(at="q", position="place", stiffness=4.0)
    system = ns.mechanical(1.0, 0.0, 0.0, parameters={"place": 1.0}, elements={"spring": spring})
    run = ns.simulate(system, duration=11.0, ramps={"place": (1.0, -0.1)})
    assert float(run.u[-1, 0]) == pytest.approx(-0.1 * (1.0 - np.sin(2.0) / 2.0), abs=1e-11)
