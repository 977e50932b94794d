"""The generated jet of one mode: lines of code that fill the Taylor coefficients of states, indicators, outputs.

Coefficient 0 comes first, in straight lines; then one loop over the order computes coefficient k of every node
and k + 1 of every state; last, coefficient ``order`` of what the indicators and outputs need.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sympy import Basic, Expr, Symbol

from nonsmooth.system.codegen.recurrences import Sum
from nonsmooth.system.codegen.series import CornerError, Linear, Series
from nonsmooth.system.symbolic.printing import Printer


@dataclass(frozen=True)
class JetCode:
    """Lines of one mode's jet, the rows of scratch it needs, and which of the rows are smooth."""

    lines: list[str]
    n_scratch: int
    smooth: tuple[bool, ...]
    functions: frozenset[str]  # of the module ``math``


def jet_code(
    t: Symbol, u: Sequence[Symbol], constants: dict[Basic, str], fields: Sequence[Expr], rows: Sequence[Expr]
) -> JetCode:
    """Write the body of ``jet`` for one mode.

    Parameters
    ----------
    t, u
        The variables.
    constants
        Parameter or memory symbol -> identifier.
    fields
        du/dt, one expression per state.
    rows
        Further expressions whose series along the flow are wanted: indicators, then outputs. One with a corner
        (abs, maximum, ...) gets its value as coefficient 0 and NaN as the others.

    Raises
    ------
    SystemDefinitionError
        A field has a corner, or holds a function without known series.
    """
    return _writer(t, u, constants, fields, rows).code()


def jet_steps(
    t: Symbol, u: Sequence[Symbol], constants: dict[Basic, str], fields: Sequence[Expr], rows: Sequence[Expr]
) -> tuple[list[str], list[str]]:
    """The same in two parts, to be called order by order: for coefficient 0, and for coefficient ``k`` of the rest."""
    writer = _writer(t, u, constants, fields, rows)
    first, following = writer.first(), writer.following()
    return [*writer.series.constant_lines(), *first], following


def _writer(
    t: Symbol, u: Sequence[Symbol], constants: dict[Basic, str], fields: Sequence[Expr], rows: Sequence[Expr]
) -> _Writer:
    series = Series(t, tuple(u), constants)
    field_forms = [series.linear(e) for e in fields]
    row_forms = [_form_or_none(series, e) for e in rows]
    return _Writer(series, field_forms, rows, row_forms)


def _form_or_none(series: Series, expression: Expr) -> Linear | None:
    try:
        return series.linear(expression)
    except CornerError:
        return None


class _Writer:
    def __init__(
        self, series: Series, fields: list[Linear], rows: Sequence[Expr], row_forms: list[Linear | None]
    ) -> None:
        self.series, self.fields, self.rows, self.row_forms = series, fields, rows, row_forms
        self.n = len(fields)
        smooth_rows = [form for form in row_forms if form is not None]
        self.tail = self._closure(smooth_rows)
        self.all = self._closure([*fields, *smooth_rows])
        nodes = series.nodes
        stored = sorted({x for i in self.all for _, *pair in nodes[i].sums for x in pair if x >= self.n})
        self.scratch = {node: row for row, node in enumerate(stored)}

    def _closure(self, forms: Iterable[Linear]) -> list[int]:
        """The nodes these forms need, in an order of computation; states apart."""
        nodes, reached = self.series.nodes, set()
        pending = [node for form in forms for node, _ in form.terms]
        while pending:
            i = pending.pop()
            if i not in reached:
                reached.add(i)
                pending.extend(nodes[i].needs)
                pending.extend([nodes[i].partner] if nodes[i].partner >= 0 else [])
        return sorted(i for i in reached if i >= self.n)

    def code(self) -> JetCode:
        first, following, tail = self.first(), self.following(), self._tail()
        loop = ["for k in range(1, order):", *("    " + line for line in following)]
        lines = [*self.series.constant_lines(), *first, *loop, *tail]
        smooth = tuple(form is not None for form in self.row_forms)
        return JetCode(lines, len(self.scratch), smooth, frozenset(self.series.functions | self.functions))

    def first(self) -> list[str]:
        """Coefficient 0 of everything and 1 of the states."""
        series, n = self.series, self.n
        lines = [f"z{i} = u[{i}]" for i in range(n)]
        lines += [f"C[{i}, 0] = z{i}" for i in range(n)]
        lines += [f"z{series.time} = t"] if series.time >= 0 else []
        lines += [f"z{i} = {series.nodes[i].value}" for i in self.all if i != series.time]
        names = {**series.names, series.t: "t", **{symbol: f"z{i}" for i, symbol in enumerate(series.u)}}
        printer = Printer(names)
        for row, (expression, form) in enumerate(zip(self.rows, self.row_forms, strict=True), start=n):
            lines.append(f"C[{row}, 0] = {printer(expression) if form is None else series.combination(form, True)}")
        self.functions = printer.used
        lines += [f"c{i} = z{i}" for i in self.all if series.nodes[i].carried]
        lines += [f"c{series.time} = 1.0"] if series.time in self.all else []
        lines += [f"c{i} = {series.combination(form, True)}" for i, form in enumerate(self.fields)]
        return [*lines, *(f"C[{i}, 1] = c{i}" for i in range(n))]

    def following(self) -> list[str]:
        """Coefficient k of everything and k + 1 of the states."""
        series, n = self.series, self.n
        body = [*self._steps(self.all, store=True), *self._row_lines("k")]
        body.append("r1 = 1.0/(k + 1)")
        for i, form in enumerate(self.fields):
            text = series.combination(form, False)
            body.append(f"d{i} = " + (text if text == "0.0" else f"({text})*r1" if " " in text else f"{text}*r1"))
        body += [f"c{i} = d{i}" for i in range(n)]
        body += [f"C[{i}, k + 1] = d{i}" for i in range(n)]
        body += [f"c{series.time} = 0.0"] if series.time in self.all else []
        return body

    def _tail(self) -> list[str]:
        lines = self._steps(self.tail, store=False)
        return (["k = order", *lines] if self.tail else []) + self._row_lines("order")

    def _row_lines(self, k: str) -> list[str]:
        lines = []
        for row, form in enumerate(self.row_forms, start=self.n):
            lines.append(f"C[{row}, {k}] = " + ("1e400*0.0" if form is None else self.series.combination(form, False)))
        return lines

    def _steps(self, chosen: list[int], store: bool) -> list[str]:
        """Coefficient k of the chosen nodes, from their coefficients below k."""
        nodes = self.series.nodes
        sums: dict[Sum, str] = {}
        for i in chosen:
            for term in nodes[i].sums:
                sums.setdefault(self._canonical(term), f"s{len(sums)}")
        lines = []
        if sums:
            lines += [f"{name} = 0.0" for name in sums.values()]
            weighted = any("x" in weight for weight, _, _ in sums)
            lines += ["xk = float(k)"] if any("xk" in weight for weight, _, _ in sums) else []
            lines += ["for j in range(1, k):", "    i = k - j", *(["    x = float(j)"] if weighted else [])]
            lines += [f"    {s} += {w}{self._at(a, 'j')}*{self._at(b, 'i')}" for (w, a, b), s in sums.items()]
        steps = {i: nodes[i].step([sums[self._canonical(term)] for term in nodes[i].sums]) for i in chosen}
        lines += ["r = 1.0/k"] if any(re.search(r"\br\b", step) for step in steps.values()) else []
        for i, step in steps.items():
            if i == self.series.time:
                continue
            if not nodes[i].carried or nodes[i].partner < 0:
                lines.append(f"c{i} = {step}")
            elif nodes[i].partner > i:  # both of a pair use the previous coefficients of both
                lines += [f"d{i} = {step}", f"d{i + 1} = {steps[i + 1]}", f"c{i} = d{i}", f"c{i + 1} = d{i + 1}"]
        return lines + ([f"W[{row}, k] = c{i}" for i, row in self.scratch.items()] if store else [])

    @staticmethod
    def _canonical(term: Sum) -> Sum:
        weight, a, b = term
        return term if weight else (weight, min(a, b), max(a, b))

    def _at(self, node: int, index: str) -> str:
        return f"C[{node}, {index}]" if node < self.n else f"W[{self.scratch[node]}, {index}]"
