"""The smoothed switch against Eqs. 6-10 of Savi et al. (2007), typed in here by hand."""

import functools

import numpy as np
import pytest
import sympy as sp

import nonsmooth as ns
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.models import discontinuous_support, impact_oscillator
from nonsmooth.system.system import System
from nonsmooth.system.transition import Surface, Transition

ETA = 1e-5
FREE, CONTACT, S_A, S_B = range(4)


def symbol(name):
    return sp.Symbol(name, real=True)


t, x, v = symbol("t_"), symbol("u_x"), symbol("u_v")
m, k, k_s, c, c_s, g, rho, omega = (symbol(f"p_{name}") for name in discontinuous_support().values)
eta = symbol("p_eta")
v_a = symbol("m_v_a")
COMMON = -2 * k / m * x + rho / m * sp.cos(omega * t)
EQ_7A = COMMON - c / m * v
EQ_7B = COMMON - k_s / m * (x - g) - (c + c_s) / m * v
EQ_8A = COMMON - (c + c_s) / m * v - k_s / (2 * m) * (x - g + eta) + c_s / m * v_a * (1 - (x - g + eta) / (2 * eta))
EQ_8B = COMMON - c / m * v - k_s / (2 * m) * (x - g + eta) - c_s / (2 * m) * v
H_A, H_B = x - g, -(x - g) - c_s / k_s * v


@pytest.fixture(scope="module")
def smoothed():
    return discontinuous_support().smoothed(ETA)


def test_fields_are_equations_7_and_8(smoothed):
    traced = smoothed.traced
    assert traced.mode_names == ("free", "contact", "penetration_band", "separation_band")
    for field, equation in zip(traced.fields, (EQ_7A, EQ_7B, EQ_8A, EQ_8B), strict=True):
        assert sp.simplify(field[0] - v) == 0
        assert sp.simplify(field[1] - equation) == 0


def borders():
    """(from, to, substitutions that put the state on the border): Eqs. 9 and 10."""
    on_a = {x: g - eta, v_a: v}  # entered here: v_a is the present velocity
    return [
        (FREE, S_A, on_a),
        (S_A, CONTACT, {x: g + eta}),
        (FREE, S_B, {x: g - c_s / k_s * v - eta}),  # h_b = eta
        (S_B, CONTACT, {x: g - c_s / k_s * v + eta}),  # h_b = -eta
        (S_B, S_A, {v: 0, v_a: 0}),
    ]


@pytest.mark.parametrize(("one", "two", "place"), borders())
def test_fields_are_continuous_at_the_borders(smoothed, one, two, place):
    fields = smoothed.traced.fields
    assert sp.simplify((fields[one][1] - fields[two][1]).subs(place)) == 0


def test_the_one_jump_is_that_of_entering_velocity(smoothed):
    fields, q = smoothed.traced.fields, (x - g + eta) / (2 * eta)
    jump = (fields[S_A][1] - fields[S_B][1]).subs(v, 0)
    assert sp.simplify(jump - c_s * v_a * (1 - q) / m) == 0


def region(h_a, h_b, width):
    """Eqs. 9 and 10, word for word."""
    found = []
    if h_a <= -width or h_b >= width:
        found.append(FREE)
    if h_a >= width and h_b <= -width:
        found.append(CONTACT)
    if -width < h_a < width and h_b <= -h_a:
        found.append(S_A)
    if h_a > -h_b and -width < h_b < width:
        found.append(S_B)
    assert len(found) == 1
    return found[0]


@functools.cache
def compiled(system):
    """The indicators and what each transition writes, as functions of (u, p)."""
    traced = system.traced
    writes = [sp.lambdify([traced.u, traced.p], [e for _, e in jump.writes]) for jump in traced.transitions]
    return sp.lambdify([traced.u, traced.p], traced.indicators, modules="math"), writes


def settle(system, u, memory, mode=0):
    """The start rule: transitions that hold are taken, in declared order, each mode entered at most once."""
    traced, values = system.traced, system.parameter_vector()
    function, writes = compiled(system)
    indicators = function(u, values)
    memory, entered = list(memory), set()
    while True:
        for i, jump in enumerate(traced.transitions):
            holds = all(
                row.sign * indicators[row.indicator] > 0 or (not row.strict and indicators[row.indicator] == 0)
                for row in jump.rows
            )
            if jump.source == mode and jump.target not in entered and holds:
                for (index, _), value in zip(jump.writes, writes[i](u, values), strict=True):
                    memory[index] = value
                mode = jump.target
                entered.add(mode)
                break
        else:
            return mode, memory


@pytest.mark.parametrize("damping", [0.6, 0.0])
def test_from_the_first_mode_every_point_finds_its_region(damping):
    system = discontinuous_support(c_s=damping).smoothed(ETA)
    values = dict(system.values)
    gap, ratio = values["g"], values["c_s"] / values["k_s"]
    random, seen = np.random.default_rng(2), set()
    for _ in range(400):
        speed = random.choice([1e-2, 1.0]) * random.uniform(-1, 1)
        place = gap + random.choice([2 * ETA, 1e-3]) * random.uniform(-1, 1) - random.choice([0, ratio * speed])
        h_a = place - gap
        expected = region(h_a, -h_a - ratio * speed, ETA)
        for carried in (0, 1):  # from the first mode, and in contact when the gap changes under the state
            mode, memory = settle(system, (place, speed), [np.nan], carried)
            assert mode == expected
            if mode == S_A:
                assert memory == [speed]
        seen.add(expected)
    assert seen == ({FREE, CONTACT, S_A, S_B} if damping else {FREE, CONTACT, S_A})


def test_eta_is_a_parameter_of_one_set_of_equations():
    system = discontinuous_support()
    one, two = system.smoothed(1e-5), system.smoothed(1e-6)
    assert one.traced is two.traced
    assert one.traced.parameter_names[-1] == "eta"
    assert one.parameter_vector()[-1] == one.eta == 1e-5
    assert one.with_parameters(eta=1e-6) == two
    assert one.smoothed(1e-6) == two
    assert one.smoothed(None) == system
    assert one.with_parameters(g=0.1).smoothed(1e-6).values["g"] == 0.1
    with pytest.raises(ValueError, match="must be positive"):
        system.smoothed(0.0)
    with pytest.raises(ValueError, match="must be positive"):
        one.with_parameters(eta=-1e-6)
    with pytest.raises(ValueError, match="must be positive"):
        one.parameter_points({"eta": [1e-5, -1e-5]})
    assert dict(one.memory) == {"v_a": "m/s"}


def test_a_width_for_each_indicator():
    system = discontinuous_support()
    both = system.smoothed({"penetration": 1e-5, "separation": 2e-5})
    assert both.eta == {"penetration": 1e-5, "separation": 2e-5}
    assert both.traced.parameter_names[-2:] == ("eta_penetration", "eta_separation")
    with pytest.raises(ValueError, match="no width for separation"):
        system.smoothed({"penetration": 1e-5})
    with pytest.raises(ValueError, match="`gap` is not a smoothed indicator"):
        system.smoothed({"gap": 1e-5})


def test_of_unequal_bands_the_least_margin_counts_in_its_own_width():
    """Entering over 1e-5 in the penetration against 4e-5 in the separation: the least of g_r / eta_r tells the band.

    At g_a = 2e-5 and g_b = 6e-5 the ratios are 2 and 1.5: the second is the least, though its margin is the larger one.
    """
    smooth = general().smoothed({"penetration": 1e-5, "separation": 4e-5})
    traced = smooth.traced
    (least,) = [i for i, name in enumerate(traced.indicator_names) if "*" in name]
    point = {x: g + 2e-5, v: k_s / c_s * 4e-5}  # penetration 2e-5, separation -6e-5
    values = dict(zip(traced.p, smooth.parameter_vector(), strict=True))
    number = float(traced.indicators[least].subs(point).subs(values))
    assert number == pytest.approx(2e-5 - 6e-5 / 4, abs=1e-15)  # > 0: the first is not the least


def general():
    """The paper's system without its own bands, so that the general form applies."""

    def free(t, u, p):
        return u.v, (p.rho * np.cos(p.omega * t) - 2 * p.k * u.x - p.c * u.v) / p.m

    def contact(t, u, p):
        return u.v, (p.rho * np.cos(p.omega * t) - 2 * p.k * u.x - (p.c + p.c_s) * u.v - p.k_s * (u.x - p.g)) / p.m

    known = discontinuous_support()
    return System(
        states=known.states,
        parameters=known.parameters,
        modes={"free": free, "contact": contact},
        indicators={
            "penetration": lambda t, u, p: u.x - p.g,
            "separation": lambda t, u, p: -(u.x - p.g) - p.c_s / p.k_s * u.v,
        },
        transitions=[
            Transition("free", "contact", when="penetration > 0 and separation < 0"),
            Transition("contact", "free", when="separation > 0"),
        ],
        outputs={"contact_force": ({"free": lambda t, u, p: 0, "contact": lambda t, u, p: -p.k_s * (u.x - p.g)}, "N")},
    )


def test_the_general_form_interpolates_the_fields():
    traced = general().smoothed(ETA).traced
    q_a = (H_A + eta) / (2 * eta)
    q_b = (-H_B + eta) / (2 * eta)
    assert sp.simplify(traced.fields[S_A][1] - ((1 - q_a) * EQ_7A + q_a * EQ_7B)) == 0
    assert sp.simplify(traced.fields[S_B][1] - ((1 - q_b) * EQ_7A + q_b * EQ_7B)) == 0
    assert sp.simplify(traced.outputs[0][S_A] + q_a * k_s * (x - g)) == 0
    assert traced.m == ()
    system = general().smoothed(ETA)
    ratio = 0.6 / 1210
    for dx, speed in np.random.default_rng(4).uniform(-1, 1, (100, 2)) * (3 * ETA, 0.02):
        mode, _ = settle(system, (-0.0045 + dx, speed), [])
        assert mode == region(dx, -dx - ratio * speed, ETA)


def two_sided(distance=1.0, second="left_of < 0"):
    return System(
        name="two walls",
        states=["x", "v"],
        parameters={"d": distance, "K": 10.0},
        modes={
            "free": lambda t, u, p: (u.v, -u.x),
            "right": lambda t, u, p: (u.v, -u.x - p.K * (u.x - p.d)),
            "left": lambda t, u, p: (u.v, -u.x - p.K * (u.x + p.d)),
        },
        indicators={"right_of": lambda t, u, p: u.x - p.d, "left_of": lambda t, u, p: u.x + p.d},
        transitions=[
            Transition("free", "right", when="right_of > 0"),
            Transition("right", "free", when="right_of < 0"),
            Transition("free", "left", when=second),
            Transition("left", "free", when="left_of > 0"),
        ],
    )


def test_several_pairs_of_modes():
    system = two_sided().smoothed(1e-2)
    assert system.modes == ("free", "right", "left", "right_of_band", "left_of_band")
    for place, mode in ((0.0, 0), (2.0, 1), (-2.0, 2), (1.005, 3), (0.995, 3), (-1.005, 4), (-0.995, 4)):
        assert settle(system, (place, 0.3), [])[0] == mode
    with pytest.raises(SystemDefinitionError, match=r"'free' and 'right' and between 'free' and 'left' overlap"):
        two_sided().smoothed(1.5)
    with pytest.raises(SystemDefinitionError, match="overlap"):
        system.with_parameters(d=1e-3)


def test_a_surface_is_smoothed_as_a_pair():
    system = System(
        states=["x", "v"],
        parameters={"F": 1.0},
        modes={"left": lambda t, u, p: (u.v, p.F - u.x), "right": lambda t, u, p: (u.v, -p.F - u.x)},
        indicators={"slip": lambda t, u, p: u.v - 0.2},
        transitions=[Surface("slip", below="left", above="right")],
    ).smoothed(0.01)
    traced = system.traced
    F, width = traced.p
    assert sp.expand(traced.fields[2][1] + F * (traced.u[1] - sp.Float(0.2)) / width + traced.u[0]) == 0


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"static": 1.5}, "static value"),
        ({"static": lambda t, u, p: 1 + u.x**2}, "static value"),
        ({"static": lambda t, u, p: 1.2 * p.F}, "static value"),
        ({"field": lambda t, u, p: (u.v, 0)}, "`field` of its own"),
    ],
)
def test_a_band_has_no_static_friction_and_no_field_of_its_own(given, why):
    def sticking(**values):
        return System(
            states=["x", "v"],
            parameters={"F": 1.0},
            modes={"left": lambda t, u, p: (u.v, p.F - u.x), "right": lambda t, u, p: (u.v, -p.F - u.x)},
            indicators={"slip": lambda t, u, p: u.v - 0.2},
            transitions=[Surface("slip", below="left", above="right", **values)],
        )

    with pytest.raises(SystemDefinitionError, match=f"'left' and 'right': .*{why}"):
        sticking(**given).smoothed(0.01)
    assert len(sticking(static=lambda t, u, p: p.F).smoothed(0.01).modes) == 3  # F = 1: there is none


def corner(enter="one > 0", leave="one < 0", **more):
    return System(
        states=["x", "y"],
        parameters={"d": 1.0},
        modes={name: (lambda t, u, p, s=s: (s * u.y, u.x)) for s, name in enumerate(["A", "B", "C"])},
        indicators={"one": lambda t, u, p: u.x, "two": lambda t, u, p: u.y, "far": lambda t, u, p: u.x + 1},
        transitions=[Transition("A", "B", when=enter, **more), Transition("B", "A", when=leave)],
    )


def test_what_cannot_be_smoothed_names_the_pair():
    with pytest.raises(SystemDefinitionError, match=r"'motion' and 'motion'.*reset"):
        impact_oscillator().smoothed(1e-5)
    with pytest.raises(SystemDefinitionError, match=r"'A' and 'B'.*hysteresis"):
        corner(leave="far < 0").smoothed(1e-5)
    with pytest.raises(SystemDefinitionError, match=r"'A' and 'B'.*reset"):
        corner(reset=lambda t, u, p: (u.x, u.y)).smoothed(1e-5)
    overlapping = System(
        states=["x", "y"],
        parameters={},
        modes={name: (lambda t, u, p, s=s: (s * u.y, u.x)) for s, name in enumerate(["A", "B", "C"])},
        indicators={"one": lambda t, u, p: u.x, "two": lambda t, u, p: u.y},
        transitions=[
            Transition("A", "B", when="one > 0"),
            Transition("B", "A", when="one < 0"),
            Transition("A", "C", when="two > 0"),
            Transition("C", "A", when="two < 0"),
        ],
    )
    with pytest.raises(SystemDefinitionError, match=r"'A' and 'B' and between 'A' and 'C' overlap"):
        overlapping.smoothed(1e-5)


def test_contact_force_is_the_difference_of_the_fields(smoothed):
    traced = smoothed.traced
    for mode in range(4):
        difference = m * (traced.fields[mode][1] - EQ_7A)
        assert sp.simplify(traced.outputs[0][mode] - difference) == 0


def rubbing(**element):
    return ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"f": 0.1, "mu": 0.2, "mu_s": 0.2},
        forcing={"q": lambda t, p: p.f},
        elements={"floor": ns.elements.Coulomb(at="q", **{"friction": "mu", **element})},
    )


@pytest.mark.parametrize(("band", "creep"), [("linear", 0.5), ("tanh", np.arctanh(0.5)), ("arctan", 1.0)])
def test_a_smoothed_block_creeps_where_it_would_stick(band, creep):
    """A force of half the friction is balanced at 2 q - 1 = 1/2."""
    system = rubbing().smoothed(1e-3, band)
    run = ns.simulate(system, duration=1.0, start={"v_q": 1e-3})
    assert run.u.values[-1, 1] == pytest.approx(1e-3 * creep, rel=1e-9)
    assert run.floor_force.values[-1] == pytest.approx(-0.1, rel=1e-9)
    assert "stick" not in " ".join(system.modes)
    assert (system.band, rubbing().band) == (band, None)


def test_a_tanh_band_ends_where_it_is_one_to_rounding():
    system = rubbing().smoothed(1e-3, "tanh")
    traced = system.traced
    values = {**dict(zip(traced.p, system.parameter_vector(), strict=True)), traced.u[1]: 0.019}
    inside, outside = (float(traced.fields[mode][1].subs(values)) for mode in (2, 0))
    assert system.modes == ("floor_forward", "floor_back", "floor_speed_band")
    assert inside == pytest.approx(outside, abs=1e-16)
    assert any("19*eta" in name for name in traced.indicator_names)


def test_static_friction_above_the_kinetic_one_has_no_band():
    equal = rubbing(static="mu_s").smoothed(1e-3)
    with pytest.raises(SystemDefinitionError, match="the friction that holds in 'floor_stick' is not the kinetic one"):
        equal.with_parameters(mu_s=0.3)
    with pytest.raises(SystemDefinitionError, match="is not the kinetic one"):
        rubbing(static=0.3, friction=0.2).smoothed(1e-3)


def test_arctan_weights_sum_to_one_where_three_regions_meet():
    """Fields 1 in the middle, 2 right and 3 left of it, at x = 1 and x = -1."""
    system = System(
        states=["x"],
        parameters={"d": 1.0},
        modes={"middle": lambda t, u, p: (1,), "right": lambda t, u, p: (2,), "left": lambda t, u, p: (3,)},
        indicators={"r": lambda t, u, p: u.x - p.d, "l": lambda t, u, p: u.x + p.d},
        transitions=[
            Transition("middle", "right", when="r > 0"),
            Transition("right", "middle", when="r < 0"),
            Transition("middle", "left", when="l < 0"),
            Transition("left", "middle", when="l > 0"),
        ],
    ).smoothed(0.1, "arctan")
    traced = system.traced
    field = sp.lambdify([traced.u[0], traced.p], traced.fields[0][0])
    for place in (-2.0, -1.0, 0.3, 1.0, 2.0):
        q, r = 0.5 + np.arctan((place - 1) / 0.1) / np.pi, 0.5 + np.arctan((-place - 1) / 0.1) / np.pi
        weights = np.array([(1 - q) * (1 - r), q, r])
        expected = weights @ [1, 2, 3] / weights.sum()
        assert field(place, system.parameter_vector()) == pytest.approx(expected, rel=1e-13)
    assert len(set(traced.fields)) == 1


@pytest.mark.parametrize("band", ["linear", "tanh", "arctan"])
def test_where_bands_cross_each_element_does_its_part(band):
    two = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"k": 5.0, "mu": 0.2},
        elements={
            "floor": ns.elements.Coulomb(at="q", friction="mu"),
            "wall": ns.elements.ElasticStop(at="q", position=1.0, stiffness="k"),
        },
    )
    traced = two.smoothed(1e-3, band).traced
    t, (q, v), (k, mu, eta) = traced.t, traced.u, traced.p
    share = {"linear": lambda x: (1 + x) / 2, "tanh": lambda x: (1 + sp.tanh(x)) / 2}.get(
        band, lambda x: sp.Rational(1, 2) + sp.atan(x) / sp.pi
    )
    force = -0.1 * v - q + mu * (1 - 2 * share(v / eta)) - k * (q - 1) * share((q - 1) / eta)
    values = {t: 0.3, q: 1.0004, v: -0.0002, k: 5.0, mu: 0.2, eta: 1e-3}
    assert float(traced.fields[-1][1].subs(values)) == pytest.approx(float(force.subs(values)), rel=1e-12)
    assert len(traced.mode_names) == (4 if band == "arctan" else 9)


def test_a_rubbing_preloaded_mass_has_no_mode_that_nothing_leads_to():
    """No condition of one element leads where both hold: elements are asked there."""
    held = ns.mechanical(
        0.7,
        0.0,
        2.312,
        elements={
            "a": ns.elements.Coulomb(at="q", friction=0.2345),
            "b": ns.elements.PreloadedSpring(at="q", preload=0.3, stiffness=1.0),
        },
    )
    modes = held.smoothed(1e-2).modes
    assert len(modes) == 9 and not any("stick" in mode or "held" in mode for mode in modes)


def test_the_shape_of_a_band_is_part_of_a_system():
    support = discontinuous_support()
    systems = [support.smoothed(ETA, band) for band in ("linear", "tanh", "arctan")]
    assert [System.from_text(system.to_text()).band for system in systems] == ["linear", "tanh", "arctan"]
    assert len({system.content_hash() for system in systems}) == 3
    assert "tanh band" in str(systems[1])
    assert systems[1].with_parameters(g=0.1).band == "tanh" and systems[1].smoothed(1e-6).band == "linear"


def test_unknown_bands_are_refused():
    with pytest.raises(ValueError, match="band is one of linear, tanh, arctan, not 'cubic'"):
        rubbing().smoothed(1e-3, "cubic")


def test_a_preloaded_spring_rests_in_its_band():
    """P - k s on one side, -P - k s on the other: within the band a spring of the stiffness P / eta + k."""
    spring = ns.mechanical(
        1.0,
        0.2,
        0.0,
        parameters={"P": 1.0, "k": 1.0, "f": 0.3},
        forcing={"q": lambda t, p: p.f},
        elements={"spring": ns.elements.PreloadedSpring(at="q", preload="P", stiffness="k")},
    )
    run = ns.simulate(spring.smoothed(1e-3), duration=400.0, start={"q": 0.5}, samples=2)
    assert run.u.values[-1] == pytest.approx([0.3 / 1001, 0.0], abs=1e-9)


def test_a_switch_beside_elements_that_decide_together_has_its_band():
    """A mass against a spring of the system's own, with a second that it drags along, by the sharp system's motion."""
    rub = ns.elements.Coulomb
    system = System(
        states=["x", "v", "w"],
        parameters={"k": 50.0},
        modes={
            "off": lambda t, u, p: (u.v, np.cos(t) - u.x, -u.w),
            "on": lambda t, u, p: (u.v, np.cos(t) - u.x - p.k * (u.x - 0.5), -u.w),
        },
        indicators={"h": lambda t, u, p: u.x - 0.5},
        transitions=[Transition("off", "on", when="h > 0"), Transition("on", "off", when="h < 0")],
        elements={
            "a": rub(speed=lambda t, u, p: u.v, friction=0.1, on={"v": 1.0}),
            "b": rub(speed=lambda t, u, p: u.v - u.w, friction=0.05, on={"v": 1.0, "w": -1.0}),
        },
    )
    sharp, smoothed = (
        ns.simulate(one, duration=6.0, start={"x": 0.4, "v": 1.0}) for one in (system, system.smoothed(1e-4))
    )
    assert sharp.u.values[:, 0].max() < 0.7  # without the spring 1.6
    assert smoothed.u.values[-1] == pytest.approx(sharp.u.values[-1], abs=1e-5)
