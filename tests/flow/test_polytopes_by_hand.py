"""Linear programmes of few conditions, whose corners are compared, against HiGHS."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from nonsmooth.flow.polytopes import best


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_the_best_corner_is_that_of_a_solver(d: int) -> None:
    """Bounded programmes, programmes without a bound, and empty ones, of up to eight conditions."""
    rng, seen = np.random.default_rng(d), set()
    for _ in range(200):
        slopes = rng.normal(size=(int(rng.integers(d, 9)), d))
        slopes /= np.linalg.norm(slopes, axis=1)[:, None]
        cost, room = rng.normal(size=d), rng.normal(0.5, 1.0, size=len(slopes))
        found, known = best(cost, slopes, room), linprog(cost, slopes, room, bounds=(None, None))
        if known.status in (2, 4):  # HiGHS does not always tell empty from unbounded: without a cost it does
            known = linprog(0.0 * cost, slopes, room, bounds=(None, None))
            known.status = 3 if known.status == 0 else known.status
        seen.add(known.status)
        if known.status == 2:
            assert found is None
        elif known.status == 3:
            assert found is not None and np.isinf(found).all()
        else:
            assert found is not None and (slopes @ found <= room + 1e-9).all()
            assert cost @ found == pytest.approx(known.fun, abs=1e-9)
    assert seen == {0, 2, 3}


def test_a_corner_that_many_conditions_hold() -> None:
    """The tip of a pyramid of six sides, which any three of them hold."""
    angles = np.arange(6) * np.pi / 3
    slopes = np.column_stack([np.cos(angles), np.sin(angles), np.ones(6)]) / np.sqrt(2.0)
    tip = np.array([0.3, -0.2, 1.7])
    assert best(np.array([0.1, 0.2, -1.0]), slopes, slopes @ tip) == pytest.approx(tip, abs=1e-12)
    assert np.isinf(best(np.array([0.1, 0.2, 1.0]), slopes, slopes @ tip)).all()  # type: ignore[arg-type]
