"""Integer codes shared by the kernels and the rooms above them (see results/labels.py for their sentences)."""

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
