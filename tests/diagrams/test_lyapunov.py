"""Lyapunov spectra: closed forms, multipliers of stable orbits, a published attractor; the trace identity always."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import nonsmooth as ns
from nonsmooth.diagrams.spectrum import FrameGrowth, evaluated, kaplan_yorke
from nonsmooth.elements import Coulomb, Stop

DEFECT = 1e-10


def spectrum(system: ns.System, **options: Any) -> xr.Dataset:
    """``ns.lyapunov``, with the trace identity asserted for every spectrum computed here."""
    found = ns.lyapunov(system, progress=False, **options)
    whole = np.isfinite(found.trace_defect.values)
    assert whole.any() and (np.abs(found.trace_defect.values[whole]) < DEFECT).all()
    return found


def multipliers(system: ns.System, period_number: int, transient: int = 2000) -> np.ndarray:
    """Of the return map at the attractor, by central differences of the exact flow."""
    last = ns.poincare(system, n=1, transient=transient).section.values[-1]

    def image(u: np.ndarray) -> Any:
        return ns.poincare(system, n=period_number, start=u).section.values[-1]

    assert np.abs(image(last) - last).max() < 1e-11 * np.abs(last).max() + 1e-13
    steps = 1e-5 * np.abs(last).max() * np.eye(len(last))
    matrix = np.stack([(image(last + h) - image(last - h)) / (2 * h.max()) for h in steps], axis=1)
    return np.sort(np.abs(np.linalg.eigvals(matrix)))[::-1]


def folded(expansion: float, contraction: float, reset: float = 0.0) -> ns.System:
    """A tent map as a flow: x grows by mu in a period; what is beyond mu / 2 at its end is folded back; y shrinks.

    (A force of size 0: a shape of code that is there. So below.)"""

    def grow(t: Any, u: Any, p: Any) -> Any:
        return np.log(p.mu) * u.x, p.A * np.cos(2 * np.pi * t) - p.b * u.y

    def fold(t: Any, u: Any, p: Any) -> Any:
        return p.mu - u.x, u.y + p.r * u.x

    return ns.System(
        states=["x", "y"],
        parameters={"mu": expansion, "b": contraction, "r": reset, "A": 0.0},
        period=1.0,
        modes={"low": grow, "high": grow},
        indicators={"middle": lambda t, u, p: u.x - p.mu / 2},
        transitions=[
            ns.Transition("low", "high", when="middle > 0"),
            ns.Transition("high", "low", at=0.999, reset=fold),
        ],
    )


def test_a_tent_map_as_a_flow_has_its_logarithms() -> None:
    """Every orbit has the exponents log mu and -b: the first grows alike on both sides of the fold."""
    mu, b = 1.9, 0.7
    found = spectrum(folded(mu, b), periods=3000, start={"x": 0.3, "y": 0.1})
    assert np.abs(found.exponents.values - [np.log(mu), -b]).max() < 1e-12
    assert found.status == 0 and found.exponents.attrs["units"] == "1"
    assert abs(float(found.kaplan_yorke) - (1 + np.log(mu) / b)) < 1e-12
    assert found.standard_error.values.max() < 1e-12
    # With a shear in the fold the frame turns to and fro: the same limit, approached like 1/t.
    sheared = spectrum(folded(mu, b, 0.3), periods=3000, start={"x": 0.3, "y": 0.1})
    assert np.abs(sheared.exponents.values - [np.log(mu), -b]).max() < 1e-4


def test_what_a_saltation_matrix_adds_is_counted() -> None:
    """Constant fields: a crossing stretches by f+ / f-, a pulse by k. The exponent is the count of both."""
    k, low, high, edge = 1.6, 1.0, 2.5, 1.4

    def pulse(t: Any, u: Any, p: Any) -> Any:
        return p.k * (u.x - 1.0), u.y

    def fold(t: Any, u: Any, p: Any) -> Any:
        return 1.0 - (u.x - p.edge) / 1.5, u.y

    system = ns.System(
        states=["x", "y"],
        parameters={"k": k, "low": low, "high": high, "edge": edge, "A": 0.0},
        period=1.0,
        modes={
            "slow": lambda t, u, p: (p.low + p.A * np.cos(2 * np.pi * t), -u.y),
            "fast": lambda t, u, p: (p.high + p.A * np.cos(2 * np.pi * t), -u.y),
        },
        indicators={"middle": lambda t, u, p: u.x - p.edge},
        transitions=[
            ns.Transition("slow", "fast", when="middle > 0"),
            ns.Transition("slow", "slow", at=0.999, reset=pulse),
            ns.Transition("fast", "slow", at=0.999, reset=fold),
        ],
    )
    run = ns.simulate(system, periods=40, start={"x": 0.1, "y": 1.0})
    names = run.crossing_transition.attrs["flag_meanings"].split()
    counts = np.bincount(run.crossing_transition.values, minlength=3)
    assert names == ["slow_to_fast", "slow_to_slow", "fast_to_slow"] and counts.min() > 5
    found = spectrum(system, periods=40, transient=0, start={"x": 0.1, "y": 1.0})
    wanted = (counts[0] * np.log(high / low) + counts[1] * np.log(k) + counts[2] * np.log(1 / 1.5)) / 40
    assert np.abs(np.sort(found.exponents.values) - np.sort([wanted, -1.0])).max() < 1e-11


def test_states_that_change_places_share_their_exponents() -> None:
    """x and y shrink at rates a and b, and change places once in each period: M M = exp(-(a + b) T)."""
    system = ns.System(
        states=["x", "y"],
        parameters={"a": 0.2, "b": 0.6, "A": 0.0},
        period=1.0,
        modes={"only": lambda t, u, p: (-p.a * u.x, p.A * np.cos(2 * np.pi * t) - p.b * u.y)},
        transitions=[ns.Transition("only", "only", at=0.5, reset=lambda t, u, p: (u.y, u.x))],
    )
    found = spectrum(system, periods=64, transient=2, start={"x": 1.0, "y": 0.5}).exponents.values
    assert found == pytest.approx([-0.4, -0.4], abs=5e-3)
    assert found.sum() == pytest.approx(-0.8, abs=1e-12)


def test_one_impact_per_period() -> None:
    """Test problem A: complex multipliers of modulus e exp(-c T / 2), so two equal exponents (1/t), and their sum."""
    system = ns.models.impact_oscillator().with_parameters(A=1.0)
    v, period = system.values, system.period()
    wanted = np.log(v["e"]) / period - v["c"] / 2
    found = spectrum(system, periods=5000)
    assert abs(float(found.exponents.sum()) - 2 * wanted) < 1e-12
    assert np.abs(found.exponents.values - wanted).max() < 2e-3
    assert float(found.elapsed) == pytest.approx(5000 * period, rel=1e-12)
    assert float(found.kaplan_yorke) == 0.0


@pytest.mark.parametrize("rho", [0.25, 0.30, 0.35, 0.46])
def test_exponents_of_a_stable_orbit_are_those_of_its_multipliers(rho: float) -> None:
    """Periods 4, 2, 2 and 1 of the paper's oscillator."""
    system = ns.models.discontinuous_support().with_parameters(rho=rho, omega=3.69, g=-0.0045)
    swept = ns.sweep(system, "rho", [rho], transient=2000, progress=False)
    period_number = int(swept.period_number.values.squeeze())
    assert period_number == {0.25: 4, 0.30: 2, 0.35: 2, 0.46: 1}[rho]
    wanted = np.log(multipliers(system, period_number)) / (period_number * system.period())
    found = spectrum(system, periods=64 * period_number, transient=2000)
    assert np.abs(found.exponents.values - wanted).max() < 1e-6 and abs(wanted[0] - wanted[1]) > 0.1
    assert found.standard_error.values.max() < 1e-9


def test_both_ways_to_a_spectrum_agree() -> None:
    """The planar kernel, and Taylor series with frames that follow a record, on a chaotic run too short to part."""
    system = ns.models.discontinuous_support().with_parameters(rho=0.33, g=0.0018, omega=11.15)
    options = {"periods": 32, "transient": 10, "start": {"x": 0.0011, "v": 0.01}}
    exact = spectrum(system, **options)
    taylor = spectrum(system, method="taylor", rtol=1e-15, **options)
    assert np.abs(exact.exponents.values - taylor.exponents.values).max() < 1e-6
    assert np.abs(exact.running.values[:8] - taylor.running.values[:8]).max() < 1e-9
    assert abs(float(exact.nearest_graze) - float(taylor.nearest_graze)) < 1e-5


def lorenz() -> ns.System:
    return ns.System(
        states=["x", "y", "z"],
        parameters={"s": 10.0, "r": 28.0, "b": 8 / 3},
        modes={"all": lambda t, u, p: (p.s * (u.y - u.x), u.x * (p.r - u.z) - u.y, u.x * u.y - p.b * u.z)},
    )


@pytest.mark.parametrize(("pieces", "options"), [(4096, {}), (64, {}), (64, {"order": 18})])
def test_lorenz(pieces: int, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Published: 0.9056, 0, -14.5723 (Sprott 2003); the sum -(sigma + 1 + b) is exact. Here within the stated error.

    Also in units of time in which the lengths of a frame would underflow, and (with an order of the engine's own the
    frame follows a record) with so few samples that a motion begun at one has forgotten it before the next."""
    monkeypatch.setattr("nonsmooth.diagrams.lyapunov.UNITS", pieces)
    found = spectrum(lorenz(), duration=4000, start=[1.0, 1.0, 20.0], **options)
    assert found.equilibrium == 0 and "note" not in found.attrs
    error = found.standard_error.values
    assert error[0] < 5e-3 and error[1] < 2e-3
    assert (np.abs(found.exponents.values - [0.9056, 0.0, -14.5723]) < 4 * error + 1e-4).all()
    assert abs(float(found.exponents[1])) < 1e-3
    assert abs(float(found.exponents.sum()) + 10.0 + 1.0 + 8 / 3) < 1e-10
    assert abs(float(found.kaplan_yorke) - 2.062) < 2e-3  # Sprott: 2.062


def test_a_frame_marched_with_its_motion_is_one_that_follows_a_record() -> None:
    """Lorenz's system and a forced one, whose clock goes on from the transient, in periods and in pieces of none. The
    record is a run of the series engine, which knows nothing of frames: it gives the true motion."""
    duffing = ns.System(
        states=["x", "v"],
        parameters={"c": 0.2},
        period=4.0,
        scale={"x": 0.5, "v": 2.0},
        modes={"all": lambda t, u, p: (u.v, u.x - u.x**3 - p.c * u.v + 0.3 * np.cos(np.pi * t / 2))},
    )
    for system, start, length in (
        (lorenz(), [1.0, 1.0, 20.0], {"duration": 8.0}),
        (duffing, [0.1, 0.2], {"periods": 5, "transient": 2}),
        (duffing, [0.1, 0.2], {"duration": 17.0, "transient": 7.0}),
    ):
        marched = spectrum(system, start=start, rtol=1e-12, **length)
        followed = spectrum(system, start=start, rtol=1e-12, order=18, **length)
        assert np.abs(marched.exponents.values - followed.exponents.values).max() < 1e-8
    assert abs(float(marched.exponents.sum()) + 0.2) < 1e-12
    with pytest.raises(ns.SolveError, match="grew beyond"):
        ns.lyapunov(duffing.with_parameters(c=-80.0), periods=4)


def test_a_motion_that_needs_its_steps_checked_is_recorded() -> None:
    """A kick once in a period, 3e-3 of it long: Taylor steps of their own choice pass over it (-1.04 then)."""
    kicked = ns.System(
        states=["x"],
        parameters={"w": 0.01},
        period=1.0,
        modes={"all": lambda t, u, p: (40.0 * np.exp(-((np.sin(np.pi * t) / p.w) ** 2)) - u.x - u.x**3,)},
    )

    def field(t: float, y: Any) -> list[float]:
        return [40.0 * np.exp(-((np.sin(np.pi * t) / 0.01) ** 2)) - y[0] - y[0] ** 3, -1.0 - 3.0 * y[0] ** 2]

    settled = solve_ivp(field, (0.5, 10.5), [0.3, 0.0], rtol=1e-9, max_step=2e-3).y[0, -1]
    over_one = solve_ivp(field, (0.5, 1.5), [settled, 0.0], rtol=1e-9, max_step=2e-3).y[1, -1]
    assert abs(float(spectrum(kicked, periods=8, transient=12).exponents[0]) - over_one) < 1e-5


def at_origin(r: float) -> np.ndarray:
    """Eigenvalues of the Lorenz system at the origin: (-11 +- sqrt(121 + 40 (r - 1))) / 2 and -8/3."""
    root = np.sqrt(121.0 + 40.0 * (r - 1.0))
    return np.sort([0.5 * (-11.0 + root), 0.5 * (-11.0 - root), -8 / 3])[::-1]


def test_exponents_of_an_unstable_equilibrium_are_named_as_such(tmp_path: Path) -> None:
    """The start of zeros is one: 11.8277, -2.6667, -22.8277 are the origin's eigenvalues, not the attractor's."""
    with pytest.warns(UserWarning, match=r"x = 0, y = 0, z = 0 .* unstable equilibrium, eigenvalues 11\.8277.*start="):
        found = spectrum(lorenz(), duration=200.0)
    assert np.abs(found.exponents.values - at_origin(28.0)).max() < 1e-9
    assert np.isnan(found.standard_error.values).all() and np.isnan(found.kaplan_yorke)
    assert found.equilibrium == 2 and found.equilibrium.attrs["flag_meanings"] == "none stable unstable undecided"
    assert "not of an attractor" in found.attrs["note"]
    ns.save(found, tmp_path / "found.nc")
    assert ns.load(tmp_path / "found.nc").identical(found)


def test_exponents_of_a_stable_equilibrium_are_the_real_parts_of_its_eigenvalues(
    recwarn: pytest.WarningsRecorder,
) -> None:
    """The origin below r = 1; at r = 10 a focus, lambda^3 + (41/3) lambda^2 + (160/3) lambda + 480 = 0, to whose real
    parts the estimates go like 1/t: the error covers that."""
    focus = np.sort(np.roots([1.0, 41 / 3, 160 / 3, 480.0]).real)[::-1]
    for r, start, known in ((0.5, [0.1, 0.2, 0.3], at_origin(0.5)), (10.0, [4.0, 5.0, 8.0], focus)):
        found = spectrum(lorenz().with_parameters(r=r), duration=400.0, start=start)
        error = found.standard_error.values
        assert found.equilibrium == 1 and found.kaplan_yorke == 0.0
        assert "real parts of its eigenvalues" in found.attrs["note"]
        assert (error > 0.0).all() and (np.abs(found.exponents.values - known) <= error + 1e-12).all()
    assert not recwarn.list


@pytest.mark.parametrize("field", [lambda t, u, p: (u.v, -2 * u.x - 3 * u.v), lambda t, u, p: (-u.x, -2 * u.v)])
def test_the_error_of_a_short_run_at_a_stable_equilibrium_covers_its_eigenvalues(field: Any) -> None:
    """-1 and -2: the frame of the first is still turning, the batches of the second are alike to the last bit."""
    found = spectrum(ns.System(states=["x", "v"], parameters={}, modes={"all": field}), duration=64.0)
    error = found.standard_error.values
    assert found.equilibrium == 1 and (error > 0.0).all()
    assert (np.abs(found.exponents.values - [-1.0, -2.0]) <= error).all()


def test_equilibria_are_named_along_a_sweep() -> None:
    with pytest.warns(UserWarning, match=r"at 2 of 3 values of 'r', 2 the first.*direction=None"):
        found = spectrum(lorenz(), parameter="r", values=[0.5, 2.0, 28.0], direction=None, duration=100.0)
    assert found.equilibrium.values.tolist() == [1, 2, 2]
    assert np.isnan(found.standard_error.values).all(axis=1).tolist() == [False, True, True]
    for row, r in zip(found.exponents.values, (0.5, 2.0, 28.0), strict=True):
        assert np.abs(row - at_origin(r)).max() < 1e-9


def test_a_fixed_point_of_a_forced_system_is_no_attractor_where_its_neighbours_leave() -> None:
    """x grows by r in a kick and is folded, x -> r x (1 - x): the start of zeros stays, with the exponent log r."""
    logistic = ns.System(
        states=["x"],
        parameters={"r": 3.9},
        modes={"rest": lambda t, u, p: 0 * u.x},
        period=1.0,
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: p.r * u.x * (1 - u.x))],
    )
    with pytest.warns(UserWarning, match=r"x = 0 \(mode 'rest'\) is an unstable equilibrium"):
        found = spectrum(logistic, periods=640)
    assert abs(float(found.exponents[0]) - np.log(3.9)) < 1e-12 and np.isnan(found.standard_error[0])


def test_an_autonomous_cycle_with_impacts_has_a_zero_exponent() -> None:
    """Test problem E at q = 5: impacts on the seat, three states, one exponent zero."""
    found = spectrum(
        ns.models.relief_valve().with_parameters(q=5.0), duration=2000.0, transient=200.0, start={"y1": 1.0, "y3": 5.0}
    )
    error = found.standard_error.values
    assert np.abs(found.exponents.values).min() < 5e-3
    assert found.exponents.values[2] < -0.5 and np.isfinite(error).all()


def test_sticking_loses_a_direction() -> None:
    """Test problem K: multipliers 1 and 0, so the exponents 0 and minus infinity; the defect is 0."""

    def slip(t: Any, u: Any, p: Any) -> Any:
        return u.v, -u.x + p.F / (1 + p.d * (p.b - u.v))

    system = ns.System(
        states=["x", "v"],
        parameters={"F": 1.0, "d": 3.0, "b": 0.2},
        modes={"slip": slip, "stick": lambda t, u, p: (p.b, 0.0 * u.v)},
        indicators={"relative": lambda t, u, p: u.v - p.b, "pull": lambda t, u, p: u.x - p.F},
        transitions=[
            ns.Transition("slip", "stick", when="relative > 0", reset=lambda t, u, p: (u.x, p.b)),
            ns.Transition("stick", "slip", when="pull > 0"),
        ],
    )
    found = spectrum(system, duration=1200.0, start={"x": 0.0, "v": 0.0})
    assert found.exponents.values[1] == -np.inf and abs(found.exponents.values[0]) < 1e-3
    assert found.trace_defect == 0.0 and found.kaplan_yorke == 1.0


def test_the_smoothed_switch_has_three_exponents() -> None:
    """The memory v_a is written anew at every entry: minus infinity. The others tend to those of the sharp system."""
    system = ns.models.discontinuous_support().with_parameters(rho=0.46)
    sharp = spectrum(system, periods=200, transient=300)
    errors = []
    for eta in (2e-4, 1e-4, 5e-5):
        smooth = spectrum(system.smoothed(eta), periods=200, transient=300)
        assert smooth.exponents.values[2] == -np.inf and smooth.trace_defect == 0.0
        errors.append(float(np.abs(smooth.exponents.values[:2] - sharp.exponents.values).max()))
    assert errors[0] < 2e-2 and errors[1] < 0.5 * errors[0] and errors[2] < 0.5 * errors[1]
    # Below the gap the memory is never written: it is no state then.
    quiet = spectrum(system.with_parameters(g=0.2).smoothed(1e-4), periods=64, transient=64)
    assert np.isnan(quiet.exponents.values[2]) and np.isnan(quiet.standard_error.values[2])
    assert abs(float(quiet.exponents[:2].sum()) + system.values["c"] / system.values["m"]) < 1e-10


def test_a_sweep_is_its_points() -> None:
    """Carried along, down and up; on a single attractor each point is what it is alone."""
    system = ns.models.discontinuous_support()
    values = [0.20, 0.22, 0.21]
    swept = spectrum(system, parameter="rho", values=values, direction="down", periods=500, transient=500)
    assert swept.exponents.dims == ("rho", "exponent") and list(swept.rho.values) == values
    assert (swept.status == 0).all() and swept.running.shape == (3, 32, 2)
    alone = spectrum(system.with_parameters(rho=0.22), periods=500, transient=500)
    assert np.abs(swept.exponents.values[1].sum() - alone.exponents.values.sum()) < 1e-10


def test_a_point_that_fails_keeps_its_status() -> None:
    system = ns.System(
        states=["x", "y"],
        parameters={"a": -1.0},
        modes={"all": lambda t, u, p: (p.a * u.x + np.cos(t), -9 * u.y)},
    )
    found = spectrum(system, parameter="a", values=[-1.0, 5.0, -2.0], periods=64, transient=64, direction=None)
    assert list(found.status.values) == [0, 3, 0] and np.isnan(found.exponents.values[1]).all()
    assert np.abs(found.exponents.values[[0, 2]] - [[-1.0, -9.0], [-2.0, -9.0]]).max() < 1e-12
    with pytest.raises(ns.SolveError, match="grew beyond"):
        ns.lyapunov(system.with_parameters(a=5.0), periods=64)


def test_a_stop_that_moves_past_a_carried_state_begins_anew() -> None:
    """Below the graze at A = 1 the motion keeps away from the stop: -c / 2, twice. The carried state does not fit."""
    system = ns.models.impact_oscillator().with_parameters(A=0.01)
    c, far = system.values["c"], 5.0
    found = ns.lyapunov(
        system,
        parameter="d",
        values=[far, 4.0, 1.0],
        direction="down",
        start={"x": 0.99},
        periods=40,
        transient=0,
        progress=False,
    )
    assert found["status"].values.tolist() == [0, 0, 0]
    np.testing.assert_allclose(found["exponents"].sum("exponent"), -c, rtol=1e-6)
    moved = ns.lyapunov(
        ns.models.impact_oscillator(),
        parameter="d",
        values=[-1.0, 0.5, 1.0],
        direction="down",
        periods=40,
        progress=False,
    )
    assert moved["status"].values.tolist()[1:] == [0, 0]


def test_kaplan_yorke_dimension() -> None:
    assert kaplan_yorke(np.array([0.5, -1.0])) == 1.5
    assert kaplan_yorke(np.array([-0.1, -1.0])) == 0.0
    assert kaplan_yorke(np.array([0.5, -0.2])) == 2.0
    assert kaplan_yorke(np.array([0.9056, 1e-4, -14.5723]), zero=1e-3) == 2 + 0.9056 / 14.5723
    assert kaplan_yorke(np.array([0.3, 0.1, -np.inf])) == 2.0
    assert kaplan_yorke(np.array([-1e-5, -0.3]), zero=1e-4) == 1.0


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_a_chatter_beside_a_mass_that_sticks_leaves_its_place_alone(method: str) -> None:
    """One mass bounces to rest in each period, its neighbour sticks by two frictions: its place is all that is left."""
    elements = {
        "floor": Stop(at="q1", side=-1, position=0.0, restitution=0.6),
        "one": Coulomb(at="q2", friction=0.8),
        "other": Coulomb(at="q2", friction=0.9),
    }
    for k in (0.3, 0.6, 0.9):
        pair = ns.mechanical(
            np.diag([1.3, 0.8]),
            0.1 * np.eye(2),
            [[k, -0.4], [-0.4, 1.0]],
            parameters={"w": 0.9},
            elements=elements,
            forcing={"q1": lambda t, p: 2.0 * np.cos(p.w * t) - 1.5},
        )
        found = ns.lyapunov(pair, periods=40, transient=20, start={"q2": 0.1}, method=method)
        assert found.exponents.values == pytest.approx([0.0, -np.inf, -np.inf, -np.inf], abs=1e-12)


def test_what_is_lost_has_no_error_and_what_is_not_known_has_none_either() -> None:
    sums = np.tile([-np.inf, np.nan, -1.0], (32, 1))
    found = evaluated(3, FrameGrowth(sums, 0.0, 0.0, 1.0, 0), 32, 1.0, forced=True)
    assert found.exponents.tolist()[:2] == [-1.0, -np.inf] and found.error.tolist()[:2] == [0.0, 0.0]
    assert np.isnan(found.exponents[2]) and np.isnan(found.error[2])


def test_errors_at_the_door() -> None:
    system = ns.models.discontinuous_support()
    with pytest.raises(ValueError, match="belong together"):
        ns.lyapunov(system, parameter="rho")
    with pytest.raises(ValueError, match="`gap` is not a parameter"):
        ns.lyapunov(system, parameter="gap", values=[0.1])
    with pytest.raises(ValueError, match="direction = 'both'"):
        ns.lyapunov(system, parameter="rho", values=[0.1], direction="both")
    with pytest.raises(ValueError, match="no forcing period"):
        ns.lyapunov(ns.models.relief_valve())
    with pytest.raises(ValueError, match="once"):
        ns.lyapunov(system, periods=10, duration=3.0)
    with pytest.raises(ValueError, match="one start"):
        ns.lyapunov(system, start=[{"x": 0.0}, {"x": 1.0}])
    with pytest.raises(TypeError, match="takes an ns.System"):
        ns.lyapunov("Lorenz")


def test_results_are_saved_whole(tmp_path: Path) -> None:
    """NetCDF keeps infinities, units and the input; a sweep and a single point."""
    system = ns.models.discontinuous_support()
    for k, found in enumerate(
        (
            ns.lyapunov(system, periods=64, transient=64),
            ns.lyapunov(
                system.smoothed(1e-3), parameter="rho", values=[0.2, 0.3], periods=64, transient=64, progress=False
            ),
            ns.sensitivity(system.smoothed(1e-3), periods=1, parameters=("rho", "eta")),
        )
    ):
        path = tmp_path / f"{k}.nc"
        ns.save(found, path)
        assert ns.load(path).identical(found)


def test_what_contacts_hold_is_no_exponent() -> None:
    """A mass stuck on the ground beside a damped one: its place is free (0), its speed lost (-inf), and the other mass
    has the eigenvalues of x'' + 0.1 x' + 2 x = 0; one at rest at a stop loses place and speed."""
    for element, free in (({"f": Coulomb(at="q1", friction=6.0)}, [0.0]), ({"s": Stop(at="q1", position=0.3)}, [])):
        pair = ns.mechanical(
            np.eye(2),
            0.1 * np.eye(2),
            [[2.0, -1.0], [-1.0, 2.0]],
            parameters={"w": 0.7},
            elements=element,
            forcing={"q1": lambda t, p: 3.0 + 0.3 * np.cos(p.w * t)},
        )
        found = ns.lyapunov(pair, periods=400)
        exponents = found["exponents"].values
        lost = 2 - len(free)
        assert exponents[: len(free)] == pytest.approx(free, abs=1e-12)
        assert exponents[len(free) : len(free) + 2].sum() == pytest.approx(-0.1, abs=1e-10)
        assert exponents[len(free) : len(free) + 2] == pytest.approx([-0.05, -0.05], abs=1e-3)
        assert (exponents[-lost:] == -np.inf).all() and len(exponents) == len(free) + 2 + lost
        assert float(found["trace_defect"]) == 0.0
    alone = ns.mechanical(1.0, 0.1, 1.0, parameters={}, elements={"f": Coulomb(at="q", friction=0.6)})
    assert ns.lyapunov(alone, duration=50.0, start={"q": 0.2})["exponents"].values == pytest.approx([0.0, -np.inf])


def test_what_friction_holds_is_no_exponent_beside_a_memory_that_nobody_wrote() -> None:
    """A stuck mass: its place is free (0), its speed lost (-inf); y' = -0.3 y goes on beside it."""
    system = ns.System(
        states=["x", "v", "y"],
        parameters={"w": 1.0},
        modes={"only": lambda t, u, p: (u.v, 0.1 * np.cos(p.w * t) - u.x - 0.2 * u.v, -0.3 * u.y)},
        memory={"never": (0.5, "")},
        elements={"rub": Coulomb(speed=lambda t, u, p: u.v, on={"v": 1.0}, friction=5.0)},
    )
    found = ns.lyapunov(system, periods=50, transient=5, start={"x": 0.1, "y": 1.0}, progress=False)
    assert found["exponents"].values[:3] == pytest.approx([0.0, -0.3, -np.inf], abs=1e-12)


SLOW = pytest.param(0.6, {"f": Coulomb(at="q", friction=0.1)}, "taylor", marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("restitution", "rubs", "method"),
    [
        *[(e, {}, method) for e in (0.0, 0.3) for method in ("exact", "taylor")],
        (0.6, {"f": Coulomb(at="q", friction=0.1)}, "exact"),
        SLOW,
    ],
)
def test_a_chatter_that_ends_in_rest_loses_place_and_speed(restitution: float, rubs: Any, method: str) -> None:
    """A mass on a shaken table rests in each period, it may rub; another one, alone, keeps the trace of its damping."""
    shaken = {"q": lambda t, p: 1.5 * np.cos(t) - 1.0}
    table = {"s": Stop(at="q", side=-1, position=0.0, restitution=restitution), **rubs}
    options: Any = {"periods": 40, "transient": 10, "start": {"q": 0.3}, "method": method}
    alone = ns.mechanical(1.0, 0.1, 0.2, forcing=shaken, elements=table, coordinates=["q"])
    assert (ns.lyapunov(alone, **options).exponents.values == -np.inf).all()
    both = ns.mechanical(
        np.eye(2), 0.1 * np.eye(2), np.diag([0.2, 1.0]), forcing=shaken, elements=table, coordinates=["q", "r"]
    )
    exponents = ns.lyapunov(both, **options).exponents.values
    assert (exponents[2:] == -np.inf).all() and exponents[:2].sum() == pytest.approx(-0.1, abs=1e-10)


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_what_comes_to_rest_without_an_impulse_loses_its_place_too(method: str) -> None:
    """A mass that rubs comes down on a table without bouncing on, tied to another one that goes on."""
    load = {name: lambda t, p: 1.721 * (np.cos(0.9474 * t) - 0.5758) for name in ("q", "y")}
    system = ns.mechanical(
        np.eye(2),
        np.diag([0.0926, 0.0613]),
        [[2.2983, -0.3], [-0.3, 1.5451]],
        coordinates=["q", "y"],
        forcing=load,
        period=2 * np.pi / 0.9474,
        elements={
            "s": Stop(at="q", side=-1, position=0.0, restitution=0.0494),
            "f": Coulomb(at="q", friction=0.0622),
        },
    )
    exponents = ns.lyapunov(system, periods=20, transient=20, method=method, progress=False).exponents.values
    assert (np.sort(exponents)[:2] == -np.inf).all() and np.isfinite(np.sort(exponents)[2:]).all()


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_an_order_of_two_impacts_that_matters_is_said(method: str) -> None:
    """Equal masses strike together: with a spring between them the exponents are those of one alone and of the
    difference, whose oscillator strikes in the same way; with a damper the map has a kink."""

    def found(damping: float, **sweep: Any) -> xr.Dataset:
        between = np.array([[1.0, -1.0], [-1.0, 1.0]])
        system = ns.mechanical(
            np.eye(2),
            0.16 * np.eye(2) + damping * between,
            0.81 * np.eye(2) + 0.5 * between,
            parameters={"w": 1.47},
            coordinates=["a", "b"],
            forcing={name: (lambda t, p: 1.45 * np.cos(p.w * t)) for name in "ab"},
            elements={f"s{name}": Stop(at=name, position=0.2, restitution=0.7) for name in "ab"},
        )
        return spectrum(system, start={"a": 0.05, "b": 0.05}, periods=64, transient=200, method=method, **sweep)

    alone = found(0.0)
    assert "note" not in alone.attrs
    strikes = np.log(0.7) / (2 * np.pi / 1.47)  # once a period: lengths are multiplied by sqrt(e^2) and by exp(-c T/2)
    assert alone.exponents.values.sum() == pytest.approx(-0.32 + 4 * strikes, abs=1e-9)
    with pytest.warns(RuntimeWarning, match="happen at one instant.*those of one order"):
        assert "do not hold for the other" in found(0.3).attrs["note"]
    with pytest.warns(RuntimeWarning, match=r"at 2 of 2 values, 1\.47 the first"):
        found(0.3, parameter="w", values=[1.47, 1.48])
