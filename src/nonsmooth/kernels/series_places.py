"""Places in the integer and float arrays that the series kernels share with their driver."""

# Methods
TAYLOR, RKF45, EXACT = 0, 1, 2

# choice: what is asked for
METHOD, ORDER, LOCATE, TRANSIENT, KEEP, SECTION, RISING, SECTION_MODE, AFTER, EVERY = range(10)
RECORD, N_PARAMETERS, N_INDICATORS, N_OUTPUTS, CORNERS, NONLINEAR_ROWS, CHECKED, N_GUARDS, PAUSE = range(10, 19)
N_CHOICE = 19
NEVER = 2**62  # for PAUSE: the number of steps after which the kernel returns, to be called again

# control: tolerances and times (the phase in time units, -1 where the section is not stroboscopic)
RTOL, STEP, PERIOD, PHASE, T_MAX, UNTIL = range(6)
N_CONTROL = 6

# tally: what has been counted; kept when the kernel returns to be called again (a full log, a pause)
BEGUN, SETTLED, RETURNS, PASSES, SAMPLES, CROSSINGS, TOUCHES, JUMPS, WINDOW = range(9)
KEPT_CROSSINGS, KEPT_CONTACTS, RAPID, DOUBTFUL, STEPS, STEPS_IN_RETURN, SEGMENT, READY, RESTING = range(9, 18)
N_TALLY = 18

# memo: times that go with them
SINCE_RETURN, SINCE_CROSSING, LONGEST, WINDOW_FRACTION, WINDOW_PERIODS, ELAPSED = range(6)
REST = 6  # and here begins the state about which it has stayed
N_MEMO = 6  # and one for each state

# limits
MOST_JUMPS = 1000  # transitions within one return or period
MOST_RAPID = 50  # transitions in a row closer than 1e-12 of the time scale
MOST_STEPS = 2_000_000  # within one return or period
AT_REST = 1000  # steps in a row near one place, before a state without forcing counts as an equilibrium
HALVINGS = 8  # of a step whose polynomial leaves a graze undecided
