"""Working memory of the kernels of the exact flow."""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.kernels.compile.assembly import is_planar
from nonsmooth.kernels.compile.pointers import one_block
from nonsmooth.kernels.hybrid.codes import N_MEMO, N_TALLY
from nonsmooth.kernels.hybrid.records import Tables, Work
from nonsmooth.kernels.linear.bands import BANDED
from nonsmooth.kernels.linear.search import WIDTH
from nonsmooth.kernels.linear.tables import DEGREE, NODES, TERMS

LANES = 4  # numbers of a vector: columns of propagators are filled up to whole ones


def scratch(
    states: int, harmonics: int, n_modes: int, n_indicators: int, n_outputs: int, n_rows: int, apart: bool = False
) -> tuple[Tables, Work]:
    """Tables and working memory for one thread, in one block.

    ``apart``: each table by itself, which takes memory only where it is written."""
    n, m, n_f = states, states + 1 + 2 * harmonics, n_indicators + states + n_outputs
    planar = is_planar(states, harmonics) and not apart  # modes that are made on the way have the other module's
    filled = n if planar else -(-n // LANES) * LANES

    def whole(*shape: int) -> Any:
        return np.zeros(shape, dtype=np.int64)

    tables = (
        np.zeros((n_modes, NODES + 1, m, filled)),
        np.zeros((n_modes, NODES + 1, 2 * harmonics + 1)),
        np.zeros((n_modes, n_f, 2 * (m + n + 1))),
        np.zeros((n_modes, n_f, m, DEGREE + 1)),
        np.zeros((n_modes, n, m)),
        np.zeros((n_modes, 2 + n)),
        whole(1, 1, 1, 1) if planar else whole(n_modes, n_f, 2, m + 1),
        np.zeros((n_modes, n + m, n) if n >= BANDED else (n_modes, 1, 1)),
        whole(n_modes, n + m if n >= BANDED else 1, 3),
    )
    work = (
        *(np.zeros(m + LANES) for _ in range(8)),
        np.zeros((max(TERMS, n) + 1, m)),
        np.zeros((n_rows + n + 1, WIDTH)),
        np.zeros(4),
        np.zeros(harmonics),
        *map(whole, (n_indicators, 4, n_modes, n_indicators, 2, N_TALLY)),
        np.zeros(N_MEMO),
    )
    if apart:
        return Tables(*tables), Work(*one_block(*work))
    block = one_block(*tables, *work)
    return Tables(*block[: len(tables)]), Work(*block[len(tables) :])
