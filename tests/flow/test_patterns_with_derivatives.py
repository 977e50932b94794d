"""Derivatives of systems whose modes are made when visited: against differences, and against the same written out."""

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.system.derived import combinations

E = ns.elements
START = {"q1": -0.4, "q2": 0.2, "q3": 0.3, "v_q1": 0.1, "v_q2": 0.33, "v_q3": 0.2}
VALUES = {
    "m": 1.0,
    "k": 1.0,
    "c": 0.05,
    "F": 1.2,
    "omega": 0.9,
    "mu": 0.05,
    "e": 0.6,
    "pos": 0.35,
    "belt": 0.2,
    "phi": 0.1,
    "fr": 0.1,
    "kc": 3.0,
}


def row(n, elements, used, impacts="simultaneous"):
    """A row of n masses between walls, the first one driven, as a function of values other than ``VALUES``."""

    def stiffness(p):
        return p.k * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))

    mass = [[("m" if i == 0 else 0.838 if i == 1 else 1.0) if i == j else 0 for j in range(n)] for i in range(n)]
    damping = [["c" if i == j else 0 for j in range(n)] for i in range(n)]
    names = {"m", "k", "c", "F", "omega", "phi", *used}

    def make(**other):
        values = {name: value for name, value in {**VALUES, **other}.items() if name in names}
        return ns.mechanical(
            mass,
            damping,
            stiffness,
            parameters=values,
            elements=elements,
            impacts=impacts,
            forcing={"q1": lambda t, p: p.F * np.cos(p.omega * t + p.phi)},
        )

    return make


def many_elements(n=4):
    """A stop, a friction and an elastic stop at each of four masses: 20 736 combinations of phases."""
    elements = {}
    for i in range(1, n + 1):
        elements[f"s{i}"] = E.Stop(at=f"q{i}", position="pos", restitution="e")
        elements[f"f{i}"] = E.Coulomb(at=f"q{i}", friction="fr")
        elements[f"e{i}"] = E.ElasticStop(at=f"q{i}", side=-1, position=-0.3, stiffness="kc")
    return elements


def many():
    return row(4, many_elements(), {"pos", "e", "fr", "kc"})


RUBS = {
    "stop": E.Stop(at="q1", position="pos", restitution="e", friction="mu", tangent="q2", belt="belt"),
    "friction": E.Coulomb(at="q2", friction="fr"),
}
SLIPS = {
    "stop": E.Stop(at="q1", position="pos", restitution="e", friction="mu", tangent={"q2": 1, "q1": 0.2}, belt=1.5)
}
CRADLE = {
    "a": E.Stop(at={"q1": 1, "q2": -1}, restitution="e"),
    "b": E.Stop(at={"q2": 1, "q3": -1}, position=0.1, restitution="e"),
    "c": E.Stop(at="q3", position="pos", restitution="e"),
    "friction": E.Coulomb(at="q2", friction="fr"),
}
CASES = {
    "rubs": (row(2, RUBS, {"pos", "e", "mu", "belt", "fr"}), ("m", "k", "mu", "e", "pos", "omega", "phi", "fr")),
    "slips": (row(2, SLIPS, {"pos", "e", "mu"}), ("m", "k", "mu", "e", "pos", "omega", "phi")),
    "in sequence": (row(3, CRADLE, {"pos", "e", "fr"}, "sequential"), ("m", "k", "e", "pos", "omega", "phi", "fr")),
    "many": (many(), ("m", "k", "e", "pos", "omega", "phi", "fr", "kc")),
}


def end(system, start):
    return ns.simulate(system, duration=23.1, start=start, samples=2).u.values[-1]


@pytest.mark.physics
@pytest.mark.parametrize("case", ["rubs", "slips", "in sequence", pytest.param("many", marks=pytest.mark.slow)])
def test_a_run_answers_to_parameters_and_start_as_differences_say(case):
    make, names = CASES[case]
    system, step = make(), 1e-6
    start = {name: START.get(name, 0.21) for name in system.states}
    if case == "in sequence":
        start["v_q3"] = 0.0
    found = ns.sensitivity(system, duration=23.1, start=start, parameters=names)
    np.testing.assert_allclose(found.end.values, end(system, start), atol=1e-13)
    for j, name in enumerate(names):
        value = system.values[name]
        sides = [end(system.with_parameters({name: value + by}), start) for by in (step, -step)]
        slope = (sides[0] - sides[1]) / (2 * step)
        assert np.abs(found.P.values[:, j] - slope).max() < 1e-6 * max(1.0, np.abs(slope).max())
    for j, name in enumerate(system.states):
        sides = [end(system, {**start, name: start[name] + by}) for by in (step, -step)]
        slope = (sides[0] - sides[1]) / (2 * step)
        np.testing.assert_allclose(found.Phi.values[:, j], slope, atol=1e-6)


@pytest.mark.physics
def test_friction_and_impacts_that_accumulate_at_one_coordinate():
    """A mass comes to rest at a stop under friction; where both hold, nothing of the start is left."""
    system = ns.mechanical(
        1.0,
        0.05,
        1.0,
        coordinates=["q"],
        parameters={"pos": -0.35, "F": 0.5, "w": 0.9},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t + 0.1)},
        elements={"stop": E.Stop(at="q", position="pos", restitution=0.6), "f": E.Coulomb(at="q", friction=0.1)},
    )
    found = ns.sensitivity(system, duration=23.1, start={"q": -0.5, "v_q": 0.2}, parameters=["pos", "F"])
    assert found.sizes["crossing"] > 50
    np.testing.assert_allclose(found.P.sel(parameter="pos"), [1.0, 0.0], atol=1e-10)
    np.testing.assert_allclose(found.P.sel(parameter="F"), 0.0, atol=1e-10)
    np.testing.assert_allclose(found.Phi, 0.0, atol=1e-10)


def pair():
    return ns.mechanical(
        np.diag([1.0, 0.8]),
        [[0.1, -0.02], [-0.02, 0.1]],
        [[3.0, -1.0], [-1.0, 2.0]],
        parameters={"F": 1.2, "w": 1.1, "mu": 0.1},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        elements={"f": E.Coulomb(at="q2", friction="mu"), "s": E.Stop(at="q1", position=0.4, restitution=0.5)},
    )


def rubs():
    return CASES["rubs"][0](mu=0.3)


def test_an_orbit_and_its_branch_go_on_from_a_file(tmp_path):
    """Modes and transitions are numbered as they are met: another process reads them by what they are."""
    orbit = ns.find_orbit(rubs())
    branch = ns.continue_orbit(orbit, "omega", (0.899, 0.906))
    assert "special" in branch.sizes
    ns.save(orbit.to_dataset(), tmp_path / "orbit.nc")
    ns.save(branch, tmp_path / "branch.nc")
    again = ns.Orbit.from_dataset(ns.load(tmp_path / "orbit.nc"))  # its system has visited nothing yet
    names = [[one.system.modes[visit.mode] for visit in one.signature.visits] for one in (orbit, again)]
    assert names[0] == names[1]
    assert len(set(names[0])) > 2
    np.testing.assert_array_equal(again.floquet_multipliers, orbit.floquet_multipliers)
    longer = ns.continue_orbit(ns.load(tmp_path / "branch.nc"), range=(0.899, 0.912))
    shorter = ns.continue_orbit(orbit, "omega", (0.899, 0.912))
    assert list(longer.special_kind.values) == list(shorter.special_kind.values)
    np.testing.assert_allclose(longer.special_value, shorter.special_value, rtol=1e-8)


def test_orbits_and_branches_are_those_of_the_system_written_out(monkeypatch):
    written = pair().written_out()
    assert len(written.modes) > 1
    monkeypatch.setattr(combinations, "MOST", 1)
    visited = pair()
    orbits = [ns.find_orbit(one) for one in (written, visited)]
    values = [np.sort_complex(np.asarray(orbit.floquet_multipliers)) for orbit in orbits]
    np.testing.assert_allclose(values[1], values[0], atol=1e-11)
    branches = [ns.continue_orbit(orbit, "w", (1.05, 1.3)) for orbit in orbits]
    kinds = [list(map(str, branch.special_kind.values)) for branch in branches]
    assert kinds[0] == kinds[1]
    assert kinds[0]
    np.testing.assert_allclose(branches[1].special_value, branches[0].special_value, rtol=1e-9)


@pytest.mark.physics
def test_two_frictions_whose_shares_depend_on_a_parameter_are_one_of_their_sum():
    def system(elements, **other):
        return ns.System(
            states=["x", "v"],
            parameters={"a": 2.0, "F": 0.9, "w": 0.7, **other},
            modes={"m": lambda t, u, p: (u.v, p.F * np.cos(p.w * t) - u.x)},
            elements=elements,
        )

    def rub(push, friction):
        return E.Coulomb(speed=lambda t, u, p: u.v, on={"v": push}, friction=friction)

    two = system({"f": rub(1.0, 0.1), "g": rub(lambda t, u, p: p.a, 0.05)})
    for a in (2.0, 1.0):
        one = system({"f": rub(1.0, 0.1 + 0.05 * a)})
        runs = [
            ns.sensitivity(s, duration=30.0, start={"x": 0.4}, parameters=["F"])
            for s in (two.with_parameters(a=a), one)
        ]
        assert runs[0].sizes["crossing"] > 3
        np.testing.assert_allclose(runs[0].end, runs[1].end, atol=1e-12)
        np.testing.assert_allclose(runs[0].P, runs[1].P, atol=1e-11)
    with pytest.raises(ns.SystemDefinitionError, match="depends on a parameter in which derivatives"):
        ns.sensitivity(two.with_parameters(F=0.1), duration=30.0, start={"x": 0.4}, parameters=["a"])  # it sticks


@pytest.mark.parametrize("pulls", [True, False])
def test_a_damping_of_zero_has_a_derivative(pulls):
    """A mass of speed 1 is thrown back by a unit spring within pi: the damper takes c pi / 2 of it to first order."""
    elements = {
        "spring": E.ElasticStop(at="q", position=0.0, stiffness=1.0, damping="c", pulls=pulls),
        "rub": E.Coulomb(at="q", friction=0.0),
        "wall": E.Stop(at="q", position=-50.0, side=-1),
    }
    system = ns.mechanical(1.0, 0.0, 0.0, parameters={"c": 0.0}, elements=elements)
    found = ns.sensitivity(system, duration=6.0, start={"q": -1.0, "v_q": 1.0}, parameters=["c"])
    assert found.end.values == pytest.approx([np.pi - 5.0, -1.0], abs=1e-12)
    assert float(found.P.sel(state="v_q", parameter="c")) == pytest.approx(0.5 * np.pi, abs=1e-11)


@pytest.mark.parametrize("moves", [0.0, 0.1])
def test_numbers_made_at_another_frequency_serve_only_where_they_do_not_depend_on_it(moves):
    """A system looked at at one frequency after another answers as one that was never looked at; its walls stand, or
    swing with the forcing, so that the rates of what they meet depend on the frequency."""
    wall = E.Stop(at="q1", position=lambda t, u, p: p.pos + moves * np.cos(p.omega * t), restitution="e")
    make = row(4, many_elements() | {"s1": wall}, {"pos", "e", "fr", "kc"})
    one = make()
    for omega in (0.9, 1.1):
        both = [
            ns.sensitivity(system, duration=25.0, start={**START, "q4": 0.1, "v_q4": 0.1}, parameters=["omega", "pos"])
            for system in (one.with_parameters(omega=omega), make(omega=omega))
        ]
        for name in ("end", "P", "Phi"):
            np.testing.assert_allclose(both[0][name], both[1][name], rtol=0.0, atol=1e-12)
