"""Steps of many states with few entries by their series: against matrix exponentials."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from nonsmooth.flow.engines.linear import scratch, table_bytes
from nonsmooth.kernels.compile.assembly import linear_module
from nonsmooth.kernels.compile.cache import load_module
from nonsmooth.kernels.hybrid.records import Form

MASSES, RATE = 20, 1.3
STATES = 2 * MASSES
FULL = 1  # the mode whose matrix has no zeros
CALLABLE = """
from numba import types
from nonsmooth.kernels.compile.cache import kernel
from nonsmooth.kernels.hybrid.records import FORM, TABLES, WORK
import {0} as text

i, f, f1, f2 = types.int64, types.float64, types.float64[::1], types.float64[:, ::1]


@kernel(types.void(i, FORM, TABLES, WORK))
def build(point, form, tables, work):
    text.build(point, form, tables, work)


@kernel(types.void(TABLES, WORK, i))
def whole_step(tables, work, mode):
    text.whole_step(tables, work, mode)


@kernel(types.void(TABLES, WORK, i, f, f1))
def dense(tables, work, mode, at, out):
    text.dense(tables, work, mode, at, out)


@kernel(f(TABLES, f2, i, i, f1))
def bound_at(tables, row, mode, k, w):
    return text.bound_at(tables, row, mode, k, w)


@kernel(types.void(TABLES, WORK, i, f, f1, f2))
def carry(tables, work, mode, part, scale, X):
    text.carry(tables, work, mode, part, scale, X)
"""  # kept on disk, as what ``njit`` makes of functions is not


@pytest.fixture(scope="module")
def generators() -> list[np.ndarray]:
    """Of masses in a row, damped and driven all over, and of the same in coordinates that mix all states."""
    rng = np.random.default_rng(5)
    k = rng.uniform(0.5, 2.0, MASSES + 1)
    K = np.diag(k[1:] + k[:-1]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    A = np.block([[np.zeros((MASSES, MASSES)), np.eye(MASSES)], [-K, -0.1 * K - np.diag(rng.uniform(0, 0.1, MASSES))]])
    forcing = rng.normal(size=(STATES, 3))
    forcing[:MASSES] = 0.0
    mixed = np.linalg.qr(rng.normal(size=(STATES, STATES)))[0]
    found = []
    for a, c in ((A, forcing), (mixed @ A @ mixed.T, mixed @ forcing)):
        M = np.zeros((STATES + 3, STATES + 3))
        M[:STATES, :STATES], M[:STATES, STATES:] = a, c
        M[-2, -1], M[-1, -2] = -RATE, RATE
        found.append(M)
    return found


@pytest.fixture(scope="module")
def made(generators: list[np.ndarray]) -> tuple[Any, Any, Any]:
    """The kernels, the tables of the two modes, and working memory with a state in it; no indicators, no outputs."""
    text, n = linear_module(), STATES
    module = load_module(CALLABLE.format(text.__name__), "test_bands")

    def of(part: Any) -> np.ndarray:
        return np.ascontiguousarray(np.array([part(M) for M in generators])[None])

    none = [np.zeros((1, 0, n)), np.zeros((1, 0)), np.zeros((1, 0, 1)), np.zeros((1, 0, 1))]
    form = Form(
        of(lambda M: M[:n, :n]),
        of(lambda M: M[:n, n]),
        of(lambda M: M[None, :n, n + 1]),
        of(lambda M: M[None, :n, n + 2]),
        np.array([1]),
        np.array([RATE]),
        np.array([2 * np.pi / RATE]),
        *none,
        np.zeros((1, 0, 2, n)),
        np.zeros((1, 0, 2)),
        np.zeros((1, 0, 2, 1)),
        np.zeros((1, 0, 2, 1)),
        np.zeros((1, 0, n, n)),
        np.zeros((1, 0, n)),
        np.zeros((1, 0, 1, n)),
        np.zeros((1, 0, 1, n)),
        np.zeros((2, n), dtype=np.int64),
    )
    tables, work = scratch(n, 1, 2, 0, 0, 2)
    module.build(0, form, tables, work)
    work.w[:n] = np.random.default_rng(6).normal(size=n)
    work.w[n : n + 3] = 1.0, np.cos(0.4), np.sin(0.4)
    return module, tables, work


@pytest.mark.parametrize("mode", [0, FULL])
def test_a_state_at_any_instant_of_a_step_is_the_matrix_exponential(generators, made, mode: int) -> None:
    module, tables, work = made
    assert (tables.lines[mode, 0, 0] > 0) == (mode != FULL)
    module.whole_step(tables, work, mode)
    work.found[module.text.NODE] = -1
    step, out = tables.info[mode, 0], np.zeros(STATES + 7)
    end = expm(generators[mode] * step) @ work.w[: STATES + 3]
    assert np.abs(work.w1[: STATES + 3] - end).max() < 2e-15 * np.abs(end).max()
    for part in (0.0, 1e-9, 0.2, 0.511, 0.99, 1.0):
        module.dense(tables, work, mode, part * step, out)
        there = expm(generators[mode] * part * step) @ work.w[: STATES + 3]
        assert np.abs(out[: STATES + 3] - there).max() < 4e-15 * np.abs(end).max()


@pytest.mark.parametrize("mode", [0, FULL])
def test_the_bound_on_a_fourth_derivative_holds_on_the_whole_step(generators, made, mode: int) -> None:
    module, tables, work = made
    module.whole_step(tables, work, mode)
    M, step = generators[mode], tables.info[mode, 0]
    fourth = np.linalg.matrix_power(M, 4)
    largest = np.max([np.abs(fourth @ expm(M * s) @ work.w[: STATES + 3]) for s in np.linspace(0.0, step, 41)], axis=0)
    bounds = np.array([module.bound_at(tables, work.row, mode, f, work.w) for f in range(STATES)])
    assert (bounds >= largest[:STATES]).all()
    assert (bounds <= 100.0 * largest[:STATES].max()).all()  # and is of some use


def test_directions_are_carried_by_the_matrix_exponential(generators, made) -> None:
    module, tables, work = made
    scale, X = np.geomspace(0.1, 10.0, STATES), np.random.default_rng(7).normal(size=(STATES, 3))
    carried, part = X.copy(), 0.7
    module.carry(tables, work, 0, part, scale, carried)
    flow = expm(generators[0][:STATES, :STATES] * part * tables.info[0, 0])
    wanted = flow @ (scale[:, None] * X) / scale[:, None]
    assert np.abs(carried - wanted).max() < 4e-15 * np.abs(wanted).max()


@pytest.mark.parametrize(("states", "harmonics", "modes"), [(4, 0, 3), (8, 2, 1)])
def test_the_memory_of_tables_is_known_beforehand(states: int, harmonics: int, modes: int) -> None:
    propagators = scratch(states, harmonics, modes, 1, 0, 1)[0][0]
    assert propagators.nbytes == table_bytes(states, harmonics, modes)
