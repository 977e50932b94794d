"""Working memory of the kernels of the exact flow."""

import numpy as np

from nonsmooth.kernels.compile.block import one_block
from nonsmooth.kernels.hybrid.places import N_MEMO, N_TALLY
from nonsmooth.kernels.hybrid.records import Tables, Work
from nonsmooth.kernels.linear.search import WIDTH
from nonsmooth.kernels.linear.tables import BANDED, DEGREE, HARMONICS, MANY, NODES, STATES, TERMS, M


def scratch(n_modes, n_indicators, n_outputs, n_rows):
    """Tables and working memory for one thread, in one block."""
    tables = _tables(n_modes, n_indicators + STATES + n_outputs)
    block = one_block(*tables, *_work(n_modes, n_indicators, n_rows))
    return Tables(*block[: len(tables)]), Work(*block[len(tables) :])


def scratch_apart(n_modes, n_indicators, n_outputs, n_rows):
    """The same with each table by itself, which takes memory only where it is written."""
    tables = _tables(n_modes, n_indicators + STATES + n_outputs)
    return Tables(*tables), Work(*one_block(*_work(n_modes, n_indicators, n_rows)))


def _tables(n_modes, n_f):
    return (
        np.zeros((n_modes, NODES + 1, M, STATES)), np.zeros((n_modes, NODES + 1, 2 * HARMONICS + 1)),
        np.zeros((n_modes, n_f, 2 * (M + STATES + 1))), np.zeros((n_modes, n_f, M, DEGREE + 1)),
        np.zeros((n_modes, STATES, M)), np.zeros((n_modes, 2 + STATES)),
        np.zeros((n_modes, n_f, 2, M + 1) if STATES >= MANY else (1, 1, 1, 1), dtype=np.int64),
        np.zeros((n_modes, STATES + M, STATES) if BANDED else (1, 1, 1)),
        np.zeros((n_modes, STATES + M, 3) if BANDED else (1, 1, 1), dtype=np.int64),
    )  # fmt: skip


def _work(n_modes, n_indicators, n_rows):
    vectors = [np.zeros(M) for _ in range(8)]
    integers = [np.zeros(n, dtype=np.int64) for n in (n_indicators, 4, n_modes, n_indicators, 2, N_TALLY)]
    return (
        *vectors, np.zeros((max(TERMS, STATES) + 1, M)), np.zeros((n_rows + STATES + 1, WIDTH)), np.zeros(4),
        np.zeros(HARMONICS), *integers, np.zeros(N_MEMO),
    )  # fmt: skip
