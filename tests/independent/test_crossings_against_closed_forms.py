"""Crossings against closed-form truths, for every method: grazes, two crossings in a step, release, special entries."""

from __future__ import annotations

import heyoka_support as hs
import numpy as np
import pytest
import reference_values as known
import scipy_support

import nonsmooth as ns

pytestmark = pytest.mark.physics

METHODS = {"exact": {}, "taylor": {"rtol": 1e-13}, "rkf45": {"rtol": 1e-13}}
PHASES = 2 * np.pi * np.random.default_rng(2007).random(50)
CLEARANCE = 1e-12


def phased_support() -> ns.System:
    """The paper's oscillator with its forcing in two components, so that the phase is a parameter."""

    def force(t, u, p):
        return p.a * np.cos(p.omega * t) + p.b * np.sin(p.omega * t) - 2 * p.k * u.x - p.c * u.v

    def free(t, u, p):
        return u.v, force(t, u, p) / p.m

    def contact(t, u, p):
        return u.v, (force(t, u, p) - p.k_s * (u.x - p.g) - p.c_s * u.v) / p.m

    units = {"m": "kg", "k": "N/m", "k_s": "N/m", "c": "N s/m", "c_s": "N s/m", "g": "m"}
    return ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={name: (known.TABLE_1.get(name, 0.02), unit) for name, unit in units.items()}
        | {"a": (0.14, "N"), "b": (0.0, "N"), "omega": (5.3, "rad/s")},
        modes={"free": free, "contact": contact},
        indicators={
            "penetration": lambda t, u, p: u.x - p.g,
            "separation": lambda t, u, p: -(u.x - p.g) - p.c_s / p.k_s * u.v,
        },
        transitions=[
            ns.Transition("free", "contact", when="penetration > 0 and separation < 0"),
            ns.Transition("contact", "free", when="separation > 0"),
        ],
        scale={"x": 1e-3, "v": 1e-2},
    )


@pytest.fixture(scope="module")
def phased() -> ns.System:
    return phased_support()


def steady(p: dict[str, float], phase: float) -> tuple[np.ndarray, float]:
    """State at t = 0 of the steady motion under rho cos(omega t + phase), and the time of its maximum in [0, T)."""
    response = p["rho"] * np.exp(1j * phase) / (2 * p["k"] - p["m"] * p["omega"] ** 2 + 1j * p["c"] * p["omega"])
    return np.array([response.real, (1j * p["omega"] * response).real]), (-np.angle(response) % (2 * np.pi)) / p[
        "omega"
    ]


@pytest.mark.parametrize("side", ["below", "above"])
@pytest.mark.parametrize("method", METHODS)
def test_a_graze_is_decided_at_a_picometre(method: str, side: str, phased: ns.System) -> None:
    """A motion that stays 1e-12 m below the gap has no contact and one touch; 1e-12 m above it has its contact.

    The amplitude is 3.6 mm (Fig. 17); the gap is set to amplitude +- 1e-12 m; the truth is the closed form.
    """
    p = dict(known.TABLE_1, rho=0.23, omega=9.7864)
    top = known.amplitude(p)
    gap = top + CLEARANCE if side == "below" else top - CLEARANCE
    wrong = []
    worst = 0.0
    for phase in PHASES:
        u, at = steady(p, phase)
        system = phased.with_parameters(
            omega=p["omega"], a=p["rho"] * np.cos(phase), b=-p["rho"] * np.sin(phase), g=gap
        )
        run = ns.simulate(system, periods=1, start={"x": u[0], "v": u[1]}, method=method, **METHODS[method])
        if side == "below":
            touches = run["touch_time"].values
            fine = run["crossing_time"].size == 0 and touches.size == 1
            if fine:
                fine = abs(touches[0] - at) < 1e-5
                worst = max(worst, abs(float(run["touch_clearance"].values[0]) - CLEARANCE))
        else:
            entry = at - np.arccos(1 - CLEARANCE / top) / p["omega"]  # x = g before the maximum
            fine = run["crossing_time"].size >= 1 and abs(run["crossing_time"].values[0] - entry) < 0.2 * (at - entry)
        if not fine:
            wrong.append(phase)
    print(f"\n{method}, {side}: {len(wrong)} of {len(PHASES)} phases wrong; worst clearance error {worst:.1e} m")
    assert not wrong, f"{len(wrong)} of {len(PHASES)} phases: {wrong[:5]}"
    assert worst < 2e-13


def cubic_gate() -> ns.System:
    """x'' = -x in both modes; the gate is open where (x - a)(x - b)(x - c) > 0."""

    def motion(t, u, p):
        return u.v, -u.x

    return ns.System(
        states={"x": "", "v": ""},
        parameters={"a": 0.1, "b": 0.11, "c": 0.6},
        modes={"shut": motion, "open": motion},
        indicators={"gate": lambda t, u, p: (u.x - p.a) * (u.x - p.b) * (u.x - p.c)},
        transitions=[
            ns.Transition("shut", "open", when="gate > 0"),
            ns.Transition("open", "shut", when="gate < 0"),
        ],
    )


@pytest.fixture(scope="module")
def gate() -> ns.System:
    return cubic_gate()


@pytest.mark.parametrize(
    ("method", "settings", "width", "tolerance"),
    [
        (method, settings, width, 1e-7)
        for method, settings in {**METHODS, "auto": {}}.items()
        if method != "exact"  # the indicator is not affine
        for width in (1e-2, 1e-4, 1e-5)
    ]
    + [("taylor", {"step": 0.25, "rtol": 1e-12}, width, 1e-6) for width in (1e-2, 1e-4, 1e-5)]
    # The formula's own error on a step of 0.25, about 1e-9 in the indicator, is more than narrower passages rise.
    + [("rkf45", {"step": 0.25}, 1e-2, 1e-4)],
)
def test_two_crossings_and_two_extrema_inside_one_step(
    method: str, settings: dict[str, float], width: float, tolerance: float, gate: ns.System
) -> None:
    """x = sin(t + phase): open between a and b = a + width, again above c.

    A step (0.25 where it is fixed) holds the first two crossings and both extrema of the indicator; between the
    crossings it rises by no more than 0.05 width^2.
    """
    a, b, c = 0.1, 0.1 + width, 0.3
    system = gate.with_parameters(a=a, b=b, c=c)
    for phase in np.random.default_rng(7).uniform(-0.2, 0.09, 40):
        start = {"x": np.sin(phase), "v": np.cos(phase)}
        run = ns.simulate(system, duration=0.6, start=start, method=method, **settings)
        expected = [t for t in (np.arcsin(z) - phase for z in (a, b, c)) if 0 < t < 0.6]
        times = run["crossing_time"].values
        assert len(times) == len(expected), f"phase {phase}: {times}, expected {expected}"
        assert np.max(np.abs(times - expected)) < tolerance


@pytest.mark.parametrize("method", METHODS)
def test_release_beyond_the_gap_does_not_begin_contact_again(method: str) -> None:
    """At release x > g still; the next contact comes only after the mass has been below the gap."""
    p = dict(known.TABLE_1, rho=0.29, g=-0.0045, omega=3.69)
    theirs = hs.run(p, 10)
    system = ns.models.discontinuous_support().with_parameters(p)
    run = ns.simulate(system, periods=10, method=method, **METHODS[method])
    times, kinds = run["crossing_time"].values, run["crossing_transition"].values
    assert len(times) == len(theirs.crossings)
    assert np.max(np.abs(times - [c.time for c in theirs.crossings])) < 1e-9
    assert all((k == 1) == (c.kind == "release") for k, c in zip(kinds, theirs.crossings, strict=True))
    released = run["u_before"].transpose("crossing", "state").values[kinds == 1]
    assert np.all(released[:, 0] > p["g"])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("c_s", [60.0, 0.6])
def test_contact_through_the_second_indicator_beyond_the_gap(method: str, c_s: float) -> None:
    """Free with x > g, moving back and pushed forward: contact begins where h_b falls through zero."""
    p = dict(known.TABLE_1, c_s=c_s, rho=1e-3, g=-0.05, omega=5.0)
    tau = c_s / p["k_s"]
    depth = 0.05 * tau**2  # well within tau^2 a / 2, a about 1 m/s^2: it turns before it leaves
    start = (p["g"] + depth, -(depth + 0.05 * tau**2) / tau)
    theirs = hs.run(p, 1, start)
    _states, crossings = scipy_support.run_oscillator(p, 1, start)
    assert theirs.crossings[0].kind == crossings[0][1] == "enter_b"
    assert theirs.crossings[0].u[0] > p["g"]
    run = ns.simulate(
        ns.models.discontinuous_support().with_parameters(p),
        periods=1,
        start={"x": start[0], "v": start[1]},
        method=method,
        **METHODS[method],
    )
    assert len(run["crossing_time"]) == len(theirs.crossings)
    assert np.max(np.abs(run["crossing_time"].values - [c.time for c in theirs.crossings])) < 1e-9
    assert np.max(np.abs(run["u"].transpose("time", "state").values[-1] - theirs.states[-1])) < 1e-10


@pytest.mark.parametrize("method", METHODS)
def test_an_elastic_support_finds_every_contact(method: str) -> None:
    """c_s = 0: h_b = -h_a, both indicators cross together at every entry and release."""
    p = dict(known.TABLE_1, c_s=0.0, rho=0.39, g=-0.0045, omega=3.69)
    theirs = hs.run(p, 10)
    assert theirs.n_contacts >= 15
    run = ns.simulate(
        ns.models.discontinuous_support().with_parameters(p), periods=10, method=method, **METHODS[method]
    )
    assert len(run["crossing_time"]) == len(theirs.crossings)
    assert np.max(np.abs(run["crossing_time"].values - [c.time for c in theirs.crossings])) < 1e-8


@pytest.mark.parametrize("method", METHODS)
def test_the_mode_is_the_region_of_the_state(method: str) -> None:
    p = dict(known.TABLE_1, rho=0.23, g=0.0036, omega=9.55)
    system = ns.models.discontinuous_support().with_parameters(p)
    run = ns.simulate(system, periods=20, samples=821, method=method, **METHODS[method])
    crossings = run["crossing_time"].values
    times, modes, states = run["time"].values, run["mode"].values, run["u"].transpose("time", "state").values
    away = np.array([crossings.size == 0 or np.min(np.abs(crossings - t)) > 1e-9 for t in times])
    assert away.sum() > 100
    assert all(hs.region(p, *u) == mode for u, mode in zip(states[away], modes[away], strict=True))
