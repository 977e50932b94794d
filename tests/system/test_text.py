"""Text and back: nothing lost, nothing executed, the same in every process."""

import json
import subprocess
import sys

import numpy as np
import pytest
import sympy as sp

from nonsmooth import mechanical, models
from nonsmooth.elements import Backlash, Coulomb, ElasticStop, PreloadedSpring, Stop
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.symbolic.expressions import read_expression, write_expression
from nonsmooth.system.symbolic.scalar import where
from nonsmooth.system.system import System
from nonsmooth.system.transition import Mode, Surface, Transition


def everything():
    """A system that uses every part of a description at once."""
    return System(
        name="everything (µ)",
        states={"x": "m", "v": "m/s", "w": ""},
        parameters={"a": (0.1, "N"), "b": 1 / 3, "omega": (2.0, "rad/s", r"\Omega")},
        memory={"kept": (0.25, "m")},
        modes={
            "one": lambda t, u, p: (u.v, -u.x / (2 * p.b) + p.a * np.cos(p.omega * t) ** 2, -u.w * np.exp(-u.x)),
            "two": lambda t, u, p: (u.v, -2 * (u.x + u.v) / p.b + p.kept, where(p.a > 0.05, p.a, -p.a) * u.w),
            "held": Mode(lambda t, u, p: (1e-17 * u.v + 0.1, np.arctan2(u.x, 2 + u.v**2)), states=["x", "v"]),
        },
        indicators={"level": lambda t, u, p: u.x - 0.3 * np.sqrt(1 + u.v**2), "speed": lambda t, u, p: u.v - p.b},
        transitions=[
            Surface("speed", below="one", above="two"),
            Transition("one", "held", when="level > 0 and speed < 0"),
            Transition(
                "held",
                "two",
                at=0.25,
                reset=lambda t, u, p: (u.x, -p.b * u.v, p.kept),
                write={"kept": lambda t, u, p: u.x},
            ),
        ],
        outputs={
            "power": (lambda t, u, p: abs(u.v) * np.maximum(u.x, p.a), "W"),
            "side": {"one": lambda t, u, p: u.w, "two": lambda t, u, p: -u.w, "held": lambda t, u, p: 0},
        },
        scale={"x": 1e-3},
        period=lambda p: 4 * np.pi / p.omega,
    )


SYSTEMS = {name: getattr(models, name) for name in models.names()} | {
    "smoothed": lambda: models.discontinuous_support(c_s=0.1 + 0.2).smoothed(1e-5),
    "two widths": lambda: models.discontinuous_support().smoothed({"penetration": 1e-5, "separation": 3e-6}),
    "everything": everything,
}


@pytest.mark.parametrize("make", SYSTEMS.values(), ids=SYSTEMS.keys())
def test_text_and_back_is_the_same_system(make):
    system = make()
    again = System.from_text(system.to_text())
    assert again.to_text() == system.to_text()
    assert again.written_out().traced == system.written_out().traced
    assert again.values == system.values
    assert again.surfaces == system.surfaces
    assert again == system


def pushed(elements, **options):
    """One driven mass with elements."""
    return mechanical(
        [["m"]],
        0.05,
        1.0,
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
        parameters={"m": (2.0, "kg"), "F": 0.5, "w": 0.8, "mu": 0.2, "e": 0.6},
        elements=elements,
        **options,
    )


ALONE = {
    "stop": Stop(at="q", position=1.0, restitution="e"),
    "friction": Coulomb(at="q", friction=lambda v, p: p.mu / (1 + v), static=0.3, belt="F"),
    "spring": PreloadedSpring(at="q", preload="mu", stiffness=lambda t, u, p: 2 * p.mu),
    "play": Backlash(at="q", half_width=2.0, stiffness=3.0, damping="mu"),
    "support": ElasticStop(at="q", position="mu", stiffness=9.0, damping=0.1, pulls=np.True_, side=np.int64(-1)),
}
POWER = {"outputs": {"power": (lambda t, u, p: u.v_q * p.F, "W")}}
MIRRORED = {
    "play": {"e_above": "e_below", "e_below": "e_above"},
    "spring": {"e_above": "e_below", "e_below": "e_above"},
}
BESIDE = [(name, beside) for name in ALONE for beside in ({}, POWER)]
BESIDE += [(name, {"symmetry": (lambda u: -u, 0.5, swapped)}) for name, swapped in MIRRORED.items()]


@pytest.mark.parametrize(("name", "beside"), BESIDE, ids=[f"{name} {' '.join(beside)}" for name, beside in BESIDE])
def test_a_system_with_one_element_is_written_as_it_was_given(name, beside):
    """One rule for all elements, those that decide alone too: the modes without them, and the elements."""
    system = pushed({"e": ALONE[name]}, **beside)
    content = json.loads(system.to_text())
    assert list(content["modes"]) == ["all"] and list(content["elements"]) == ["e"]
    again = System.from_text(system.to_text())
    assert again.traced == system.traced and again == system and str(again) == str(system)
    assert again.outputs == system.outputs and again.symmetry == system.symmetry


def test_a_system_is_read_at_values_at_which_it_could_not_be_defined():
    """A fit may come to a friction beside zero; a mass below it is refused in a text too."""
    system = pushed({"rub": Coulomb(at="q", friction="mu")}).with_parameters(mu=-1e-9)
    assert System.from_text(system.to_text()) == system
    with pytest.raises(SystemDefinitionError, match="friction of element 'rub' must not be negative"):
        pushed({"rub": Coulomb(at="q", friction=-1e-9)})
    for elements in ({}, {"rub": ALONE["friction"]}, {"rub": ALONE["friction"], "stop": ALONE["stop"]}):
        with pytest.raises(SystemDefinitionError, match="the mass of coordinate 'q' must be positive"):
            System.from_text(pushed(elements).to_text()).with_parameters(m=-1.0)


def test_the_hash_of_the_equations_does_not_see_values():
    system = models.discontinuous_support()
    other = system.with_parameters(g=np.nextafter(system.values["g"], 1))
    assert system.content_hash() == other.content_hash()
    assert system.content_hash(values=True) != other.content_hash(values=True)
    assert system.smoothed(1e-5).content_hash() == system.smoothed(2e-5).content_hash() != system.content_hash()


def test_copies_are_written_with_their_own_values():
    """Parts that copies share are put together once; numbers and widths of bands are those of the copy."""
    etas = ({}, {"eta": 1e-5}, {"eta": 2e-5}, {"eta": {"penetration": 1e-5, "separation": 3e-5}})
    for eta in (*etas, *etas):
        for given in ({"rho": 0.1 + 0.2, "g": -0.0}, {"rho": 1e300}, {}):
            system = models.discontinuous_support().with_parameters(given)
            system = system.smoothed(eta["eta"]) if eta else system
            content = json.loads(system.to_text())
            assert {key: part["value"] for key, part in content["parameters"].items()} == {
                key: value for key, value in system.values.items() if not key.startswith("eta")
            }
            assert content.get("smoothing", {}) == eta
            assert json.dumps(content, indent=1, ensure_ascii=False) == system.to_text()
            assert System.from_text(system.to_text()) == system


def test_the_text_is_the_same_in_another_process():
    code = (
        "from nonsmooth import models; print(models.discontinuous_support().smoothed(1e-5).content_hash(values=True))"
    )
    environment = {"PYTHONHASHSEED": "1", "PYTHONPATH": ":".join(sys.path)}
    other = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert other.stdout.strip() == models.discontinuous_support().smoothed(1e-5).content_hash(values=True)


def random_expression(random, symbols, depth):
    if depth == 0:
        choice = random.integers(4)
        number = sp.Rational(int(random.integers(-6, 7)), int(random.integers(1, 4)))
        return (*random.permutation(np.array(symbols, dtype=object)), number, sp.Float(random.normal()))[choice + 1]
    a, b = (random_expression(random, symbols, depth - 1) for _ in range(2))
    kind = random.integers(8)
    if kind < 5:
        return [a + b, a - b, a * b, a / (2 + b**2), -(a**3) * b][kind]
    return [sp.sin(a), sp.sqrt(1 + a**2) + b, sp.exp(-(a**2)) / (1 + b**2) ** sp.Rational(3, 2)][kind - 5]


@pytest.mark.parametrize("many", [50, pytest.param(150, marks=pytest.mark.slow)])
def test_random_expressions_survive(many):
    symbols = sp.symbols("u_x u_v p_k t_", real=True)
    names = dict(zip(symbols, ("u.x", "u.v", "p.k", "t"), strict=True))
    table = {name: symbol for symbol, name in names.items()}
    random = np.random.default_rng(8)
    for _ in range(many):
        expression = random_expression(random, symbols, 3)
        text = write_expression(expression, names)
        again = read_expression(text, table)
        assert write_expression(again, names) == text
        assert again == expression, text


def test_floats_survive_to_the_last_bit():
    for value in np.random.default_rng(9).uniform(-1, 1, 300) * 10.0 ** np.random.default_rng(9).integers(
        -300, 300, 300
    ):
        assert float(read_expression(write_expression(sp.Float(value), {}), {})) == value


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "().__class__",
        "u.x.real",
        "[1]",
        "lambda: 1",
        "print(1)",
        "p.unknown",
        "x",
        "'a'",
        "1 if u.x else 2",
        "(1, 2)",
        "sin(*[1])",
        "9**9**9**9",
        "10.0**1e9",
        "sin()",
        "1e999",
        "u.x +",
        "f'{1}'",
        "1j",
        "u[0]",
        "",
        "(" * 500 + "1" + ")" * 500,
        "where(1, 2)",
        "nan",
    ],
)
def test_only_the_white_list_is_read(text):
    with pytest.raises(ValueError, match=r"expression"):
        read_expression(text, {"u.x": sp.Symbol("u_x", real=True)})


#: Texts that ask for more than can be worked out, and what is said of each.
HOSTILE = {
    "((9**9999)**9999)*u.x": "9 to the power 9999 is not accepted",
    "floor(exp(exp(exp(3))))": "exp of a number as large as exp(exp(3)) is not accepted",
    "floor(exp(1e300*((2**53 + 1) - 2**53)))": "is not accepted",  # 0 in floating point, 1e300 in fact
    "(1 + 1/2**1000)**(2**1000)": "is not accepted",  # 1 in floating point
    "pi**pi**pi**pi": "is not accepted",
    "9" * 4000: "more digits than a float can have",
    "where(" + " and ".join(f"u.x > {i}" for i in range(3000)) + ", 1, 2)": "joins 3000 parts at once; at most 40",
    "where(" + "(" * 150 + "u.x > 1" + " and u.x < 9)" * 150 + ", 1, 2)": "nested at most 60 deep",
    "max(" + ", ".join(f"{i}*u.x" for i in range(500)) + ")": "joins 500 parts at once",
    "cos((u.x + t + 1 + sin(t))**99)": "terms when it is multiplied out; at most 5000",
    "u.x**9999": "u_x to the power 9999 is not accepted",
    "+".join(f"sin({i}*u.x)" for i in range(20000)): "characters is too long",
    "sin(" * 90 + "u.x" + ")" * 90: "nested at most 60 deep",
}


def test_what_takes_for_ever_is_refused_before_it_is_worked_out():
    """In a process of its own: a power that is worked out cannot be interrupted."""
    code = (
        "import json, sys, sympy\n"
        "from nonsmooth.system.symbolic.expressions import read_expression\n"
        "symbols = {'u.x': sympy.Symbol('u_x', real=True), 't': sympy.Symbol('t_', real=True)}\n"
        "for text in json.load(sys.stdin):\n"
        "    try:\n        print(read_expression(text, symbols))\n"
        "    except ValueError as error:\n        print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], input=json.dumps(list(HOSTILE)), capture_output=True, text=True, timeout=600
    )
    said = done.stdout.splitlines()
    assert not done.stderr and len(said) == len(HOSTILE)
    for sentence, expected in zip(said, HOSTILE.values(), strict=True):
        assert expected in sentence and len(sentence) < 700


@pytest.mark.parametrize(("given", "read"), [("\u00b5", "\u03bc"), ("\ufb01", "fi"), ("e\u0301", "\u00e9")])
def test_a_name_is_what_python_reads(given, read):
    """The micro sign of a keyboard is another character than the Greek letter that ``p.µ`` asks for in code."""
    with pytest.raises(SystemDefinitionError, match=f"in code Python reads the name as '{read}'.*Name it '{read}'"):
        System(states=["x"], parameters={given: 1.0}, modes={"m": lambda t, u, p: -u.x * getattr(p, given)})
    system = System(states=["x"], parameters={read: 1.0}, modes={"m": lambda t, u, p: -u.x * getattr(p, read)})
    assert System.from_text(system.to_text()) == system


def test_a_number_too_large_arises_in_a_product():
    with pytest.raises(SystemDefinitionError, match="component 'v', holds a number beyond"):
        System.from_text(damaged(lambda d: d["modes"]["free"].update(v="(9999*u.x*p.m)**99")))


def test_what_is_said_of_a_text_is_short():
    vast = [1] * 10**5, "a" * 10**6
    for change in (lambda d: d["states"].update(x=vast[0]), lambda d: d["transitions"][0].update(target=vast[1])):
        with pytest.raises(SystemDefinitionError) as raised:
            System.from_text(damaged(change))
        assert len(str(raised.value)) < 1500


def damaged(change):
    content = json.loads(models.discontinuous_support().to_text())
    change(content)
    return json.dumps(content)


def test_a_text_of_version_1_without_elements_is_read():
    assert System.from_text(damaged(lambda d: d.update(version=1))) == models.discontinuous_support()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "JSON expected"),
        ("[]", '"format"'),
        ("{}", '"format"'),
        (damaged(lambda d: d.update(version=99)), "version 99"),
        (
            damaged(lambda d: d.update(version=1, elements={})),
            "version 1; .* reads 2, and 1 of systems without elements",
        ),
        (damaged(lambda d: d.pop("modes")), "'modes' is missing"),
        (damaged(lambda d: d["indicators"].update(penetration="__import__('os')")), "not allowed"),
        (damaged(lambda d: d["transitions"][0].update(target="nowhere")), "`nowhere` is not a mode"),
        (damaged(lambda d: d["parameters"]["m"].update(value=0)), "m = 0"),
        (damaged(lambda d: d["parameters"]["m"].update(value="0.1")), "must be a real number"),
        (damaged(lambda d: d.update(modes=3)), "damaged"),
        (damaged(lambda d: d["modes"]["free"].update(v="abs(u.x)")), "`abs` of the state"),
        (damaged(lambda d: d.update(smoothing={"eta": -1})), "positive"),
        (models.discontinuous_support().to_text().replace("0.838", "NaN"), "not a finite number"),
    ],
)
def test_damaged_text_is_refused(text, sentence):
    with pytest.raises(SystemDefinitionError, match=sentence):
        System.from_text(text)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("not u.x", "a number is wanted"),
        ("u.x > 0", "a number is wanted"),
        ("True", "a number is wanted"),
        ("u.x > 0 and u.v > 0", "a number is wanted"),
        ("where(u.x > 0, not u.x, 1)", "a number is wanted"),
        ("where(u.x > 0 and not u.v, 2, 1)", "a condition such as u.x > 0 is wanted"),
    ],
)
@pytest.mark.parametrize(
    "place",
    [
        lambda d, text: d["modes"]["free"].update(v=text),
        lambda d, text: d["indicators"].update(penetration=text),
        lambda d, text: d.update(period=text),
    ],
)
def test_a_condition_is_no_number(place, text, sentence):
    """True and false are neither a field nor an indicator nor a period, and a state is no condition."""
    with pytest.raises(SystemDefinitionError, match=sentence):
        System.from_text(damaged(lambda d: place(d, text)))


def test_a_condition_within_where_is_read():
    text = "where((p.k > 1 and p.c > 1) or not p.g < 1, 2*p.m, sin(p.m))"
    found = System.from_text(damaged(lambda d: d["modes"]["free"].update(v=text)))
    parameters = dict(zip(found.parameters, found.traced.p, strict=True))
    value = found.traced.fields[0][1].subs(parameters["m"], 0.5)
    for k, c, g, expected in ((2, 2, 0, 1.0), (2, 0, 0, np.sin(0.5)), (0, 0, 1, 1.0)):
        numbers = {parameters["k"]: k, parameters["c"]: c, parameters["g"]: g}
        assert float(value.subs(numbers)) == pytest.approx(expected)


@pytest.mark.parametrize("mode", [None, "stuck"])
def test_a_surface_beside_an_element_is_read_back(mode):
    """Sliding beside each state of the element is a mode of its own, called after both."""
    system = System(
        states=["x", "v", "y"],
        parameters={"mu": 0.3},
        modes={
            "low": lambda t, u, p: (u.v, np.cos(t) - u.x, 1.0),
            "high": lambda t, u, p: (u.v, np.cos(t) - u.x, -1.0),
        },
        indicators={"h": lambda t, u, p: u.y - 0.2},
        transitions=[Surface("h", "low", "high", mode=mode)],
        elements={"rub": Coulomb(speed=lambda t, u, p: u.v, on={"v": 1.0}, friction="mu")},
    )
    again = System.from_text(system.to_text())
    assert again == system and again.modes == system.modes
    assert again.modes[6:] == tuple(f"{mode or 'h_sliding'}_rub_{one}" for one in ("stick", "forward", "back"))
