"""The forcing period: closed forms for what is read off, checks for what is given."""

import numpy as np
import pytest

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.system import System
from nonsmooth.system.transition import Transition


def forced(force, period=None, **parameters):
    return System(
        states=["x"],
        parameters={"w": 3.0, "b": 0.7} | parameters,
        modes={"only": lambda t, u, p: -u.x + force(t, u, p)},
        period=period,
    )


@pytest.mark.parametrize(
    ("force", "period"),
    [
        (lambda t, u, p: np.cos(p.w * t), 2 * np.pi / 3),
        (lambda t, u, p: np.cos(2 * p.w * t) + np.sin(3 * p.w * t), 2 * np.pi / 3),
        (lambda t, u, p: np.cos(2 * p.w * t) * u.x, np.pi / 3),
        (lambda t, u, p: np.cos(p.w * t) * np.sin(1.5 * p.w * t), 4 * np.pi / 3),
        (lambda t, u, p: np.cos(p.w * t + u.x) + np.sin(p.w * (t - p.b)), 2 * np.pi / 3),
        (lambda t, u, p: np.cos(1.1 * t) + np.cos(3.3 * t), 2 * np.pi / 1.1),
        (lambda t, u, p: np.cos(p.w * t / 3) ** 3 + np.exp(np.sin(p.w * t / 2)), 12 * np.pi / 3),
        (lambda t, u, p: np.cos(np.pi * t), 2.0),
        (lambda t, u, p: np.cos(p.w * t - p.b), 2 * np.pi / 3),  # SymPy has it as cos(b - w t)
        (lambda t, u, p: np.sin(p.b - p.w * t) + np.cos(2 * p.w * t - p.b), 2 * np.pi / 3),
        (lambda t, u, p: np.cos((p.w + p.b) * t) + np.cos(2 * (p.b + p.w) * t), 2 * np.pi / 3.7),
        (lambda t, u, p: np.cos((p.b - p.w) * t) + np.sin(2 * (p.w - p.b) * t), 2 * np.pi / 2.3),
    ],
)
def test_the_period_is_read_off(force, period):
    system = forced(force)
    assert system.period() == pytest.approx(period, rel=1e-14)
    assert system.depends_on_time
    assert not system.explicit_time


def test_autonomous_and_not_periodic():
    assert forced(lambda t, u, p: p.w).period() is None
    assert not forced(lambda t, u, p: p.w).depends_on_time
    for force in (
        lambda t, u, p: np.cos(p.w * t) + np.cos(p.b * t),
        lambda t, u, p: p.w * t,
        lambda t, u, p: np.cos(p.w * t**2),
        lambda t, u, p: np.cos(u.x * t),
    ):
        system = forced(force)
        assert system.period() is None
        assert system.explicit_time
        assert system.depends_on_time
        assert "not periodically" in repr(system)


def test_a_given_period_is_checked():
    two = forced(lambda t, u, p: np.cos(p.w * t) + np.cos(p.b * t), period=lambda p: 20 * np.pi, w=0.3, b=0.7)
    assert two.period() == pytest.approx(20 * np.pi)
    assert forced(lambda t, u, p: np.cos(p.w * t), period=lambda p: 4 * np.pi / p.w).period() == pytest.approx(
        4 * np.pi / 3
    )
    assert forced(lambda t, u, p: 0, period=2.5).period() == 2.5
    vast = forced(lambda t, u, p: (9999 - p.w) ** 99 * np.cos(p.w * t), period=lambda p: 2 * np.pi / p.w, w=0.3)
    assert vast.period() == pytest.approx(2 * np.pi / 0.3)  # 1e396 is no number that could be compared, and no accident
    with pytest.raises(SystemDefinitionError, match="does not repeat after the period"):
        forced(lambda t, u, p: np.cos(p.w * t), period=lambda p: 3 * np.pi / p.w)
    with pytest.raises(SystemDefinitionError, match=r"are \(t, u, p\), but it is called as f\(p\): parameters"):
        forced(lambda t, u, p: np.cos(p.w * t), period=lambda t, u, p: t)


def test_switching_at_a_phase_needs_a_period():
    def bang_bang(**more):
        return System(
            states=["x", "v"],
            parameters={"A": 26.0, "omega": 1.0},
            modes={
                "minus": lambda t, u, p: (u.v, -p.A - 0.2 * u.v - u.x - u.x**3),
                "plus": lambda t, u, p: (u.v, p.A - 0.2 * u.v - u.x - u.x**3),
            },
            transitions=[Transition("minus", "plus", at=0.5), Transition("plus", "minus", at=0.0)],
            **more,
        )

    with pytest.raises(SystemDefinitionError, match=r"minus -> plus: `at` is a phase.*give period="):
        bang_bang()
    system = bang_bang(
        period=lambda p: 2 * np.pi / p.omega, symmetry=(lambda u: (-u.x, -u.v), 0.5, {"plus": "minus", "minus": "plus"})
    )
    assert system.period() == pytest.approx(2 * np.pi)
    assert [jump.at for jump in system.transitions] == [0.5, 0.0]
    assert system.depends_on_time


def test_two_transitions_from_one_mode_at_one_phase_are_refused():
    """Only the first would ever be taken."""
    kicks = [Transition("only", "only", at=0.25, reset=lambda t, u, p, k=k: (u.x + k,)) for k in (1, 2)]
    told = {
        "states": ["x"],
        "parameters": {"w": (1.0, "rad/s")},
        "modes": {"only": lambda t, u, p: (-u.x + np.cos(p.w * t),)},
    }
    with pytest.raises(SystemDefinitionError, match=r"both leave mode 'only' at phase 0.25: only the first"):
        System(**told, transitions=kicks)
    later = Transition("only", "only", at=0.5, reset=lambda t, u, p: (u.x + 2,))
    assert len(System(**told, transitions=[kicks[0], later]).transitions) == 2


def test_every_reset_counts_though_transitions_have_one_label():
    """Two walls of one mode: the first one gives a push that goes with the time, the second one does not."""

    def between(push, **more):
        return System(
            states=["x", "v"],
            parameters={"w": 3.0, "e": 0.8},
            modes={"only": lambda t, u, p: (u.v, -u.x)},
            indicators={"right": lambda t, u, p: u.x - 1, "left": lambda t, u, p: u.x + 1},
            transitions=[
                Transition("only", "only", when="right > 0", reset=lambda t, u, p: (u.x, -u.v - push(t, p))),
                Transition("only", "only", when="left < 0", reset=lambda t, u, p: (u.x, -p.e * u.v)),
            ],
            **more,
        )

    assert between(lambda t, p: 0.1 * np.cos(p.w * t)).period() == pytest.approx(2 * np.pi / 3)
    assert between(lambda t, p: 0.1 * t).explicit_time
    with pytest.raises(SystemDefinitionError, match=r"the reset of only -> only \(v\) does not repeat"):
        between(lambda t, p: 0.1 * np.cos(p.w * t), period=lambda p: np.pi / p.w)
    with pytest.raises(SystemDefinitionError, match="w = 0"):
        between(lambda t, p: 0.1 / p.w).with_parameters(w=0.0)


def test_a_given_period_holds_at_other_values_too():
    """The forcing would begin anew at each multiple of a period that is not its own."""
    system = forced(lambda t, u, p: np.cos(p.w * t), period=2 * np.pi / 3)
    assert system.with_parameters(w=6.0).period() == pytest.approx(2 * np.pi / 3)
    for one in (lambda: system.with_parameters(w=3.3), lambda: system.parameter_points({"w": [3.0, 4.5]})):
        with pytest.raises(SystemDefinitionError, match="do not repeat after the period .* function of p"):
            one()
    again = System.from_text(system.with_parameters(w=6.0, b=0.1).to_text())
    with pytest.raises(SystemDefinitionError, match="do not repeat"):
        again.with_parameters(w=3.3)
    even = forced(lambda t, u, p: np.cos(p.w * t) ** 2, period=np.pi / 3)  # half a turn of the wave
    assert even.with_parameters(w=9.0).period() == pytest.approx(np.pi / 3)
    with pytest.raises(SystemDefinitionError, match="do not repeat"):
        even.with_parameters(w=4.5)
