"""Period numbers of sequences whose period is known."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.analysis.classify import MARGIN, judge, longest_period, residuals
from nonsmooth.analysis.classify_many import candidates, certain
from nonsmooth.kernels import codes

SIZE = np.array([1.0, 10.0])


def cycle(p: int, n: int, decay: float = 0.0, mu: float = 0.5) -> np.ndarray:
    """n points of a p-cycle, approached by an error decay * mu^k."""
    k = np.arange(n)
    turn = 2 * np.pi * k / p
    return np.stack([np.cos(turn) + decay * mu**k, 10 * np.sin(turn)], axis=1)


def test_residuals_are_scaled_returns() -> None:
    points = cycle(4, 40)
    r = residuals(points, SIZE, 16)
    assert len(r) == 16
    assert np.flatnonzero(r < 1e-12).tolist() == [3, 7, 11, 15]
    assert r[1] == pytest.approx(2.0)
    assert len(residuals(points[:5], SIZE, 16)) == 4


@pytest.mark.parametrize("p", [1, 2, 3, 5, 8, 16])
def test_a_cycle_has_its_least_period(p: int) -> None:
    verdict = judge(cycle(p, 100), SIZE, 16, lambda _: 0.5)
    assert (verdict.period_number, verdict.status) == (p, codes.OK)
    assert verdict.residual < 1e-12


def test_a_period_beyond_the_longest_is_not_periodic() -> None:
    assert judge(cycle(17, 100), SIZE, 16, lambda _: 0.5).status == codes.NOT_PERIODIC
    assert judge(cycle(5, 5), SIZE, 16, lambda _: 0.5).status == codes.NOT_PERIODIC


def test_what_has_not_settled_is_slow() -> None:
    """Close to a cycle but still on its way; a multiplier too near to the unit circle; an unknown multiplier."""
    assert judge(cycle(1, 100, decay=0.01, mu=0.99), SIZE, 16, lambda _: 0.99).status == codes.SLOW
    for mu in (1.0 - 0.5 * MARGIN, 1.0, np.nan):
        verdict = judge(cycle(2, 100), SIZE, 16, lambda _, mu=mu: mu)
        assert (verdict.period_number, verdict.status, verdict.unstable) == (0, codes.SLOW, False)
    assert judge(cycle(2, 100), SIZE, 16, lambda _: 1.5).unstable


@pytest.mark.parametrize("p", [1, 2, 4])
def test_returns_that_all_shrink_are_slow(p: int) -> None:
    """Near a flip the error falls like 1 / sqrt(n): by less than one percent per return, but at every one."""
    k = np.arange(600, 700)
    points = cycle(p, 100)
    points[:, 0] += (-1.0) ** (k // p) / np.sqrt(k)
    assert judge(points, SIZE, 16, lambda _: 0.99).status == codes.SLOW
    points[:, 0] = np.sin(k**2) / 50  # as small, without a direction
    assert judge(points, SIZE / 50, 16, lambda _: 0.99).status == codes.NOT_PERIODIC


def test_a_shorter_period_that_is_not_told_apart_is_slow() -> None:
    """A 2-cycle of width 1e-11 with a return of 1e-10 could be a fixed point."""
    k = np.arange(100)
    points = np.stack([1e-9 * (-1.0) ** k + 3e-10 * (k % 4 == 0), np.zeros(100)], axis=1)
    verdict = judge(points, SIZE, 16, lambda _: 0.9, tolerance=1e-9)
    assert verdict.status == codes.SLOW


def test_points_that_are_not_finite_have_no_period() -> None:
    points = cycle(1, 20)
    points[-1] = np.nan
    assert judge(points, SIZE, 16, lambda _: 0.5).period_number == 0


def test_many_at_once_are_judged_like_one() -> None:
    """Cycles near and far from settled, all that shrinks, chaos, what is not finite; multipliers of every kind."""
    k, rng = np.arange(600, 700), np.random.default_rng(3)
    shrinking = cycle(2, 100)
    shrinking[:, 0] += (-1.0) ** (k // 2) / np.sqrt(k)
    lost = cycle(2, 100)
    lost[50, 0] = np.nan
    kinds = [cycle(p, 100, decay, mu) for p in (1, 2, 4, 17) for decay, mu in ((0, 0.5), (1e-8, 0.99), (0.01, 0.99))]
    kinds += [cycle(4, 100) * [1, 0] + cycle(2, 100) * 1e-12, shrinking, lost, rng.normal(size=(100, 2))]
    for mu in (0.1, 0.9, 1.0 - 0.5 * MARGIN, 1.5, np.nan):
        for keep in (100, 12):
            points = np.array([one[-keep:] for one in kinds])
            size = np.tile(SIZE, (len(points), 1))
            period, status, residual, returns = candidates(points, size, 16, 1e-9)
            found = certain(period, np.full(len(points), mu), residual, returns) & (period > 0)
            one_by_one = [judge(p, SIZE, 16, lambda _, mu=mu: mu) for p in points]
            assert [v.period_number for v in one_by_one] == np.where(found, period, 0).tolist()
            assert [v.status for v in one_by_one] == np.where(
                period > 0, np.where(found, codes.OK, codes.SLOW), status
            ).tolist()
            np.testing.assert_array_equal([v.residual for v in one_by_one], residual)


@pytest.mark.parametrize(("keep", "longest"), [(2, 1), (10, 9), (16, 15), (17, 16), (100, 16)])
def test_periods_are_looked_for_as_far_as_the_kept_points_show_them(keep: int, longest: int) -> None:
    assert longest_period(keep, None) == longest
