"""Vectors that a matrix takes to zero, of few unknowns and of many, against a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.continuation.problems.solve import null_vectors


@pytest.mark.parametrize("n", [7, 150])
@pytest.mark.parametrize("cuts", [(), (3,), (2, 5)])
def test_null_vectors_of_differences_are_constant_between_cuts(n: int, cuts: tuple[int, ...]) -> None:
    differences = np.eye(n - 1, n) - np.eye(n - 1, n, k=1)
    differences[list(cuts)] *= 1e-12  # two parts that know nothing of each other
    found = null_vectors(differences, 1e-7)
    parts = np.split(np.arange(n), [cut + 1 for cut in cuts])
    expected = sum(np.outer(one, one) / one.sum() for one in (np.isin(np.arange(n), part) * 1.0 for part in parts))
    assert len(found) == len(parts)
    assert found.T @ found == pytest.approx(expected, abs=1e-9)
