"""Expressions of a traced system as functions of numbers: the one place that makes them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from sympy import Symbol

    from nonsmooth.system.symbolic.traced import Traced


@lru_cache(maxsize=512)
def numeric(
    traced: Traced, expressions: tuple[Any, ...], slopes: tuple[Symbol, ...] | None = None, quick: bool = False
) -> Callable[..., Any]:
    """Make the function f(p, t, u, m) of expressions of a system.

    It takes parameters (..., n_p), times (...), states and memory, whose leading dim (one at most) is broadcast, and
    returns (..., E), or (..., E, 1 + S) with the derivatives of each expression in S symbols behind it. ``quick``: of
    one point, by Python's numbers alone, as one list; a division by zero raises there.
    """
    from sympy import sympify

    from nonsmooth.system.symbolic.printing import Printer, compiled

    every = [one for e in map(sympify, expressions) for one in (e, *map(e.diff, slopes or ()))]
    vectors = {"p": traced.p, "u": traced.u, "m": traced.m}
    names = {symbol: f"{name}[{i}]" for name, symbols in vectors.items() for i, symbol in enumerate(symbols)}
    targets = [(f"out[{i}]", e) for i, e in enumerate(every)]
    fill = compiled("p, t, u, m, out", targets, Printer({**names, traced.t: "t"}, arrays=not quick))

    def at_one(p: Any, t: float = 0.0, u: Any = (), m: Any = ()) -> list[float]:
        out = [0.0] * len(every)
        fill(p, t, u, m, out)
        return out

    def at(p: Any, t: Any = 0.0, u: Any = (), m: Any = ()) -> FloatArray:
        p, t, u, m = (np.asarray(one, dtype=float).T for one in (p, t, u, m))
        out = np.empty((len(every), *np.broadcast_shapes(t.shape, *(one.shape[1:] for one in (p, u, m)))))
        with np.errstate(all="ignore"):
            fill(p, t, u, m, out)
        return out.T if slopes is None else out.T.reshape(*out.shape[1:], len(expressions), 1 + len(slopes))

    return at_one if quick else at
