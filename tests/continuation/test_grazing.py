"""Grazing followed in both directions, on the soft support and at a rigid stop."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import reference_values as known
import xarray as xr

import nonsmooth as ns
from nonsmooth.continuation.branches.following import resumed_at
from nonsmooth.continuation.branches.reading import read_branch

support = ns.models.discontinuous_support

#: rho, g, an omega without contact and one with contact on the period-1 branch, and the range.
SOFT = {
    "figure 9": (0.14, 0.02, 3.3, 4.5, (3.0, 7.0)),
    "figure 10": (0.16, 0.0145, 2.2, 5.0, (2.0, 8.0)),
    "figure 17": (0.23, 0.0036, 10.9, 9.0, (7.5, 11.0)),
}


def table(branch: xr.Dataset) -> list[tuple[str, float]]:
    special = ns.special_points(branch)
    name = branch.attrs["parameter"]
    return sorted((str(k), float(v)) for k, v in zip(special["kind"].values, special[name].values, strict=True))


def from_both_sides(figure: str, **more: float) -> tuple[xr.Dataset, xr.Dataset]:
    rho, g, free, contact, limits = SOFT[figure]
    system = support(rho=rho, g=g, **more)
    one = ns.find_orbit(system.with_parameters(omega=free), period_number=1)
    other = ns.find_orbit(system.with_parameters(omega=contact), period_number=1)
    assert not one.signature.crossings and other.contacts_per_period == 1
    return ns.continue_orbit(one, "omega", limits), ns.continue_orbit(other, "omega", limits)


@pytest.mark.parametrize(
    ("figure", "c_s"),
    [
        ("figure 17", 0.6),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in (("figure 9", 0.6), ("figure 10", 0.0))),
    ],
)
def test_both_directions_agree(figure: str, c_s: float) -> None:
    """A contact gained or lost: special points to 1e-9, branch points to 1e-8 at equal parameters."""
    one, other = from_both_sides(figure, c_s=c_s)
    a, b = table(one), table(other)
    assert [kind for kind, _ in a] == [kind for kind, _ in b]
    assert [value for _, value in a] == pytest.approx([value for _, value in b], abs=1e-9)
    apart = []
    # Orbits at equal parameters: those of one branch, solved from its own points, are points of the other.
    folds = [value for kind, value in b if kind == "fold"]
    for i in np.linspace(1, other.sizes["point"] - 2, 10).astype(int):
        row = other.isel(point=int(i))
        if min((abs(float(row["omega"]) - fold) for fold in folds), default=1.0) < 1e-6:
            continue  # no orbit is solved at the parameter of a fold; these are compared above
        gaps = [np.abs(u - row["section"].values).max() for u in solved_at(one, float(row["omega"]))]
        apart.append(min(gaps))
    special = max(abs(x - y) for (_, x), (_, y) in zip(a, b, strict=True))
    print(f"\n{figure}, c_s {c_s}: special points {special:.1e}, {len(apart)} branch points {max(apart):.1e} apart")
    assert max(apart) < 1e-8


def solved_at(branch: xr.Dataset, omega: float) -> list[np.ndarray]:
    """Section points of a branch at omega, solved from its neighbours there and from the line between them."""
    system, record = read_branch(branch)
    found = []
    for a, b in itertools.pairwise(record.points):
        if (a.value - omega) * (b.value - omega) > 0 or a.value == b.value:
            continue
        starts = [(a, a.X), (b, b.X)]
        if a.signature == b.signature:
            starts.append((a, a.X + (omega - a.value) / (b.value - a.value) * (b.X - a.X)))
        for point, X in starts:
            curve, _ = resumed_at(system, record.period_number, point, "omega", 4.0)
            solved = curve.at_parameter(X / curve.scale, omega)
            if solved is not None:
                found.append(solved.X[:2])
    return found


@pytest.mark.parametrize("side", ["lower", pytest.param("upper", marks=pytest.mark.slow)])
def test_multipliers_just_past_the_graze(side: str) -> None:
    """They tend to those of M- with S inserted: within 1e-2 at a depth of 1e-10 m, like the root of the depth."""
    rho, g, free, _, limits = SOFT["figure 9"]
    graze_at = known.grazing_frequencies(rho, g)[0 if side == "lower" else 1]
    free = free if side == "lower" else 6.5  # the contact is gained where this graze is met
    branch = ns.continue_orbit(ns.find_orbit(support(rho=rho, g=g, omega=free)), "omega", limits, step=0.02)
    special = ns.special_points(branch)
    i = int(np.flatnonzero(np.abs(special["omega"].values - graze_at) < 1e-9)[0])
    row = special.isel(special=i)
    limit = closed_limit(rho, g, graze_at)
    found = row["contact_multipliers"].values
    assert sorted_by_imag(found) == pytest.approx(sorted_by_imag(limit), abs=1e-7)
    # Points of the branch in contact next to the graze, by depth.
    contact = branch["contacts_per_period"].values == 1
    depth = branch["maximum"].sel(state="x").values - g
    order = [int(k) for k in np.flatnonzero(contact & (depth > 0) & (depth < 3e-8))]
    near = [k for k in order if abs(float(branch["omega"][k]) - graze_at) < 1e-3]
    errors = np.array(
        [np.abs(sorted_by_imag(branch["floquet_multipliers"].values[k]) - sorted_by_imag(limit)).max() for k in near]
    )
    depths = depth[near]
    shallow = depths < 1.2e-10
    assert shallow.any() and errors[shallow].max() < 1e-2
    rates = errors / np.sqrt(depths)
    low, high = rates.min(), rates.max()
    print(f"\n{side}: error {errors[shallow].max():.1e} at 1e-10 m; error / sqrt(depth) {low:.0f} to {high:.0f}")
    assert high < 3 * low


def sorted_by_imag(mu: np.ndarray) -> np.ndarray:
    return mu[np.argsort(mu.imag)]


def closed_limit(rho: float, g: float, omega: float) -> np.ndarray:
    """M- and S of the paper's oscillator in closed form: S = [[1, 0], [-c_s / m, 1]] put in at the touch."""
    m, k, c, c_s = (known.TABLE_1[key] for key in ("m", "k", "c", "c_s"))
    a, w = c / (2 * m), np.sqrt(2 * k / m - (c / (2 * m)) ** 2)
    T = 2 * np.pi / omega
    cos, sin = np.cos(w * T), np.sin(w * T)
    M = np.exp(-a * T) * np.array([[cos + a / w * sin, sin / w], [-(a * a + w * w) / w * sin, cos - a / w * sin]])
    # The eigenvalues of Phi2 S Phi1 are those of M S: the flow without contact commutes with itself.
    return np.linalg.eigvals(M @ np.array([[1.0, 0.0], [-c_s / m, 1.0]]))


def test_jump_of_the_multipliers_is_proportional_to_the_damper() -> None:
    """c_s = 0: continuous at the graze. As c_s -> 0 the jump of the trace is c_s times a constant."""
    rho, g, free, _, limits = SOFT["figure 9"]
    jumps = {}
    for c_s in (0.0, 0.02, 0.04, 0.08):
        system = support(rho=rho, g=g, omega=free, c_s=c_s)
        special = ns.special_points(ns.continue_orbit(ns.find_orbit(system), "omega", (limits[0], 3.7)))
        row = special.isel(special=int(np.flatnonzero(special["kind"].values == "grazing")[0]))
        jumps[c_s] = (row["contact_multipliers"].sum() - row["floquet_multipliers"].sum()).values.real
    print("\njump of the trace", jumps[0.0], "and over c_s", [jumps[c_s] / c_s for c_s in (0.02, 0.04, 0.08)])
    assert abs(jumps[0.0]) < 1e-6
    # the trace moves with the root of the distance to the graze, which rounding alone makes 1e-13
    assert [jumps[c_s] / c_s for c_s in (0.02, 0.04)] == pytest.approx([jumps[0.08] / 0.08] * 2, rel=1e-3)


@pytest.mark.parametrize(("omega", "kind"), [(0.8, "persistence"), (1.3, "non_smooth_fold")])
def test_impact_oscillator_both_ways(omega: float, kind: str) -> None:
    """Rigid stop, det S = e^2: the multiplier has no bound at the graze, and the sign of det(I - M+) decides."""
    system = ns.models.impact_oscillator(omega=omega)
    exact = float(np.hypot(1 - omega**2, 0.1 * omega))
    free = ns.continue_orbit(ns.find_orbit(system.with_parameters(A=0.5 * exact)), "A", (0.1 * exact, 2 * exact))
    special = ns.special_points(free)
    graze = special.isel(special=int(np.flatnonzero(special["kind"].values == "grazing")[0]))
    assert float(graze["A"]) == pytest.approx(exact, abs=1e-12)
    assert str(graze["grazing"].values) == kind and not bool(graze["bounded"])
    minus, plus = graze["determinant"].values[:2]
    assert (minus * plus > 0) == (kind == "persistence")
    # The impacting branch lies on the other side of A, or on the same one.
    impacts = free["contacts_per_period"].values > 0
    here = int(graze["point"])
    beyond = next(k for k in (here - 1, here + 1) if impacts[k])
    assert (float(free["A"][beyond]) > exact) == (kind == "persistence")
    # det M = e^2 exp(-c T) on every orbit with one impact per period.
    tame = impacts & (np.abs(free["floquet_multipliers"].values).max(axis=1) < 1e2)  # beside the graze digits are lost
    product = np.prod(free["floquet_multipliers"].values[tame], axis=1)
    T = 2 * np.pi / omega
    assert tame.sum() > 10 and np.allclose(product, 0.64 * np.exp(-0.1 * T), rtol=1e-10)
    # And back: begun with an impact.
    k = int(np.flatnonzero(impacts)[len(np.flatnonzero(impacts)) // 2])
    start = free["section"].values[k]
    at = system.with_parameters(A=float(free["A"][k]))
    orbit = ns.find_orbit(at, start=start, period_number=1, transient=0)
    back = ns.continue_orbit(orbit, "A", (0.1 * exact, 2 * exact))
    assert [value for _, value in table(back)] == pytest.approx([value for _, value in table(free)], abs=1e-9)


@pytest.mark.parametrize("friction", [0.0, pytest.param(0.05, marks=pytest.mark.slow)])
def test_a_symmetric_motion_grazes_both_walls_all_along_its_curve(friction: float) -> None:
    """A mass midway between two walls reaches both where its amplitude is 1: F = |1 - w^2 + i c w|; with friction the
    curve of another law passes the grazes of branches."""
    rubs = {"rub": ns.elements.Coulomb(at="q", friction=friction)} if friction else {}
    walls = {
        name: ns.elements.Stop(at="q", position=side, side=int(side), restitution=0.6)
        for name, side in (("right", 1.0), ("left", -1.0))
    }
    rig = ns.mechanical(
        1.0,
        0.2,
        1.0,
        parameters={"F": 0.5, "w": 1.3},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
        elements=walls | rubs,
    )

    def graze(w: float) -> xr.Dataset:
        branch = ns.continue_orbit(ns.find_orbit(rig.with_parameters(w=w)), "F", (0.45, 0.8))
        special = ns.special_points(branch)
        return special.isel(special=special["kind"].values.tolist().index("grazing"))

    curve = ns.continue_curve(graze(1.3), {"F": (0.1, 0.9), "w": (1.1, 1.6)}, step=0.1)
    F, w = curve["F"].values, curve["w"].values
    assert w.min() == pytest.approx(1.1) and F.max() == pytest.approx(0.9)  # two edges of the box
    if friction:
        nearest = int(np.abs(w - 1.25).argmin())
        assert float(graze(float(w[nearest]))["F"]) == pytest.approx(F[nearest], rel=1e-7)
    else:
        assert pytest.approx(np.hypot(1 - w**2, 0.2 * w), rel=1e-10) == F
