"""Period numbers of sequences whose period is known; the cycle of transient, judgement and perturbation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nonsmooth.flow.options import longest_period
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.judging.judge import MARGIN, ROUNDS, contraction, multiplier
from nonsmooth.kernels.judging.settle import END, FRESH, PROBE, RUN, Jobs, Rules, begin_job, new_jobs, next_run

SIZE = np.array([1.0, 10.0])


def cycle(p: int, n: int, decay: float = 0.0, mu: float = 0.5) -> np.ndarray:
    """n points of a p-cycle, approached by an error decay * mu^k."""
    k = np.arange(n)
    turn = 2 * np.pi * k / p
    return np.stack([np.cos(turn) + decay * mu**k, 10 * np.sin(turn)], axis=1)


def rules(keep: int, size: np.ndarray = SIZE, max_period: int = 16, **given: Any) -> Rules:
    """Rules under which the motion has this size whatever its extremes."""
    usual = {
        "transient": 0,
        "keep": keep,
        "max_period": max_period,
        "first_look": 0,
        "attempts": 0,
        "beyond": 0,
        "tolerance": 1e-9,
        "difference": 1e-6,
        "least": size,
        "rounded": 0.0,
        "perturb_least": size,
        "perturb_rounded": 0.0,
    }
    return Rules(**(usual | given))


class Job:
    """One job that is told what its runs gave."""

    def __init__(self, given: Rules, carried: int = 1) -> None:
        n = len(given.least)
        self.rules, self.jobs, self.u = given, new_jobs(1, n, given.max_period), np.zeros(n)
        begin_job(self.jobs, 0, given, carried)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.jobs, name)[0]

    def ran(self, points: np.ndarray, code: int = codes.OK) -> None:
        nothing = np.zeros(len(self.u))
        next_run(self.jobs, 0, self.rules, code, np.ascontiguousarray(points), nothing, nothing, np.nan, self.u)

    def probed(self, mu: float) -> None:
        assert self.wanted == PROBE
        nothing = np.zeros(len(self.u))
        next_run(self.jobs, 0, self.rules, codes.OK, np.zeros((1, 2)), nothing, nothing, mu, self.u)


def judge(points: np.ndarray, mu: float = 0.5, size: np.ndarray = SIZE, **given: Any) -> Job:
    job = Job(rules(len(points), size, **given))
    job.ran(points)
    if job.wanted == PROBE:
        job.probed(mu)
    return job


def test_returns_are_scaled() -> None:
    """Of a 4-cycle: sqrt(2), 2 and sqrt(2) of its radius, then nothing, in each state's own unit."""
    jobs: Jobs = judge(cycle(4, 40)).jobs
    np.testing.assert_allclose(jobs.returns[0], [1.0, 2.0, 1.0, 0.0] * 4, atol=1e-12)


@pytest.mark.parametrize("p", [1, 2, 3, 5, 8, 16])
def test_a_cycle_has_its_least_period(p: int) -> None:
    verdict = judge(cycle(p, 100))
    assert (verdict.period_number, verdict.status) == (p, codes.OK)
    assert verdict.residual < 1e-12
    assert verdict.multiplier == 0.5


def test_three_states_are_judged_in_all_of_them() -> None:
    points = np.concatenate([cycle(2, 100), np.tile([0.0, 0.0, 1.0, 0.0], 25)[:, None]], axis=1)
    assert judge(points, size=np.ones(3)).period_number == 4


def test_a_period_beyond_the_longest_is_not_periodic() -> None:
    assert judge(cycle(17, 100)).status == codes.NOT_PERIODIC
    assert judge(cycle(5, 5)).status == codes.NOT_PERIODIC


def test_what_has_not_settled_is_slow() -> None:
    """Close to a cycle but still on its way; a multiplier too near to the unit circle; an unknown multiplier."""
    assert judge(cycle(1, 100, decay=0.01, mu=0.99), 0.99).status == codes.SLOW
    for mu in (1.0 - 0.5 * MARGIN, 1.0, 1.5, np.nan):
        verdict = judge(cycle(2, 100), mu)
        assert (verdict.period_number, verdict.status) == (0, codes.SLOW)


@pytest.mark.parametrize("p", [1, 2, 4])
def test_returns_that_all_shrink_are_slow(p: int) -> None:
    """Near a flip the error falls like 1 / sqrt(n): by less than one percent per return, but at every one."""
    k = np.arange(600, 700)
    points = cycle(p, 100)
    points[:, 0] += (-1.0) ** (k // p) / np.sqrt(k)
    assert judge(points, 0.99).status == codes.SLOW
    points[:, 0] = np.sin(k**2) / 50  # as small, without a direction
    assert judge(points, 0.99, SIZE / 50).status == codes.NOT_PERIODIC


def test_a_shorter_period_that_is_not_told_apart_is_slow() -> None:
    """A 2-cycle of width 1e-11 with a return of 1e-10 could be a fixed point."""
    k = np.arange(100)
    points = np.stack([1e-9 * (-1.0) ** k + 3e-10 * (k % 4 == 0), np.zeros(100)], axis=1)
    assert judge(points, 0.9).status == codes.SLOW


def test_points_that_are_not_finite_have_no_period() -> None:
    points = cycle(1, 20)
    points[-1] = np.nan
    verdict = judge(points)
    assert (verdict.period_number, verdict.status) == (0, codes.SLOW)
    assert np.isnan(verdict.residual)


@pytest.mark.parametrize(("keep", "longest"), [(2, 1), (10, 9), (16, 15), (17, 16), (100, 16)])
def test_periods_are_looked_for_as_far_as_the_kept_points_show_them(keep: int, longest: int) -> None:
    assert longest_period(keep, None) == longest


def test_multipliers_are_those_of_the_map() -> None:
    """Maps with known eigenvalues in a skewed basis: real ones, a pair of complex ones, a Jordan block, none but 0."""
    rng = np.random.default_rng(5)
    turn = 0.9 * np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    for n in (1, 2, 3, 6):
        kinds = [
            np.diag(np.linspace(0.1, 0.7, n) * (-1.0) ** np.arange(n)),
            0.6 * np.eye(n) + np.eye(n, k=1),
            np.eye(n, k=1),
        ]
        if n > 1:
            kinds.append(np.block([[turn, np.ones((2, n - 2))], [np.zeros((n - 2, 2)), 0.5 * np.eye(n - 2)]]))
        for normal, radius in zip(kinds, (0.7 if n > 1 else 0.1, 0.6, 0.0, 0.9), strict=False):
            basis = np.eye(n) + 0.3 * rng.normal(size=(n, n)) / n
            size = 10.0 ** rng.uniform(-3, 3, n)
            matrix = np.diag(size) @ basis @ normal @ np.linalg.inv(basis) @ np.diag(1.0 / size)
            images = np.array([np.zeros(n), *(0.5 * matrix.T * size[:, None])])
            found = multiplier(images, np.ones(n), size, 0.5, np.zeros((2, n, n)))
            defective = normal[0, 0] in (0.6, 0.0)  # differences over 1e-6, to 1e-16, move an n-fold eigenvalue so far
            assert found == pytest.approx(radius, abs=1e-10 ** (1.0 / n) if defective else 1e-8)
    assert np.isnan(multiplier(np.full((4, 3), np.nan), np.ones(3), np.ones(3), 1e-6, np.zeros((2, 3, 3))))


def test_what_is_held_has_no_multiplier() -> None:
    """(x, v) -> (x + .3 v, .5 v): x stands wherever it is, v dies out; a start that moves is not held."""
    start, size = np.array([0.7, 0.0]), np.array([2.0, 3.0])
    nudged = start + 1e-6 * np.diag(size)
    for shift, radius in ((0.0, 0.5), (1e-9, 1.0)):
        images = np.array([[x + 0.3 * v + shift, 0.5 * v] for x, v in (start, *nudged)])
        found = multiplier(images, start, size, 1e-6, np.zeros((2, 2, 2)))
        assert found == pytest.approx(radius, abs=1e-8)


@pytest.mark.parametrize("p", [1, 3])
def test_contraction_is_the_factor_of_the_distance_to_the_cycle(p: int) -> None:
    """A run of returns that near a 3-cycle by 0.8 per return, one return behind the cycle's count."""
    k = np.arange(ROUNDS * p + 2)
    points, run = cycle(p, 12), cycle(p, len(k) + 1)[1:]
    run[:, 1] += 1e-4 * 0.8**k
    assert contraction(points, run, SIZE, p, 1e-9) == pytest.approx(0.8**p, rel=1e-6)
    assert contraction(points, cycle(p, len(k)), SIZE, p, 1e-9) == 0.5


def test_what_still_settles_is_run_on_and_perturbed_on_an_unstable_orbit() -> None:
    """Transients of 1, 2 and 4 times the first; a perturbation only where the orbit is unstable, and by its size."""
    job = Job(rules(100, transient=50, attempts=3))
    waited = []
    for mu in (1.5, 1.0, np.nan):
        waited.append(int(job.transient))
        job.ran(cycle(2, 100))
        job.probed(mu)
        assert (job.wanted, job.settled) == (RUN, int(mu != 1.5))
        np.testing.assert_array_equal(job.u, 1e-3 * SIZE)
    assert [*waited, job.transient] == [50, 50, 100, 200]
    job.ran(cycle(2, 100))
    job.probed(1.5)
    assert (job.wanted, job.status, job.spent) == (END, codes.SLOW, 400 + 4 * 100)
    np.testing.assert_array_equal(job.u, 1e-3 * SIZE)


def test_a_job_is_looked_at_before_its_transient_ends() -> None:
    """After 40 returns, then after twice as many each time; it ends where its period number is certain."""
    noise = np.random.default_rng(2).normal(size=(10, 2))
    job, ended = Job(rules(10, transient=300, first_look=40, max_period=4)), []
    while job.wanted != END:
        ended.append(int(job.spent + job.transient))
        job.ran(noise)
    assert ended == [40, 100, 220, 300]
    assert job.status == codes.NOT_PERIODIC
    job = Job(rules(10, transient=300, first_look=40, max_period=4))
    job.ran(noise)
    job.ran(cycle(2, 10))
    job.probed(0.5)
    assert (job.wanted, job.period_number, job.spent) == (END, 2, 110)


def test_a_run_that_fails_ends_a_job() -> None:
    """A carried state that a stop has overtaken begins anew first; its own start beyond it is the end."""
    job = Job(rules(10))
    job.ran(cycle(1, 10), codes.BEYOND_STOP)
    assert job.wanted == FRESH
    job.ran(cycle(1, 10), codes.BEYOND_STOP)
    assert (job.wanted, job.status, job.period_number) == (END, codes.BEYOND_STOP, 0)
    job = Job(rules(10), carried=0)
    assert job.wanted == FRESH
    job.ran(cycle(1, 10), codes.DIVERGED)
    assert (job.wanted, job.status) == (END, codes.DIVERGED)


def test_a_period_of_a_run_that_may_have_missed_a_crossing_is_not_guaranteed() -> None:
    """Also where the job ends early."""
    for look in (0, 40):
        job = Job(rules(10, transient=300, first_look=look))
        job.ran(cycle(2, 10), codes.NOT_GUARANTEED)
        job.probed(0.5)
        assert (job.wanted, job.period_number, job.status) == (END, 2, codes.NOT_GUARANTEED)
