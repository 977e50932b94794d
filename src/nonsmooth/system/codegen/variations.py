r"""The equations of first variation of a traced system, as a generated module.

Along a motion :math:`\dot u = f(t, u, p, m)` in one mode, small changes of the state, the memory and the parameters
obey :math:`\dot X = f_u X + [0, f_m, f_p]`. The generated ``jet`` gives the Taylor coefficients of the states and of
every entry of these Jacobians that is not zero; ``switch`` gives what a transition does to a state and all its first
derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from nonsmooth.system.codegen.generate import (
    MOST_MODELS,
    SIGNATURES,
    choosing_code,
    constants_of,
    fields_of,
    function_of,
    jet_functions,
)
from nonsmooth.system.codegen.jet import chain, jet_code
from nonsmooth.system.symbolic.traced import Traced, TracedTransition

ZERO, CONSTANT, VARYING = 0, 1, 2
FOUR = 4  # columns in a vector (``kernels.lanes``)
_JET, _FIELD, _SWITCH = (
    f'callback("{signature}")'
    for signature in (
        SIGNATURES["jet"][:-1] + ", f8[:,:,::1])",
        SIGNATURES["field"],
        "void(i8, f8, f8[::1], f8[::1], f8[::1])",
    )
)


@dataclass(frozen=True)
class VariationalModel:
    """Compiled functions and the pattern of the Jacobians.

    Attributes
    ----------
    jet : ``jet(mode, order, t, u, q, C, W)``
        Coefficients of the states, then of the entries below.
    field : ``field(mode, t, u, q, du)``
    switch : ``switch(transition, t, u, q, out)``
        ``out``: the extended state z = (u, memory) after (n), R_z (n, n), R_t (n), R_p (n, n_active), and for each
        row of the condition h, h_z (n), h_t, h_p (n_active).
    entries : array (E, 2)
        Row and column of each entry; columns: states, memory, active parameters.
    kinds : array (n_modes, E)
        0: zero in this mode, 1: constant, 2: varying.
    n_scratch : int
        Rows of W.
    path
        The jet without small changes, of those that no expressions are compiled for.
    """

    jet: Any
    field: Any
    switch: Any
    entries: NDArray[np.int64]
    kinds: NDArray[np.int64]
    n_scratch: int
    path: Any = None


@lru_cache(maxsize=MOST_MODELS)
def variational_model(traced: Traced, active: tuple[int, ...]) -> VariationalModel:
    """Generate and compile (or load from the cache) for some active parameters, given by index."""
    from nonsmooth.kernels.compile.cache import load_module

    wanted = [*traced.u, *traced.m, *(traced.p[i] for i in active)]
    jacobians = [[[_derivative(e, s) for s in wanted] for e in field] for field in traced.fields]
    n = len(traced.u)
    entries = [(i, j) for i in range(n) for j in range(len(wanted)) if any(jac[i][j] != 0 for jac in jacobians)]
    varying = {traced.t, *traced.u}
    kinds = [
        [ZERO if jac[i][j] == 0 else VARYING if jac[i][j].free_symbols & varying else CONSTANT for i, j in entries]
        for jac in jacobians
    ]
    jet = jet_code(
        traced.t, traced.u, constants_of(traced), traced.fields, [[jac[i][j] for i, j in entries] for jac in jacobians]
    )
    small = [tuple(_small_changes(entries, kind, n, len(wanted))) for kind in kinds]
    different = list(dict.fromkeys(small))
    choice = chain([(f"change == {i}", [*lines]) for i, lines in enumerate(different)])
    field, field_lines, used = choosing_code(traced, fields_of(traced))
    switch, switch_lines, used_by_switch = choosing_code(
        traced, [_switch(traced, jump, wanted) for jump in traced.transitions]
    )
    functions = jet.functions | used | used_by_switch
    parts = [
        "from numpy import array",
        "from nonsmooth.kernels.compile.direct import callback, device",
        "from nonsmooth.kernels.compile.lanes import load, plus, store, times",
        f"from math import {', '.join(sorted(functions))}" if functions else "",
        *jet_functions(
            jet,
            _JET,
            "mode, order, t, u, q, C, W, D",
            choice,
            change=list(map(different.index, small)),
        ),
        function_of("field", _FIELD, "mode, t, u, q, du", field, field_lines),
        function_of("switch", _SWITCH, "transition, t, u, q, out", switch, switch_lines),
    ]
    module = load_module("\n".join(part for part in parts if part) + "\n", "variations", lasting=False)
    return VariationalModel(
        module.jet,
        module.field,
        module.switch,
        np.array(entries, dtype=np.int64).reshape(-1, 2),
        np.array(kinds, dtype=np.int64).reshape(len(kinds), len(entries)),
        max(1, jet.n_scratch),
    )


def _small_changes(entries: list[tuple[int, int]], kinds: list[int], n: int, columns: int) -> list[str]:
    """Lines that go on with the series D[k, number, column] of small changes, from D[0] and the entries' series in C:
    X_(k+1) = sum_j A_j X_(k-j) / (k + 1), four columns at once."""
    width = -(-columns // FOUR) * FOUR

    def load(m: int, k: str = "k") -> str:
        place = f"{m * width} + b" if k == "0" else f"{columns * width}*{k} + {m * width} + b"
        return f"load(D, {place})"

    rows: dict[int, list[str]] = {i: [] for i in range(n)}  # terms of each row: factor, vector
    sums, used = [], set()
    for e, ((i, m), kind) in enumerate(zip(entries, kinds, strict=True)):
        if kind == VARYING and m < n:
            sums.append((e, i, m))
        elif kind != ZERO:
            rows[i].append(f"C[{n + e}, k], {load(m, '0')}" if m >= n else f"C[{n + e}, 0], y{m}")
            used |= {m} if m < n else set()
    body = [f"y{m} = {load(m)}" for m in sorted(used)]
    if sums:
        body += [f"s{e} = times(0.0, {load(m, '0')})" for e, _, m in sums]
        body += ["for j in range(k + 1):", *(f"    x{m} = {load(m, 'j')}" for m in sorted({m for _, _, m in sums}))]
        body += [f"    s{e} = plus(s{e}, C[{n + e}, k - j], x{m})" for e, _, m in sums]
    for i, terms in rows.items():
        own = [f"s{e}" for e, row, _ in sums if row == i]
        first = own[0] if own else f"times({terms.pop(0)})" if terms else f"times(0.0, {load(i, '0')})"
        body.append(f"v{i} = {first}")
        body += [f"v{i} = plus(v{i}, 1.0, {more})" for more in own[1:]]
        body += [f"v{i} = plus(v{i}, {term})" for term in terms]
        body.append(f"store(D, {columns * width}*(k + 1) + {i * width} + b, times(1.0/(k + 1), v{i}))")
    return ["for k in range(order):", f"    for b in range(0, {width}, {FOUR}):", *(f"        {line}" for line in body)]


def _derivative(e: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Expanded only where that can show that nothing but constants is left."""
    return sp.expand(e.diff(symbol)) if symbol in e.free_symbols else sp.S.Zero


def _switch(traced: Traced, jump: TracedTransition, wanted: list[sp.Symbol]) -> list[tuple[str, sp.Expr]]:
    """Targets and expressions in the order of ``VariationalModel.switch``."""
    reset = list(traced.u if jump.reset is None else jump.reset)
    # A state that the next mode lacks is dropped: it is nothing that later motion could depend on.
    reset = [sp.S.Zero if gone else e for e, gone in zip(reset, traced.lacking[jump.target], strict=True)]
    memory = dict(jump.writes)
    after = [*reset, *(memory.get(i, symbol) for i, symbol in enumerate(traced.m))]
    n = len(after)
    z, p = wanted[:n], wanted[n:]
    values = [*after, *(_derivative(e, s) for e in after for s in z)]
    values += [_derivative(e, traced.t) for e in after]
    values += [_derivative(e, s) for e in after for s in p]
    for row in jump.rows:
        h = traced.indicators[row.indicator]
        values += [h, *(_derivative(h, s) for s in (*z, traced.t, *p))]
    return [(f"out[{i}]", e) for i, e in enumerate(values)]
