"""A campaign: branches of random systems of ten kinds go on to the edge of the range, or end rightly.

``pytest -m slow -s tests/continuation/test_random_branches.py`` runs ten systems of each kind and prints the table.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, islice
from typing import Any

import brute_force
import numpy as np
import pytest
import random_templates as templates
import xarray as xr

import nonsmooth as ns

WHOLE = ("range", "closed", "branching")
SYSTEMS = 10  # of each kind
ended: dict[str, dict[str, int]] = {}


def drawn(template: str) -> Iterator[tuple[int, templates.Drawn, ns.Orbit]]:
    """Seeds, systems and first orbits; where motion is chaotic, or leaves, the next seed is taken."""
    for seed in count():
        system = templates.TEMPLATES[template](np.random.default_rng([seed, len(template)]))
        try:
            orbit = ns.find_orbit(system[0], start=system[3], max_period=4, progress=False)
        except ns.SolveError:
            continue
        yield seed, system, orbit


def endings(branch: xr.Dataset) -> list[str]:
    words = str(branch["ended"].attrs["flag_meanings"]).split()
    return [words[int(i)] for i in branch["ended"].values]


def judge(drawn: templates.Drawn, orbit: ns.Orbit) -> list[str]:
    """The endings of a branch; followed by ``lost`` or ``false`` where it goes on, or its statement is wrong."""
    system, name, limits, _ = drawn
    branch = ns.continue_orbit(orbit, name, limits, points=2500)
    if brute_force.misses(system, branch, name) > 1e-8:  # an orbit of it does not come back
        return ["missed false", "missed false"]
    found = []
    for end, word in zip((0, -1), endings(branch), strict=True):
        verdict = ""
        if word in ("points", "no_convergence", "physical"):  # says that it may go on
            verdict = " lost"
        elif word == "closed":
            verdict = " false" if brute_force.retraced(branch, name) else ""
        elif word not in WHOLE:
            verdict = " false" if brute_force.goes_on(system, branch, name, end, limits) else ""
        found.append(word + verdict)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("template", templates.TEMPLATES)
def test_hundred_systems(template: str) -> None:
    """A branch that ends within its range loses its orbit: no simulated fixed point nearby comes to its end."""
    table = ended.setdefault(template, {})
    wrong = []
    for seed, system, orbit in islice(drawn(template), SYSTEMS):
        words = judge(system, orbit)
        for word in words:
            table[word] = table.get(word, 0) + 1
        if any(" " in word for word in words):
            wrong.append((seed, words))
    print(f"\n{template}: {table}, wrong: {wrong}")
    assert sum(table.values()) == 2 * SYSTEMS


@pytest.mark.slow
def test_of_all_branches() -> None:
    """At least 95 % of the branches above go on to the edge, close, or end in a bifurcation that is confirmed."""
    total = sum(sum(table.values()) for table in ended.values())
    wrong = sum(n for table in ended.values() for word, n in table.items() if " " in word)
    print(f"\n{total} ends, {wrong} wrong")
    assert total >= 20 * SYSTEMS
    assert wrong <= 0.05 * total


def test_graze_of_a_rigid_stop_beyond_a_fold() -> None:
    """The orbits with impact near the graze have multipliers without bound: no simulated round shows them."""
    system, name, limits, _ = templates.impact(np.random.default_rng([2, 6]))
    branch = ns.continue_orbit(ns.find_orbit(system, progress=False), name, limits)
    assert endings(branch) == ["range", "range"]
    assert brute_force.misses(system, branch, name, 40) < 1e-9
    # Without impact the amplitude is 1 / sqrt((1 - w^2)^2 + (c w)^2).
    p = system.values
    at = ns.special_points(branch)
    grazes = at[name].values[at["kind"].values == "grazing"]
    first = np.sqrt(np.roots([1.0, p["c"] ** 2 - 2.0, 1.0 - p["d"] ** -2]).max())
    assert grazes.max() == pytest.approx(first, abs=1e-10)


@pytest.mark.parametrize(("lam", "begun"), [(0.15, -0.05), (0.7, 0.001), (0.15, 0.2)])
def test_square_root_map_behind_its_border(lam: float, begun: float) -> None:
    """x = lam x + mu - sqrt(x): sqrt(x) = (sqrt(1 + 4 (1 - lam) mu) - 1) / (2 (1 - lam)), with infinite slope at 0.

    The map has no values on the other side, and the border is met from there too."""

    def fixed(mu: Any) -> Any:
        root = (np.sqrt(np.maximum(1 + 4 * (1 - lam) * mu, 0.0)) - 1) / (2 * (1 - lam))
        return np.where(mu > 0, root**2, mu / (1 - lam))

    orbit = ns.find_orbit(
        ns.models.square_root_map(lam=lam, mu=begun),
        start=[float(fixed(begun))],
        period_number=1,
        transient=0,
        progress=False,
    )
    branch = ns.continue_orbit(orbit, "mu", (-0.1, 0.3))
    assert endings(branch) == ["range", "range"]
    assert branch["section"].values[:, 0] == pytest.approx(fixed(branch["mu"].values), abs=1e-11)
    special = ns.special_points(branch)
    assert special["kind"].values.tolist() == ["corner"]
    assert special["mu"].values == pytest.approx([0.0], abs=1e-10)


@pytest.mark.slow
def test_mass_at_rest_on_a_table_until_impacts_accumulate() -> None:
    """The branch goes on at lift-off, and through the grazes that accumulate where rest ends, without turning back."""
    system, name, limits, start = templates.rest(np.random.default_rng([7, 4]))
    branch = ns.continue_orbit(ns.find_orbit(system, start=start, progress=False), name, limits)
    assert endings(branch) == ["range", "range"]
    assert brute_force.misses(system, branch, name, 8) < 1e-9
    special = ns.special_points(branch)
    assert set(special["kind"].values) <= {"grazing", "flip", "fold", "corner"}
    assert "table_slow" not in special["touched"].values  # below that speed impacts are completed: a tolerance
    # The cascade shrinks towards where impacts accumulate, by e for each impact more.
    grazes = np.sort(special[name].values[special["kind"].values == "grazing"])
    gaps = np.diff(grazes)[1:6]
    assert gaps[:-1] / gaps[1:] == pytest.approx(system.values["e"], rel=0.06)
