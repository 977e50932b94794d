"""Functions of numbers that are made of a system's expressions, against the formulas written by hand."""

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.system.symbolic.numeric import numeric

TINY = 0.1 + 0.2  # 0.30000000000000004: sixteen digits that fifteen do not hold


@pytest.fixture(scope="module")
def traced():
    system = ns.System(
        states=["x", "v"],
        parameters={"k": 2.0, "w": 3.0},
        modes={"all": lambda t, u, p: (u.v, -p.k * u.x**3 + TINY * np.cos(p.w * t))},
        outputs={"one": lambda t, u, p: 1.0, "share": lambda t, u, p: u.x / p.k},
    )
    return system.traced


def test_one_point_and_many_have_the_values_of_the_formulas(traced) -> None:
    field = numeric(traced, traced.fields[0])
    p, t, u = np.array([2.0, 3.0]), np.linspace(0.0, 1.0, 5), np.random.default_rng(1).normal(size=(5, 2))
    expected = np.stack([u[:, 1], -2.0 * u[:, 0] ** 3 + TINY * np.cos(3.0 * t)], axis=1)
    np.testing.assert_allclose(field(p, t, u), expected, rtol=1e-15)
    np.testing.assert_allclose(field(p, t[2], u[2]), expected[2], rtol=1e-15)
    assert field([0.0, 0.0], 0.0, [0.0, 0.0])[1] == TINY  # to the last digit


def test_constants_have_the_shape_of_the_arguments(traced) -> None:
    shown = numeric(traced, tuple(output[0] for output in traced.outputs))
    assert shown([2.0, 3.0], 0.0, np.ones((4, 2))).tolist() == [[1.0, 0.5]] * 4
    assert shown([[2.0, 3.0], [4.0, 3.0]], 0.0, [1.0, 0.0]).tolist() == [[1.0, 0.5], [1.0, 0.25]]
    assert numeric(traced, ())([2.0, 3.0], np.zeros(3)).shape == (3, 0)
    assert numeric(traced, (), ())([2.0, 3.0], np.zeros(3)).shape == (3, 0, 1)


def test_slopes_stand_behind_each_expression(traced) -> None:
    found = numeric(traced, traced.fields[0], (*traced.u, traced.p[0]))([2.0, 3.0], 0.0, [[0.5, 1.0], [0.0, 2.0]])
    assert found.shape == (2, 2, 4)
    np.testing.assert_allclose(found[0], [[1.0, 0.0, 1.0, 0.0], [-0.25 + TINY, -1.5, 0.0, -0.125]], rtol=1e-15)


def test_a_division_by_zero_is_infinite_or_raises_where_quick(traced) -> None:
    part = (traced.outputs[1][0],)
    assert numeric(traced, part)([0.0, 1.0], 0.0, [1.0, 0.0]) == np.inf
    quick = numeric(traced, part, traced.u[:1], quick=True)
    assert quick([4.0, 1.0], 0.0, [1.0, 0.0]) == [0.25, 0.25]
    with pytest.raises(ZeroDivisionError):
        quick([0.0, 1.0], 0.0, [1.0, 0.0])
