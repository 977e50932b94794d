"""Points of codimension two on curves, against closed forms: maps written as resets at a phase, and grazing curves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import nonsmooth as ns
from nonsmooth.continuation.problems.locus import Locus
from nonsmooth.continuation.problems.shooting import Shooting


def mapping(f: Callable[[Any, Any], Any], start: Mapping[str, float], **parameters: float) -> tuple[ns.System, Any]:
    """A map as a system that stands still and jumps in the middle of every period; and a start."""
    system = ns.System(
        states=list(start),
        parameters=parameters,
        period=1.0,
        scale=dict.fromkeys(start, 1000.0),  # a size of 1
        modes={"rest": lambda t, u, p: tuple(0 * x for x in u) if len(start) > 1 else 0 * next(iter(u))},
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: f(u, p))],
    )
    return system, ns.find_orbit(system, start=dict(start), transient=0, period_number=1)


def row(branch: xr.Dataset, kind: str, i: int = 0) -> xr.Dataset:
    special = ns.special_points(branch)
    return special.isel(special=int(np.flatnonzero(special["kind"].values == kind)[i]))


def points(curve: xr.Dataset) -> list[tuple[str, float, float]]:
    """(kind, first parameter, second parameter) of the points of codimension two, in order of the first parameter."""
    x, y = [name for name, values in curve.coords.items() if values.dims == ("point",)]
    at = curve["special_point"].values
    kinds = [str(kind) for kind in curve["special_kind"].values]
    return sorted(zip(kinds, curve[x].values[at].tolist(), curve[y].values[at].tolist(), strict=True))


def henon(a: float, b: float) -> tuple[ns.System, Any]:
    x = (-(1 - b) + np.sqrt((1 - b) ** 2 + 4 * a)) / (2 * a)
    return mapping(lambda u, p: (1 - p.a * u.x**2 + u.y, p.b * u.x), {"x": x, "y": b * x}, a=a, b=b)


@pytest.mark.parametrize(("kind", "a", "end"), [("flip", 0.2, 3.0), ("fold", 0.2, -1.0)])
def test_henon_map_1_1_and_1_2(kind: str, a: float, end: float) -> None:
    """Flips at a = 3 (1 - b)^2 / 4, folds at -(1 - b)^2 / 4; 1:2 at (3, -1), 1:1 at (-1, -1); fold-flip at b = 1."""
    system, orbit = henon(a, 0.3)
    branch = ns.continue_orbit(orbit, "a", (-0.3, 0.5), step=0.1, points=40)
    curve = ns.continue_curve(row(branch, kind), {"a": (-1.9, 3.5), "b": (-1.1, 0.5)}, step=0.1)
    sign = 3.0 if kind == "flip" else -1.0
    assert curve["a"].values == pytest.approx(sign * (1 - curve["b"].values) ** 2 / 4, abs=1e-10)
    assert [(name, pytest.approx((x, y), abs=1e-8)) for name, x, y in points(curve)] == [
        (f"resonance_1_{2 if kind == 'flip' else 1}", (end, -1.0))
    ]
    assert system.name


def test_henon_map_resonances_on_the_torus_curve() -> None:
    """b = -1 keeps areas: there a = cos^2 - 2 cos of the angle; 1:1 at -1, 1:4 at 0, 1:3 at 5/4, 1:2 at 3."""
    _, orbit = henon(0.5, -0.8)
    branch = ns.continue_orbit(orbit, "b", (-1.1, -0.5))
    curve = ns.continue_curve(row(branch, "neimark_sacker"), {"a": (-1.5, 4.0), "b": (-1.2, -0.8)})
    assert curve["b"].values == pytest.approx(-1.0, abs=1e-10)
    found = {name: x for name, x, _ in points(curve)}
    exact = {"resonance_1_1": -1.0, "resonance_1_2": 3.0, "resonance_1_3": 1.25, "resonance_1_4": 0.0}
    assert found == pytest.approx(exact, abs=1e-7)
    assert all("real axis" in str(text) for text in curve["ended_because"].values)
    assert sorted(curve["a"].values[[0, -1]]) == pytest.approx([-1.0, 3.0], abs=1e-7)


def locus(system: ns.System, orbit: Any, kind: str, names: tuple[str, str]) -> tuple[Locus, np.ndarray]:
    shooting = Shooting(system, orbit.signature, 1, names)
    states = np.vstack([orbit.u, orbit.crossing_states])
    X = shooting.join(orbit.crossing_times, states, None, [system.values[name] for name in names])
    curve = Locus(shooting, kind, np.full(2, 0.7), 1.0, (2.0, 3.0))
    return curve, X / curve.scale


def test_derivatives_of_the_monodromy_matrix() -> None:
    """Central differences to 1e-6: det(M + I) = 1 - 2 a x - b of the Henon map, det M = e^2 exp(-2 pi c / omega) at a
    stop."""
    system, orbit = henon(0.5, 0.3)
    curve, Y = locus(system, orbit, "flip", ("a", "b"))
    exact = np.zeros(len(Y))
    exact[[0, -2, -1]] = -2 * 0.5, -2 * orbit.u[0], -1.0
    assert curve.gradient(Y) == pytest.approx(exact * curve.scale, abs=1e-6)
    system = ns.models.impact_oscillator()
    curve, Y = locus(system, ns.find_orbit(system), "neimark_sacker", ("omega", "c"))
    exact, det = np.zeros(len(Y)), 0.64 * np.exp(-0.1 * 2 * np.pi)
    exact[[-2, -1]] = det * 0.1 * 2 * np.pi, -2 * np.pi * det
    assert curve.gradient(Y) == pytest.approx(exact * curve.scale, abs=1e-6)


def test_generalised_flip_of_a_cubic_map() -> None:
    """x -> -(1 + m) x + q x^2 + b x^3: the flip m = 0 changes from soft to hard at b = -q^2."""
    _, orbit = mapping(lambda u, p: -(1 + p.m) * u.x + p.q * u.x**2 + p.b * u.x**3, {"x": 0.0}, m=-0.3, q=0.7, b=0.2)
    branch = ns.continue_orbit(orbit, "m", (-0.5, 0.5))
    curve = ns.continue_curve(row(branch, "flip"), {"b": (-1.0, 1.0), "m": (-0.5, 0.5)})
    assert curve["m"].values == pytest.approx(0.0, abs=1e-11)
    (found,) = points(curve)
    assert found[0] == "generalised_flip" and found[1] == pytest.approx(-0.49, abs=1e-8)


@pytest.mark.slow
def test_chenciner_point_of_a_rotation() -> None:
    """z -> e^(i w) z (1 + m + (d + i) |z|^2), seen in sheared coordinates: soft to hard at d = 0."""

    def turn(u: Any, p: Any) -> Any:
        x, y = u.x - p.shear * u.y, u.y
        r = x * x + y * y
        c, s = np.cos(1.3), np.sin(1.3)
        a, b = 1 + p.m + p.d * r, r
        X, Y = c * x - s * y, s * x + c * y
        X, Y = a * X - b * Y, b * X + a * Y
        return X + p.shear * Y, Y

    _, orbit = mapping(turn, {"x": 0.0, "y": 0.0}, m=-0.3, d=-0.5, shear=0.4)
    branch = ns.continue_orbit(orbit, "m", (-0.5, 0.5))
    curve = ns.continue_curve(row(branch, "neimark_sacker"), {"d": (-1.0, 1.0), "m": (-0.5, 0.5)})
    assert curve["m"].values == pytest.approx(0.0, abs=1e-11)
    (found,) = points(curve)
    assert found[0] == "chenciner" and found[1] == pytest.approx(0.0, abs=1e-8)


def test_chenciner_point_with_quadratic_terms() -> None:
    """Quadratic terms beside the cubic one: the coefficient by Wan's formula.

    For z -> mu z + g20 z^2 / 2 + g11 z zbar + g02 zbar^2 / 2 + g21 z^2 zbar / 2 the coefficient is
    Re(conj(mu) g21) / 2 - Re((1 - 2 mu) conj(mu)^2 g20 g11 / (2 (1 - mu))) - |g11|^2 / 2 - |g02|^2 / 4."""
    w, q = 1.1, 0.8
    mu = np.exp(1j * w)

    def step(u: Any, p: Any) -> Any:
        # z' = mu (1 + m) z + q (z^2 + 2 z zbar + zbar^2) / 2 + k z^2 zbar, so g20 = g11 = g02 = q and g21 = 2 k
        x, y = u
        c, s = (1 + p.m) * np.cos(w), (1 + p.m) * np.sin(w)
        r = x * x + y * y
        return c * x - s * y + 2 * q * x * x + p.k * r * x, s * x + c * y + p.k * r * y

    def wan(k: float) -> float:
        first = (np.conj(mu) * 2 * k).real / 2
        second = ((1 - 2 * mu) * np.conj(mu) ** 2 * q * q / (2 * (1 - mu))).real
        return float(first - second - q * q / 2 - q * q / 4)

    exact = brentq(wan, -20.0, 20.0)
    _, orbit = mapping(step, {"x": 0.0, "y": 0.0}, m=-0.1, k=exact + 0.5)
    branch = ns.continue_orbit(orbit, "m", (-0.2, 0.2))
    curve = ns.continue_curve(row(branch, "neimark_sacker"), {"k": (exact - 1.0, exact + 1.0), "m": (-0.2, 0.2)})
    (found,) = points(curve)
    assert found[0] == "chenciner" and found[1] == pytest.approx(exact, abs=1e-7)


def test_cusp_and_fold_flip() -> None:
    """x -> x + h + s x - x^3: folds 27 h^2 = 4 s^3, cusp at 0; beside it y -> -(s + 1/2) y + y^3 flips at s = 1/2."""
    _, orbit = mapping(
        lambda u, p: (u.x + p.h + p.s * u.x - u.x**3, -(p.s + 0.5) * u.y + u.y**3), {"x": 1.0, "y": 0.0}, h=0.0, s=0.8
    )
    branch = ns.continue_orbit(orbit, "h", (-1.0, 1.0))
    curve = ns.continue_curve(row(branch, "fold"), {"h": (-0.9, 0.9), "s": (-0.5, 1.0)})
    h, s = curve["h"].values, curve["s"].values
    assert 27 * h**2 == pytest.approx(4 * s**3, abs=1e-9)
    found = points(curve)
    assert [name for name, _, _ in found] == ["cusp", "fold_flip", "fold_flip"]
    assert found[0][1:] == pytest.approx((0.0, 0.0), abs=1e-5)
    assert [abs(x) for _, x, _ in found[1:]] == pytest.approx([np.sqrt(4 * 0.125 / 27)] * 2, abs=1e-9)


@pytest.mark.parametrize("own", ["fold", "flip", "neimark_sacker"])
def test_a_torus_beside_a_fold_or_a_flip(own: str) -> None:
    """z -> m e^(0.8 i) z beside x -> x + h - x^2 (fold at h = 0) or x -> -(1 + h) x + x^3: both at m = 1."""
    c, s = np.cos(0.8), np.sin(0.8)

    def step(u: Any, p: Any) -> Any:
        alone = p.flip * (u.x**3 - (1 + p.h) * u.x) + (1 - p.flip) * (u.x + p.h - u.x**2)
        return alone, p.m * (c * u.y - s * u.z), p.m * (s * u.y + c * u.z)

    start = {"x": 0.0 if own == "flip" else 0.3, "y": 0.0, "z": 0.0}
    h = -0.1 if own == "flip" else 0.09
    _, orbit = mapping(step, start, h=h, m=0.8, flip=float(own == "flip"))
    name = "m" if own == "neimark_sacker" else "h"
    branch = ns.continue_orbit(orbit, name, (0.5, 1.5) if name == "m" else (-0.2, 0.4))
    curve = ns.continue_curve(row(branch, own), {"h": (-0.2, 0.4), "m": (0.6, 1.4)})
    found = [point for point in points(curve) if "_neimark_sacker" in point[0]]
    first = "flip" if own == "flip" else "fold"
    if own == "neimark_sacker":  # h = x^2 along the curve: it ends where the orbits end
        assert curve["m"].values == pytest.approx(1.0, abs=1e-9)
    assert [(name, pytest.approx((x, y), abs=1e-6)) for name, x, y in found] == [
        (f"{first}_neimark_sacker", (0.0, 1.0))
    ]


@pytest.mark.parametrize("low", [0.6, pytest.param(0.45, marks=pytest.mark.slow)])
def test_rigid_stop_changes_over_where_the_free_period_fits(low: float) -> None:
    """On A's grazing curve persistence and non-smooth fold change over where half the free period divides the
    forcing's: M- has no entry from speed to position at omega = 2 sqrt(k - c^2 / 4) / n."""
    branch = ns.continue_orbit(ns.find_orbit(ns.models.impact_oscillator(A=0.05)), "A", (0.02, 1.2))
    curve = ns.continue_curve(row(branch, "grazing"), {"omega": (low, 1.1), "A": (0.01, 1.0)})
    w = np.sqrt(1 - 0.01 / 4)
    for kind in ("grazing_fold", "grazing_flip"):
        omega = [x for name, x, _ in points(curve) if name == kind]
        assert omega == pytest.approx([x for x in (2 * w / 4, 2 * w / 3, 2 * w / 2) if x > low], abs=1e-7)


def test_soft_stop_changes_over_with_its_damper() -> None:
    """det(I + M- S) with S = [[1, 0], [-c_s / m, 1]]: the doubled orbit is born or not, in closed form."""
    system = ns.models.discontinuous_support(rho=0.14, g=0.02, omega=3.3)
    branch = ns.continue_orbit(ns.find_orbit(system), "omega", (3.0, 3.7))
    graze = row(branch, "grazing")
    omega = float(graze["omega"])
    m, k, c = 0.838, 8.47, 0.87
    a, w, T = c / (2 * m), np.sqrt(2 * k / m - (c / (2 * m)) ** 2), 2 * np.pi / omega
    trace, det, corner = 2 * np.exp(-a * T) * np.cos(w * T), np.exp(-2 * a * T), np.exp(-a * T) * np.sin(w * T) / w
    # tr(M S) = tr M - (c_s / m) M12
    signs = {"grazing_fold": -1, "grazing_flip": 1}
    exact = {kind: m * (trace + sign * (1 + det)) / corner for kind, sign in signs.items()}
    curve = ns.continue_curve(graze, {"c_s": (0.01, 40.0), "rho": (0.1, 0.2)})
    found = {name: x for name, x, _ in points(curve)}
    expected = {kind: c_s for kind, c_s in exact.items() if 0.01 < c_s < 40.0}
    assert expected and found == pytest.approx(expected, rel=1e-5)
