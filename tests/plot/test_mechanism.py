"""Sketches: what is read off a system by hand, and what is drawn of it."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.plot.mechanism import Sketch
from nonsmooth.plot.pen import GROUND, Pen, put
from nonsmooth.plot.scheme import scheme_of

E = ns.elements


@pytest.fixture
def chain():
    """Three masses: ground k1 m1 k2 m2 k3 m3, a damper c beside each spring, contacts and friction."""
    return ns.mechanical(
        lambda p: [[p.m1, 0, 0], [0, p.m2, 0], [0, 0, p.m3]],
        lambda p: [[2 * p.c, -p.c, 0], [-p.c, 2 * p.c, -p.c], [0, -p.c, p.c]],
        lambda p: [[p.k1 + p.k2, -p.k2, 0], [-p.k2, p.k2 + p.k3, -p.k3], [0, -p.k3, p.k3]],
        parameters={
            "m1": 1.0,
            "m2": 1.0,
            "m3": 0.5,
            "c": 0.1,
            "k1": 1.0,
            "k2": 1.0,
            "k3": 2.0,
            "F": 1.0,
            "w": 1.0,
            "g": 0.4,
            "mu": 0.2,
            "v_b": 0.1,
            "k_s": 20.0,
            "b": 0.2,
        },
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        elements={
            "stop": E.Stop(at="q3", position="g", restitution=0.7),
            "bump": E.Stop(at={"q2": 1, "q1": -1}, position=-0.5, side=-1),
            "tie": E.Stop(at={"q2": 1, "q1": -1}, position=0.7),
            "rub": E.Coulomb(at="q1", friction="mu"),
            "belt": E.Coulomb(at="q2", friction="mu", belt="v_b"),
            "snub": E.ElasticStop(at="q2", position=-0.3, side=-1, stiffness="k_s", damping=0.1),
            "play": E.Backlash(at={"q3": 1, "q2": -1}, half_width="b", stiffness="k_s"),
        },
    )


def test_what_stands_between_two_masses_or_at_a_wall_is_drawn_there(chain) -> None:
    """Zone i lies on the left of mass i, the last one on the right of the last mass."""
    zones = Sketch(scheme_of(chain)).zones
    drawn = [sorted(link.kind for link in zone) for zone in zones]
    assert drawn[0] == ["damper", "spring"] and drawn[3] == ["stop"]  # q3 strikes on its right
    assert drawn[1] == [
        "damper",
        "elastic",
        "spring",
        "stop",
        "stop",
    ]  # q2 has a buffer on its left, bump and tie to q1
    assert drawn[2] == ["backlash", "damper", "spring"]


def test_a_chain_is_read_as_it_was_built(chain) -> None:
    scheme = scheme_of(chain)
    assert scheme.pairs == [("q1", "v_q1"), ("q2", "v_q2"), ("q3", "v_q3")]
    assert scheme.masses == ["m_{1}", "m_{2}", "m_{3}"]
    joined = {(one.kind, one.left, one.right, one.label) for one in scheme.links if one.kind in ("spring", "damper")}
    assert joined == {
        ("spring", GROUND, 0, "k_{1}"),
        ("spring", 0, 1, "k_{2}"),
        ("spring", 1, 2, "k_{3}"),
        ("damper", GROUND, 0, "c"),
        ("damper", 0, 1, "c"),
        ("damper", 1, 2, "c"),
    }
    contacts = {(one.kind, one.left, one.right, one.gap, one.pulls) for one in scheme.links if one.gap}
    assert contacts == {
        ("stop", 2, GROUND, 0.4, False),  # on the right of the last mass
        ("stop", 0, 1, 0.5, False),  # closes when the masses come together
        ("stop", 0, 1, 0.7, True),  # when they part
        ("elastic", GROUND, 1, 0.3, False),  # on the left
    }
    rubs = {(one.left, one.right, one.label, one.words) for one in scheme.links if one.kind == "friction"}
    assert rubs == {(GROUND, 0, r"\mu", ""), (GROUND, 1, r"\mu", "v_{b}")}
    (play,) = [one for one in scheme.links if one.kind == "backlash"]
    assert (play.left, play.right, play.label, play.words, play.half) == (1, 2, "k_{s}", "b", 0.2)
    assert scheme.forces == {0: r"F\,\cos{\left(w\,t \right)}"}


def test_masses_of_numbers_and_springs_beyond_the_next_mass() -> None:
    K = [[2.0, -0.5, -1.0], [-0.5, 1.5, -1.0], [-1.0, -1.0, 2.0]]
    scheme = scheme_of(ns.mechanical(np.diag([2.0, 4.0, 0.5]), np.diag([0.2, 0.4, 0.1]), K, parameters={}))
    assert scheme.masses == ["2", "4", "0.5"]
    springs = {(one.left, one.right): one.label for one in scheme.links if one.kind == "spring"}
    assert springs == {(GROUND, 0): "0.5", (0, 1): "0.5", (0, 2): "1", (1, 2): "1"}
    assert len(Sketch(scheme).above) == 1  # the spring from the first to the last


@pytest.mark.parametrize("seed", range(12))
def test_what_rounding_leaves_of_a_free_chain_is_no_spring_and_no_mass_beside_the_diagonal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m, k, c = rng.uniform(0.3, 2, 3).round(2), rng.uniform(0.3, 2, 3).round(2), rng.choice([0.05, 0.07, 0.013])
    K = np.diag(k) + np.diag([*k[1:], 0.0]) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    scheme = scheme_of(ns.mechanical(np.diag(m), c * K, K, parameters={}))
    assert scheme.masses == [f"{one:.4g}" for one in m]
    for kind, values in (("spring", k), ("damper", c * k)):
        found = {(one.left, one.right): one.label for one in scheme.links if one.kind == kind}
        assert found == {place: f"{one:.4g}" for place, one in zip([(GROUND, 0), (0, 1), (1, 2)], values, strict=True)}


@pytest.mark.parametrize(
    ("name", "mass", "contacts"),
    [
        ("discontinuous_support", "m", {("elastic", 0, GROUND, "k_{s}")}),
        ("impact_oscillator", "1", {("stop", 0, GROUND, "e")}),
        ("double_impact_oscillator", "1", {("stop", 0, GROUND, "e"), ("stop", GROUND, 0, "e")}),
        ("impact_damper", "1", {("stop", 0, 1, "e")}),
        ("bilinear_oscillator", "1", {("backlash", GROUND, 0, r"\beta")}),
        ("gear_pair", "1", {("backlash", GROUND, 0, "1")}),
        ("dry_friction_oscillator", "1", {("friction", GROUND, 0, "")}),
        ("stick_slip_belt", "1", {("friction", GROUND, 0, "")}),
        ("impact_friction_oscillator", "1", {("stop", 0, GROUND, "e"), ("friction", GROUND, 0, "f")}),
    ],
)
def test_models_of_the_literature(name: str, mass: str, contacts: set) -> None:
    scheme = scheme_of(getattr(ns.models, name)())
    assert scheme.masses[0] == mass
    found = {(one.kind, one.left, one.right, one.label) for one in scheme.links if one.kind not in ("spring", "damper")}
    assert found == contacts


def test_a_belt_keeps_the_damper_apart_from_the_slope_of_its_friction() -> None:
    (damper,) = [one for one in scheme_of(ns.models.stick_slip_belt()).links if one.kind == "damper"]
    assert damper.label == "c"


def drawn_texts(ax) -> set[str]:
    return {text.get_text() for text in ax.texts}


def test_the_parts_and_their_labels_are_drawn(chain) -> None:
    ax = ns.plot.mechanism(chain)
    assert {"$m_{1}$", "$k_{2}$", "$c$", "$g$", "$0.5$", "$v_{b}$", "$q_{3}$", r"$\pm b$"} <= drawn_texts(ax)
    assert drawn_texts(ns.plot.mechanism(chain, labels=False)) <= {""}
    _, own = plt.subplots()
    assert ns.plot.mechanism(ns.models.impact_oscillator(), own) is own
    low, high = own.get_xlim()
    for line in own.lines:  # everything lies within the picture
        x = np.asarray(line.get_xdata(), dtype=float)
        assert low <= np.nanmin(x) <= np.nanmax(x) <= high


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("name", ["bilinear_oscillator", "impact_damper", "impact_oscillator", "stick_slip_belt"])
def test_a_sketch_fills_its_paper(name: str, moving: bool) -> None:
    """Over a base that moves, over a belt, beside walls: no side is further from its parts than a label is high."""
    sketch = Sketch(scheme_of(getattr(ns.models, name)()), moving)
    x, y = (np.concatenate([np.ravel(part[k]) for part in sketch.parts()]) for k in (1, 2))
    assert 0 < np.nanmin(y) - sketch.bottom < 0.3 and 0 < sketch.top - np.nanmax(y) < 0.3
    assert abs(np.nanmin(x) - sketch.left) < 0.15 and abs(sketch.right - np.nanmax(x)) < 0.15


def test_a_belt_lies_on_both_rollers() -> None:
    pen = Pen(labels=False)
    pen.belt(0.0, 2.0, "")
    one, other, upper, lower = (np.array(part[1:3]) for part in pen.made[:4])
    for roller, middle in ((one, 0.0), (other, 2.0)):
        assert (roller[0].min() + roller[0].max()) / 2 == pytest.approx(middle)
        assert [roller[1].max(), roller[1].min()] == pytest.approx([0.0, lower[1, 0]])
    assert upper.tolist() == [[0.0, 2.0], [0.0, 0.0]]
    assert lower[1, 0] == lower[1, 1] < 0.0


def test_gaps_and_displacements_are_to_one_scale() -> None:
    """At contact the face of the mass is at the stop: x = d on the paper too."""
    sketch = Sketch(scheme_of(ns.models.impact_oscillator(d=0.5)))
    scale = sketch.scale_for(np.array([[-0.8], [0.5]]))
    _, ax = plt.subplots()
    put(ax, sketch.parts([0.5 * scale], scale, labels=False))
    mass, *_, pad = (one.get_xy()[:, 0] for one in ax.patches if len(one.get_xy()) == 5)
    assert mass.max() == pytest.approx(pad.min(), abs=1e-12)
    for room in (0.0, 0.5):  # as large as the figure is made for it, and about its middle
        sketch.frame(ax, room)
        assert ax.get_xlim() == pytest.approx((sketch.left - 0.2 - room, sketch.left - 0.2 + sketch.width + room))
        assert np.diff(ax.get_ylim()) == pytest.approx([sketch.height])


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (lambda: ns.models.chua_circuit(), "has no mass to draw"),
        (lambda: ns.models.rubbing_rotor(), "follows a curve"),
        (lambda: ns.mechanical([[2.0, 1.0], [1.0, 2.0]], np.eye(2), np.eye(2), parameters={}), "not diagonal"),
        (
            lambda: ns.mechanical(
                [[2.0, 1.0], [1.0, 2.0]],
                np.zeros((2, 2)),
                np.eye(2),
                parameters={},
                forcing={"q1": lambda t, p: np.cos(t)},
            ),
            "not diagonal",
        ),
        (
            lambda: ns.mechanical(
                [[2.0, 1.0], [1.0, 2.0]],
                np.zeros((2, 2)),
                np.eye(2),
                parameters={},
                elements={"stop": E.Stop(at="q1", position=1.0)},
            ),
            "not diagonal",
        ),
        (
            lambda: ns.mechanical(
                np.eye(2),
                0.1 * np.eye(2),
                np.eye(2),
                coordinates=["x", "y"],
                parameters={},
                elements={"floor": E.Stop(at="y", side=-1, position=-1.0, friction=0.3, tangent="x")},
            ),
            "rubs along another coordinate",
        ),
    ],
)
def test_what_has_no_sketch_says_why(system, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ns.plot.mechanism(system())


def test_a_measured_input_is_a_force_and_no_mass() -> None:
    cart = ns.mechanical(2.0, 0.0, 8.0, forcing={"q": lambda t, p: p.force}, inputs={"force": "N"})
    scheme = scheme_of(cart)
    assert [name for name, _ in scheme.pairs] == ["q"]
    assert scheme.forces == {0: r"\mathrm{force}"}
    run = ns.simulate(cart, duration=3.0, inputs={"force": ns.Input([0, 1, 2], [4, 0, -4], between="steps")})
    with pytest.warns(UserWarning, match="interpolated by cubic splines"):  # the record does not hold the samples
        found = ns.table(run, ["q"], samples=[0.5])
    assert found["q"][0] == pytest.approx(0.5 * (1 - np.cos(1.0)), abs=1e-7)  # 4 N on 2 kg and 8 N/m


def test_laws_are_written_as_they_are_and_what_none_gives_by_its_value() -> None:
    elements = {
        "buffer": E.ElasticStop(at="q", position=0.5, stiffness=lambda t, u, p: 2 * p.k),
        "snub": E.ElasticStop(at="q", position=1.0, stiffness="k", damping=lambda t, u, p: p.k / 10),
        "rub": E.Coulomb(at="q", friction=lambda v, p: p.mu / (1 + v)),
        "wall": E.Stop(at="q", position=-1.0, side=-1),
    }
    parameters = {"k": 3.0, "mu": 0.2}
    system = ns.mechanical([[1.0]], [[0.1]], [[1.0]], parameters=parameters, elements=elements)
    found = {
        (one.kind, one.label, one.damped) for one in scheme_of(system).links if one.kind not in ("spring", "damper")
    }
    assert found == {
        ("elastic", r"2\,k", False),
        ("elastic", "k", True),
        ("friction", "f(v)", False),
        ("stop", "e = 0", False),
    }


def test_factors_are_apart_as_they_are_drawn() -> None:
    """Names of several letters do not run into each other: the width of a label is measured, not its text."""
    import matplotlib.pyplot as plt

    belt = E.Coulomb(at="q", friction=0.2, belt=lambda t, u, p: p.vb * np.cos(p.w * t))
    system = ns.mechanical(1, 0.1, 1, parameters={"vb": 0.3, "w": 1.2}, elements={"rub": belt})
    label = str(scheme_of(system).links[-1].words)
    name, space, rest = label.partition(r"\,")
    assert (name, space, rest[:4]) == (r"\mathrm{vb}", r"\,", r"\cos")
    figure = plt.figure()
    whole, alone = (
        figure.text(0, 0, f"${words}$").get_window_extent().width for words in (label, rf"\mathrm{{vb}}{rest}")
    )
    assert whole > alone + 1.0
    plt.close(figure)


def test_a_law_that_is_longer_than_its_gap_is_not_written() -> None:
    """The names of functions count as the reader sees them: one wave is written, two waves would cover the masses."""

    def gap(law):
        values = {"A": 0.1, "B": 0.05, "d": 0.4, "w": 1.0, "phi": 0.5}
        stop = E.ElasticStop(at="q", position=law, stiffness=2.0)
        links = scheme_of(ns.mechanical(1, 0.1, 1, parameters=values, elements={"stop": stop})).links
        return str(links[-1].words)

    assert gap(0.0) == ""
    assert r"\cos" in gap(lambda t, u, p: p.d + p.A * np.cos(p.w * t))
    assert gap(lambda t, u, p: p.d + p.A * np.cos(p.w * t + p.phi) + p.B * np.sin(2 * p.w * t - p.phi)) == ""
