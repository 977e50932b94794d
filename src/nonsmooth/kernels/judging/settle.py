"""The cycle that brings a job to its attractor: transient, judgement, perturbation where an orbit is unstable.

A job is a trajectory that shall settle. Whoever runs it (a compiled loop, Python, the rounds of a GPU) begins it, runs
what is wanted and tells ``next_run``, which says what is wanted next; only here is it decided::

    begin_job(jobs, j, rules, carried)
    while jobs.wanted[j] != END: run it; next_run(jobs, j, rules, ...)

Where ``wanted`` is RUN, the state goes on by ``transient`` returns and the ``keep`` of the rules, which are judged; a
FRESH run is the same from the job's own start; PROBE asks for the largest multiplier of the returns over
``period_number`` section points. A job may end before its transient does, once its period number is certain: it is
looked at after ``first_look`` returns, then after twice as many each time.
"""

from math import nan
from typing import Any, NamedTuple

import numpy as np
from numba import types

from nonsmooth.kernels.compile.cache import kernel
from nonsmooth.kernels.hybrid.codes import BEYOND_STOP, NOT_GUARANTEED, OK, SLOW
from nonsmooth.kernels.judging.judge import MARGIN, candidate, certain, size_of

END, RUN, FRESH, PROBE = 0, 1, 2, 3
PERTURBATION = 1e-3  # what perturbs a state on an unstable orbit, in units of the motion's size


class Rules(NamedTuple):
    """Settings that all jobs share."""

    transient: Any
    keep: Any
    max_period: Any  # 0: nothing is judged
    first_look: Any  # 0: none before the transient ends
    attempts: Any  # further transients, at most
    beyond: Any  # returns that follow each kept window, for its extremes
    tolerance: Any  # of a return, in units of the motion's size
    difference: Any  # of neighbours, in the same units
    least: Any  # (n,) the least size of a motion
    rounded: Any  # and as a part of the states' values
    perturb_least: Any  # (n,) for a perturbation: where errors set the least size, it would be a new motion
    perturb_rounded: Any


class Jobs(NamedTuple):
    """J jobs: what is wanted of them, and what is known."""

    wanted: Any  # (J,)
    transient: Any
    settled: Any  # 0: transitions that hold where the run begins are to be taken first
    carried: Any  # 1: not run from its own start
    attempt: Any
    guaranteed: Any  # 0: a crossing may have been missed in the window judged last
    period_number: Any
    status: Any
    spent: Any  # section returns run
    residual: Any
    multiplier: Any
    size: Any  # (J, n)
    perturbation: Any  # (J, n)
    returns: Any  # (J, max_period)


_i, _f = types.int64, types.float64
_f1, _f2, _i1 = _f[::1], _f[:, ::1], _i[::1]
RULES = types.NamedTuple((*[_i] * 6, _f, _f, _f1, _f, _f1, _f), Rules)
JOBS = types.NamedTuple((*[_i1] * 9, _f1, _f1, *[_f2] * 3), Jobs)


def new_jobs(jobs: int, n: int, max_period: int) -> Jobs:
    """Room for so many jobs of n states."""
    widths = (None, None, n, n, max_period)
    real = [np.zeros(jobs if width is None else (jobs, width)) for width in widths]
    return Jobs(*[*np.zeros((9, jobs), dtype=np.int64), *real])


@kernel(types.void(JOBS, _i, RULES, _i))
def begin_job(jobs, j, rules, carried):
    """Begin job j: from its own start, or ``carried`` on from where a run stands."""
    jobs.wanted[j] = RUN if carried != 0 else FRESH
    jobs.transient[j] = rules.first_look if 0 < rules.first_look < rules.transient else rules.transient
    jobs.settled[j] = 0
    jobs.carried[j] = carried
    jobs.attempt[j] = 0
    jobs.spent[j] = 0


@kernel(types.void(JOBS, _i, RULES, _i, _f2, _f1, _f1, _f, _f1))
def next_run(jobs, j, rules, code, points, top, bottom, mu, u):
    """Take what the run that was wanted of job j gave, and decide what is wanted next.

    After a run: its code, the kept section points, extremes of the states there, and u, where the run stands, which is
    moved where an orbit is unstable. After a probe: mu (nan: unknown), and u."""
    if jobs.wanted[j] == PROBE:
        jobs.multiplier[j] = mu
        if certain(jobs.period_number[j], mu, jobs.residual[j], jobs.returns[j]):
            jobs.status[j] = OK if jobs.guaranteed[j] != 0 else NOT_GUARANTEED
            jobs.wanted[j] = END
            return
        jobs.period_number[j] = 0
        jobs.status[j] = SLOW
    else:
        jobs.multiplier[j] = nan
        jobs.settled[j] = 1
        if code == BEYOND_STOP and jobs.carried[j] != 0:  # a carried state that a moved stop has overtaken
            begin_job(jobs, j, rules, 0)
            return
        if (code != OK and code != NOT_GUARANTEED) or rules.max_period == 0:
            jobs.period_number[j] = 0
            jobs.status[j] = code
            jobs.residual[j] = nan
            jobs.wanted[j] = END
            return
        jobs.guaranteed[j] = 1 if code == OK else 0
        jobs.spent[j] += jobs.transient[j] + rules.keep + rules.beyond
        for k in range(rules.least.shape[0]):
            jobs.size[j, k] = size_of(top[k], bottom[k], rules.least[k], rules.rounded)
            size = size_of(top[k], bottom[k], rules.perturb_least[k], rules.perturb_rounded)
            jobs.perturbation[j, k] = PERTURBATION * size
        p, status, residual = candidate(points, jobs.size[j], rules.max_period, rules.tolerance, jobs.returns[j])
        jobs.period_number[j] = p
        jobs.status[j] = status
        jobs.residual[j] = residual
        if p > 0:
            jobs.wanted[j] = PROBE
            return
    spent = jobs.spent[j]
    if spent - rules.keep - rules.beyond < rules.transient:  # that was a look before the transient's end
        left = max(rules.transient - spent, 0)
        jobs.transient[j] = spent if 2 * spent + rules.keep < rules.transient else left
    elif jobs.status[j] == SLOW and jobs.attempt[j] < rules.attempts:
        if jobs.multiplier[j] > 1.0 + MARGIN:
            for k in range(rules.least.shape[0]):
                u[k] += jobs.perturbation[j, k]
            jobs.settled[j] = 0
        jobs.transient[j] = (1 << jobs.attempt[j]) * max(rules.transient, 1)
        jobs.attempt[j] += 1
    else:
        jobs.wanted[j] = END
        return
    jobs.wanted[j] = RUN
