"""Responses and diagrams of several coordinates, laid over theory: closed forms and the logistic map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

M, C = np.diag([1.0, 0.5]), np.array([[0.1, -0.04], [-0.04, 0.06]])
FREQUENCIES = np.linspace(0.6, 2.4, 10)


def chain() -> ns.System:
    """Two masses with a stop between them that is out of reach."""
    return ns.mechanical(
        M,
        C,
        lambda p: [[p.k + 1, -1], [-1, 1.5]],
        parameters={"k": 1.0, "F": 0.5, "w": 1.0},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        elements={"stop": ns.elements.ElasticStop(at={"q2": 1, "q1": -1}, position=9.0, stiffness=5.0)},
    )


def amplitudes(w: float, F: float, k: float = 1.0) -> np.ndarray:
    """|(K + i w C - w^2 M)^-1 F| of both masses."""
    return np.abs(np.linalg.solve(np.array([[k + 1, -1], [-1, 1.5]]) + 1j * w * C - w**2 * M, [F, 0]))


def runs(values: np.ndarray, **more: Any) -> xr.Dataset:
    coords = {"state": "q2"} if "state" not in more else more.pop("state")
    return xr.Dataset({"amplitude": ("run", values), "w": ("run", FREQUENCIES), **more}, coords)


def test_a_setting_that_follows_from_the_frequency_changes_along_a_response() -> None:
    """An unbalance pulls with m e w^2; a draw is off this rule by the same force at every frequency."""
    expected = np.array([amplitudes(w, 0.3 * w**2)[1] for w in FREQUENCIES])
    rule = {"F": (lambda p: 0.3 * p["w"] ** 2, 0.02)}
    found = ns.compare(runs(expected), chain(), settings=rule, draws=2)  # w sets the period: no parameter= is needed
    np.testing.assert_allclose(found["theory_at_run"], expected, rtol=1e-9)
    by_hand = [amplitudes(w, 0.3 * w**2)[1] for w in found["w"].values]
    np.testing.assert_allclose(found["theory_amplitude"].values[:, 0], by_hand, rtol=1e-9)
    off = found["drawn_F"].values - 0.3  # at w = 1
    drawn = [[amplitudes(w, 0.3 * w**2 + one)[1] for w in found["w"].values] for one in off]
    for name, edge in (("theory_low", 0.025), ("theory_high", 0.975)):
        np.testing.assert_allclose(found[name].values[:, 0], np.quantile(drawn, edge, axis=0), rtol=1e-9)


def test_a_response_says_in_which_state_it_is_compared() -> None:
    """The first of those that a measurement holds; of one that names none, the first of the theory."""
    both = np.array([amplitudes(w, 0.5) for w in FREQUENCIES])
    whole = ns.frequency_response(chain(), FREQUENCIES, direction="up", progress=False)
    for measured, state, column in (
        (whole, "q1", 0),
        (whole.sel(state=["q2", "v_q2"]), "q2", 1),
        (runs(both[:, 0], state={}), "q1", 0),
    ):
        found = ns.compare(measured, chain())
        assert found["state"].values.tolist() == [state]
        np.testing.assert_allclose(found["theory_at_run"], both[:, column], rtol=1e-9)
        assert np.abs(found["relative_difference"]).max() < 1e-8
    assert ns.compare(runs(both[:, 1]), whole)["theory_at_run"].values == pytest.approx(both[:, 1], rel=1e-9)


def test_a_direction_that_is_none_is_refused() -> None:
    measured = runs(np.ones(len(FREQUENCIES)), direction=("run", ["none"] * len(FREQUENCIES)))
    with pytest.raises(ValueError, match="reached up or down .up where not given.; got none"):
        ns.compare(measured, chain())


def doubled_in_the_middle(top: float, values: np.ndarray) -> xr.Dataset:
    """x' = 1 - a x^2 with a = top - s^2, doubled where a > 3/4: flips at s = -+ sqrt(top - 3/4)."""
    field = ns.Map(
        states=["x"],
        parameters={"top": top, "s": 0.0},
        branches=[ns.Branch(lambda u, p: (1 - (p.top - p.s**2) * u.x**2,))],
    )
    return ns.sweep(field, "s", values, start={"x": 0.3}, transient=3000, keep=40, progress=False)


@pytest.mark.parametrize("edges", [(-0.9, 0.6), (-0.6, 0.9), (-0.9, 0.9)])
def test_a_diagram_that_flips_twice_is_compared_at_both(edges: tuple[float, float]) -> None:
    """Whichever side of the doubled motion is shown more of, in the measurement or in the theory."""
    measured = doubled_in_the_middle(1.0, np.linspace(-0.8, 0.7, 61))[["section"]]
    theory = doubled_in_the_middle(0.95, np.linspace(*edges, 121))
    found = ns.compare(measured, theory, noise={"x": 1e-4})
    assert found["flip"].values.tolist() == ["1-2", "1-2"]
    np.testing.assert_allclose(found["measured_flip"], [-0.5, 0.5], atol=0.026)
    np.testing.assert_allclose(found["theory_flip"], np.sqrt(0.2) * np.array([-1, 1]), atol=0.02)
