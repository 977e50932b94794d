"""Test problems A to E and K of the literature: orbits, multipliers and special points."""

from __future__ import annotations

import numpy as np
import pytest
import systems
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

import nonsmooth as ns

pytestmark = pytest.mark.physics


def table(branch: xr.Dataset) -> list[tuple[str, float]]:
    special = ns.special_points(branch)
    name = branch.attrs["parameter"]
    return [(str(kind), float(value)) for kind, value in zip(special["kind"].values, special[name].values, strict=True)]


def of_kind(branch: xr.Dataset, kind: str) -> list[float]:
    return sorted(value for name, value in table(branch) if name == kind)


# A: impact oscillator


def test_a_one_impact_orbit() -> None:
    """Phase, speed and multipliers as published; det M = e^2 exp(-c T) exactly."""
    system = ns.models.impact_oscillator()
    orbit = ns.find_orbit(system)
    values = dict(system.values)
    assert orbit.period_number == 1 and orbit.stable and orbit.contacts_per_period == 1.0
    assert orbit.crossing_times[0] == pytest.approx(0.0759522, abs=5e-8)
    assert orbit.crossing_states[0, 1] == pytest.approx(-0.8 * 1.6957329, abs=5e-8)
    top = orbit.floquet_multipliers[np.argmax(orbit.floquet_multipliers.imag)]
    assert top == pytest.approx(-0.5842953 + 0.0056004j, abs=1e-7)
    expected = values["e"] ** 2 * np.exp(-values["c"] * orbit.period)
    assert np.linalg.det(orbit.monodromy_matrix) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("amplitude", [0.05, 1.0])
def test_a_grazing_from_either_side(amplitude: float) -> None:
    system = ns.models.impact_oscillator(A=amplitude)
    branch = ns.continue_orbit(ns.find_orbit(system), "A", (0.02, 1.2))
    (graze,) = of_kind(branch, "grazing")
    assert graze == pytest.approx(0.1, abs=1e-12)
    row = ns.special_points(branch).isel(special=int(np.flatnonzero(ns.special_points(branch)["kind"] == "grazing")[0]))
    assert str(row["grazing"].values) == "non_smooth_fold" and not bool(row["bounded"])
    # Without the impact the oscillator is linear: mu = exp((-c/2 +- i w) T).
    c, T = 0.1, 2 * np.pi
    expected = np.exp(complex(-c / 2, np.sqrt(1 - c * c / 4)) * T)
    mu = row["floquet_multipliers"].values
    assert mu[np.argmax(mu.imag * np.sign(expected.imag))] == pytest.approx(expected, abs=1e-10)


def impact_fold(c: float = 0.1, e: float = 0.8, d: float = 1.0) -> float:
    """A at the fold of the one-impact orbits of problem A, in closed form.

    Between impacts x is linear in (A cos phi, A sin phi, v), so for each speed v there is one A: the fold is the
    least of A(v)."""
    from scipy.optimize import minimize_scalar

    T, w = 2 * np.pi, np.sqrt(1 - c * c / 4)

    def amplitude(v: float) -> float:
        # x = C(t) a + S(t) b + q(t) with q the response (c omega = c): q = (A / c) sin(t + phi)
        E, cos, sin = np.exp(-c * T / 2), np.cos(w * T), np.sin(w * T)
        flow = np.array([[cos + c / (2 * w) * sin, sin / w], [-sin / w, cos - c / (2 * w) * sin]]) * E
        # z = (x, x') less the response r at the impact: flow z+ = z-; z+ = (d - r, -e v - r'), z- = (d - r, v - r')
        # => flow (d - r, -e v - r') = (d - r, v - r'), linear in (r, r').
        one = np.eye(2)
        right = flow @ np.array([d, -e * v]) - np.array([d, v])
        r = np.linalg.solve(flow - one, right)
        return float(c * np.hypot(*r))

    found = minimize_scalar(amplitude, bounds=(1e-4, 1.0), method="bounded", options={"xatol": 1e-9})
    return float(found.fun)


def test_a_fold_of_the_impacting_orbit() -> None:
    branch = ns.continue_orbit(ns.find_orbit(ns.models.impact_oscillator(A=0.05)), "A", (0.02, 1.2))
    (fold,) = of_kind(branch, "fold")
    assert fold == pytest.approx(impact_fold(), abs=1e-10)


# B: bang-bang Duffing


def duffing_map(omega: float, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One period and its derivative, by the equation and its variations in SciPy."""

    def field(t: float, y: np.ndarray, force: float) -> list[float]:
        stiffness = 1.0 + 3.0 * y[0] ** 2
        return [
            y[1],
            force - 0.2 * y[1] - y[0] - y[0] ** 3,
            y[4],
            y[5],
            -0.2 * y[4] - stiffness * y[2],
            -0.2 * y[5] - stiffness * y[3],
        ]

    half, y = np.pi / omega, np.array([*u, 1.0, 0.0, 0.0, 1.0])
    for force in (-26.0, 26.0):
        y = solve_ivp(field, (0.0, half), y, args=(force,), method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return y[:2], y[2:].reshape(2, 2)


def duffing_condition(kind: str, omega: float, u: np.ndarray) -> np.ndarray:
    end, D = duffing_map(omega, u)
    sign = 1.0 if kind == "flip" else -1.0
    return np.append(end - u, np.linalg.det(D + sign * np.eye(2)))


@pytest.fixture(scope="module")
def duffing() -> list[xr.Dataset]:
    """From one start, the asymmetric orbits; from a pitchfork on them, the symmetric ones."""
    window = (0.84, 1.1)
    first = ns.continue_orbit(ns.find_orbit(systems.bang_bang_duffing()), "omega", window)
    special = ns.special_points(first)
    crossing = int(np.flatnonzero(special["kind"].values == "pitchfork")[0])
    return [first, ns.continue_orbit(special.isel(special=crossing))]


def test_b_all_special_points(duffing: list[xr.Dataset]) -> None:
    """Mirror pairs of folds and flips, and the pitchforks in which they end."""
    asymmetric, symmetric = duffing
    folds, flips, forks = (of_kind(asymmetric, kind) for kind in ("fold", "flip", "pitchfork"))
    assert len(folds) == 4 and len(flips) == 4 and len(forks) == 2
    assert folds[0] == pytest.approx(folds[1], abs=1e-9) and folds[2] == pytest.approx(folds[3], abs=1e-9)
    assert flips[0] == pytest.approx(flips[1], abs=1e-9) and flips[2] == pytest.approx(flips[3], abs=1e-9)
    on_both = of_kind(symmetric, "pitchfork")
    assert all(min(abs(x - y) for y in on_both) < 1e-8 for x in forks)


def test_b_symmetric_branch_is_symmetric(duffing: list[xr.Dataset]) -> None:
    """x(t + T/2) = -x(t): the extremes are mirror images."""
    symmetric = duffing[1]
    assert np.allclose(symmetric["maximum"], -symmetric["minimum"], rtol=1e-8)
    assert not np.allclose(duffing[0]["maximum"], -duffing[0]["minimum"], rtol=1e-2)


@pytest.mark.slow
def test_b_doubled_branches_lead_from_flip_to_flip(duffing: list[xr.Dataset]) -> None:
    """The branch of twice the period that leaves one flip ends at the other one of the pair, to the last digits."""
    special = ns.special_points(duffing[0])
    flips = special.isel(special=np.flatnonzero(special["kind"].values == "flip"))
    low, high = flips["omega"].values.min(), flips["omega"].values.max()
    for i in (int(flips["omega"].values.argmin()), int(flips["omega"].values.argmax())):
        doubled = ns.continue_orbit(flips.isel(special=i))
        ends = sorted(float(doubled["omega"][k]) for k in (0, -1))
        assert ends == pytest.approx([low, high], abs=1e-9)
        assert [of_kind(doubled, "flip")[k] for k in (0, -1)] == pytest.approx([low, high], abs=1e-9)


@pytest.mark.parametrize("kind", ["fold", "flip"])
def test_b_against_scipy(duffing: list[xr.Dataset], kind: str) -> None:
    """SciPy's own solution of P(u) = u, det(DP -+ I) = 0 from our numbers: they move by less than 1e-8."""
    special = ns.special_points(duffing[0])
    rows = [special.isel(special=int(i)) for i in np.flatnonzero(special["kind"].values == kind)]
    seen: set[float] = set()
    for row in rows:
        omega = float(row["omega"])
        if round(omega, 6) in seen:  # the mirror image
            continue
        seen.add(round(omega, 6))
        first = np.append(row["section"].values, omega)
        found = fsolve(lambda z, kind=kind: duffing_condition(kind, z[2], z[:2]), first, xtol=1e-12)
        assert found[2] == pytest.approx(omega, abs=1e-8)
    assert len(seen) == 2


# C: stick-slip with impact


def test_c_sticking_orbit_grazes_the_wall() -> None:
    """The grazing V against SciPy: the periodic motion of the sticking mass alone whose largest x is 0.5."""
    system = systems.stick_slip_with_impact()
    orbit = ns.find_orbit(system, start={"x": 0.17}, period_number=1)
    assert not orbit.signature.crossings and orbit.period == pytest.approx(np.pi / 0.92)
    branch = ns.continue_orbit(orbit, "V", (0.45, 0.65), points=400)
    graze = of_kind(branch, "grazing")[0]
    assert graze == pytest.approx(0.59, abs=0.01)

    def turn(V: float, u: np.ndarray) -> tuple[np.ndarray, float]:
        def field(t: float, y: np.ndarray) -> list[float]:
            return [y[1], V**2 * np.sin(0.92 * t) ** 2 / (1 - y[0]) ** 2 - 0.04 * y[1] - y[0]]

        def top(t: float, y: np.ndarray) -> float:
            return float(y[1])

        top.direction = -1
        run = solve_ivp(field, (0.0, np.pi / 0.92), u, method="DOP853", rtol=1e-13, atol=1e-13, events=top)
        return run.y[:, -1], max(float(y[0]) for y in run.y_events[0])

    def equations(z: np.ndarray) -> np.ndarray:
        end, highest = turn(z[2], z[:2])
        return np.append(end - z[:2], highest - 0.5)

    special = ns.special_points(branch)
    row = special.isel(special=int(np.flatnonzero(special["kind"].values == "grazing")[0]))
    found = fsolve(equations, np.append(row["section"].values[1:], graze), xtol=1e-12)
    assert found[2] == pytest.approx(float(row["V"]), abs=1e-9)


# D: piecewise-smooth planar system


def planar_multiplier() -> float:
    """The map of the radius from section to section, in closed form (published: 0.002430512, its last digit is 1).

    Left: r' = r (1 - r) for the time pi. Right: dr/dtheta = r (2 - r) / (3.5 - r) =: g(r) over the angle pi, so that
    G(r) = 1.75 ln r - 0.75 ln(2 - r) grows by pi and dr_2/dr_1 = g(r_2) / g(r_1)."""
    growth = np.exp(np.pi)

    def g(r: float) -> float:
        return r * (2 - r) / (3.5 - r)

    def G(r: float) -> float:
        return float(1.75 * np.log(r) - 0.75 * np.log(2 - r))

    def left(r: float) -> float:
        return float(r * growth / (1 + r * (growth - 1)))

    r = brentq(lambda r: G(r) - G(left(r)) - np.pi, 1.5, 1.9999, xtol=1e-15)
    return float(growth / (1 + r * (growth - 1)) ** 2 * g(r) / g(left(r)))


def test_d_limit_cycle() -> None:
    orbit = ns.find_orbit(systems.planar(), start={"x": 1.0, "y": 0.1})
    states = orbit.crossing_states
    radius = float(np.hypot(*states[np.argmax(states[:, 1])]))
    assert radius == pytest.approx(1.934147003, abs=5e-10)
    assert orbit.period == pytest.approx(4.810271606, abs=5e-10)
    assert orbit.floquet_multipliers[0] == pytest.approx(1.0, abs=1e-11)
    assert orbit.floquet_multipliers[1] == pytest.approx(planar_multiplier(), abs=1e-12)
    assert orbit.stable and orbit.period_number == 0


# E: relief valve


@pytest.fixture(scope="module")
def valve() -> xr.Dataset:
    system = ns.models.relief_valve(q=8.0)
    return ns.continue_orbit(ns.find_orbit(system, start={"y1": 0.2, "y2": 0.0, "y3": 10.0}), "q", (7.0, 10.0))


def test_e_cycle() -> None:
    orbit = ns.find_orbit(ns.models.relief_valve(q=8.0), start={"y1": 0.2, "y2": 0.0, "y3": 10.0})
    assert orbit.minimum[0] == pytest.approx(0.668282564, abs=5e-10)
    assert orbit.maximum[0] == pytest.approx(6.009885866, abs=5e-10)
    assert orbit.period == pytest.approx(2.392389442, abs=5e-10)
    assert not orbit.signature.crossings


def test_e_cycle_is_born_in_a_hopf_bifurcation_and_reaches_the_seat(valve: xr.Dataset) -> None:
    (hopf,) = of_kind(valve, "hopf")
    assert hopf == pytest.approx(8.4911176352, abs=1e-7)
    (graze,) = of_kind(valve, "grazing")
    assert graze == pytest.approx(7.56, abs=0.01)
    assert set(np.unique(valve["contacts_per_period"])) == {0.0, 1.0}
    # Without forcing a multiplier is 1 and det(I - M) tells nothing: the branch itself shows on which side it goes on.
    q, contact = valve["q"].values, valve["contacts_per_period"].values == 1.0
    beside = [q[some][np.argsort(np.abs(q[some] - graze))[1:4]].mean() - graze for some in (contact, ~contact)]
    (kind,) = ns.special_points(valve)["grazing"].values[ns.special_points(valve)["kind"].values == "grazing"]
    assert kind == ("persistence" if beside[0] * beside[1] < 0.0 else "non_smooth_fold")


# K: stick-slip on a belt


def test_k_stick_slip_orbit() -> None:
    """Entering stick sets v to the belt's speed: a rank-deficient saltation matrix, multipliers {1, 0}."""
    orbit = ns.find_orbit(systems.belt(), start={"x": 0.5, "v": 0.2})
    assert orbit.period == pytest.approx(12.001031, abs=5e-7)
    times, states = orbit.crossing_times, orbit.crossing_states
    slip = int(np.argmax(states[:, 0]))
    stick = 1 - slip
    assert (times[stick] - times[slip]) % orbit.period == pytest.approx(4.296000, abs=5e-7)
    assert states[slip] == pytest.approx([1.0, 0.2], abs=1e-12)
    assert states[stick, 0] == pytest.approx(-0.54100635, abs=5e-9)
    assert np.abs(orbit.floquet_multipliers - [1.0, 0.0]).max() < 1e-10
