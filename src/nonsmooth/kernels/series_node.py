"""What happens at one instant: the jets there, start rules, jumps with their chains, and returns to the section."""

from math import fabs, inf

from . import series_places as place
from .cache import device
from .codes import BEYOND_STOP, CHATTER, OK, TOO_MANY_CROSSINGS
from .crossing import holding, holds, section_crossing, snap
from .polynomial import NONE
from .rkf45 import first_step
from .series_step import polished
from .taylor import dense_states, step_length
from .watch import extend_at_node, forget

__all__ = [
    "begin", "clear", "copy", "count_pass", "leap", "look", "meets_section", "open_window", "passes", "rests",
]  # fmt: skip


@device
def copy(source, target):
    """Element by element: kernels allocate nothing, and a slice assignment might."""
    for i in range(target.shape[0]):
        target[i] = source[i]


@device
def clear(target):
    """All elements zero."""
    for i in range(target.shape[0]):
        target[i] = 0


@device
def look(jet, mode, t, u, q, choice, norms, log_rtol, rtol, fixed, exact_steps, parts):
    """Jets and after-limits at a start or after a jump."""
    C, W, J0, scale, measured, side, usual = parts[:7]
    n, n_indicators = u.shape[0], choice[place.N_INDICATORS]
    if choice[place.METHOD] == place.RKF45:
        m = 4
        jet(mode, m, t, u, q, J0, W)
        X = J0
    else:
        m = choice[place.ORDER]
        jet(mode, m, t, u, q, C, W)
        X = C
    h = usual[mode]
    if fixed > 0.0:
        h = fixed
    elif choice[place.METHOD] == place.EXACT:
        h = exact_steps[mode]
    elif choice[place.METHOD] == place.RKF45:
        if h <= 0.0:
            h = first_step(X, u, n, norms[1], rtol)
    else:
        h = step_length(X, m, n, n_indicators, u, norms[0], scale, log_rtol)
    if not (h < inf):
        h = 1.0
    for i in range(n_indicators):
        if scale[i] == 0.0:
            scale[i] = max(fabs(X[n + i, 0]), fabs(X[n + i, 1]) * h)
    snap(X, m, n, n_indicators, h, scale, measured, side)
    for i in range(n_indicators):
        scale[i] = max(scale[i], fabs(X[n + i, 0]))


@device
def begin(jet, jump, mode, t, u, q, settled, choice, norms, log_rtol, rtol, fixed, exact_steps, net, parts):
    """The start rule: (mode, status). Transitions without reset that hold already are taken, each mode at most once."""
    first, outgoing, transitions = net[0], net[1], net[2]
    side, u_new, q_new, visited = parts[5], parts[8], parts[9], parts[10]
    for i in range(visited.shape[0]):
        visited[i] = 0
    visited[mode] = 1
    look(jet, mode, t, u, q, choice, norms, log_rtol, rtol, fixed, exact_steps, parts)
    while settled == 0:
        k = -1
        for j in range(first[mode], first[mode + 1]):
            o = outgoing[j]
            if holds(o, net, side):
                if transitions[o, 5] == 1:
                    return mode, BEYOND_STOP
                if visited[transitions[o, 1]] == 0:
                    k = o
                    break
        if k < 0:
            break
        jump(k, t, u, q, u_new, q_new)
        copy(u_new, u)
        copy(q_new, q)
        mode = transitions[k, 1]
        visited[mode] = 1
        look(jet, mode, t, u, q, choice, norms, log_rtol, rtol, fixed, exact_steps, parts)
    return mode, OK


@device
def leap(
    jet, values, jump, pending, hit, mode, t, clock, u, q, choice, norms, log_rtol, rtol, fixed, period, exact_steps,
    lacking, net, parts, extremes, tally, memo, crossings,
):  # fmt: skip
    """Take the transition ``pending`` (its row ``hit`` crossed; -1: none) and those that then hold: (mode, status)."""
    transitions, rows = net[2], net[3]
    C, J0, measured, side, vals, u_new, q_new = parts[0], parts[2], parts[4], parts[5], parts[7], parts[8], parts[9]
    n, n_parameters = u.shape[0], choice[place.N_PARAMETERS]
    scale_of_time = max(memo[place.LONGEST], memo[place.SINCE_CROSSING])
    memo[place.LONGEST] = scale_of_time
    if period < inf:
        scale_of_time = period
    tally[place.RAPID] = tally[place.RAPID] + 1 if memo[place.SINCE_CROSSING] < 1e-12 * scale_of_time else 0
    memo[place.SINCE_CROSSING] = 0.0
    if hit >= 0:
        values(mode, t, u, q, vals)
        measured[rows[hit, 0]] = fabs(vals[rows[hit, 0]])
    for turn in range(lacking.shape[0] + 3):
        jump(pending, t, u, q, u_new, q_new)
        if choice[place.RECORD] == 1:
            row = tally[place.CROSSINGS]
            crossings[row, 0] = t + (clock[1] * period if period < inf else 0.0)
            crossings[row, 1] = pending
            for i in range(n):
                crossings[row, 2 + i] = u[i]
                crossings[row, 2 + n + i] = u_new[i]
            for i in range(q.shape[0] - n_parameters):
                crossings[row, 2 + 2 * n + i] = q_new[n_parameters + i]
            tally[place.CROSSINGS] += 1
        copy(u_new, u)
        copy(q_new, q)
        mode = transitions[pending, 1]
        tally[place.SEGMENT] += 1
        tally[place.JUMPS] += 1
        if tally[place.WINDOW] == 1:
            tally[place.KEPT_CROSSINGS] += 1
            tally[place.KEPT_CONTACTS] += transitions[pending, 4]
        look(jet, mode, t, u, q, choice, norms, log_rtol, rtol, fixed, exact_steps, parts)
        if tally[place.WINDOW] == 1:
            all_rows = n + choice[place.N_INDICATORS] + choice[place.N_OUTPUTS]
            extend_at_node(J0 if choice[place.METHOD] == place.RKF45 else C, all_rows, lacking, mode, n, extremes)
        if hit >= 0 and turn == 0:
            measured[rows[hit, 0]] = 0.0
        if tally[place.JUMPS] > place.MOST_JUMPS:
            return mode, TOO_MANY_CROSSINGS
        pending = holding(mode, net, side)
        if pending < 0:
            return mode, CHATTER if tally[place.RAPID] > place.MOST_RAPID else OK
    return mode, CHATTER


@device
def next_is_edge(choice, tally):
    """Whether the next pass of the section opens or closes the kept window."""
    if (tally[place.PASSES] + 1) % choice[place.EVERY] != 0:
        return False
    r = tally[place.RETURNS] + 1
    return r in (choice[place.TRANSIENT], choice[place.TRANSIENT] + choice[place.KEEP])


@device
def count_pass(choice, tally, memo, clock, t, period, mode, u, sections, extremes):
    """Count a pass of the section at the time t of the period. Returns 1 where the window opens, 2 where it closes."""
    tally[place.PASSES] += 1
    if tally[place.PASSES] % choice[place.EVERY] != 0:
        return 0
    memo[place.SINCE_RETURN] = 0.0
    tally[place.JUMPS] = 0
    tally[place.STEPS_IN_RETURN] = 0
    tally[place.RETURNS] += 1
    row = tally[place.RETURNS] - choice[place.TRANSIENT] - 1
    if row >= 0:
        n = u.shape[0]
        for i in range(n):
            sections[row, i] = u[i]
        sections[row, n] = t + (clock[1] * period if period < inf else 0.0)
        sections[row, n + 1] = mode
    if row + 1 == choice[place.KEEP]:
        span = (clock[1] - memo[place.WINDOW_PERIODS]) * period if period < inf else 0.0
        memo[place.ELAPSED] = span + (t - memo[place.WINDOW_FRACTION])
        return 2
    if row == -1:
        open_window(tally, memo, clock, t, extremes)
        return 1
    return 0


@device
def passes(
    values, mode, t, h, part, pending, clock, period, C, m, n, q, interpolated, choice, side, side_next, powers, scale,
    a, stack, found, u, vals, sections, extremes, tally, memo,
):  # fmt: skip
    """Count the passes of a Poincare section on the step, up to its part where a transition is ``pending``.

    Returns the local time of the pass that opens or closes the kept window (the step ends there), else -1."""
    section = choice[place.SECTION]
    cursor, before = 0.0, side[section]
    while cursor < 1.0:
        x = section_crossing(
            C, n + section, m, choice[place.RISING], before, cursor, powers, scale[section], a, stack, found
        )
        side_next[section] = found[1]
        if x == NONE or (pending >= 0 and x * h >= part * (1.0 - 1e-10)):
            break
        tau = x * h
        if interpolated:
            tau = polished(values, mode, t, q, C, m, n, section, h, tau, u, vals)
        if next_is_edge(choice, tally):
            return tau
        dense_states(C, m, n, tau, u)
        count_pass(choice, tally, memo, clock, t + tau, period, mode, u, sections, extremes)
        if memo[place.SINCE_RETURN] == 0.0:
            memo[place.SINCE_RETURN] = -tau
        cursor, before = x, 0
    return -1.0


@device
def open_window(tally, memo, clock, t, extremes):
    """From here on extremes and crossings are kept."""
    tally[place.WINDOW] = 1
    tally[place.KEPT_CROSSINGS] = 0
    tally[place.KEPT_CONTACTS] = 0
    memo[place.WINDOW_PERIODS] = clock[1]
    memo[place.WINDOW_FRACTION] = t
    forget(extremes)


@device
def meets_section(choice, before, slope_before, after, slope_after, noise):
    """Whether a transition at this instant is also a pass of the section: its indicator is zero before the jump.

    The direction may be that of the arrival or, where the indicator stays zero, of the departure (an impact does
    both)."""
    if fabs(before) > noise:
        return False
    way = choice[place.RISING]
    if way == 0 or slope_before * way > 0.0:
        return True
    return fabs(after) <= noise and slope_after * way > 0.0


@device
def rests(u, n, lacking, mode, weight, rtol, tally, memo):
    """Whether a state without forcing has come to rest, so that no section is met again: ``AT_REST`` steps in a row,
    and no return among them, have left it where it was within a hundred tolerances."""
    moved = 0.0
    for i in range(n):
        if lacking[mode, i] == 0:
            moved = max(moved, fabs(u[i] - memo[place.REST + i]) / (fabs(u[i]) + weight[i]))
    tally[place.RESTING] += 1
    if not (moved <= 1e2 * rtol) or tally[place.STEPS_IN_RETURN] <= 1:
        tally[place.RESTING] = 0
        for i in range(n):
            memo[place.REST + i] = u[i]
    return tally[place.RESTING] > place.AT_REST
