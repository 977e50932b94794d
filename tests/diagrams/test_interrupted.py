"""Ctrl-C in a sweep, a chart or basins: points that were run are those of a whole one, the others say so."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

SYSTEM = ns.models.discontinuous_support()
VALUES = np.linspace(0.25, 0.5, 41)
SHORT: dict[str, Any] = {"transient": 60, "keep": 20}


def was_run(result: Any) -> Any:
    """Marks of the points that do not say that they were left out."""
    words = result["status"].attrs["flag_meanings"].split()
    return result["status"].values != result["status"].attrs["flag_values"][words.index("interrupted")]


def part_of(verb: Callable[..., Any], system: ns.System, **options: Any) -> ns.Interrupted:
    with pytest.raises(ns.Interrupted) as caught:
        verb(system, progress=lambda done: done < 0.5, **SHORT, **options)
    return caught.value


@pytest.mark.parametrize("direction", ["up", "down", "both", None])
def test_a_sweep(direction: str | None) -> None:
    named: dict[str, Any] = {"parameter": "rho", "values": VALUES, "direction": direction}
    whole = ns.sweep(SYSTEM, progress=False, **named, **SHORT)
    error = part_of(ns.sweep, SYSTEM, **named)
    part = error.result
    run = was_run(part)
    assert run.sum() >= run.size / 2 and not run.all()
    assert f"{run.sum()} of {run.size} points of the sweep over rho were computed" in str(error)
    assert was_run(whole).all()
    for name in ("section", "maximum", "period_number", "contacts_per_period"):
        np.testing.assert_array_equal(part[name].values[run], whole[name].values[run], err_msg=name)
    for name in ("section", "maximum", "contacts_per_period", "residual"):
        assert np.isnan(part[name].values[~run]).all(), name


def test_a_frequency_response() -> None:
    values = np.linspace(3.0, 6.5, 41)
    part = part_of(ns.frequency_response, SYSTEM, values=values).result
    whole = ns.frequency_response(SYSTEM, values, progress=False, **SHORT)
    run = was_run(part)
    np.testing.assert_array_equal(part["amplitude"].values[run], whole["amplitude"].values[run])
    assert np.isnan(part["amplitude"].values[~run]).all() and not run.all()


@pytest.mark.parametrize(
    "options",
    [{}, {"carry": {"rho": "up"}}, {"start": [[0.0, 0.0], [0.01, 0.0]]}, {"refine": 0.9}],
    ids=["plain", "carried", "starts", "refined"],
)
def test_a_chart(options: dict[str, Any]) -> None:
    grid = {"rho": np.linspace(0.3, 0.5, 16), "g": np.linspace(-0.005, -0.004, 44)}
    named = {"transient": 20, "max_period": 4, "threads": 1, **options}
    whole = ns.chart(SYSTEM, grid, progress=False, **named)
    with pytest.raises(ns.Interrupted) as caught:
        ns.chart(SYSTEM, grid, progress=lambda done: done < 0.5, **named)
    part = caught.value.result
    run = was_run(part)
    assert run.any() and not run.all()
    assert f"{run.sum()} of {run.size} points of the chart over rho and g" in str(caught.value)
    for name in ("period_number", "contacts_per_period", "maximum"):
        np.testing.assert_array_equal(part[name].values[run], whole[name].values[run], err_msg=name)
    for name in ("contacts_per_period", "maximum", "minimum"):
        assert np.isnan(part[name].values[~run]).all(), name


#: x' = x - a x^3: a start ends at the one of +-1 / sqrt(a) on its side.
WELLS = ns.System(
    states=["x", "y"], parameters={"a": 1.0}, modes={"only": lambda t, u, p: (u.x - p.a * u.x**3, -u.y)}, period=1.0
)


def test_basins() -> None:
    """Runs that were made have the attractors of their sides."""
    x = np.linspace(-1.9, 2.1, 40)
    with pytest.raises(ns.Interrupted, match="points of the basins over x and y were computed") as caught:
        ns.basins(WELLS, {"x": x, "y": np.linspace(-1, 1, 15)}, progress=lambda done: done < 0.5, threads=1)
    part = caught.value.result
    run = was_run(part)
    assert run.any() and not run.all()
    assert (part["label"].values[~run] == -1).all()
    sides = part["section"].sel(state="x").values[part["label"].values]
    assert all(np.isnan(part[name].values).all() for name in ("fraction", "minimal_shock", "entropy", "uncertain"))
    np.testing.assert_allclose(sides[run], np.broadcast_to(np.sign(x)[:, None], run.shape)[run], rtol=1e-9)


def test_basin_fractions() -> None:
    """The result has the values at which all runs were made."""
    with pytest.raises(ns.Interrupted) as caught:
        ns.basin_fractions(
            WELLS, "a", [1.0, 4.0, 9.0], n_starts=200, box={"x": (-2, 2)}, progress=lambda done: done < 0.5, threads=1
        )
    part = caught.value.result
    assert 1 <= part.sizes["a"] < 3
    ends = np.sort(part["section"].sel(state="x").values, axis=-1)
    np.testing.assert_allclose(ends, [[-1.0, 1.0] / np.sqrt(a) for a in part["a"].values], rtol=1e-9)
    np.testing.assert_allclose(part["fraction"].sum("attractor"), 1.0)


def test_where_nothing_was_run_there_is_no_part() -> None:
    with pytest.raises(KeyboardInterrupt) as caught:
        ns.sweep(SYSTEM, "rho", VALUES, progress=lambda done: False)
    assert not isinstance(caught.value, ns.Interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        ns.chart(SYSTEM, {"rho": VALUES, "g": [-0.005, -0.004]}, progress=lambda done: False)
    assert not isinstance(caught.value, ns.Interrupted)


def test_where_no_value_is_whole_there_is_no_part() -> None:
    stopped: dict[str, Any] = {"box": {"x": (-2, 2)}, "progress": lambda done: done < 0.1, "threads": 1}
    with pytest.raises(KeyboardInterrupt) as caught:
        ns.basin_fractions(WELLS, "a", [1.0, 4.0], n_starts=600, **stopped)
    assert not isinstance(caught.value, ns.Interrupted)


def test_loads_are_measured_behind_a_chain_of_points() -> None:
    """They are lacking where it was cut, and the result says so by NaN."""
    rig = ns.mechanical(
        1.0,
        0.1,
        1.0,
        coordinates=["x"],
        parameters={"P": 1.0, "omega": 0.8, "gap": 0.5, "e": 0.6},
        forcing={"x": lambda t, p: p.P * np.cos(p.omega * t)},
        elements={"wall": ns.elements.Stop(at="x", position="gap", restitution="e")},
    )
    part = part_of(ns.sweep, rig, parameter="omega", values=np.linspace(0.7, 0.9, 21), loads=True).result
    run = was_run(part)
    assert run.any() and np.isfinite(part["section"].values[run]).all()
    assert np.isnan(part["wall_impulse"].values).all()
