"""Branches of copies that do not feel each other: those of one, with every multiplier once for each copy."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.continuation.events.special_orbits import NeimarkSacker
from nonsmooth.continuation.problems.multipliers import copies as is_of_copies

pytestmark = pytest.mark.filterwarnings("ignore:multipliers of the orbit are equal:RuntimeWarning")
E = ns.elements


def copies(count: int, **elements: ns.elements.Element) -> ns.System:
    """Forced masses, each before elements of its own."""
    names = [f"q{i}" for i in range(count)]
    return ns.mechanical(
        np.eye(count),
        0.16 * np.eye(count),
        0.81 * np.eye(count),
        parameters={"w": 1.47, "d": 0.2},
        coordinates=names,
        forcing={name: (lambda t, p: 1.45 * np.cos(p.w * t)) for name in names},
        elements={f"{key}{name}": make(name) for name in names for key, make in elements.items()},
    )


def followed(system: ns.System, count: int) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Kinds and places of special points of the branch from end to end, and multipliers of its last point."""
    orbit = ns.find_orbit(system, start={f"q{i}": 0.05 for i in range(count)})
    branch = ns.continue_orbit(orbit, "w", (1.2, 2.25), points=200)
    assert branch["w"].values[[0, -1]] == pytest.approx([1.2, 2.25], abs=1e-12)
    special = ns.special_points(branch)
    order = np.argsort(special["w"].values)
    return list(special["kind"].values[order]), special["w"].values[order], branch["floquet_multipliers"].values[-1]


@pytest.mark.physics
def test_copies_that_are_struck_at_one_instant_have_the_branch_of_one() -> None:
    """It ended at a corner that rounding made, or passed the flip, where two multipliers pass -1 together."""

    def stop(name: str) -> ns.elements.Stop:
        return E.Stop(at=name, position="d", restitution=0.87, rest=False)

    kinds, places, multipliers = followed(copies(1, s=stop), 1)
    assert kinds == ["flip"]
    twice = followed(copies(2, s=stop), 2)
    assert twice[0] == kinds
    assert twice[1] == pytest.approx(places, abs=1e-8)
    assert np.sort_complex(twice[2]) == pytest.approx(np.sort_complex(np.repeat(multipliers, 2)), abs=1e-6)


@pytest.mark.physics
def test_copies_that_change_their_modes_at_one_instant_have_no_corners() -> None:
    """A support that is left as its force ends: its gap is beyond its surface then, and the force just on it."""

    def support(name: str) -> ns.elements.ElasticStop:
        return E.ElasticStop(at=name, position=0.4, stiffness=20.0, damping=0.2)

    one, two = (ns.find_orbit(copies(n, s=support), start={f"q{i}": 0.05 for i in range(n)}) for n in (1, 2))
    branches = [ns.continue_orbit(orbit, "w", (1.4, 1.54)) for orbit in (one, two)]
    for branch in branches:
        assert branch["w"].values[[0, -1]] == pytest.approx([1.4, 1.54], abs=1e-12)
        assert ns.special_points(branch).sizes["special"] == 0
    first, second = (branch["section"].values[-1] for branch in branches)
    assert second == pytest.approx(np.repeat(first, 2), abs=1e-9)


@pytest.mark.physics
def test_what_copies_do_at_one_instant_passes_the_section_together() -> None:
    """Three corners were listed where a contact of two masses passes phase 0 of the forcing."""

    def found(count: int) -> list[float]:
        system = copies(count, s=lambda name: E.ElasticStop(at=name, position=0.4, stiffness=2.0, damping=0.05))
        orbit = ns.find_orbit(system.with_parameters(w=0.6), start={f"q{i}": 0.05 for i in range(count)})
        branch = ns.continue_orbit(orbit, "w", (0.6, 2.0), points=300)
        assert branch["w"].values[[0, -1]] == pytest.approx([0.6, 2.0], abs=1e-12)
        special = ns.special_points(branch)
        assert special["kind"].values.tolist() == ["flip"]
        return special["w"].values.tolist()

    assert found(2) == pytest.approx(found(1), abs=1e-9)


@pytest.mark.physics
def test_copies_whose_impacts_turn_their_friction_have_the_multipliers_of_one() -> None:
    """The impact of the second was one with the first: its multipliers were -0.41 and 0.19 for -0.05 +- 0.15 i."""

    def found(count: int) -> ns.Orbit:
        names = [f"q{i}" for i in range(count)]
        unit = np.eye(count)
        system = ns.mechanical(
            unit,
            0.28 * unit,
            1.31 * unit,
            parameters={"w": 1.66},
            coordinates=names,
            forcing={name: (lambda t, p: 0.77 * np.cos(p.w * t)) for name in names},
            elements={f"f{name}": E.Coulomb(at=name, friction=0.14) for name in names}
            | {f"s{name}": E.Stop(at=name, position=0.13, restitution=0.31) for name in names},
        )
        return ns.find_orbit(system, start=dict.fromkeys(names, 0.05))

    one, two = found(1), found(2)
    assert two.u == pytest.approx(np.repeat(one.u, 2), abs=1e-9)
    assert two.monodromy_matrix == pytest.approx(np.kron(one.monodromy_matrix, np.eye(2)), abs=1e-8)


@pytest.mark.physics
def test_where_copies_part_together_another_branch_crosses() -> None:
    """Two multipliers that pass 1 together change no determinant's sign: it was missed. A warning comes before it."""

    def clearance(count: int) -> ns.System:
        names = [f"q{i}" for i in range(count)]
        return ns.mechanical(
            np.eye(count),
            0.1 * np.eye(count),
            np.zeros((count, count)),
            parameters={"w": 0.8},
            coordinates=names,
            forcing={name: (lambda t, p: np.cos(p.w * t)) for name in names},
            elements={
                f"{key}{name}": E.ElasticStop(at=name, position=side, stiffness=1.0, side=side)
                for name in names
                for key, side in (("high", 1), ("low", -1))
            },
        )

    def found(count: int) -> tuple[str, float]:
        start = {f"{key}q{i}": value for i in range(count) for key, value in (("", 0.3), ("v_", 0.2))}
        special = ns.special_points(ns.continue_orbit(ns.find_orbit(clearance(count), start=start), "w", (0.45, 0.81)))
        ((kind,), (place,)) = special["kind"].values.tolist(), special["w"].values.tolist()
        return kind, place

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = found(1)
    assert one == ("pitchfork", pytest.approx(0.458871, abs=1e-6))
    with pytest.warns(RuntimeWarning, match="parts of the system do the same"):
        assert found(2) == ("branch_point", pytest.approx(one[1], abs=1e-8))


@pytest.mark.physics
def test_a_fold_of_copies_is_a_fold() -> None:
    """It was called transcritical too: the orbits in which only one copy turns back cross there."""

    def found(count: int) -> list[tuple[str, float]]:
        system = copies(count, s=lambda name: E.ElasticStop(at=name, position=0.4, stiffness=9.0, damping=0.05))
        orbit = ns.find_orbit(system.with_parameters(w=0.6), start={f"q{i}": 0.05 for i in range(count)})
        special = ns.special_points(ns.continue_orbit(orbit, "w", (0.55, 0.8), points=60))
        return list(zip(special["kind"].values.tolist(), special["w"].values.tolist(), strict=True))

    one = found(1)
    assert "fold" in dict(one)
    assert found(2) == [(kind, pytest.approx(place, abs=1e-8)) for kind, place in one]


def equal_masses(damping: float) -> ns.System:
    """Two with a stop each and a spring between them; in phase they move as one alone."""
    between = np.array([[1.0, -1.0], [-1.0, 1.0]])
    return ns.mechanical(
        np.eye(2),
        0.16 * np.eye(2) + damping * between,
        0.81 * np.eye(2) + 0.5 * between,
        parameters={"w": 1.47},
        coordinates=["a", "b"],
        forcing={name: (lambda t, p: 1.45 * np.cos(p.w * t)) for name in "ab"},
        elements={f"s{name}": E.Stop(at=name, position=0.2, restitution=0.7) for name in "ab"},
    )


@pytest.mark.physics
def test_multipliers_that_hold_for_one_order_of_two_impacts_are_warned_of() -> None:
    """Two equal masses that strike together: a spring between them leaves the order alone, a damper does not."""

    def found(damping: float) -> tuple[ns.Orbit, float]:
        system = equal_masses(damping)
        orbit = ns.find_orbit(system, start={"a": 0.05, "b": 0.05})
        first, h = np.array([1.0, -1.0, 0.0, 0.0]), 1e-6
        ends = [ns.simulate(system, periods=1, start=orbit.u + one * first).u.values[-1] for one in (h, -h)]
        return orbit, float(np.abs((ends[0] + ends[1] - 2 * orbit.u) / h).max())

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found(0.0)[1] < 1e-3  # the return map has no kink
    with pytest.warns(RuntimeWarning, match="multipliers of an orbit, are those of one order"):
        orbit, kink = found(0.3)
    assert kink > 0.1
    assert orbit.crossing_times[0] == pytest.approx(orbit.crossing_times[1], abs=1e-12)


@pytest.mark.physics
def test_where_masses_part_that_struck_together_is_a_branch_point() -> None:
    """It was called transcritical, by second derivatives for one order of the impacts: the other mirrors it."""
    orbit = ns.find_orbit(equal_masses(0.0).with_parameters(w=1.95), start={"a": 0.05, "b": 0.05})
    special = ns.special_points(ns.continue_orbit(orbit, "w", (1.9, 2.1)))
    assert special["kind"].values.tolist() == ["branch_point"]
    w = float(special["w"].values[0])
    away = ns.continue_orbit(special.isel(special=0), points=10)
    assert (away["w"].values[1:] < w).all()  # and its mirror image: nothing branches off above
    a, b = away["section"].sel(state=["a", "b"]).values[-1]
    back = ns.simulate(
        equal_masses(0.0).with_parameters(w=float(away["w"].values[-1])),
        periods=1,
        start=np.array([b, a, *away["section"].sel(state=["v_b", "v_a"]).values[-1]]),
    )
    assert abs(a - b) > 1e-3
    assert back.u.values[-1] == pytest.approx(back.u.values[0], abs=1e-9)


def test_pairs_that_leave_the_unit_circle_together_change_the_sign() -> None:
    pair = np.exp(np.array([1j, -1j]))
    for count in (1, 2, 3):
        points = [
            SimpleNamespace(multipliers=np.tile(radius * pair, count), shooting=SimpleNamespace(forced=True))
            for radius in (0.99, 1.01)
        ]
        inside, outside = map(NeimarkSacker().number, points)
        assert inside * outside < 0.0


@pytest.mark.parametrize(
    ("mu", "are"),
    [
        ([0.5, 0.2, 0.5, 0.2], True),
        ([0.1 + 0.2j, 0.1 - 0.2j] * 2, True),
        ([1.0, 1.0 + 1e-8, 0.3, 0.3], True),
        ([0.1 + 0.2j, 0.1 - 0.2j], False),
        ([0.5, 0.5], False),  # a star node
        ([0.0, 0.0, 0.3, 0.2], False),  # what friction holds
        ([2e-6, 2.5e-6, 1e-6, 1.1e-6], False),
    ],
)
def test_multipliers_of_copies(mu: list[complex], are: bool) -> None:
    assert is_of_copies(np.array(mu, dtype=complex)) is are
