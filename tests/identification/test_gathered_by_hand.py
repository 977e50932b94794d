"""Curves of draws at the places of another curve."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.identification.gathered import _at


@pytest.mark.parametrize("flag", [False, True])
@pytest.mark.parametrize("value", [[1.0], [1.0, 1.0, 2.0], [2.0, 1.0, 1.0]])
def test_a_branch_of_one_point_and_one_that_begins_with_a_point_listed_twice(value: list[float], flag: bool) -> None:
    """As behind a boundary: the orbit stands there once with each signature, at one value of the parameter."""
    found = _at(np.array([0.5, 1.0]), np.array(value), np.full((len(value), 2), 3.0), flag)
    assert np.isnan(found[0]).all() and (found[1] == 3.0).all()


def test_between_points_a_curve_is_straight_in_either_direction() -> None:
    for value in ([1.0, 3.0], [3.0, 1.0]):
        assert _at(np.array([1.5, 3.0]), np.array(value), 2 * np.array(value), False) == pytest.approx([3.0, 6.0])
