"""Places beside its optimum at which a fit looks for other minima; the states whose rate is another one."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.identification.fit import likelihood
from nonsmooth.identification.fit.first_windows import rates


@pytest.mark.parametrize("another_piece", [True, False])
def test_places_between_are_looked_at_where_the_farthest_is_of_another_piece(
    another_piece: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sum of squares with a dip at five standard uncertainties, which a motion of one piece cannot have."""

    def motion(theta: np.ndarray, window: None, start: None) -> SimpleNamespace:
        return SimpleNamespace(log=SimpleNamespace(crossing_transition=np.arange(another_piece and theta[0] > 4.0)))

    def cost(theta: np.ndarray, starts: list[None]) -> float:
        return float(theta[0] ** 2 * (theta[0] != 5.0))

    monkeypatch.setattr(likelihood, "reduced", lambda *_: (np.eye(1),))
    unknowns = SimpleNamespace(low=np.array([-20.0]), high=np.array([9.0]), precision=np.zeros((1, 1)))
    problem = SimpleNamespace(
        unknowns=unknowns, pieces=[None], steady=(), marched=motion, cost=cost, residuals=lambda *_: None
    )
    problem.weights = lambda state: state
    found = likelihood._beside(SimpleNamespace(problem=problem, theta=np.zeros(1), starts=[None], apart=np.zeros(0)))
    assert [place.tolist() for _, _, place in found] == [[5.0]] * another_piece


def test_a_place_has_its_rate_where_it_also_stands_still() -> None:
    """Of three states: x moves by v in one mode and stands in the other, v and the drift of w are no state's."""
    system = ns.System(
        states=["x", "v", "w"],
        parameters={"d": 1.0},
        modes={
            "moves": lambda t, u, p: (u.v, -u.x, p.d),
            "stands": lambda t, u, p: (0.0 * u.x, 0.0 * u.v, p.d),
        },
        indicators={"gap": lambda t, u, p: u.x - p.d},
        transitions=[
            ns.Transition("moves", "stands", when="gap > 0"),
            ns.Transition("stands", "moves", when="gap < 0"),
        ],
    )
    assert rates(system) == {0: 1}
