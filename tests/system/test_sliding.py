"""Sliding modes as expressions: fields, thresholds, transitions, intersections, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.codegen.linear import linear_form
from nonsmooth.system.system import System
from nonsmooth.system.transition import Mode, Surface, Transition


def friction(belt: Any = lambda t, p: p.v_b, transitions: Any = (), **surface: Any) -> System:
    return System(
        states=["x", "v"],
        parameters={"mu": 0.5, "v_b": 0.2, "w": 1.3},
        modes={
            "slow": lambda t, u, p: (u.v, np.cos(p.w * t) - u.x + p.mu),
            "fast": lambda t, u, p: (u.v, np.cos(p.w * t) - u.x - p.mu),
        },
        indicators={"slip": lambda t, u, p: u.v - belt(t, p), "wall": lambda t, u, p: u.x - 1},
        transitions=[Surface("slip", below="slow", above="fast", mode="stick", **surface), *transitions],
        outputs={"friction": {"slow": lambda t, u, p: p.mu, "fast": lambda t, u, p: -p.mu}},
    )


def same(a: Any, b: Any) -> bool:
    return bool(sp.simplify(a - b) == 0)


def test_a_mass_that_sticks_to_a_belt_moves_with_it():
    """dv/dt = dv_b/dt on the surface; beside it the distance decays at the forcing frequency. Both are linear."""
    system = friction(lambda t, p: p.v_b * (1 + np.sin(p.w * t)))
    traced = system.traced
    (_, v_b, w), (x, v), t = traced.p, traced.u, traced.t
    belt = v_b * (1 + sp.sin(w * t))
    field = traced.fields[system.modes.index("stick")]
    assert field[0] == v
    assert same(field[1], belt.diff(t) - w * (v - belt))
    assert linear_form(traced).affine_indicators
    # what the friction must be so that the forces give this acceleration
    assert same(traced.outputs[0][2], belt.diff(t) + x - sp.cos(w * t))


def test_a_moving_mass_leaves_and_enters_by_the_forces_alone():
    """Sticking ends where the force without friction, cos w t - x, passes mu, or static mu with static friction."""
    for ratio, given in ((1, {}), (sp.Rational(5, 2), {"static": 2.5}), (3, {"static": lambda t, u, p: 1.5 / p.mu})):
        system = friction(**given)
        traced = system.traced
        mu, force = traced.p[0], sp.cos(traced.p[2] * traced.t) - traced.u[0]
        limit = sp.Rational(3, 2) if ratio == 3 else ratio * mu
        exits = {jump.label: jump.rows for jump in traced.transitions if jump.source == system.modes.index("stick")}
        assert set(exits) == {"stick -> slow", "stick -> fast"}
        ((up,), (down,)) = exits["stick -> fast"], exits["stick -> slow"]
        assert (up.sign, down.sign) == (1, -1)
        assert same(traced.indicators[up.indicator], force - limit)
        assert same(traced.indicators[down.indicator], force + limit)


def test_fields_whose_difference_turns_are_combined_by_filippov():
    """On the surface z = x y + t the combination has L_s h = -kappa h exactly, and is convex."""
    system = System(
        states=["x", "y", "z"],
        parameters={},
        modes={"low": lambda t, u, p: (u.y, u.x * u.z, 1 + u.x**2), "high": lambda t, u, p: (-u.z, u.x, -2 - u.y**2)},
        indicators={"h": lambda t, u, p: u.z - u.x * u.y - t},
        transitions=[Surface("h", below="low", above="high")],
    )
    traced = system.traced
    h = traced.indicators[0]
    low, high, slide = traced.fields[:3]
    rate = h.diff(traced.t) + sum(h.diff(u) * f for u, f in zip(traced.u, slide, strict=True))
    assert same(rate, -h)
    on = dict(zip((traced.t, *traced.u), (0.3, 0.4, -0.2, 0.4 * -0.2 + 0.3), strict=True))
    weights = {round(float(((s - a) / (b - a)).subs(on)), 12) for a, b, s in zip(low, high, slide, strict=True)}
    assert len(weights) == 1
    assert 0 < weights.pop() < 1


def test_a_relay_keeps_its_plant_on_the_surface():
    """With e = b / (k b) the sliding field is (I - e k) A x, also where the relay's gain depends on the state."""
    A = np.array([[0.2, 1.0, 0.0], [-1.0, 0.1, 0.3], [0.4, 0.0, -0.5]])
    b, k = np.array([1.0, -2.0, 0.5]), np.array([2, 1, 0.5])

    def side(sign: int) -> Any:
        return lambda t, u, p: A @ u - sign * b * p.g * (1 + u.x**2)

    system = System(
        states=["x", "y", "z"],
        parameters={"g": 1.0},
        modes={"minus": side(-1), "plus": side(1)},
        indicators={"h": lambda t, u, p: k @ u},
        transitions=[Surface("h", below="minus", above="plus")],
    )
    traced = system.traced
    P = np.eye(3) - np.outer(b, k) / (k @ b)
    jacobian = np.array(sp.Matrix(traced.fields[2]).jacobian(traced.u), dtype=float)
    assert jacobian == pytest.approx(P @ A - np.outer(b, k) / (k @ b), abs=1e-14)


def two_contacts() -> System:
    def side(one: int, two: int) -> Any:
        return lambda t, u, p: (
            u.v1,
            u.v2,
            np.cos(t) - 2 * u.x1 + u.x2 - one * p.F1,
            u.x1 - 2 * u.x2 - two * p.F2,
        )

    signs = {-1: "m", 1: "p"}
    return System(
        states=["x1", "x2", "v1", "v2"],
        parameters={"F1": 0.3, "F2": 0.2},
        modes={signs[a] + signs[b]: side(a, b) for a in (-1, 1) for b in (-1, 1)},
        indicators={"rub1": lambda t, u, p: u.v1, "rub2": lambda t, u, p: u.v2 - 0.1},
        transitions=[
            Surface("rub1", below="mm", above="pm"),
            Surface("rub1", below="mp", above="pp"),
            Surface("rub2", below="mm", above="mp"),
            Surface("rub2", below="pm", above="pp"),
        ],
    )


def test_two_contacts_may_stick_both():
    system = two_contacts()
    assert len(system.modes) == 9
    both = system.modes[-1]
    assert both == "rub1_rub2_sliding"
    (x1, x2, v1, v2), (F1, F2) = system.traced.u, system.traced.p
    field = system.traced.fields[-1]
    assert all(same(a, b) for a, b in zip(field, (v1, v2, -v1, -(v2 - sp.Float(0.1))), strict=True))
    exits = [jump for jump in system.transitions if jump.source == 8]
    assert {system.modes[jump.target] for jump in exits} == set(system.modes[4:8])
    force = {1: sp.cos(system.traced.t) - 2 * x1 + x2, 2: x1 - 2 * x2}
    limits = [row.sign * system.traced.indicators[row.indicator] for jump in exits for row in jump.rows]
    expected = [s * force[i] - F for i, F in ((1, F1), (2, F2)) for s in (1, -1)]
    assert len(limits) == 4
    assert all(any(same(limit, one) for one in expected) for limit in limits)


def test_what_both_modes_do_happens_in_sliding_too():
    stop = {"when": "wall > 0", "reset": lambda t, u, p: (u.x, -u.v)}
    system = friction(transitions=[Transition("slow", "slow", **stop), Transition("fast", "fast", **stop)])
    (impact,) = [jump for jump in system.transitions if jump.source == 2 and jump.reset is not None]
    assert impact.contact
    assert impact.rows == system.transitions[0].rows
    other = {"when": "wall > 0", "reset": lambda t, u, p: (u.x, -0.5 * u.v)}
    with pytest.raises(SystemDefinitionError, match="the same condition, but other resets"):
        friction(transitions=[Transition("slow", "slow", **stop), Transition("fast", "fast", **other)])


def test_a_sliding_mass_that_meets_a_spring_slides_on() -> None:
    """Both modes go over to their own contact modes: so does the stick, to the stick between those."""

    def side(sign: int, stiffness: float) -> Any:
        return lambda t, u, p: (u.v, -u.x - stiffness * (u.x - 1) - sign * p.F)

    system = System(
        states=["x", "v"],
        parameters={"F": 0.5},
        modes={"m": side(-1, 0.0), "q": side(1, 0.0), "m_pressed": side(-1, 9.0), "q_pressed": side(1, 9.0)},
        indicators={"slip": lambda t, u, p: u.v - 0.2, "wall": lambda t, u, p: u.x - 1},
        transitions=[
            Surface("slip", below="m", above="q", mode="stick"),
            Surface("slip", below="m_pressed", above="q_pressed", mode="stick_pressed"),
            Transition("m", "m_pressed", when="wall > 0"),
            Transition("q", "q_pressed", when="wall > 0"),
            Transition("m_pressed", "m", when="wall < 0"),
            Transition("q_pressed", "q", when="wall < 0"),
        ],
    )
    labels = [jump.label for jump in system.transitions]
    assert labels.count("stick -> stick_pressed") == labels.count("stick_pressed -> stick") == 1
    assert not {"stick -> m_pressed", "stick -> q_pressed"} & set(labels)


def utkin(field: Any) -> System:
    """A control c that enters squared: Utkin's solves x' = 0.2 + c = 0; Filippov mixes both ends."""
    return System(
        states=["x", "y"],
        parameters={},
        modes={s: (lambda t, u, p, c=c: (0.2 + c, c * c - u.y)) for s, c in (("below", 1.0), ("above", -1.0))},
        indicators={"h": lambda t, u, p: u.x},
        transitions=[Surface("h", below="below", above="above", field=field)],
    )


def test_a_field_may_be_given_for_the_surface():
    x, y = utkin(None).traced.u
    assert same(utkin(None).traced.fields[2][1], 1 - y)
    equivalent = utkin(lambda t, u, p: (0.0, 0.04 - u.y)).traced.fields[2]
    assert same(equivalent[0], -x)
    assert same(equivalent[1], sp.Float(0.04) - y)
    with pytest.raises(SystemDefinitionError, match="leaves the surface 'h'.* rate '1'"):
        utkin(lambda t, u, p: (1.0, -u.y))


def test_a_surface_is_kept_as_text():
    for system in (friction(static=lambda t, u, p: 1 + u.x**2 / p.mu), utkin(lambda t, u, p: (0.0 * u.x, 0.04 - u.y))):
        again = System.from_text(system.to_text())
        assert again == system
        assert again.traced == system.traced
    assert "crossed or slid on" in repr(system)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"static": 0.9}, "1 or more"),
        ({"static": lambda t, u, p: p.mu}, "`static` of surface slip .* 1 or more"),
        ({"field": 3}, "must be a function"),
        ({"mode": "slow"}, "all names of a system must be different"),
    ],
)
def test_wrong_surfaces(given: dict[str, Any], says: str) -> None:
    if "mode" in given:
        with pytest.raises(SystemDefinitionError, match=says):
            System(
                states=["x"],
                parameters={},
                modes={"slow": lambda t, u, p: (1,), "fast": lambda t, u, p: (-1,)},
                indicators={"h": lambda t, u, p: u.x},
                transitions=[Surface("h", below="slow", above="fast", **given)],
            )
        return
    with pytest.raises(SystemDefinitionError, match=says):
        friction(**given)


def test_texts_leave_out_where_runs_end():
    """Behind a two-fold motion is not unique: that mode has no equations of its own to read."""
    system = System(
        states=["x", "y", "z"],
        parameters={},
        modes={"below": lambda t, u, p: (0, 2, u.y), "above": lambda t, u, p: (1, -3, u.x)},
        indicators={"h": lambda t, u, p: u.z},
        transitions=[Surface("h", below="below", above="above")],
    )
    assert system.modes[-1] == "h_sliding_not_unique"
    latex = system.to_latex()
    assert "not_unique" not in str(system)
    assert r"not\_unique" not in latex
    assert latex.count(r"\dot{z}") == 3


def test_a_jump_that_begins_no_contact_begins_none_while_motion_slides() -> None:
    """Friction, and a wall whose impact, or a controller whose push, is a transition of both modes alike."""
    for contact in (True, False):
        ways = [
            Transition(k, k, at=0.5, reset=lambda t, u, p: (u.x, u.v + 3), contact=contact) for k in ("slow", "fast")
        ]
        system = friction(transitions=ways)
        assert [jump.contact for jump in system.transitions if jump.at is not None] == 3 * [contact]


def test_a_surface_of_a_state_that_its_modes_lack_is_refused() -> None:
    modes: dict[str, Any] = {
        "left": Mode(lambda t, u, p: (1.0,), states=["x"]),
        "right": Mode(lambda t, u, p: (-1.0,), states=["x"]),
    }
    with pytest.raises(SystemDefinitionError, match="'h' involves the state 'y', which mode 'left' does not have"):
        System(
            states=["x", "y"],
            parameters={},
            modes=modes,
            indicators={"h": lambda t, u, p: u.x - u.y},
            transitions=[Surface("h", below="left", above="right")],
        )
