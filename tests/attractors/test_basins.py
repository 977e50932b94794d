"""Measures of basins against closed forms; basins and shares on systems whose attractors are known."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.attractors.basin_fractions import basin_fractions
from nonsmooth.attractors.basins import basins
from nonsmooth.attractors.basins_measures import (
    basin_entropy,
    boundary_dimension,
    minimal_shock,
    share_errors,
    starts_needed,
    uncertain_part,
)
from nonsmooth.flow.sections import Stroboscopic

QUIET = {"progress": False}


def cantor_labels(n: int, stages: int) -> np.ndarray:
    """Stripes: each gap of the middle-third Cantor set has the parity of its stage; the boundary is the set times a
    line, of dimension 1 + ln 2 / ln 3."""
    x = (np.arange(n) + 0.5) / n
    label = np.full(n, -1)
    for stage in range(stages):
        x = 3 * x
        gap = (label < 0) & (x >= 1) & (x < 2)
        label[gap] = stage % 2
        x = np.where(x >= 2, x - 2, x)
    label[label < 0] = stages % 2
    return np.tile(label[:, None], (1, n))


def test_entropy_in_closed_form() -> None:
    """Half and half in a box is ln 2; one label is 0; the mean over boxes."""
    halves = np.zeros((20, 20), dtype=int)
    halves[:, 10:] = 1
    assert basin_entropy(halves) == (0.0, pytest.approx(np.nan, nan_ok=True))
    assert basin_entropy(halves, box=20) == (pytest.approx(np.log(2)), pytest.approx(np.log(2)))
    four = np.arange(16).reshape(4, 4)
    assert basin_entropy(four, box=4)[0] == pytest.approx(np.log(16))
    shifted = np.zeros((10, 10), dtype=int)
    shifted[:, 7:] = 1  # two boxes with shares 2/5 and 3/5, two of one label
    expected = -(0.4 * np.log(0.4) + 0.6 * np.log(0.6))
    assert basin_entropy(shifted) == (pytest.approx(expected / 2), pytest.approx(expected))
    assert np.isnan(basin_entropy(np.zeros((3, 3), dtype=int))).all()


def test_dimension_of_a_line_a_cantor_set_and_noise() -> None:
    n = 729
    line = np.zeros((n, n), dtype=int)
    line[:, n // 2 :] = 1
    assert boundary_dimension(line) == pytest.approx(1.0, abs=0.01)
    assert boundary_dimension(cantor_labels(n, 6)) == pytest.approx(1 + np.log(2) / np.log(3), abs=0.08)
    noise = np.random.default_rng(1).integers(0, 2, (200, 200))
    assert boundary_dimension(noise) == pytest.approx(2.0, abs=0.03)
    assert np.isnan(boundary_dimension(np.zeros((50, 50), dtype=int)))


def test_uncertain_part_of_a_line() -> None:
    """Within a distance e of a line lie 2 e of the n - 2 e columns that have neighbours on both sides."""
    n = 400
    line = np.zeros((n, n), dtype=int)
    line[:, n // 2 :] = 1
    steps, parts = uncertain_part(line)
    np.testing.assert_allclose(parts, 2 * steps / (n - 2 * steps))


def test_starts_needed_is_the_least_number() -> None:
    """One attractor of share f is missed by n starts with (1 - f)^n."""
    for f in (0.5, 0.1, 0.015):
        n = starts_needed([f])
        assert (1 - f) ** n <= 0.01 < (1 - f) ** (n - 1)
    assert starts_needed([1.0]) == 1 and starts_needed([]) == 0
    n = starts_needed([0.98, 0.01, 0.01])
    assert 2 * 0.99**n <= 0.01 < 2 * 0.99 ** (n - 1)


def test_binomial_errors_and_the_least_shock() -> None:
    fraction, error = share_errors([25, 75], 100)
    assert fraction.tolist() == [0.25, 0.75]
    np.testing.assert_allclose(error, np.sqrt(0.25 * 0.75 / 100))
    x = y = np.linspace(0, 10, 11)
    label = np.zeros((11, 11), dtype=int)
    label[8:, :] = 1
    assert minimal_shock(label, x, y, np.array([[2.0, 5.0], [4.5, 1.0]]), 0) == 3.5
    assert np.isnan(minimal_shock(label, x, y, np.array([[20.0, 5.0]]), 0))


@pytest.fixture(scope="module")
def two_wells() -> ns.System:
    """Damped motion in the double well (x^2 - 1)^2 / 4 without forcing, looked at once per unit of time."""
    return ns.System(
        states=["x", "v"],
        parameters={"d": 0.5},
        modes={"only": lambda t, u, p: (u.v, u.x - u.x**3 - p.d * u.v)},
        period=2.0,
    )


def test_wells_by_symmetry(two_wells: ns.System) -> None:
    """u -> -u maps each basin on the other; both are the fixed points (+-1, 0)."""
    axis = np.linspace(-1.5, 1.5, 6)
    found = basins(two_wells, {"x": axis, "v": axis}, **QUIET)
    assert found["period_number"].values.tolist() == [1, 1]
    np.testing.assert_allclose(np.sort(found["section"].sel(state="x")), [-1, 1], atol=1e-8)
    np.testing.assert_array_equal(found["label"].values, 1 - found["label"].values[::-1, ::-1])
    assert found["fraction"].values.tolist() == [0.5, 0.5]
    # the slower eigenvalue at the bottom: lambda^2 + d lambda + 2 = 0, a decay of d / 2
    np.testing.assert_allclose(found["lyapunov"], -0.25, rtol=0.05)


def test_a_motion_that_escapes_is_diverged() -> None:
    """x'' = -x + x^3 beyond the barrier of 1 escapes; below it (damped) it comes to rest."""
    system = ns.System(
        states=["x", "v"],
        parameters={"d": 0.5},
        modes={"only": lambda t, u, p: (u.v, -u.x + u.x**3 - p.d * u.v)},
        period=1.0,
    )
    found = basins(system, {"x": [-1.5, 0.0, 0.5, 1.5], "v": [0.0]}, transient=100, keep=20, **QUIET)
    assert found["label"].values.ravel().tolist() == [-2, 0, 0, -2]
    assert float(found["fraction"][0]) == 0.5


def test_the_phase_of_the_section_is_that_of_the_starts() -> None:
    """In a linear oscillator every start leads to one cycle, whose point at a phase is known in closed form."""
    system = ns.models.discontinuous_support(g=1.0)
    p = system.values
    response = p["rho"] / (2 * p["k"] - p["m"] * p["omega"] ** 2 + 1j * p["c"] * p["omega"])
    for phase in (0.0, 0.3):
        found = basins(
            system, {"x": [-0.01, 0.02], "v": [0.0, 0.1]}, section=Stroboscopic(phase), transient=100, keep=20, **QUIET
        )
        assert found.sizes["attractor"] == 1
        expected = (response * np.exp(2j * np.pi * phase)).real
        assert float(found["section"].sel(state="x")[0]) == pytest.approx(expected, rel=1e-8)


def test_fractions_keep_their_number_along_a_parameter() -> None:
    """Fig. 9's hysteresis: the motion without contact, in closed form, keeps one number up to its grazing."""
    system = ns.models.discontinuous_support(g=0.02, rho=0.14)
    omega = np.array([5.95, 5.0, 5.3, 5.6, 5.86])  # any order
    found = basin_fractions(
        system, "omega", omega, n_starts=40, box={"x": (-0.04, 0.02), "v": (-0.2, 0.2)}, seed=3, **QUIET
    )
    p = system.values
    free = p["rho"] / np.hypot(2 * p["k"] - p["m"] * omega**2, p["c"] * omega)
    top = found["maximum"].sel(state="x").values
    without = np.isclose(top, free[:, None], rtol=1e-6)
    assert without.any(axis=1).tolist() == (free < p["g"]).tolist()
    (number,) = set(np.nonzero(without)[1].tolist())
    touching = 1 - number
    assert found.sizes["attractor"] == 2
    assert (found["period_number"].values[free >= p["g"], number] == -1).all()
    assert (found["fraction"].values[:, number] + found["fraction"].values[:, touching] == 1).all()
    assert found["omega"].values.tolist() == omega.tolist()


def test_equal_seeds_give_equal_results_on_any_number_of_threads() -> None:
    system = ns.models.discontinuous_support(omega=11.15, rho=0.33)
    box = {"x": (-0.02, 0.02), "v": (-0.2, 0.2)}
    one, two = (
        basin_fractions(system, "g", [0.0014, 0.0016], n_starts=50, box=box, seed=7, threads=n, **QUIET) for n in (1, 2)
    )
    assert one.identical(two)
    plane = {"x": np.linspace(-0.02, 0.02, 20), "v": np.linspace(-0.2, 0.2, 20)}
    a, b = (basins(system.with_parameters(g=0.0014), plane, threads=n, **QUIET) for n in (1, 2))
    assert a.identical(b)


@pytest.mark.parametrize(
    ("grid", "options", "message"),
    [
        ({"x": [0.0]}, {}, "two of the states"),
        ({"x": [0.0], "y": [0.0]}, {}, "y"),
        ({"x": [1.0, 0.0], "v": [0.0]}, {}, "rising"),
        ({"x": [0.0], "v": [0.0]}, {"fixed": {"x": 1.0}}, "give it once"),
    ],
)
def test_bad_planes_are_told_at_the_door(grid, options, message) -> None:
    with pytest.raises(ValueError, match=message):
        basins(ns.models.discontinuous_support(), grid, **options, **QUIET)


@pytest.mark.parametrize("box", [None, {}, {"x": (1.0,)}, {"x": (1.0, 0.0)}])
def test_bad_boxes_are_told_at_the_door(box) -> None:
    with pytest.raises(ValueError, match="box|low"):
        basin_fractions(ns.models.discontinuous_support(), "g", [0.001], box=box, **QUIET)


def test_where_no_run_settles_there_is_no_attractor() -> None:
    """A Taylor series of order 2 does not hold a cycle to the tolerance of a judgement."""
    s = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.0)
    found = ns.basin_fractions(
        s, "rho", [0.14], n_starts=3, box={"x": (0.0, 0.01)}, transient=10, keep=12, order=2, progress=False
    )
    assert found.sizes["attractor"] == 0 and found["not_converged"].values == [1.0]


@pytest.mark.parametrize("rubbing", [False, True])
@pytest.mark.parametrize("speed", [-1.0, 0.0, 1.0])
def test_a_start_beyond_a_stop_is_run_by_no_verb(rubbing: bool, speed: float) -> None:
    """Whatever its speed, and whatever decides beside the stop; where states are carried, all begins with the first
    value at which the start is on the right side."""
    elements = {"stop": ns.elements.Stop(at="q", position="d", restitution=0.5)}
    if rubbing:
        elements["rub"] = ns.elements.Coulomb(at="q", friction=0.01)
    forcing, values = {"q": lambda t, p: 0.3 * np.cos(t)}, {"d": 0.5, "c": 0.2}
    system = ns.mechanical(
        1.0, lambda p: p.c, 1.0, parameters=values, forcing=forcing, coordinates=["q"], elements=elements
    )
    start = {"q": 0.8, "v_q": speed}
    few = {"transient": 100, "keep": 10, "progress": False}
    for verb in (ns.simulate, ns.lyapunov):
        with pytest.raises(ns.SolveError, match="the start lies beyond a stop: 'stop'"):
            verb(system, start=start, periods=50)
    plane = ns.basins(system, {"q": [0.2, 0.8, 2.0], "v_q": [speed - 0.5, speed]}, **few)
    assert plane["label"].values.tolist() == [[0, 0], [-1, -1], [-1, -1]]
    for direction in ("up", None):
        swept = ns.sweep(system, "d", [0.5, 0.6, 0.9, 1.0], start=start, direction=direction, **few)
        assert swept["period_number"].values.tolist() == [0, 0, 1, 1]
        assert (swept["status"].values[2:] == 0).all() and (swept["status"].values[:2] != 0).all()
        spectrum = ns.lyapunov(
            system, parameter="d", values=[0.5, 0.9], start=start, periods=50, direction=direction, progress=False
        )
        assert (np.isfinite(spectrum["exponents"].values).any(axis=1) == [False, True]).all()
    grid = {"d": [0.5, 0.9], "c": [0.1, 0.3]}
    for carry in (None, {"d": "up"}):
        numbers = ns.chart(system, grid, start=start, carry=carry, **few)["period_number"].transpose("d", "c").values
        assert numbers.tolist() == [[0, 0], [1, 1]]
