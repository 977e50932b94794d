r"""Is every mode linear with constant coefficients and harmonic forcing, and if so, with which matrices?

    u' = A u + b + sum_h c_h cos(k_h omega t) + s_h sin(k_h omega t),    omega = 2 pi / period

for each mode, with the same form for indicators, outputs and resets where they are affine in u. Memory counts as
further states behind the others, at rest but for what transitions write. The decision is made by taking the expressions
apart, once per system; the matrices of any number of parameter points then come from one generated NumPy function.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy
from sympy import Expr, Symbol

from nonsmooth.arrays import FloatArray
from nonsmooth.system.symbolic.printing import Printer, compiled
from nonsmooth.system.symbolic.traced import Traced, TracedTransition

if TYPE_CHECKING:
    from nonsmooth.kernels.hybrid.records import Form

#: The tables of a parameter point, by the letters of what they are for: modes, n states, h harmonics, indicators,
#: outputs and resets.
SHAPES = {
    "omega": "",
    "A": "mnn",
    "b": "mn",
    "c": "mhn",
    "s": "mhn",
    "ia": "in",
    "ib": "i",
    "ic": "ih",
    "is_": "ih",
    "oa": "omn",
    "ob": "om",
    "oc": "omh",
    "os": "omh",
    "ra": "rnn",
    "rb": "rn",
    "rc": "rhn",
    "rs": "rhn",
}
Terms = dict[Hashable, Expr]  # "1", "t", ("u", i), ("cos", k) or ("sin", k) -> coefficient in the parameters


class LinearForm:
    """The linear form of a system whose modes are all linear: the entries of its tables, and functions that fill them.

    Attributes
    ----------
    multiples : tuple of int
        The harmonics k_h >= 1 that occur anywhere, ascending.
    affine_indicators, affine_resets : bool
        Whether all of them have the form above; an output that has not is NaN.
    """

    def __init__(self, traced: Traced, base: Expr | None, affine_indicators: bool, affine_resets: bool) -> None:
        self.traced, self.base = traced, base
        self.affine_indicators, self.affine_resets = affine_indicators, affine_resets
        self._entries: list[tuple[str, list[int], int, Expr]] = []  # table, place but for the harmonic, that, formula
        self._fills: dict[Any, Callable[..., None]] = {}

    def add(self, vectors: Sequence[list[Terms]], a: str, b: str, c: str, s: str) -> None:
        """Add vectors to the tables of the states, the constant, cosines and sines."""
        for lead, vector in enumerate(vectors):
            for i, terms in enumerate(vector):
                place = [lead, i][len(SHAPES[b]) == 1 :]  # indicators are one vector
                for key, coefficient in terms.items():
                    if not isinstance(key, tuple):
                        self._entries.append((b, place, 0, coefficient))
                    elif key[0] == "u":
                        self._entries.append((a, [*place, key[1]], 0, coefficient))
                    else:
                        self._entries.append((c if key[0] == "cos" else s, place, key[1], coefficient))

    @cached_property
    def multiples(self) -> tuple[int, ...]:
        return tuple(sorted({k for _, _, k, _ in self._entries if k}))

    def evaluate(self, points: FloatArray, place: int | None = None) -> Form:
        """All matrices at points (P, n_parameters), not finite where a formula is not (a division by a zero parameter).
        Memory stands behind the states; where indicators, outputs or resets are not affine, theirs are zero (of resets
        the identity).

        With ``place`` the derivatives of all entries in that parameter, at fixed states and time (``omega``: of the
        frequency)."""
        from nonsmooth.kernels.hybrid.records import Form

        points = np.asarray(points, dtype=np.float64)
        t = self.traced
        sizes = {
            "n": len(t.u) + len(t.m),
            "m": len(t.fields),
            "h": len(self.multiples),
            "i": len(t.indicators),
            "o": len(t.outputs),
            "r": len(t.transitions),
        }
        shapes = {name: [sizes[letter] for letter in letters] for name, letters in SHAPES.items()}
        tables = {name: np.zeros((len(points), *shape)) for name, shape in shapes.items()}
        with np.errstate(all="ignore"):
            self._filler(place, tuple(tables))(np.ascontiguousarray(points.T), **tables)
            period = np.where(tables["omega"] > 0.0, 2.0 * np.pi / tables["omega"], np.inf)
        lacking = np.ones((sizes["m"], sizes["n"]), dtype=np.int64)  # memory is no state of a mode
        lacking[:, : len(t.u)] = np.reshape(t.lacking, (-1, len(t.u)))
        multiples = np.array(self.multiples, dtype=np.int64)
        return Form(**tables, multiples=multiples, period=period, lacking=lacking)

    def fill(self, values: FloatArray, place: int | None, tables: dict[str, FloatArray], again: bool = False) -> None:
        """Write the entries that are not zero, or their derivatives in one parameter, into tables for one point.

        Those of ``SHAPES`` that are not given are left out; ``again``: entries that are constants stand there."""
        with np.errstate(all="ignore"):
            self._filler(place, tuple(tables), again)(values[:, None], **tables)

    def _filler(self, place: int | None, names: tuple[str, ...], again: bool = False) -> Callable[..., None]:
        """The function that fills some tables, or those of the derivatives in one parameter; ``again``: all that
        depends on parameters."""
        if (place, names, again) in self._fills:
            return self._fills[place, names, again]
        targets: list[tuple[str, Expr]] = [] if self.base is None else [("omega[:]", self.base)]
        for table, index, k, coefficient in self._entries:
            if table in names:
                where = list(index)
                if k:
                    where.insert(SHAPES[table].index("h"), self.multiples.index(k))
                targets.append((f"{table}[{', '.join([':', *map(str, where)])}]", coefficient))
        if place is not None:
            targets = [(target, sympy.diff(e, self.traced.p[place])) for target, e in targets]
            targets = [(target, e) for target, e in targets if e != 0]
        if again:
            targets = [(target, e) for target, e in targets if e.free_symbols]
        printer = Printer({symbol: f"p[{i}]" for i, symbol in enumerate(self.traced.p)}, arrays=True)
        self._fills[place, names, again] = compiled(f"p, {', '.join(names)}", targets, printer)
        return self._fills[place, names, again]


def apart(rows: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Views on rows (..., M) over w = (u, 1, cos, sin, ...): of the n states, the constant, cosines, sines."""
    return rows[..., :n], rows[..., n], rows[..., n + 1 :: 2], rows[..., n + 2 :: 2]


def put_together(into: FloatArray, n: int, *tables: FloatArray) -> None:
    """Write tables of the states, the constant, cosines and sines into rows."""
    for view, values in zip(apart(into, n), tables, strict=True):
        view[...] = values


@lru_cache(maxsize=256)
def linear_form(traced: Traced) -> LinearForm | None:
    """Return the linear form, or None where some mode has none."""
    taking = _TakingApart(traced)
    fields: list[list[Terms]] = []
    for vector in traced.fields:  # the first that has none decides: sums of Filippov's quotients are long
        if (found := taking.all_or_none(vector)) is None:
            return None
        fields.append(found)
    indicators = taking.all_or_none(traced.indicators)
    outputs = [taking.all_or_none(row) for row in traced.outputs]
    resets = [taking.all_or_none(_map_of(t, traced)) for t in traced.transitions]
    affine_resets = all(r is not None for r in resets)
    unknown: list[Terms] = [{"1": sympy.nan}] * len(fields)
    form = LinearForm(traced, taking.base, indicators is not None, affine_resets)
    form.add(fields, "A", "b", "c", "s")
    form.add([indicators or []], "ia", "ib", "ic", "is_")
    form.add([row or unknown for row in outputs], "oa", "ob", "oc", "os")
    form.add([(affine_resets and vector) or taking.identity() for vector in resets], "ra", "rb", "rc", "rs")
    return form


def _map_of(transition: TracedTransition, traced: Traced) -> tuple[Expr, ...]:
    """States and memory behind a transition."""
    written = dict(transition.writes)
    states = traced.u if transition.reset is None else transition.reset
    return (*states, *(written.get(i, symbol) for i, symbol in enumerate(traced.m)))


class _NotAffineError(Exception):
    """The expression has no such form."""


class _TakingApart:
    """Writes expressions as a sum of coefficients times 1, u_i, cos(k omega t), sin(k omega t)."""

    def __init__(self, traced: Traced) -> None:
        self.t, self.u = traced.t, (*traced.u, *traced.m)
        self.base: Expr | None = None if traced.period is None else 2 * sympy.pi / traced.period
        self.variables: set[Symbol] = {traced.t, *self.u}

    def all_or_none(self, expressions: tuple[Expr, ...]) -> list[Terms] | None:
        try:
            return [self.terms(e) for e in expressions]
        except _NotAffineError:
            return None

    def identity(self) -> list[Terms]:
        return [{("u", i): sympy.S.One} for i in range(len(self.u))]

    def terms(self, expression: Expr) -> Terms:
        """Raise where there is no such form; products are multiplied out only if need be."""
        try:
            terms = self._terms(expression)
        except _NotAffineError:
            terms = self._terms(sympy.expand(expression))
        if sympy.expand(terms.get("t", sympy.S.Zero)) != 0:
            raise _NotAffineError
        return {key: c for key, c in terms.items() if key != "t" and c != 0}

    def _terms(self, e: Expr) -> Terms:
        if e in self.variables:
            return {"t" if e == self.t else ("u", self.u.index(e)): sympy.S.One}
        if not e.free_symbols & self.variables:
            return {"1": e}
        if e.is_Add:
            total: Terms = {}
            for part in e.args:
                _accumulate(total, self._terms(part))
            return total
        if e.is_Mul:
            product: Terms = {"1": sympy.S.One}
            for part in e.args:
                product = _multiplied(product, self._terms(part))
            return product
        if e.is_Pow and isinstance(e.exp, sympy.Integer) and e.exp > 1:
            base = self._terms(e.base)
            product = base
            for _ in range(int(e.exp) - 1):
                product = _multiplied(product, base)
            return product
        if isinstance(e, sympy.sin | sympy.cos):
            return self._wave(e, self._terms(e.args[0]))
        raise _NotAffineError

    def _wave(self, e: Expr, argument: Terms) -> Terms:
        """sin or cos of w t + phase, w a multiple of the base frequency."""
        rate = argument.pop("t", sympy.S.Zero)
        phase = argument.pop("1", sympy.S.Zero)
        if argument:
            raise _NotAffineError
        k = self._multiple(rate)
        sine, cosine = sympy.sin(phase), sympy.cos(phase)
        if isinstance(e, sympy.cos):
            return _harmonic(k, cosine, -sine)
        return _harmonic(k, sine, cosine)

    def _multiple(self, rate: Expr) -> int:
        if self.base is None:
            raise _NotAffineError
        ratio = rate / self.base
        if not ratio.is_number:
            ratio = sympy.simplify(ratio)
        if not (ratio.is_number and ratio.is_real):
            raise _NotAffineError
        k = round(float(ratio))
        # A period typed in as a number need not divide the frequency to the last digit.
        if abs(float(ratio) - k) > 1e-12 * max(1, abs(k)):
            raise _NotAffineError
        return k


def _harmonic(k: int, cosine: Expr, sine: Expr) -> Terms:
    """cosine * cos(k omega t) + sine * sin(k omega t) for any integer k."""
    if k == 0:
        return {"1": cosine}
    return {("cos", abs(k)): cosine, ("sin", abs(k)): sine if k > 0 else -sine}


def _accumulate(total: Terms, part: Terms) -> None:
    for key, c in part.items():
        total[key] = total.get(key, sympy.S.Zero) + c


def _multiplied(a: Terms, b: Terms) -> Terms:
    product: Terms = {}
    for x, c in a.items():
        for y, d in b.items():
            if c != 0 and d != 0:
                _accumulate(product, {key: c * d * factor for key, factor in _times(x, y).items()})
    return product


def _times(x: Hashable, y: Hashable) -> Terms:
    if x == "1" or y == "1":
        return {y if x == "1" else x: sympy.S.One}
    if not (isinstance(x, tuple) and isinstance(y, tuple)) or "u" in (x[0], y[0]):
        raise _NotAffineError
    half = sympy.S.Half
    (f, k), (g, m) = x, y
    total: Terms = {}
    if f == g:  # cos cos = (cos(k - m) + cos(k + m)) / 2, sin sin = (cos(k - m) - cos(k + m)) / 2
        _accumulate(total, _harmonic(k - m, half, sympy.S.Zero))
        _accumulate(total, _harmonic(k + m, half if f == "cos" else -half, sympy.S.Zero))
    else:  # sin(k) cos(m) = (sin(k + m) + sin(k - m)) / 2
        k, m = (k, m) if f == "sin" else (m, k)
        _accumulate(total, _harmonic(k + m, sympy.S.Zero, half))
        _accumulate(total, _harmonic(k - m, sympy.S.Zero, half))
    return total
