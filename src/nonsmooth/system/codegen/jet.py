"""The generated jet: lines of code that fill the Taylor coefficients of states, indicators and outputs in every mode.

One loop over the order computes coefficient k of every node, indicator and output, and k + 1 of every state. Modes that
need the same nodes share them; each has its own linear forms over them. What stays zero is left out.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter

from sympy import Basic, Expr, Symbol

from nonsmooth.system.codegen.recurrences import Sum
from nonsmooth.system.codegen.series import CornerError, Linear, Series
from nonsmooth.system.symbolic.printing import Printer


@dataclass(frozen=True)
class JetCode:
    """Lines for each group of modes, and tables of what holds in each mode: its group, and what it has there."""

    groups: list[list[str]]
    tables: dict[str, list[int]]
    n_scratch: int
    smooth: list[tuple[bool, ...]]  # whether each row is, in each mode
    functions: frozenset[str]  # of the module ``math``


def jet_code(
    t: Symbol,
    u: Sequence[Symbol],
    constants: dict[Basic, str],
    fields: Sequence[Sequence[Expr]],
    rows: Sequence[Sequence[Expr]],
) -> JetCode:
    """Write the bodies of the functions ``jet`` of the groups. In them the name of a table stands for its entry of the
    mode; rows that are zero are not written.

    ``constants`` names parameters and memory; ``fields`` are du/dt in each mode, ``rows`` further expressions whose
    series along the flow are wanted: indicators, then outputs. A row with a corner (abs, maximum, ...) has its value as
    coefficient 0 and NaN as the others; a field with one, or a function without known series, is refused."""
    series = Series(t, tuple(u), constants)
    modes = [_mode(series, *given) for given in zip(fields, rows, strict=True)]
    n, n_rows = len(u), len(rows[0])
    groups = [_Writer(series, nodes) for nodes in dict.fromkeys(mode.nodes for mode in modes)]
    tables = {"group": [[group.nodes for group in groups].index(mode.nodes) for mode in modes]}
    tables |= {f"w{target}": [0] * len(modes) for target in range(n + n_rows)}
    bodies = []
    for number, group in enumerate(groups):
        own = [i for i, where in enumerate(tables["group"]) if where == number]
        lines, chosen = group.whole([modes[i] for i in own])
        bodies.append(lines)
        for i, choices in zip(own, chosen, strict=True):
            for target, choice in enumerate(choices):
                tables[f"w{target}"][i] = choice
    return JetCode(
        bodies,
        tables,
        max(len(group.scratch) for group in groups),
        [tuple(not form.corner for form in mode.forms[n:]) for mode in modes],
        frozenset(series.functions),
    )


def jet_steps(
    t: Symbol, u: Sequence[Symbol], constants: dict[Basic, str], fields: Sequence[Expr], rows: Sequence[Expr]
) -> tuple[list[str], list[str]]:
    """The same for one mode in two parts, to be called order by order: for coefficient 0, and for coefficient ``k`` of
    the rest. Coefficients that are always zero are not written."""
    series = Series(t, tuple(u), constants)
    mode = _mode(series, fields, rows)
    writer = _Writer(series, mode.nodes)
    each = [*writer.states(), *(line for form in mode.forms for line in form.body), *writer.ahead([mode])]
    once = [line for form in mode.forms for line in writer.once(form)]
    return [*writer.first(), *once, *each], [*writer.steps(), *each]


def chain(branches: Sequence[tuple[str, list[str]]]) -> list[str]:
    """Lines that do the first branch whose condition holds; the last needs none."""
    if len(branches) == 1:
        return branches[0][1]
    lines = []
    for i, (condition, body) in enumerate(branches):
        lines.append("else:" if i == len(branches) - 1 else f"{'el' if i else ''}if {condition}:")
        lines += [f"    {line}" for line in body or ["pass"]]
    return lines


@dataclass(frozen=True)
class _Form:
    """Lines for coefficient k of a row or of the derivative of a state, and for its term of coefficient 0 alone."""

    body: tuple[str, ...] = ()
    once: tuple[str, ...] = ()
    corner: bool = False


_BODY: Callable[[_Form], tuple[str, ...]] = attrgetter("body")


@dataclass(frozen=True)
class _Mode:
    """The forms of a mode, those of the states first, and the nodes that they need."""

    nodes: tuple[int, ...]  # in an order of computation; states apart
    forms: tuple[_Form, ...]


def _mode(series: Series, fields: Sequence[Expr], rows: Sequence[Expr]) -> _Mode:
    derivatives = [series.linear(e) for e in fields]
    smooth = [_form_or_none(series, e) for e in rows]
    n = len(fields)
    forms = [_form(series, f"d{i}", i, form) for i, form in enumerate(derivatives)]
    for row, (expression, form) in enumerate(zip(rows, smooth, strict=True), start=n):
        if form is None:
            names = {**series.names, series.t: "t", **{symbol: f"z{i}" for i, symbol in enumerate(series.u)}}
            printer = Printer(names)
            forms.append(_Form((f"C[{row}, k] = n{row}",), (f"n{row} = {printer(expression)}",), True))
            series.functions.update(printer.used)
        elif form.constant == 0 and not form.terms:
            forms.append(_Form())
        else:
            forms.append(_form(series, f"C[{row}, k]", row, form))
    return _Mode(_closure(series, [*derivatives, *filter(None, smooth)]), tuple(forms))


def _form(series: Series, target: str, number: int, form: Linear) -> _Form:
    """The constant comes first: near a surface, x - g is then exact."""
    terms = series.combination(form, False)
    if form.constant == 0:
        return _Form((f"{target} = {terms}",))
    text = f"e{number}" if terms == "0.0" else f"e{number} + {terms}".replace("+ -", "- ")
    return _Form((f"{target} = {text}",), (f"e{number} = {series.constant(form.constant)}",))


def _form_or_none(series: Series, expression: Expr) -> Linear | None:
    try:
        return series.linear(expression)
    except CornerError:
        return None


def _closure(series: Series, forms: Iterable[Linear]) -> tuple[int, ...]:
    """The nodes these forms need, in an order of computation; states apart."""
    nodes, reached = series.nodes, set()
    pending = [node for form in forms for node, _ in form.terms]
    while pending:
        i = pending.pop()
        if i not in reached:
            reached.add(i)
            pending.extend(nodes[i].needs)
            pending.extend([nodes[i].partner] if nodes[i].partner >= 0 else [])
    return tuple(sorted(i for i in reached if i >= len(series.u)))


class _Writer:
    """Lines for the modes that need the same nodes. In them c is coefficient k, z coefficient 0."""

    def __init__(self, series: Series, nodes: tuple[int, ...]) -> None:
        self.series, self.nodes, self.n = series, nodes, len(series.u)
        stored = sorted({x for i in nodes for _, *pair in series.nodes[i].sums for x in pair if x >= self.n})
        self.scratch = {node: row for row, node in enumerate(stored)}

    def whole(self, modes: Sequence[_Mode]) -> tuple[list[str], list[list[int]]]:
        """Lines for all coefficients, and which of its forms each target has in each mode."""
        different = [list(dict.fromkeys(forms)) for forms in zip(*(mode.forms for mode in modes), strict=True)]

        def chosen(lines_of: Callable[[_Form], Iterable[str]], targets: range) -> list[str]:
            chains = ([(f"w{i} == {j}", [*lines_of(form)]) for j, form in enumerate(different[i])] for i in targets)
            return [line for branches in chains for line in chain(branches)]

        n, count, steps, end = self.n, len(different), self.steps(), ["if k == order:", "    break"]
        rows, derivatives = chosen(_BODY, range(n, count)), chosen(_BODY, range(n))
        of_nodes = ["if k > 0:", *(f"    {line}" for line in steps)] if steps else []
        if self._in(rows):
            body = [*of_nodes, *self.states(), *rows, *end, *derivatives]
        else:  # the last coefficients of the nodes are for nothing
            body = [*self.states(), *rows, *end, *of_nodes, *derivatives]
        lines = [f"for i in range({n}, {count}):", "    for k in range(order + 1):", "        C[i, k] = 0.0"]
        lines += [*self.first(), *(f"{name} = 0.0" for name in self._terms(modes)), *chosen(self.once, range(count))]
        lines += ["for k in range(order + 1):", *(f"    {line}" for line in [*body, *self.ahead(modes)])]
        return lines, [[own.index(form) for own, form in zip(different, mode.forms, strict=True)] for mode in modes]

    def _in(self, lines: list[str]) -> bool:
        """Do lines hold a coefficient of a node other than the time?"""
        found = {int(number) for number in re.findall(r"\bc(\d+)\b", "\n".join(lines))}
        return bool(found & set(self.nodes) - {self.series.time})

    def _terms(self, modes: Sequence[_Mode]) -> list[str]:
        """Names of the terms of coefficient 0 alone."""
        return sorted({line.split(" ")[0] for mode in modes for form in mode.forms for line in form.once})

    def first(self) -> list[str]:
        """Constants and coefficient 0 of the nodes."""
        return [*self.series.constant_lines(self._of_nodes), *self.values()]

    @cached_property
    def _of_nodes(self) -> list[str]:
        return [*self.values(), *self.steps()]

    def once(self, form: _Form) -> list[str]:
        """A form's term of coefficient 0, and its constants that the nodes do not need."""
        return [*self.series.constant_lines([*form.once, *form.body], self._of_nodes), *form.once]

    def values(self) -> list[str]:
        """Coefficient 0 of the states and nodes."""
        nodes, time = self.series.nodes, self.series.time
        lines = [f"z{i} = u[{i}]" for i in range(self.n)] + ([f"z{time} = t"] if time >= 0 else [])
        lines += [f"z{i} = {nodes[i].value}" for i in self.nodes if i != time]
        return lines + [f"c{i} = z{i}" for i in (*range(self.n), *self.nodes)]

    def states(self) -> list[str]:
        return [f"C[{i}, k] = c{i}" for i in range(self.n)]

    def ahead(self, modes: Sequence[_Mode]) -> list[str]:
        """Coefficient k + 1 of the states; what belongs to coefficient 0 alone is gone."""
        lines = ["r1 = 1.0/(k + 1)", *(f"c{i} = d{i}*r1" for i in range(self.n))]
        lines += [f"c{self.series.time} = 0.0 if k else 1.0"] if self.series.time in self.nodes else []
        return [*lines, *(f"{name} = {'1e400*0.0' if name[0] == 'n' else '0.0'}" for name in self._terms(modes))]

    def steps(self) -> list[str]:
        """Coefficient k > 0 of the nodes, from their coefficients below k."""
        nodes, chosen = self.series.nodes, self.nodes
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
        return lines + [f"W[{row}, k] = c{i}" for i, row in self.scratch.items()]

    @staticmethod
    def _canonical(term: Sum) -> Sum:
        weight, a, b = term
        return term if weight else (weight, min(a, b), max(a, b))

    def _at(self, node: int, index: str) -> str:
        return f"C[{node}, {index}]" if node < self.n else f"W[{self.scratch[node]}, {index}]"
