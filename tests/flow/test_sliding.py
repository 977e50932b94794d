"""Motion along surfaces: where a run begins, how perturbations pass, ramps, and where there is no unique way on."""

from __future__ import annotations

from time import process_time
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns


@pytest.mark.parametrize(
    ("start", "mode"),
    [
        ((0.0, 2.0), "forward"),
        ((3.0, 2.0), "forward"),
        ((-3.0, 0.5), "forward"),
        ((3.0, 0.31), "forward"),
        ((0.0, -2.0), "backward"),
        ((-3.0, 0.2), "backward"),
        ((3.0, -0.5), "backward"),
        ((1.0, 0.3), "stick"),
        ((0.6, 0.3), "forward"),
        ((1.4, 0.3), "backward"),
    ],
)
def test_a_start_goes_to_its_side(start: tuple[float, float], mode: str) -> None:
    """Beside the surface by its indicator alone, on it by the forces: |cos 0 - x| < 0.3 sticks."""
    system = ns.models.dry_friction_oscillator(v_b=0.3)
    run = ns.simulate(system, start=start, duration=1e-6, samples=2)
    assert system.modes[int(run.mode.values[0])] == mode


@pytest.mark.parametrize("rtol", [1e-9, 1e-12])
def test_sliding_round_a_circle(rtol: float) -> None:
    """Inside r' = r, theta' = 1, outside r' = -r, theta' = 3: on r = 1 half of each, theta' = 2."""
    system = ns.System(
        states=["x", "y"],
        parameters={},
        modes={
            "inside": lambda t, u, p: (u.x - u.y, u.x + u.y),
            "outside": lambda t, u, p: (-u.x - 3 * u.y, 3 * u.x - u.y),
        },
        indicators={"radius": lambda t, u, p: u.x**2 + u.y**2 - 1},
        transitions=[ns.Surface("radius", below="inside", above="outside")],
    )
    for r, arrives, angle in ((0.5, np.log(2), np.log(2)), (3.0, np.log(3), 3 * np.log(3))):
        run = ns.simulate(system, duration=100.0, start={"x": r}, samples=1001, rtol=rtol)
        assert run.crossing_time.values[-1] == pytest.approx(arrives, abs=0.01 * rtol)
        slid = run.time.values > arrives
        theta = angle + 2 * (run.time.values[slid] - arrives)
        assert run.u.values[slid] == pytest.approx(np.array([np.cos(theta), np.sin(theta)]).T, abs=10 * rtol)
        assert np.abs(np.hypot(*run.u.values[slid].T) - 1).max() < 0.01 * rtol


def test_an_impact_out_of_a_stick() -> None:
    """A belt carries a mass to a wall at x = 1; it rebounds with -e v_b and slips, x'' = F - x, back to the wall."""
    rebound = {"when": "wall > 0", "reset": lambda t, u, p: (u.x, -p.e * u.v)}
    system = ns.System(
        states=["x", "v"],
        parameters={"F": 2.0, "v_b": 0.5, "e": 0.8},
        modes={"slower": lambda t, u, p: (u.v, p.F - u.x), "faster": lambda t, u, p: (u.v, -p.F - u.x)},
        indicators={"slip": lambda t, u, p: u.v - p.v_b, "wall": lambda t, u, p: u.x - 1},
        transitions=[
            ns.Surface("slip", below="slower", above="faster", mode="stick"),
            ns.Transition("slower", "slower", **rebound),
            ns.Transition("faster", "faster", **rebound),
        ],
    )
    run = ns.simulate(system, duration=3.0, start={"x": 0.5, "v": 0.5}, samples=2)
    labels = [system.transitions[i].label for i in run.crossing_transition.values]
    first = labels.index("stick -> slower")
    assert labels[first + 1] == "slower -> slower"
    assert run.crossing_time.values[first] == pytest.approx(1.0, abs=1e-14)
    assert run.u_after.values[first] == pytest.approx([1.0, -0.4], abs=1e-14)
    # x = 2 - cos s - 0.4 sin s comes back to x = 1 with the speed 0.4, slower than the belt
    assert np.diff(run.crossing_time.values)[first] == pytest.approx(2 * np.arctan(0.4), abs=1e-14)
    assert run.u_after.values[first + 1] == pytest.approx([1.0, -0.32], abs=1e-14)


def derivatives(system: ns.System, duration: float, start: np.ndarray, step: float = 1e-6) -> np.ndarray:
    columns = []
    for i in range(len(start)):
        ends = []
        for sign in (1, -1):
            moved = start.copy()
            moved[i] += sign * step
            ends.append(ns.simulate(system, duration=duration, start=moved, samples=2).u.values[-1])
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.array(columns).T


def through(system: ns.System, duration: float, start: Any) -> list[str]:
    run = ns.simulate(system, duration=duration, start=start, samples=2)
    return [system.modes[system.transitions[i].target] for i in run.crossing_transition.values]


@pytest.mark.parametrize(("duration", "last"), [(8.0, "stick"), (12.0, "forward"), (16.0, "stick"), (20.0, "backward")])
def test_derivatives_into_and_out_of_a_stick(duration: float, last: str) -> None:
    """With static friction: the field jumps where the stick ends."""
    system = ns.models.dry_friction_oscillator(omega=0.4, f_s=0.4, zeta=0.05, v_b=0.1)
    start = np.array([0.2, 1.2])
    assert through(system, duration, start)[-1] == last
    found = ns.sensitivity(system, duration=duration, start=start).Phi.values
    assert found == pytest.approx(derivatives(system, duration, start), abs=1e-6)
    assert np.linalg.matrix_rank(found, tol=1e-9) == 1


def test_derivatives_of_the_relay() -> None:
    """Into sliding and out of it, several times."""
    system = ns.models.relay_feedback()
    start = np.array([0.1, -0.4, 0.3])
    path = through(system, 4.0, start)
    assert path.count("sliding") >= 2
    found = ns.sensitivity(system, duration=4.0, start=start).Phi.values
    expected = derivatives(system, 4.0, start, step=1e-7)
    assert found == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    assert np.linalg.matrix_rank(found, tol=1e-9 * np.abs(found).max()) == 2


def test_a_belt_that_speeds_up() -> None:
    """A ramp of the belt's speed: while the mass sticks, dv/dt is that of the belt and the friction carries it."""
    system = ns.models.stick_slip_belt()
    run = ns.simulate(system, duration=1.0, start={"x": 0.0, "v": 0.2}, ramps={"v_b": (0.2, 0.6)}, samples=11)
    t = run.time.values
    assert run.u.values[:, 1] == pytest.approx(0.2 + 0.4 * t, abs=1e-13)
    assert run.u.values[:, 0] == pytest.approx(0.2 * t + 0.2 * t**2, abs=1e-12)
    assert run.friction.values == pytest.approx(0.4 + 0.2 * t + 0.2 * t**2, abs=1e-12)


def test_a_start_on_a_repelling_surface_is_refused() -> None:
    system = ns.System(
        states=["x", "v"],
        parameters={"F": 0.3},
        modes={"low": lambda t, u, p: (u.v, -u.x - p.F), "high": lambda t, u, p: (u.v, -u.x + p.F)},
        indicators={"h": lambda t, u, p: u.v},
        transitions=[ns.Surface("h", below="low", above="high")],
    )
    with pytest.raises(ValueError, match=r"'v': 0.0.* lies on the surface 'h' where both vector fields lead away"):
        ns.simulate(system, duration=1.0)
    assert len(ns.simulate(system, duration=1.0, start={"x": 1.0}).crossing_time) <= 1  # crossing is no question


def test_resets_that_land_beyond_each_others_stops_end_at_once_with_a_sentence() -> None:
    """Each wall throws the ball behind the other one: an endless chain at one instant."""
    walls = [
        ns.Transition("fly", "fly", when="right > 0", reset=lambda t, u, p: (u.x - 3, -u.v)),
        ns.Transition("fly", "fly", when="left > 0", reset=lambda t, u, p: (u.x + 3, -u.v)),
    ]
    system = ns.System(
        states=["x", "v"],
        parameters={"a": 1.0},
        modes={"fly": lambda t, u, p: (u.v, -p.a * u.x)},
        indicators={"right": lambda t, u, p: u.x - 1, "left": lambda t, u, p: -u.x - 1},
        transitions=walls,
    )
    ns.simulate(system, duration=0.1)  # compiled
    begin = process_time()
    with pytest.raises(ns.SolveError, match="without end") as caught:
        ns.simulate(system, duration=10.0, start={"v": 2.0})
    assert process_time() - begin < 1
    assert caught.value.time == pytest.approx(np.pi / 6, abs=1e-12)  # 2 sin t = 1


def test_friction_under_the_force_of_a_rigid_contact_is_refused() -> None:
    """Such a motion need not exist or be unique: a rod that slides on a floor (Painleve 1895)."""
    begin = process_time()
    with pytest.raises(ns.SystemDefinitionError, match=r"need not exist or be unique \(Painleve\)"):
        ns.mechanical(
            [[1.0, 0.0], [0.0, 1.0]],
            0.0 * np.eye(2),
            np.eye(2),
            coordinates=["x", "y"],
            elements={
                "floor": ns.elements.Stop(at="y", side=-1, position=0.0),
                "rub": ns.elements.Coulomb(at="x", friction=0.5, normal="floor"),
            },
        )
    assert process_time() - begin < 1


def test_a_reset_that_lands_beyond_another_stop_takes_its_impact_at_the_same_instant() -> None:
    right = ns.Transition("fly", "fly", when="right > 0", reset=lambda t, u, p: (u.x - 3, -u.v))
    left = ns.Transition("fly", "fly", when="left > 0", reset=lambda t, u, p: (-0.5 + 0 * u.x, -u.v / 2))
    system = ns.System(
        states=["x", "v"],
        parameters={"a": 1.0},
        modes={"fly": lambda t, u, p: (u.v, -p.a * u.x)},
        indicators={"right": lambda t, u, p: u.x - 1, "left": lambda t, u, p: -u.x - 1},
        transitions=[right, left],
    )
    run = ns.simulate(system, duration=0.6, start={"v": 2.0}, samples=2)
    assert run.crossing_time.values == pytest.approx([np.pi / 6] * 2, abs=1e-12)
    assert run.u_after.values == pytest.approx(np.array([[-2, -(3**0.5)], [-0.5, 3**0.5 / 2]]), abs=1e-12)


def test_sliding_into_a_two_fold_ends_with_a_sentence() -> None:
    """In the time scaled by y - x the sliding flow is x' = y, y' = -3 y - 2 x: a node that attracts x < 0 < y."""
    system = ns.System(
        states=["x", "y", "z"],
        parameters={},
        modes={"below": lambda t, u, p: (0, 2, u.y), "above": lambda t, u, p: (1, -3, u.x)},
        indicators={"h": lambda t, u, p: u.z},
        transitions=[ns.Surface("h", below="below", above="above")],
    )
    with pytest.raises(ns.SolveError, match="Sliding in mode 'h_sliding' .* two-fold.* not unique") as caught:
        ns.simulate(system, duration=5.0, start=[-0.5, 0.5, 0.0])
    assert caught.value.status == "not_unique"
    assert np.abs(list(caught.value.state.values())).max() < 1e-8


def test_a_two_fold_has_its_own_status_in_sweeps() -> None:
    """The same with x' = a y on the surface: a node that attracts x < 0 < y too."""
    system = ns.System(
        states=["x", "y", "z"],
        parameters={"a": 1.0, "w": 1.0},
        modes={"below": lambda t, u, p: (0 * t, 2, u.y), "above": lambda t, u, p: (p.a, -3, u.x)},
        indicators={"h": lambda t, u, p: u.z},
        transitions=[ns.Surface("h", below="below", above="above")],
        period=lambda p: 2 * np.pi / p.w,
    )
    begin = {"x": -0.5, "y": 0.5, "z": 0.0}
    found = ns.sweep(system, "a", [0.9, 1.0], start=begin, direction=None, transient=5, keep=20, progress=False)
    names = dict(zip(found.status.flag_values.tolist(), found.status.flag_meanings.split(), strict=True))
    assert [names[int(code)] for code in found.status.values.ravel()] == ["not_unique"] * 2


@pytest.mark.parametrize("f", [0.05, 0.1, 0.3])
def test_an_end_of_sliding_is_no_return_to_it(f: float) -> None:
    """On a belt, slipping begins without relative acceleration: rounding of either rate must not end it at once."""
    system = ns.models.dry_friction_oscillator(f_k=f, f_s=f, v_b=0.5)
    frequencies = np.linspace(0.05, 2.5, 99)
    diagram = ns.sweep(system, "omega", frequencies, transient=100, keep=20, direction=None, progress=False)
    assert set(diagram.status.values.tolist()) <= {0, 1, 2}


def test_four_fields_that_leave_the_motion_on_two_surfaces_open() -> None:
    """All lead to x = y = 0, where z' depends on the order in which the fields are combined."""
    z = {"mm": 0.0, "pm": 1.0, "mp": 0.0, "pp": 0.0}
    speed = {"mm": (1, 1), "pm": (-1, 2), "mp": (3, -1), "pp": (-1, -1)}
    system = ns.System(
        states=["x", "y", "z"],
        parameters={},
        modes={mode: (lambda t, u, p, mode=mode: (*speed[mode], z[mode] - u.z)) for mode in z},
        indicators={"one": lambda t, u, p: u.x, "two": lambda t, u, p: u.y},
        transitions=[
            ns.Surface("one", below="mm", above="pm"),
            ns.Surface("one", below="mp", above="pp"),
            ns.Surface("two", below="mm", above="mp"),
            ns.Surface("two", below="pm", above="pp"),
        ],
    )
    assert not any(mode.startswith("one_two_sliding") for mode in system.modes)
    with pytest.raises(ns.SolveError, match=r"do not determine one field on both") as caught:
        ns.simulate(system, duration=5.0, start=[-0.5, -1.0, 0.2])
    assert caught.value.status == "chatter"
    assert caught.value.time < 1.5


def four_fields(speed: dict[str, Any], names: tuple[str, ...], one: Any, two: Any, **parameters: float) -> ns.System:
    """Modes m and p either side of two surfaces, each with its field."""
    return ns.System(
        states=names,
        parameters=parameters,
        modes=speed,
        indicators={"one": one, "two": two},
        transitions=[
            ns.Surface("one", below="mm", above="pm"),
            ns.Surface("one", below="mp", above="pp"),
            ns.Surface("two", below="mm", above="mp"),
            ns.Surface("two", below="pm", above="pp"),
        ],
    )


@pytest.mark.parametrize("method", ["taylor", "rkf45"])
@pytest.mark.parametrize("add_up", [False, True])
def test_a_pole_on_another_side_does_not_end_a_run(add_up: bool, method: str) -> None:
    """Four fields: sliding along x = 0 beyond y = 10 has a pole at z = 0.5, which a motion on y < 10 passes, z = t.
    Relays that add up: along x = 0 it has one at z = 0, which x' = 0.3 - z, y' = 1.5 passes at z = t - 1."""
    one, two = (lambda t, u, p: u.x), (lambda t, u, p: u.y - 10)
    if add_up:
        signs = {"mm": (-1, -1), "pm": (1, -1), "mp": (-1, 1), "pp": (1, 1)}
        speed = {k: (lambda t, u, p, a=a, b=b: (0.3 - a * u.z, 0.5 * a - b, 1)) for k, (a, b) in signs.items()}
        start, times, last = [5.0, 0.0, -1.0], [], [5.6, 3.0, 1.0]
    else:
        speed = {
            "mm": lambda t, u, p: (1, 0, 1),
            "pm": lambda t, u, p: (-1, 0, 1),
            "mp": lambda t, u, p: (u.z, 0, 0),
            "pp": lambda t, u, p: (1 - u.z, 1, 0),
        }
        start, times, last = [0.1, 0.0, 0.0], [0.1], [0.0, 0.0, 2.0]
    run = ns.simulate(four_fields(speed, ("x", "y", "z"), one, two), start=start, duration=2.0, method=method)
    assert run.crossing_time.values == pytest.approx(times, abs=1e-12)
    assert run.u.values[-1] == pytest.approx(last, abs=1e-9)


def test_four_fields_of_four_states_are_there_in_seconds() -> None:
    """Filippov's quotients are not multiplied out: that took minutes. The first crossing is that of SciPy."""
    random = np.random.default_rng(0)
    A, b, c = random.normal(size=(4, 4, 4)), random.normal(size=(4, 4)), random.normal(size=(4, 4))
    k, m = random.normal(size=(2, 4)), random.normal(size=2)
    began = process_time()
    speed = {
        mode: (lambda t, u, p, i=i: A[i] @ u - 3 * np.array([*u]) + b[i] + c[i] * np.cos(t + i))
        for i, mode in enumerate(("mm", "pm", "mp", "pp"))
    }
    system = four_fields(
        speed,
        ("x0", "x1", "x2", "x3"),
        lambda t, u, p: k[0] @ u - 1 - m[0] * np.cos(t),
        lambda t, u, p: k[1] @ u - 1 - m[1] * np.sin(t),
    )
    run = ns.simulate(system, duration=0.2, method="rkf45")
    assert process_time() - began < 20
    assert run.status == 0
    assert len(system.modes) == 12  # four, four that slide, and four from which motion is not unique


LOWER = {"mm": (1, 1), "pm": (-1, 1)}  # both lead to x = 0, where motion goes up to y = 0: it is there at t = 1


@pytest.mark.parametrize(
    ("upper", "rate"),
    [
        ({"mp": (2, 0.25), "pp": (2, 2)}, (2, 2)),  # off both surfaces
        ({"mp": (-2, 2), "pp": (-1, 0.5)}, (-2, 2)),
        ({"mp": (1, 1), "pp": (-3, 2)}, (0, 1.25)),  # on along x = 0
        ({"mp": (2, -1), "pp": (2, -1)}, (0.5, 0)),  # along y = 0, with half of pm and half of pp
        ({"mp": (1, -1), "pp": (-1, -1)}, (0, 0)),  # it stays on both
    ],
)
@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_where_two_surfaces_meet_the_one_way_on_is_taken(
    upper: dict[str, Any], rate: tuple[float, float], method: str
) -> None:
    """Constant fields: each way by hand, and all others are closed (their rates lead back)."""
    speed = {mode: (lambda t, u, p, v=v: v) for mode, v in {**LOWER, **upper}.items()}
    system = four_fields(speed, ("x", "y"), lambda t, u, p: u.x, lambda t, u, p: u.y)
    run = ns.simulate(system, start=[0.25, -1.0], duration=3.0, method=method)
    assert run.u.values[-1] == pytest.approx([2 * v for v in rate], abs=1e-9)


@pytest.mark.parametrize(
    "upper",
    [
        {"mp": (-1, 1), "pp": (1, 1)},  # off to either side
        {"mp": (-1, 1), "pp": (2, -1)},  # off to the left, or along y = 0 to the right
    ],
)
def test_where_several_ways_lead_on_from_two_surfaces_the_run_says_so(upper: dict[str, Any]) -> None:
    speed = {mode: (lambda t, u, p, v=v: v) for mode, v in {**LOWER, **upper}.items()}
    system = four_fields(speed, ("x", "y"), lambda t, u, p: u.x, lambda t, u, p: u.y)
    with pytest.raises(ns.SolveError, match="a second surface, from which several ways lead on") as caught:
        ns.simulate(system, start=[0.25, -1.0], duration=3.0)
    assert caught.value.status == "not_unique"
    assert caught.value.time == pytest.approx(1.0, abs=1e-9)


def test_a_surface_that_ends_at_another_one() -> None:
    """Behind y = 0 there is one field, and no surface x = 0: sliding ends there."""
    system = ns.System(
        states=["x", "y"],
        parameters={},
        modes={
            "left": lambda t, u, p: (1, 1),
            "right": lambda t, u, p: (-1, 1),
            "top": lambda t, u, p: (0.5, 0.25),
        },
        indicators={"one": lambda t, u, p: u.x, "two": lambda t, u, p: u.y},
        transitions=[
            ns.Surface("one", below="left", above="right"),
            ns.Surface("two", below="left", above="top"),
            ns.Surface("two", below="right", above="top"),
        ],
    )
    run = ns.simulate(system, start=[0.25, -1.0], duration=3.0)
    assert run.crossing_time.values == pytest.approx([0.25, 1.0], abs=1e-12)
    assert run.u.values[-1] == pytest.approx([1.0, 0.5], abs=1e-12)


def test_motion_that_stays_where_two_surfaces_meet_by_taylor_series() -> None:
    """x = 0.2 cos t, y = 0: what y should be is all rounding, and a run may begin there, or go on there in a sweep."""
    fields = {
        "mm": lambda t, u, p: (1, 1 + p.A * np.cos(t)),
        "pm": lambda t, u, p: (-1, 1 - u.y),
        "mp": lambda t, u, p: (2, -0.5 - u.y),
        "pp": lambda t, u, p: (-0.6 - u.x, -1),
    }
    system = four_fields(fields, ("x", "y"), lambda t, u, p: u.x - 0.2 * np.cos(t), lambda t, u, p: u.y, A=0.5)
    where = {"start": [0.2, 0.0], "mode": "one_two_sliding"}
    run = ns.simulate(system, duration=2.0, samples=21, method="taylor", **where)
    assert run.u.values[:, 0] == pytest.approx(0.2 * np.cos(run.time.values), abs=1e-9)
    assert abs(run.u.values[:, 1]).max() < 1e-15
    swept = ns.sweep(
        system, "A", [0.3, 0.49322033898305084], direction=None, start=[0.3, -1.0], transient=1, keep=3, progress=False
    )
    assert (swept.status == 0).all() and (swept.period_number == 1).all()
    assert swept.section.values[..., 0] == pytest.approx(0.2, abs=1e-9)
