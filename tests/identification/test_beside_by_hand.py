"""Places beside its optimum at which a fit looks for other minima, and what short windows lead to."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from nonsmooth.identification.arrow import Residuals
from nonsmooth.identification.fit import likelihood
from nonsmooth.identification.fit.first_level import foreseen


@pytest.mark.parametrize("another_piece", [True, False])
def test_places_between_are_looked_at_where_the_farthest_is_of_another_piece(
    another_piece: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sum of squares with a dip at five standard uncertainties, which a motion of one piece cannot have."""

    def motion(theta: np.ndarray, window: None, start: None) -> SimpleNamespace:
        return SimpleNamespace(log=SimpleNamespace(crossing_transition=np.arange(another_piece and theta[0] > 4.0)))

    def cost(theta: np.ndarray, starts: list[None], weights: None) -> float:
        return float(theta[0] ** 2 * (theta[0] != 5.0))

    monkeypatch.setattr(likelihood, "reduced", lambda *_: (np.eye(1),))
    unknowns = SimpleNamespace(low=np.array([-20.0]), high=np.array([9.0]), precision=np.zeros((1, 1)))
    problem = SimpleNamespace(
        unknowns=unknowns, pieces=[None], steady=(), marched=motion, cost=cost, residuals=lambda *_: None
    )
    problem.weights = lambda state: state
    found = likelihood._beside(SimpleNamespace(problem=problem, theta=np.zeros(1), starts=[None]))
    assert [place.tolist() for _, _, place in found] == [[5.0]] * another_piece


def test_the_foreseen_sum_of_squares_is_that_of_linear_least_squares() -> None:
    """Of two pieces with starts of their own, all residuals linear: by one fit of all unknowns together."""
    rng = np.random.default_rng(5)
    r, G, S = (rng.standard_normal(shape) for shape in ((2, 12), (2, 12, 3), (2, 12, 2)))
    pieces = [SimpleNamespace(which=np.arange(3), readings=(np.arange(12), np.zeros(12, int)))] * 2
    unknowns = SimpleNamespace(guess=np.zeros(3), centre=np.zeros(3), precision=np.zeros((3, 3)))
    problem = SimpleNamespace(pieces=pieces, unknowns=unknowns, noise=np.array([0.5]))
    problem.residuals = lambda *_: Residuals([*r], [*G], [*S], np.zeros(0), np.zeros((0, 3)))
    problem.weights = lambda _: [np.full(12, 2.0)] * 2
    nothing = np.zeros((12, 2))
    together = np.vstack([np.hstack([G[0], S[0], nothing]), np.hstack([G[1], nothing, S[1]])])
    (least,) = np.linalg.lstsq(together, r.ravel(), rcond=None)[1]
    assert foreseen(problem, np.zeros(3), [None, None]) == pytest.approx(4.0 * least, rel=1e-10)
