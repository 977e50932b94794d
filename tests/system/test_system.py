"""The description: what is accepted, what is refused at the door, and what copies share."""

import copy
import pickle

import numpy as np
import pytest

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.models import discontinuous_support
from nonsmooth.system.system import System
from nonsmooth.system.transition import Band, Mode, Surface, Transition, read_condition


def free(t, u, p):
    x, v = u
    return v, (p.rho * np.cos(p.omega * t) - p.k * x) / p.m


def stopped(t, u, p):
    return u.v, (p.rho * np.cos(p.omega * t) - p.k * u.x - p.k_s * (u.x - p.g)) / p.m


def overlap(t, u, p):
    return u.x - p.g


def back(t, u, p):
    return -(u.x - p.g) - p.c_s / p.k_s * u.v


GOOD = {
    "states": {"x": "m", "v": "m/s"},
    "parameters": {
        "m": (0.8, "kg"),
        "k": 8.0,
        "k_s": (100.0, "N/m"),
        "g": 0.01,
        "rho": 0.4,
        "omega": 3.0,
        "c_s": (0.6, "", "c_s"),
    },
    "modes": {"free": free, "contact": stopped},
    "indicators": {"overlap": overlap, "back": back},
    "transitions": [
        Transition("free", "contact", when="overlap > 0 and back < 0"),
        Transition("contact", "free", when="back > 0"),
    ],
    "name": "plain",
}


def make(**changed):
    return System(**(GOOD | changed))


def test_what_a_system_says_of_itself():
    system = make(scale={"x": 1e-3})
    assert dict(system.states) == {"x": "m", "v": "m/s"}
    assert system.parameters["m"].unit == "kg"
    assert system.parameters["c_s"].symbol == "c_s"
    assert system.modes == ("free", "contact")
    assert dict(system.scale) == {"x": 1e-3, "v": 1.0}
    assert system.parameter_vector().tolist() == [0.8, 8.0, 100.0, 0.01, 0.4, 3.0, 0.6]
    assert system.memory_vector().shape == (0,)
    assert system.eta is None
    assert system.depends_on_time
    assert not system.explicit_time
    assert [jump.contact for jump in system.transitions] == [True, False]


def test_copies_share_the_equations():
    system = make()
    other = system.with_parameters(g=0.002, m=np.float64(2))
    assert other.traced is system.traced
    assert (other.values["g"], other.values["m"], system.values["g"]) == (0.002, 2.0, 0.01)
    assert system.with_parameters({"g": 1.0}, g=2.0).values["g"] == 2.0
    assert system.with_parameters(other) == other
    assert other != system
    assert system.period_at({"omega": 2.0}) == pytest.approx(np.pi)
    assert system.period_at(other.parameter_vector()) == pytest.approx(2 * np.pi / 3)


def test_a_system_does_not_change():
    system = make()
    with pytest.raises(AttributeError, match="with_parameters"):
        system.name = "other"
    with pytest.raises(TypeError):
        system.values["g"] = 1.0
    assert copy.deepcopy(system) is system
    assert pickle.loads(pickle.dumps(system.with_parameters(g=0.3))) == system.with_parameters(g=0.3)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"m": 0}, "m = 0 makes .*mode 'free'.* divide by zero"),
        ({"k_s": 0.0}, "k_s = 0 makes indicator 'back' divide by zero"),
        ({"omega": 0}, "forcing period"),
        ({"omega": -1}, "must be positive"),
        ({"m": float("nan")}, "must be finite"),
        ({"m": float("inf")}, "must be finite"),
        ({"gap": 1.0}, "`gap` is not a parameter of 'plain'; nearest: g; all: c_s, g, k, k_s, m, omega, rho"),
        ({"eta": 1.0}, "eta is set by smoothed"),
    ],
)
def test_values_are_checked_whenever_they_change(values, sentence):
    with pytest.raises(ValueError, match=sentence):
        make().with_parameters(values)
    if next(iter(values)) in GOOD["parameters"]:
        with pytest.raises(ValueError, match=sentence):
            make(parameters=GOOD["parameters"] | values)
        with pytest.raises(ValueError, match=sentence):
            make().parameter_points({key: [1.0, value] for key, value in values.items()})


@pytest.mark.parametrize("value", ["1", None, True, [1.0], 1j])
def test_a_parameter_is_a_number(value):
    with pytest.raises(TypeError, match="must be a real number"):
        make().with_parameters(m=value)


def test_parts_that_depend_on_parameters_alone_have_a_domain():
    system = System(
        states=["x"],
        parameters={"a": 2.0, "b": 1.0, "s": 4.0},
        modes={"only": lambda t, u, p: -u.x / (p.a - p.b) + np.sqrt(p.s - 1) + np.log(p.s)},
    )
    with pytest.raises(SystemDefinitionError, match=r"a = 1.0, b = 1.0 makes .*'only'.* divide by zero"):
        system.with_parameters(a=1.0)
    with pytest.raises(SystemDefinitionError, match="root"):
        system.with_parameters(s=0.5)
    with pytest.raises(SystemDefinitionError, match=r"a = 1\.0"):
        system.parameter_points({"a": [3.0, 1.0]})
    assert system.parameter_points({"a": [3.0, 4.0]}).tolist() == [[3, 1, 4], [4, 1, 4]]


def jump(*arguments, **options):
    return lambda: make(transitions=[Transition(*arguments, **options)])


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (jump("free", "contakt", when="overlap > 0"), "`contakt` is not a mode .*nearest: contact"),
        (jump("free", "contact", when="overlapp > 0"), "`overlapp` is not an indicator .*nearest: overlap"),
        (jump("free", "contact", when="overlap == 0"), "the grammar is: <indicator> > 0"),
        (jump("free", "contact", when="overlap > 0 or back < 0"), "the grammar is"),
        (jump("free", "contact", when="overlap > 1"), "the grammar is"),
        (jump("free", "contact", when="u.x > 0"), "the grammar is"),
        (jump("free", "contact", when=""), "the grammar is"),
        (jump("free", "contact", when=overlap), "must be a string of the form"),
        (jump("free", "contact", when="overlap > 0 and overlap < 0"), "both signs"),
        (jump("free", "contact"), "neither"),
        (jump("free", "contact", when="back > 0", at=0.5), "both"),
        (jump("free", "contact", at=1.0), "0 <= at < 1"),
        (jump("free", "free", when="overlap > 0"), "needs a `reset`"),
        (jump("free", "free", when="overlap > 0", reset=lambda t, u, p: u.x), "the reset of .*must return 2"),
        (jump("free", "contact", when="overlap > 0", reset=3), "must be a function"),
        (jump("free", "contact", when="overlap > 0", write={"v_a": overlap}), "`v_a` is not memory"),
        (lambda: make(transitions=["free -> contact"]), "a list of ns.Transition"),
        (lambda: make(indicators={"late": lambda t, u, p: t - p.g}), "never involves the state.*at=phase"),
        (lambda: make(indicators={"flat": lambda t, u, p: abs(u.x)}), "indicator 'flat' contains `abs`"),
        (lambda: make(indicators={"two": lambda t, u, p: (u.x, u.v)}), "must return one number"),
        (lambda: make(states={"time": "s", "v": ""}), "'time' cannot name a state"),
        (lambda: make(parameters={"lambda": 1.0}), "'lambda' cannot name a parameter.*try lambda_"),
        (lambda: make(parameters={"x": 1.0}), "given to a state and to a parameter"),
        (lambda: make(parameters={"k s": 1.0}), "must be a Python identifier"),
        (lambda: make(parameters={"_k": 1.0}), "underscore"),
        (lambda: make(parameters={"m": (1.0, 2.0)}), "give a number"),
        (lambda: make(parameters=["m"]), "must be a mapping"),
        (lambda: make(states={}), "at least one state"),
        (lambda: make(states={"x": 1, "v": ""}), "unit of 'x'"),
        (lambda: make(modes={}), "at least one mode"),
        (lambda: make(modes={"free": 3}), "needs a function"),
        (lambda: make(modes={"free": Mode(free, states=["x", "w"])}), "mode 'free': `w` is not a state"),
        (lambda: make(modes={"free": Mode(free, states=["x"]), "contact": stopped}), "mode 'free'"),
        (lambda: make(scale={"y": 1.0}), "`y` is not a state"),
        (lambda: make(scale={"x": -1.0}), "must be positive"),
        (lambda: make(outputs={"force": 3}), "output 'force' must be a function"),
        (lambda: make(outputs={"force": ({"free": overlap}, "N")}), "not given in mode 'contact'"),
        (lambda: make(outputs={"force": ({"fre": overlap}, "N")}), "`fre` is not a mode"),
        (lambda: make(period=-1.0), "must be positive"),
        (lambda: make(period=2.0), "does not repeat after the period"),
        (lambda: make(period=lambda p: 4.1 * np.pi / p.omega), "does not repeat after the period"),
        (lambda: make(bands={"nothing": Band(free)}), "`nothing` is not an indicator"),
        (lambda: make(bands={"back": free}), "the band of 'back' must be an ns.Band"),
        (lambda: make(name=""), "`name`"),
        (lambda: make(symmetry=(lambda u: (-u.x, -u.v), 0.25)), "`symmetry` does not take mode 'free'"),
        (lambda: make(transitions=[Surface("overlap", below="free", above="free")]), "must be two modes"),
        (lambda: make(transitions=[Surface("over", below="free", above="contact")]), "`over` is not an indicator"),
    ],
)
def test_what_does_not_fit_together_is_refused(build, sentence):
    with pytest.raises(SystemDefinitionError, match=f"(?s){sentence}"):
        build()


def test_every_name_the_results_use_is_reserved():
    import nonsmooth as ns
    from nonsmooth.system.names import RESERVED

    rig = ns.models.discontinuous_support()
    own = {*rig.parameters, *(f"{output}_{end}" for output in rig.outputs for end in ("maximum", "minimum"))}
    over = {"parameter": "g", "values": [0.0017, 0.0018]}
    found = ns.lyapunov(rig, periods=40, **over), ns.sweep(rig, **over, transient=5, keep=2)
    for result in found:
        assert {*map(str, result.variables), *map(str, result.sizes)} - own <= RESERVED
    assert {"time", "touch", "u", "t", "p"} <= RESERVED


def stick_slip():
    """Problem C of the literature: a slider that sticks (two states) or slips (three)."""

    def force(t, y2, y3, p):
        return p.V**2 * np.sin(p.omega * t) ** 2 / (1 - y2) ** 2 - p.c * y3 - y2

    return System(
        name="stick-slip with impact",
        states=["y1", "y2", "y3"],
        parameters={"V": 0.59, "c": 0.04, "omega": 0.92, "e": 0.8, "n": 3.17},
        modes={
            "stick": Mode(lambda t, u, p: (u.y3, force(t, *u, p)), states=["y2", "y3"]),
            "slip": lambda t, u, p: (-p.n - force(t, u.y2, u.y3, p) / 5, u.y3, p.n + 6 * force(t, u.y2, u.y3, p) / 5),
        },
        indicators={"wall": lambda t, u, p: u.y2 - 0.5, "slider": lambda t, u, p: u.y1},
        transitions=[
            Transition(
                "stick", "slip", when="wall > 0", reset=lambda t, u, p: ((1 + p.e) / 6 * u.y3, u.y2, -p.e * u.y3)
            ),
            Transition("slip", "stick", when="slider < 0"),
        ],
    )


def test_modes_with_fewer_states():
    system = stick_slip()
    traced = system.traced
    assert traced.lacking == ((True, False, False), (False, False, False))
    assert traced.fields[0][0] == 0
    assert system.period() == pytest.approx(2 * np.pi / 0.92)
    with pytest.raises(SystemDefinitionError, match=r"has states that mode 'one' lacks \(b\); give a `reset`"):
        System(
            states=["a", "b"],
            parameters={},
            modes={"one": Mode(lambda t, u, p: -u.a, states=["a"]), "two": lambda t, u, p: (u.b, u.a)},
            indicators={"level": lambda t, u, p: u.a},
            transitions=[Transition("one", "two", when="level > 0")],
        )
    with pytest.raises(SystemDefinitionError, match="involves the state 'y1', which mode 'stick' does not have"):
        System(
            states=["y1", "y2"],
            parameters={},
            modes={"stick": Mode(lambda t, u, p: -u.y2, states=["y2"]), "slip": lambda t, u, p: (u.y2, u.y1)},
            indicators={"slider": lambda t, u, p: u.y1},
            transitions=[Transition("stick", "slip", when="slider > 0", reset=lambda t, u, p: (0, u.y2))],
        )


def test_memory_is_declared_written_and_read():
    system = System(
        states={"x": "m", "v": "m/s"},
        parameters={"k": 1.0},
        memory={"v_in": (0.25, "m/s"), "n": ""},
        modes={"only": lambda t, u, p: (u.v, -p.k * u.x - p.v_in)},
        indicators={"level": lambda t, u, p: u.x},
        transitions=[
            Transition(
                "only", "only", when="level > 0", write={"v_in": lambda t, u, p: u.v, "n": lambda t, u, p: p.n + 1}
            )
        ],
    )
    assert dict(system.memory) == {"v_in": "m/s", "n": ""}
    assert system.memory_vector().tolist() == [0.25, 0.0]
    traced = system.traced
    assert traced.transitions[0].writes == ((0, traced.u[1]), (1, traced.m[1] + 1))
    assert not traced.transitions[0].contact or traced.transitions[0].source == 0


def test_surfaces_are_kept_for_sliding():
    system = System(
        states=["x", "v"],
        parameters={"F": 1.0, "v_b": 0.2},
        modes={"slip_left": lambda t, u, p: (u.v, p.F - u.x), "slip_right": lambda t, u, p: (u.v, -p.F - u.x)},
        indicators={"slip": lambda t, u, p: u.v - p.v_b},
        transitions=[Surface("slip", below="slip_left", above="slip_right")],
    )
    (surface,) = system.surfaces
    assert (surface.indicator, surface.below, surface.above) == (0, 0, 1)
    assert [jump.label for jump in system.declared.transitions] == [
        "slip_left -> slip_right",
        "slip_right -> slip_left",
    ]
    assert [jump.contact for jump in system.declared.transitions] == [True, False]  # the first leaves the first mode
    assert system.modes == ("slip_left", "slip_right", "slip_sliding")
    assert "crossed or slid on" in repr(system)
    assert system.smoothed(1e-3).surfaces == ()


def test_a_symmetry_may_exchange_modes():
    def wall(side):
        return lambda t, u, p: (u.v, p.A * np.cos(p.w * t) - u.x - p.K * (u.x - side * p.d))

    system = System(
        states=["x", "v"],
        parameters={"A": 1.0, "w": 1.1, "K": 10.0, "d": 0.5},
        modes={"free": lambda t, u, p: (u.v, p.A * np.cos(p.w * t) - u.x), "left": wall(-1), "right": wall(1)},
        indicators={"right_of": lambda t, u, p: u.x - p.d, "left_of": lambda t, u, p: -u.x - p.d},
        transitions=[
            Transition("free", "right", when="right_of > 0"),
            Transition("right", "free", when="right_of < 0"),
            Transition("free", "left", when="left_of > 0"),
            Transition("left", "free", when="left_of < 0"),
        ],
        symmetry=(lambda u: (-u.x, -u.v), 0.5, {"left": "right", "right": "left"}),
    )
    assert system.symmetry.modes == (0, 2, 1)
    assert system.symmetry.shift == 0.5


def test_latex_shows_what_transitions_write_and_no_state_that_is_gone():
    """Memory is set as states are; a mode of fewer states has no value of the others."""
    system = System(
        states=["x", "v"],
        parameters={"e": 0.8},
        memory={"hit": 0.5},
        modes={"free": lambda t, u, p: (u.v, -u.x + p.hit), "held": Mode(lambda t, u, p: (0.0,), states=["x"])},
        indicators={"wall": lambda t, u, p: u.x - 1, "slow": lambda t, u, p: u.v - 0.1},
        transitions=[
            Transition(
                "free",
                "free",
                when="wall > 0",
                write={"hit": lambda t, u, p: 2 * u.v},
                reset=lambda t, u, p: (u.x, -p.e * u.v),
            ),
            Transition("free", "held", when="slow < 0", reset=lambda t, u, p: (u.x,)),
        ],
    )
    lines = system.to_latex().splitlines()
    assert any(line.endswith(r"v^+ = - e v,\quad \mathrm{hit}^+ = 2 v \\") for line in lines)
    assert lines[-2].endswith(r"h_{\text{slow}} < 0")


def test_repr_and_latex_show_the_equations():
    system = discontinuous_support()
    text = repr(system)
    for part in (
        "k_s = 1210 N/m",
        "x [m]",
        "mode contact",
        "penetration > 0 and separation < 0",
        "2*pi/omega = 1.70276025",
    ):
        assert part in text
    assert "eta = 1e-05" in repr(system.smoothed(1e-5))
    assert r"\rho \cos" in system.to_latex()
    assert system._repr_latex_().startswith(r"\begin{align*}")


@pytest.mark.parametrize("when", ["gap >= 0 and gap > 0", "gap > 0 and gap >= 0"])
def test_a_strict_sign_beside_the_same_one_that_is_not_is_strict(when):
    assert read_condition(when, ["gap"], "") == (("gap", 1, True),)
