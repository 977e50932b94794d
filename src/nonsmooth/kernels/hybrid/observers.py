"""The purpose of a run, as its goal says: section returns, the log of one trajectory, or the growth of small changes.

The loop asks these functions; each hands on to ``sections``, ``record`` or ``growth``. ``seen`` has a record for each.
"""

from nonsmooth.kernels.compile.cache import once
from nonsmooth.kernels.hybrid.codes import DONE, GROW, LOGGED, NO_END, OK, OPEN_RUN, RETURNS, RETURNS_OF_SECTION, WAITED
from nonsmooth.kernels.hybrid.growth import leave_transitions, mark_unit, open_frame
from nonsmooth.kernels.hybrid.record import (
    base_of,
    change_inputs,
    log_transition,
    mark_time,
    next_end,
    observe_samples,
    room_in_log,
)
from nonsmooth.kernels.hybrid.sections import (
    arrive_at_section,
    count_transition,
    hurry,
    leave_out,
    mark_return,
    observe_returns,
    open_returns,
    returns_watched,
)
from nonsmooth.kernels.linear.growth import approach_transition, carry_frame, saltate
from nonsmooth.kernels.linear.stepper import steps_at_a_stride

# What a text is made for: 0 never, 1 where the goal says so, 2 always.
LOGS = 1
GROWS = 1


@once
def open_window(i, form, section, goal, seen, tables, work):
    """Begin what is kept of a run."""
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        open_frame(seen.growth, work)
    elif LOGS == 1 and goal.kind == LOGGED:
        work.memo[DONE] = base_of(i, form, work)
    else:
        open_returns(seen.kept)


@once
def reached(goal, work):
    """Return whether the run is over."""
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        return work.tally[RETURNS] >= goal.keep
    if LOGS == 1 and goal.kind == LOGGED:
        return not work.memo[DONE] < goal.until
    return work.tally[RETURNS] >= goal.transient + goal.keep


@once
def room(goal, seen, work):
    """Return LOG_FULL where a log must grow first."""
    if LOGS == 1 and goal.kind == LOGGED:
        return room_in_log(seen.log, work)
    return OK


@once
def changed(goal, seen, work):
    """Return whether inputs have just changed."""
    if LOGS == 1 and goal.kind == LOGGED:
        return change_inputs(goal, seen.log, work)
    return False


@once
def remaining(section, goal, seen, work):
    """Time to the end of the run or unit, to a change of inputs, or for which a return to a surface is waited for."""
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        return max((work.tally[RETURNS] + 1) * goal.unit - work.memo[DONE], 0.0)  # rounding may have passed it
    if LOGS == 1 and goal.kind == LOGGED:
        return max(next_end(goal, seen.log, work) - work.memo[DONE], 0.0)
    return section.t_max - work.memo[WAITED] if section.indicator >= 0 else NO_END


@once
def may_stride(i, form, net, section, goal):
    """Return whether whole steps may be made at a stride: not where every step is seen."""
    if GROWS == 2:
        return False
    return goal.kind == RETURNS_OF_SECTION and steps_at_a_stride(i, form, net, section)


@once
def hasten(i, form, net, section, goal, seen, tables, work, patience):
    """Make whole steps at a stride (see ``sections.hurry``)."""
    if GROWS == 2:
        return False, 0, patience
    return hurry(i, form, net, section, goal, seen.kept, tables, work, patience)


@once
def watched(section, goal, work):
    """Return whether the segment itself is looked at: its extremes, its samples."""
    if LOGS == 1 and goal.kind == LOGGED:
        return True
    return returns_watched(section, goal, work)


@once
def observe(i, step, stop, triggered, form, net, section, goal, seen, tables, work):
    """Look at a segment; returns whether the run goes on, ends on it (CLOSED) or behind its transition (LATE)."""
    state = OPEN_RUN
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        carry_frame(step, goal, seen.growth, tables, work)
    elif LOGS == 1 and goal.kind == LOGGED:
        observe_samples(step, form, net, seen.log, tables, work)
    else:
        state = observe_returns(i, step, stop, triggered, form, section, goal, seen.kept, tables, work)
    return state


@once
def mark(i, wrapped, ended, crossed, step, form, goal, seen, work):
    """Set counts and times at the end of a segment."""
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        mark_unit(i, ended, crossed, step, form, goal, seen.growth, work)
    elif LOGS == 1 and goal.kind == LOGGED:
        mark_time(i, wrapped, ended, crossed, form, goal, seen.log, work)
    else:
        mark_return(step, work)


@once
def approach(mode, fired, goal, seen, tables, work):
    """Prepare for the transitions of an instant."""
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        approach_transition(mode, fired, seen.growth, tables, work)


@once
def cross(i, t, jumps, mode, form, net, section, goal, seen, tables, work):
    """Note a transition, before which there were ``jumps`` others at its instant."""
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        saltate(i, t, jumps, mode, form, net, seen.growth, tables, work)
    elif LOGS == 1 and goal.kind == LOGGED:
        log_transition(t, form, seen.log, work)
    else:
        count_transition(t, net, goal, seen.kept, work)


@once
def depart(jumps, goal, seen, work):
    """Take the transitions of an instant together."""
    if GROWS == 2 or (GROWS == 1 and goal.kind == GROW):
        leave_transitions(jumps, seen.growth, work)


@once
def arrive(i, code, source, t, sense, state, form, section, goal, seen, tables, work):
    """Count returns at the end of a segment. Gives a status."""
    if GROWS != 2:
        if goal.kind == RETURNS_OF_SECTION:
            code = arrive_at_section(i, code, source, t, sense, state, form, section, goal, seen.kept, tables, work)
            if t >= 0 and section.repeats != 0 and code == OK:
                leave_out(i, form, section, goal, seen.kept, work)
    return code
