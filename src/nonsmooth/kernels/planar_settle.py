"""Many points of a chart, or many starts of a basin, brought to their attractors and judged, by planar exact flow.

The rules are those of ``analysis.classify`` and ``analysis.settle``: a period number p needs a small p-th return and
multipliers of the p-th return map (by finite differences) inside the unit circle; what is still settling is run on,
what sits on an unstable orbit is pushed off it. Here they are compiled, because in Python they cost more than the
motion itself. Beyond those rules, a point may stop before its transient ends once all that has been shown.

Places of ``choice``: transient, keep, max_period, first look (0: none before the transient ends), further attempts,
carried along (0 or 1), extremes wanted (0 or 1). ``norms``: tolerance of a return, then the least size of a motion in
each state.
"""

from math import fabs, hypot, log, nan, sqrt

from numba import types

from .cache import device, inline, kernel
from .codes import BEYOND_STOP, NOT_PERIODIC, OK, SLOW
from .records import FORM, KEPT, NET, TABLES, Goal, Motion, Section
from .records import WORK as RUN_WORK
from .sections import chain

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _f4, _i1, _i2 = _f[::1], _f[:, ::1], _f[:, :, ::1], _f[:, :, :, ::1], _i[::1], _i[:, ::1]

LINEAR, BUFFERS = FORM, KEPT
SCRATCH = types.Tuple((TABLES, RUN_WORK))
WORK = types.Tuple((_f1, _f1, _i1, _f1, _f1, _i1, _f2, _f1))
RESULTS = types.Tuple((_i1, _i1, _f1, _f1, _f1, _f1, _f2, _f2, _f2, _i1, _i1))

NEARLY = 1e-3
SHRINKING = 3e-2
STRETCH = 32
MARGIN = 2e-3
APART = 10.0
KICK = 1e-3
NUDGE = 1e-6
ROUNDED = 1e-4
FOR_EVER = 1 << 62  # steps without a pause


@device
def go(i, u, clock, counters, linear, net, plan, phase, t_max, transient, keep, limit, out, scratch, rest):
    """Run parameter row i on from (u, clock, counters), which are left where it ends. Returns the status."""
    clock[2] = 0.0  # the time stands as it is: the kernel must not scale it to another period
    section = Section(plan[0], plan[1], plan[2], plan[3], plan[4], plan[5], phase, t_max)
    goal = Goal(transient, keep, 0.0, 0.0, limit, FOR_EVER)
    motion = Motion(u, rest[0, 0:0], clock, counters)
    chain(i, i + 1, rest[0:0], linear, net, section, goal, motion, out, scratch[0], scratch[1])
    return out[12][i]


@inline
def size_of(top, bottom, least):
    """Half the range of a state, no less than the least size, nor than what rounding leaves of a large value."""
    return max(0.5 * (top - bottom), least, ROUNDED * max(fabs(top), fabs(bottom)))


@inline
def distance(section, i, a, b, size):
    """Scaled distance between two section points of row i, in the max norm."""
    dx = fabs(section[i, a, 0] - section[i, b, 0]) / size[0]
    dv = fabs(section[i, a, 1] - section[i, b, 1]) / size[1]
    return dx if dx >= dv else dv


@device
def find_returns(section, i, keep, size, longest, returns):
    """returns[p - 1]: the largest scaled return over the last p points, p = 1 ... longest."""
    for p in range(1, longest + 1):
        first = keep - p if 2 * p <= keep else p
        worst = 0.0
        for k in range(first, keep):
            d = distance(section, i, k, k - p, size)
            if not d <= worst:
                worst = d
        returns[p - 1] = worst


@device
def shrinks(section, i, keep, size, max_period):
    """Whether for some p every one of the last returns is small and less than that p before."""
    for p in range(1, max_period + 1):
        n = keep - p
        n = n if n < STRETCH + p else STRETCH + p
        if n < 2 * p + 8:
            continue
        good = True
        for k in range(keep - n, keep):
            d = distance(section, i, k, k - p, size)
            if not d < SHRINKING or (k >= keep - n + p and not d < distance(section, i, k - p, k - 2 * p, size)):
                good = False
                break
        if good:
            return True
    return False


@device
def modulus(images, nudge):
    """Largest modulus of the eigenvalues of the map whose images of a point and its two neighbours these are."""
    a = (images[1, 0] - images[0, 0]) / nudge
    c = (images[1, 1] - images[0, 1]) / nudge
    b = (images[2, 0] - images[0, 0]) / nudge
    d = (images[2, 1] - images[0, 1]) / nudge
    half = 0.5 * (a + d)
    square = 0.25 * (a - d) * (a - d) + b * c
    if square >= 0.0:
        return fabs(half) + sqrt(square)
    return hypot(half, sqrt(-square))


@device
def candidate(section, i, keep, size, max_period, tolerance, returns):
    """(period number, status, residual) by the kept section points of row i alone; the status is OK where there is a
    period whose multipliers are still to be seen, and the period number is 0 where there is none."""
    longest = max_period if max_period < keep - 1 else keep - 1
    find_returns(section, i, keep, size, longest, returns)
    least = returns[0]
    p = 0
    for k in range(longest):
        if not returns[k] < 1e300:
            return 0, SLOW, returns[k]
        if returns[k] < least:
            least = returns[k]
        if p == 0 and returns[k] <= tolerance:
            p = k + 1
    if p > 0:
        return p, OK, returns[p - 1]
    settling = least < NEARLY or shrinks(section, i, keep, size, max_period)
    return 0, SLOW if settling else NOT_PERIODIC, least


@device
def certain(p, mu, residual, returns):
    """Whether the period number p stands with the multiplier mu: it contracts, and no shorter period is as near."""
    if mu < 0.0 or mu >= 1.0 - MARGIN:
        return False
    away = residual / (1.0 - mu)
    for d in range(1, p):
        if p % d == 0 and returns[d - 1] <= APART * away:
            return False
    return True


@device
def multiplier(
    i, p, keep, size, tolerance, linear, net, quiet, phase, t_max, limit, out, probe, scratch, rest, moved,
    moved_clock, moved_counters, images,
):  # fmt: skip
    """Largest modulus of the multipliers of the p-th return map, by differences at a kept point; -1: unknown.

    That point is the one whose p-th return is the last one kept, so that only its neighbours must be run."""
    nudge = NUDGE if NUDGE > 1e2 * tolerance else 1e2 * tolerance
    section = out[0]
    base = keep - 1 - p
    images[0, 0] = section[i, keep - 1, 0] / size[0]
    images[0, 1] = section[i, keep - 1, 1] / size[1]
    for j in range(1, 3):
        moved[0] = section[i, base, 0]
        moved[1] = section[i, base, 1]
        moved[j - 1] += nudge * size[j - 1]
        T = linear[6][i]
        moved_clock[0] = phase * T if T < 1e300 else 0.0
        moved_clock[1] = 0.0
        moved_counters[0] = out[11][i, base]
        code = go(
            i, moved, moved_clock, moved_counters, linear, net, quiet, phase, t_max, p - 1, 1, limit, probe, scratch,
            rest,
        )  # fmt: skip
        if code != OK:
            return -1.0
        images[j, 0] = moved[0] / size[0]
        images[j, 1] = moved[1] / size[1]
    return modulus(images, nudge)


@device
def verdict_of(
    i, keep, size, max_period, tolerance, linear, net, quiet, phase, t_max, limit, out, probe, scratch, rest, moved,
    moved_clock, moved_counters, images, returns,
):  # fmt: skip
    """(period number, status, residual, multiplier) of the kept section points of row i: see ``analysis.classify``."""
    p, status, residual = candidate(out[0], i, keep, size, max_period, tolerance, returns)
    if p == 0:
        return 0, status, residual, -1.0
    mu = multiplier(
        i, p, keep, size, tolerance, linear, net, quiet, phase, t_max, limit, out, probe, scratch, rest, moved,
        moved_clock, moved_counters, images,
    )  # fmt: skip
    if not certain(p, mu, residual, returns):
        return 0, SLOW, residual, mu
    return p, OK, residual, mu


@kernel(types.void(
    _i1, _f2, _f1, _i1, _i1, _f1, LINEAR, NET, _i1, _i1, _f, _f, _f1, BUFFERS, BUFFERS, SCRATCH, WORK, RESULTS,
))  # fmt: skip
def settle_many(
    rows, starts, begin, modes, choice, norms, linear, net, plan, quiet, phase, t_max, limit, out, probe, scratch,
    work, results,
):  # fmt: skip
    """Job j: parameter row rows[j], from starts[j] at the phase begin[j] of the forcing in the mode modes[j].

    With choice[5] = 1 a job goes on from where the one before it ended (from its own start where that failed).
    ``quiet`` is ``plan`` without extremes. ``results``: period number, status, residual, multiplier, crossings and
    contacts per return, maxima, minima, last section point, mode there, returns spent.
    """
    u, clock, counters, moved, moved_clock, moved_counters, images, returns = work
    period_number, status, residual, multipliers, crossings, contacts, maximum, minimum, last, mode, spent = results
    transient, keep, max_period = choice[0], choice[1], choice[2]
    look, attempts, carried = choice[3], choice[4], choice[5]
    last_plan = plan if choice[6] != 0 else quiet
    tolerance = norms[0]
    size = norms[3:5]
    rest = starts
    fresh = True
    for j in range(rows.shape[0]):
        i = rows[j]
        T = linear[6][i]
        attempt = 0
        while True:  # a carried state that a moved stop has overtaken begins anew
            if fresh or carried == 0 or attempt > 0:
                u[0] = starts[j, 0]
                u[1] = starts[j, 1]
                clock[0] = begin[j] * T if T < 1e300 else 0.0
                counters[0] = modes[j]
            else:
                clock[0] = phase * T if T < 1e300 else 0.0
            clock[1] = 0.0
            counters[1] = -1
            used = 0
            # looks before the transient ends: at the first look, then at twice as many returns each time
            todo = look if 0 < look < transient else transient
            early = todo < transient
            code = OK
            p, verdict, gap, mu = 0, SLOW, 1e300, -1.0
            extra = 0
            while True:
                code = go(
                    i, u, clock, counters, linear, net, quiet, phase, t_max, todo, keep, limit, out, scratch, rest
                )
                if code == OK:  # true extremes are dear: one return with them gives the motion's size
                    code = go(
                        i, u, clock, counters, linear, net, plan, phase, t_max, 0, 1, limit, probe, scratch, rest
                    )  # fmt: skip
                if code != OK:
                    break
                used += todo + keep + 1
                for k in range(2):
                    size[k] = size_of(probe[1][i, k], probe[2][i, k], norms[1 + k])
                p, verdict, gap, mu = verdict_of(
                    i, keep, size, max_period, tolerance, linear, net, quiet, phase, t_max, limit, out, probe,
                    scratch, rest, moved, moved_clock, moved_counters, images, returns,
                )  # fmt: skip
                if verdict == OK:
                    break
                if early:
                    todo = used if 2 * used + keep < transient else max(transient - used, 0)
                    early = used + todo < transient
                    continue
                if verdict != SLOW or extra >= attempts:
                    break
                if mu > 1.0 + MARGIN:
                    u[0] += KICK * size[0]
                    u[1] += KICK * size[1]
                todo = (1 << extra) * max(transient, 1)
                extra += 1
            if code == BEYOND_STOP and carried != 0 and not fresh and attempt == 0:
                attempt = 1
                continue
            break
        spent[j] = used
        mode[j] = counters[0]
        last[j, 0] = u[0]
        last[j, 1] = u[1]
        multipliers[j] = mu
        if code != OK:
            period_number[j] = 0
            status[j] = code
            residual[j] = 1e300
            fresh = True
            continue
        fresh = False
        period_number[j] = p
        status[j] = verdict
        residual[j] = gap
        # extremes and counts: over one whole cycle where there is one, else over as many returns as were kept
        n = p if p > 0 else keep
        if p == 0:
            crossings[j] = out[7][i] / keep
            contacts[j] = out[8][i] / keep
            if choice[6] == 0:
                continue
        for k in range(2):
            moved[k] = u[k]
        for k in range(3):
            moved_clock[k] = clock[k]
        for k in range(4):
            moved_counters[k] = counters[k]
        code = go(
            i, moved, moved_clock, moved_counters, linear, net, last_plan, phase, t_max, 0, n, limit, out, scratch,
            rest,
        )  # fmt: skip
        if code != OK:
            status[j] = code
            continue
        for k in range(2):
            maximum[j, k] = out[1][i, k] if choice[6] != 0 else nan
            minimum[j, k] = out[2][i, k] if choice[6] != 0 else nan
        if p > 0:
            crossings[j] = out[7][i] / n
            contacts[j] = out[8][i] / n


@device
def part(
    begin, end, batch, i, size, u, clock, counters, moved, moved_clock, moved_counters, apart, sums, linear, net, quiet,
    phase, t_max, limit, out, scratch, rest,
):  # fmt: skip
    """Returns begin <= n < end of a run and of a neighbour, put back to a small distance after each; gives a status.

    ``apart`` is the neighbour's distance, ``sums`` the growth in the present batch, the sum of the batches' rates and
    of their squares; nothing counts in the first quarter of a batch, in which the direction turns in."""
    first = hypot(NUDGE, NUDGE)
    for n in range(begin, end):
        moved[0] = u[0] + apart[0]
        moved[1] = u[1] + apart[1]
        for k in range(3):
            moved_clock[k] = clock[k]
        for k in range(4):
            moved_counters[k] = counters[k]
        for one in range(2):
            code = go(
                i, u if one == 0 else moved, clock if one == 0 else moved_clock,
                counters if one == 0 else moved_counters, linear, net, quiet, phase, t_max, 0, 1, limit, out, scratch,
                rest,
            )  # fmt: skip
            if code != OK:
                return code
        apart[0] = moved[0] - u[0]
        apart[1] = moved[1] - u[1]
        distance_now = hypot(apart[0] / size[0], apart[1] / size[1])
        if distance_now > 0.0:
            apart[0] *= first / distance_now
            apart[1] *= first / distance_now
        else:  # fallen together: a direction that vanishes
            distance_now = 1e-16 * first
            apart[0] = size[0] * NUDGE
            apart[1] = size[1] * NUDGE
        if n < batch // 4:
            continue
        sums[0] += log(distance_now / first)
        if (n - batch // 4) % batch == batch - 1:
            rate = sums[0] / (batch * linear[6][i])
            sums[0] = 0.0
            sums[1] += rate
            sums[2] += rate * rate
    return OK


@device
def rate_of(code, sums):
    """The mean of ten batches' rates and its standard error; nan where the runs failed."""
    if code != OK:
        return nan, nan
    return sums[1] / 10.0, sqrt(max(sums[2] / 10.0 - (sums[1] / 10.0) ** 2, 0.0) / 9.0)


@kernel(types.void(
    _i1, _f2, _i1, _i, _f1, LINEAR, NET, _i1, _f, _f, _f1, BUFFERS, SCRATCH, WORK, _f1, _f1,
))  # fmt: skip
def exponents_of(
    rows, starts, modes, n_returns, size, linear, net, quiet, phase, t_max, limit, out, scratch, work, largest, error
):
    """Largest Lyapunov exponent per unit time, from two neighbours over ``n_returns`` section returns; nan: failed.

    ``error`` is the standard error from ten batches. Job j begins on the section at starts[j] in the mode modes[j]."""
    u, clock, counters, moved, moved_clock, moved_counters, images, returns = work
    apart, sums = images[0], returns[0:3]
    batch = n_returns // 10
    for j in range(rows.shape[0]):
        i = rows[j]
        clock[0] = phase * linear[6][i]
        clock[1] = 0.0
        counters[0] = modes[j]
        for k in range(2):
            u[k] = starts[j, k]
            apart[k] = size[k] * NUDGE
        for k in range(3):
            sums[k] = 0.0
        code = part(
            0, batch // 4 + 10 * batch, batch, i, size, u, clock, counters, moved, moved_clock, moved_counters, apart,
            sums, linear, net, quiet, phase, t_max, limit, out, scratch, starts,
        )  # fmt: skip
        largest[j], error[j] = rate_of(code, sums)
