"""The hybrid loop: one trajectory through segments and transitions, over a stepper and an observer.

The *stepper* knows the flow: ``linear.stepper`` (linear modes with harmonic forcing, any number of states) or
``series.stepper`` (generated Taylor series, Runge-Kutta-Fehlberg). It prepares a point, marches a segment to its first
crossing, ends it there, takes transitions and says which conditions hold just after. The *observer* (``observers``)
says how far to go and looks at each segment and each transition. Their functions stand in the text that is joined with
this file. Everything else is here: start rule, transitions of one instant in declared order,
limits on chatter, the clock.

All that a run knows beside its arrays stands in ``work.tally`` and ``work.memo``: it may pause and go on. It pauses
also before a transition into a mode whose tables do not stand yet, and before one that is asked (its target is -1):
whoever calls says where it leads, and the next call goes on with it.
"""

from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.hybrid.codes import (
    ALONE,
    ANOTHER,
    ASKS_BEHIND,
    BEGUN,
    BEYOND_STOP,
    BURST,
    BURST_LENGTH,
    CHATTER,
    CLOSED,
    CLOSELY,
    CONCERNS,
    DEAD_END,
    DIVERGED,
    DONE,
    FIRED,
    FIRST,
    GOES_ON,
    JUMPS,
    MODE,
    MOST_AT_ONCE,
    MOST_CROSSINGS,
    MOST_ROUNDS,
    NO_END,
    NOT_GUARANTEED,
    NOT_UNIQUE,
    NOTED,
    OK,
    OPEN_RUN,
    OWN,
    PAUSED,
    PERIODS,
    RESET,
    SHORT,
    SINCE,
    SOURCE,
    STARTS,
    TAKEN,
    TIME,
    TOO_MANY_CROSSINGS,
    WAITS,
)

AT_ONE_INSTANT = 1e-14  # of the time of a run
MAY_WAIT = 1  # 0 where nothing is made or asked on the way, as on a GPU: what never happens costs nothing


@inline
def waiting(work):
    """The transition that waits for the tables of its mode or, being asked, for an answer; or -1."""
    return work.tally[WAITS] - 1 if MAY_WAIT != 0 else -1


@inline
def next_holding(mode, tables, net, work):
    """The first outgoing transition (in declared order) whose rows all hold just after the present instant, or -1."""
    for k in range(net.mode_start[mode], net.mode_start[mode + 1]):
        if holds(net.mode_list[k], mode, tables, net, work):
            return net.mode_list[k]
    return -1


@once
def settle(i, form, net, tables, work):
    """Start rule: transitions that hold already are taken, each mode at most once; so is an impact that begins there.

    Returns a status: BEYOND_STOP where one with a reset holds and the start does not lie on its surface; CHATTER where
    they lead back to a mode; PAUSED where one waits for the tables of its mode."""
    tally, visited = work.tally, work.visited
    for k in range(visited.shape[0]):
        visited[k] = 0
    visited[tally[MODE]] = 1
    for _ in range(visited.shape[0]):
        mode, t, again = tally[MODE], -1, False
        for k in range(net.mode_start[mode], net.mode_start[mode + 1]):
            one = net.mode_list[k]
            if (
                MAY_WAIT != 0
                and tally[STARTS] != 0
                and (net.transitions[one, 0] < 0 or net.transitions[one, 4] == ALONE)
            ):
                continue  # what elements hold has been asked
            if holds(one, mode, tables, net, work):
                impact = net.transitions[one, 1] == RESET
                if impact and lies_beyond(one, form, net, work):
                    return BEYOND_STOP
                if MAY_WAIT != 0 and net.transitions[one, 0] < 0:
                    tally[WAITS] = one + 1
                    return PAUSED
                if visited[net.transitions[one, 0]] == 0 or (impact and net.transitions[one, 0] == mode):
                    t = one
                    break
                again = True
        if t < 0:
            if again:  # modes that lead back to each other at once
                return CHATTER
            break
        tally[MODE] = take(i, t, ANOTHER, form, tables, net, work)
        tally[TAKEN] += 1
        if net.transitions[t, 2] >= DEAD_END:
            return NOT_UNIQUE + net.transitions[t, 2] - DEAD_END
        visited[tally[MODE]] = 1
    return OK


@once
def begin(i, form, net, section, motion, tables, work):
    """State and mode where a run begins, by the start rule. Returns a status, PAUSED where elements are asked."""
    tally, memo, code = work.tally, work.memo, OK
    if MAY_WAIT != 0 and tally[STARTS] != 0:  # it has been answered
        if tally[STARTS] < 0:  # and there is no answer
            code = NOT_UNIQUE - 1 - tally[STARTS]
            tally[STARTS] = 0
            return code
        tally[BEGUN] = 1
        look(i, form, tables, work, tally[MODE])
        code, moved = settle(i, form, net, tables, work), tally[TAKEN] != 0
        tally[TAKEN] = 0
        if moved and code == OK and tally[STARTS] <= net.together.shape[0]:  # they are asked again
            tally[BEGUN], tally[WAITS] = 0, net.together[tally[MODE]] + 1
            tally[STARTS] += 1
            return PAUSED
        tally[STARTS] = 0
    else:
        for k in range(tally.shape[0]):
            tally[k] = 0
        for k in range(memo.shape[0]):
            memo[k] = 0.0
        tally[BEGUN], tally[MODE] = 1, motion.counters[0]
        memo[TIME], memo[PERIODS], memo[SINCE] = motion.clock[0], motion.clock[1], NO_END
        prepare(i, form, motion, tables, work)
        if tally[MODE] < form.lacking.shape[0]:
            for j in range(min(motion.u.shape[0], form.lacking.shape[1])):
                if form.lacking[tally[MODE], j] != 0:  # whatever a start says of it
                    work.w[j] = 0.0
        if MAY_WAIT != 0 and motion.counters[1] != 1 and net.together[tally[MODE]] >= 0:
            tally[BEGUN], tally[STARTS], tally[WAITS] = 0, 1, net.together[tally[MODE]] + 1
            return PAUSED
        look(i, form, tables, work, tally[MODE])
        if motion.counters[1] == 1:
            tally[BEGUN] = GOES_ON
        else:
            code = settle(i, form, net, tables, work)
            tally[TAKEN] = 0
        if code == PAUSED:  # it begins anew when the mode stands
            tally[BEGUN] = 0
    if section.indicator >= 0:  # a start on the section is no return
        start_on_section(form, section, tables, work)
    return code


@once
def land(i, step, stop, t, full, form, net, tables, work):
    """End a segment: clock and state; ``stop`` is the time at which it ends exactly, or -1.

    Returns (transition, a period has ended, closely behind a crossing)."""
    memo, T = work.memo, form.period[i]
    since = memo[SINCE] + step
    short = since < SHORT * time_scale(i, since, form, tables, work)
    s = stop if stop >= 0.0 else memo[TIME] + step
    wrapped = s >= T
    if wrapped:
        s -= T
        memo[PERIODS] += 1.0
    memo[TIME] = s
    t = arrive_at(t, since, full, wrapped, form, net, tables, work)
    memo[SINCE] = 0.0 if t >= 0 else since
    return t, wrapped, short


@once
def transit(i, t, short, form, net, section, goal, seen, tables, work):
    """Transition t and those that hold just after it, at the same instant. Returns (status, section direction).

    PAUSED: the next of them waits for the tables of its mode; called again, it goes on there."""
    tally = work.tally
    mode, code, fired = tally[MODE], OK, tally[FIRED]
    jumps = tally[TAKEN] if MAY_WAIT != 0 else 0
    concerns, rounds = fired, 0
    if jumps == 0:
        if MAY_WAIT != 0 and net.transitions[t, 4] == ALONE and meets_another(mode, fired, fired, net, tables, work):
            t = net.together[mode]
        tally[SOURCE], tally[FIRST] = mode, t
        approach(mode, fired, goal, seen, tables, work)
    while t >= 0:
        if jumps == MOST_AT_ONCE or rounds > MOST_ROUNDS:
            code = CHATTER
            break
        if MAY_WAIT != 0 and net.transitions[t, 0] < 0:
            tally[WAITS], tally[TAKEN], tally[CLOSELY] = t + 1, jumps, 1 if short else 0
            tally[CONCERNS] = concerns
            return PAUSED, 0
        mode = take(i, t, fired if jumps == 0 else ANOTHER, form, tables, net, work)
        cross(i, t, jumps, mode, form, net, section, goal, seen, tables, work)
        tally[MODE] = mode
        jumps += 1
        if net.transitions[t, 2] >= DEAD_END:
            code = NOT_UNIQUE + net.transitions[t, 2] - DEAD_END
            break
        alone = MAY_WAIT != 0 and net.transitions[t, 4] == ALONE and net.transitions[t, 1] == RESET
        asks = MAY_WAIT != 0 and net.transitions[t, 4] == ASKS_BEHIND
        struck = net.rows[net.row_start[t], 0] if alone else -1
        t, concerns = next_holding(mode, tables, net, work), fired
        if MAY_WAIT != 0 and t >= 0 and net.transitions[t, 4] == ALONE and net.together[mode] >= 0:
            concerns = net.rows[net.row_start[t], 0]
            if meets_another(mode, fired, concerns, net, tables, work):
                t = net.together[mode]
        if asks and (t < 0 or net.transitions[t, 4] < OWN):
            t, concerns = net.together[mode], fired
        if alone and meets_another(mode, fired, fired, net, tables, work):  # an impact has ended other rates too
            t, concerns = net.together[mode], struck
        if t == tally[FIRST] and net.transitions[t, 0] >= 0:
            rounds += 1
    tally[TAKEN] = 0
    depart(jumps, goal, seen, work)
    tally[JUMPS] += jumps
    tally[BURST] = tally[BURST] + 1 if short else 0
    if tally[BURST] > BURST_LENGTH:
        code = CHATTER
    elif tally[JUMPS] > MOST_CROSSINGS:
        code = TOO_MANY_CROSSINGS
    sense = 0  # where the section lies on the surface just crossed
    if section.indicator >= 0 and fired >= 0:
        if section.mode < 0 or section.mode == (mode if section.after != 0 else tally[SOURCE]):
            sense = met(tally[FIRST], fired, form, net, section, tables, work)
    return code, sense


@once
def march(i, form, net, section, goal, motion, seen, tables, work):
    """Point i until its goal is reached. Returns a status: PAUSED and LOG_FULL ask to be called again.

    ``work`` then holds where it stands; ``leave`` writes that to the motion."""
    w, tally, memo = work.w, work.tally, work.memo
    code = OK
    if tally[BEGUN] == 0:
        code = begin(i, form, net, section, motion, tables, work)
        if MAY_WAIT != 0 and code == PAUSED:
            return code
        open_window(i, form, section, goal, seen, tables, work)
    patience = goal.patience
    strides = may_stride(i, form, net, section, goal)
    while code == OK and (waiting(work) >= 0 or not reached(goal, work)):
        patience -= 1
        code = PAUSED if patience < 0 and may_pause(work) else room(goal, seen, work)
        if code != OK:
            break
        t, sense = waiting(work), 0
        if t >= 0:
            tally[WAITS] = 0
            short, state = tally[CLOSELY] != 0, tally[NOTED]
        elif tally[BEGUN] == GOES_ON or changed(goal, seen, work):
            goes_on = tally[BEGUN] == GOES_ON  # an earlier run ended here before what happens at this very instant
            tally[BEGUN] = 1
            if not goes_on:  # else ``begin`` has looked
                look(i, form, tables, work, tally[MODE])
            t = next_holding(tally[MODE], tables, net, work)
            if goes_on and (t < 0 or lies_beyond(t, form, net, work)):
                continue
            tally[FIRED], tally[SOURCE], tally[NOTED] = -1, tally[MODE], OPEN_RUN
            short, state = False, OPEN_RUN
        else:
            ready, first = False, 0
            if strides:
                ready, first, patience = hasten(i, form, net, section, goal, seen, tables, work, patience)
            stop, timed = NO_END, -1
            if not strides:
                stop, timed = next_stop(i, form, net, section, goal, work)
            wait, rest = stop - memo[TIME], remaining(section, goal, seen, work)
            if abs(rest - wait) <= AT_ONE_INSTANT * (abs(memo[DONE]) + rest):
                rest = wait  # an end and a stop are one instant, whichever is the first by rounding
            step, t, full, sense = leg(i, form, net, section, goal, tables, work, min(wait, rest), ready, first)
            if not step >= 0.0:
                code = DIVERGED
                break
            # a step that ends before the stop may still end there when it is added to the clock
            stopped = t < 0 and sense == 0 and (step >= wait or memo[TIME] + step >= stop)
            if stopped and timed >= 0:
                t = timed
            state = observe(
                i, step, stop if stopped else -1.0, t >= 0 and t == timed, form, net, section, goal, seen, tables, work
            )
            if state == CLOSED:
                break
            tally[SOURCE], tally[NOTED] = tally[MODE], state
            ended = step >= rest and t < 0
            t, wrapped, short = land(i, step, stop if stopped else -1.0, t, full, form, net, tables, work)
            mark(i, wrapped, ended, t >= 0, step, form, goal, seen, work)
            if section.indicator >= 0:
                for j in range(w.shape[0]):
                    work.before[j] = w[j]
        if t >= 0:
            code, sense = transit(i, t, short, form, net, section, goal, seen, tables, work)
            if code == PAUSED:
                break
        elif sense != 0:
            touch_section(section, work)
        if not bounded(work, goal.limit):
            code = DIVERGED
        code = arrive(i, code, tally[SOURCE], t, sense, state, form, section, goal, seen, tables, work)
    return NOT_GUARANTEED if code == OK and doubtful(work) else code


@once
def leave(i, form, motion, work):
    """Write where a run stands to the motion."""
    T = form.period[i]
    put_state(motion, work)
    motion.clock[0] = work.memo[TIME]
    motion.clock[1] = work.memo[PERIODS]
    motion.clock[2] = T if T < NO_END else 0.0
    motion.counters[0] = work.tally[MODE]
    work.tally[BEGUN] = 0
