"""Argument types, scratch memory and limits of the kernels of the exact flow."""

import numpy as np

from .block import one_block
from .linear_search import WIDTH
from .linear_tables import DEGREE, HARMONICS, NODES, STATES, TERMS, M

MOST_CROSSINGS = 1000  # within one section return
MOST_STEPS = 2_000_000  # on the way to a surface that may never be met again
BURST = 50  # crossings in a row at intervals below SHORT of the mode's step end a run as chatter
SHORT = 1e-11

_VECTOR, _INTEGERS = "float64[::1], ", "int64[::1], "
_MATRIX, _TABLE, _BLOCK = "float64[:,::1], ", "float64[:,:,::1], ", "float64[:,:,:,::1], "
_LINEAR = (
    _BLOCK + _TABLE + _BLOCK * 2 + _INTEGERS + _VECTOR * 2  # A, b, c, s, multiples, omega, period
    + _TABLE + _MATRIX + _TABLE * 2  # ia, ib, ic, is
    + (_BLOCK + _TABLE + _BLOCK * 2) * 2  # oa, ob, oc, os, ra, rb, rc, rs
)  # fmt: skip
_NET = "int64[:,::1], int64[:,::1], " + _INTEGERS * 3 + _VECTOR  # transitions, rows, row and mode starts, list, at
_SCRATCH = _BLOCK + _TABLE * 2 + _BLOCK + _TABLE + _MATRIX * 4 + _VECTOR * 2 + "int64[::1]"


def scratch(n_modes, n_indicators, n_outputs, n_rows):
    """Work arrays for one thread: prop, rot, fun, tay, field, info, row, vectors, scr, points, rates, integers.

    The last integer is the point for which the tables stand there already, plus one."""
    n_f = n_indicators + STATES + n_outputs
    return one_block(
        np.zeros((n_modes, NODES + 1, M, STATES)), np.zeros((n_modes, NODES + 1, 2 * HARMONICS + 1)),
        np.zeros((n_modes, n_f, 2 * (M + STATES + 1))), np.zeros((n_modes, n_f, M, DEGREE + 1)),
        np.zeros((n_modes, STATES, M)), np.zeros((n_modes, 2 + STATES)), np.zeros((max(TERMS, STATES) + 1, M)),
        np.zeros((8, M)), np.zeros((n_rows + STATES + 1, WIDTH)),
        np.zeros(4), np.zeros(HARMONICS), np.zeros(2 * n_indicators + 5, dtype=np.int64),
    )  # fmt: skip
