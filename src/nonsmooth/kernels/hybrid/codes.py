"""Integers by name: codes that kernels share with the rooms above them, and places in ``work.tally``, ``work.memo``."""

# Outcomes of a run; ``results/labels.py`` has their sentences.
OK = 0
SLOW = 1
NOT_PERIODIC = 2
DIVERGED = 3
CHATTER = 4
TOO_MANY_CROSSINGS = 5
NOT_GUARANTEED = 6
NO_CONVERGENCE = 7
INTERRUPTED = 8
NOT_UNIQUE = 9
NO_MOTION = 10

# Only between a kernel and the driver that called it, never in a result.
LOG_FULL = -1  # a log buffer is full: grow it and call again with the same state
PAUSED = -3  # as many steps as were asked for have been made: call again with the same state
BEYOND_STOP = -2  # the start satisfies the condition of a transition with a reset

# Places in ``work.tally``: counts
BEGUN, MODE, JUMPS, BURST = 0, 1, 2, 3  # transitions within one return, period or unit; and closely behind each other
GOES_ON = 2  # of BEGUN: behind an earlier run; what holds at that very instant is still to be taken
RETURNS, PASSES, TRIES = 4, 5, 6  # of the section; steps since the last pass
SAMPLES, CROSSINGS, TOUCHES = 7, 8, 9  # logged
FIRED = 10  # the functional (indicator) that has crossed, or -1
ANOTHER = -2  # in its place, of a transition at the instant of another one or of a start
# a transition (plus one) that waits for the tables of its mode, and of its instant: the transitions taken before it,
# the mode before the first, the first; whether they are closely behind others, and what the observer saw on the leg
WAITS, TAKEN, SOURCE, FIRST, CLOSELY, NOTED = 11, 12, 13, 14, 15, 16
STARTS = 17  # 1 where what the elements of a system do at a start is asked; -1: motion is not unique, -2: there is none
CHANGES = 18  # of inputs, so far
# one more than the returns, where a run was last compared with the place noted, and where that was noted (0: none); its
# mode, and the transitions and contacts in the kept window by then
LOOKED, NOTED_AT, NOTED_MODE, NOTED_CROSSINGS, NOTED_CONTACTS = 19, 20, 21, 22, 23
CONCERNS = 24  # the condition by which what is asked was met, or -1: it may not be the first one of its instant
N_TALLY = 25

# and in ``work.memo``: times
TIME, PERIODS, SINCE, WAITED, DONE = 0, 1, 2, 3, 4  # in the period, since a crossing, since a pass, since the start
LONGEST_STEP = 5  # of the modes visited so far
NOTED_TIME = 6  # in the period, where a run was noted
N_MEMO = 7

MOST_CROSSINGS = 50_000  # within one return, period or unit of time: with e = 0.999 a mass rests after some 16 000
REPEATS_WITHIN = 16  # returns from a place noted to the last one that is compared with it
MOST_AT_ONCE = 500  # transitions at one instant: a log has room for so many when a step begins
MOST_ROUNDS = 5  # among them of the first: a reset that leaves the state on its way on, ever slower
MOST_STEPS = 2_000_000  # on the way to the next return
BURST_LENGTH = 50  # crossings in a row at intervals below SHORT of the stepper's time scale end a run as chatter
SHORT = 1e-11
NO_END = 1e300  # a time that is never reached

# What a run is for (``Goal.kind``), and what an observer says of a segment.
RETURNS_OF_SECTION, LOGGED, GROW = 0, 1, 2
UNBROKEN = 1  # ``Goal.transient`` of growth: nothing can happen to the motion, which the frame's own series moves
OPEN_RUN, LATE, CLOSED = 0, 1, 2

RESET = 1  # of ``Net.transitions``, place 1: the states change (2: memory alone)
DEAD_END = 2  # of place 2: behind it motion is not unique (3: there is none), and the run ends (1: a contact begins)
# of place 4, where elements are asked: one decides alone; the system's own, without and with a reset
ALONE, OWN, ASKS_BEHIND = 1, 2, 3

# Methods of the series stepper, and its places behind those of every march.
TAYLOR, RKF45 = 0, 1
METHODS = {"taylor": TAYLOR, "rkf45": RKF45}

# The jets at the present instant stand in their place; a polynomial of which only a part has been gone; the transition
# on it, and its row that crosses; it ends at a stop; nothing happens on it; the indicator that vanishes where the next
# one begins; a graze was left undecided; the motion stays on the section's surface; steps near one place; steps in all
READY, OPEN_STEP, PENDING, HIT, LANDING, CALM, ZERO_ROW, DOUBTFUL, STAYS, RESTING, STEPS = range(N_TALLY, N_TALLY + 11)
N_SERIES_TALLY = N_TALLY + 11

# Time at which the polynomial begins; its length, and that of its part that is used; the part of it that is gone, and
# will be at the end of the leg; the length that was planned; value and slope of the section's indicator at its end; the
# longest time between two crossings; where a frame was carried to, the time since, and how far its series reach
(
    BASE,
    LENGTH,
    PART,
    CURSOR,
    AHEAD,
    PLANNED,
    VALUE_BEFORE,
    SLOPE_BEFORE,
    LONGEST,
    ANCHOR,
    GONE,
    REACH,
) = range(N_MEMO, N_MEMO + 12)
N_SERIES_MEMO = N_MEMO + 12

AT_REST = 1000  # steps in a row near one place, before a state without forcing counts as an equilibrium
HALVINGS = 8  # of a step whose polynomial leaves a graze undecided
