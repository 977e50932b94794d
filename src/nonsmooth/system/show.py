"""A system as a table, in text and in HTML, and as LaTeX."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import sympy as sp

from nonsmooth.results.representation import html_table, text_table
from nonsmooth.system.parameter import latex_name
from nonsmooth.system.symbolic.expressions import write_expression
from nonsmooth.system.symbolic.traced import NOT_UNIQUE
from nonsmooth.system.transition import condition_text

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced, TracedTransition
    from nonsmooth.system.system import System


def _jump(jump: TracedTransition, traced: Traced, names: dict[sp.Symbol, str]) -> str:
    text = jump.label
    if jump.at is not None:
        text += f"  at phase {traced.phase_text(jump)}"
    else:
        indicators = traced.indicator_names
        text += "  when " + condition_text([(indicators[row.indicator], row.sign, row.strict) for row in jump.rows])
    if jump.reset is not None:
        changed = [
            f"{name} := {write_expression(e, names)}"
            for name, e, symbol, gone in zip(
                traced.state_names, jump.reset, traced.u, traced.lacking[jump.target], strict=True
            )
            if e != symbol and not gone
        ]
        text += ", reset " + ", ".join(changed)
    if jump.writes:
        written = (f"{traced.memory_names[i]} := {write_expression(e, names)}" for i, e in jump.writes)
        text += ", write " + ", ".join(written)
    return text


def table(system: System, *, whole: bool = True, verbose: bool = False) -> str:
    """Return the equations as a table; short enough for a terminal where it need not be ``whole``.

    Elements stand there as they were given, and where it is ``verbose`` as the modes and transitions made of them."""
    return text_table(f"System {system.name!r}", _rows(system, verbose), whole=whole, more="print(system) shows")


def page(system: System) -> str:
    """Return the same table as HTML."""
    return html_table(f"System {system.name!r}", _rows(system))


def _rows(system: System, verbose: bool = False) -> list[tuple[str, str]]:
    """Headings and texts: states, parameters, equations by mode, indicators, transitions, period."""
    patterns, description = system.traced.patterns, system._description
    loads = description.loads
    short = bool(loads and loads.elements) and not system.is_smoothed and not verbose
    given = description.plain if short or patterns is not None else None  # as it was, without elements
    traced, surfaces = given() if given else (system.traced, system.surfaces)
    names = traced.named()
    lines: list[tuple[str, str]] = []

    def listed(units: Mapping[str, str]) -> str:
        return ", ".join(f"{name} [{unit}]" if unit else name for name, unit in units.items())

    lines.append(("states", listed(system.states)))
    values = (f"{k} = {v.value:.12g}{' ' * bool(v.unit)}{v.unit}" for k, v in system.parameters.items())
    lines.append(("parameters", ", ".join(values) or "none"))
    if system.memory:
        lines.append(("memory", listed(system.memory)))
    for mode, field, lacking in zip(traced.mode_names, traced.fields, traced.lacking, strict=True):
        if mode.endswith(NOT_UNIQUE):  # a run that comes there ends
            continue
        head = "equations" if given and len(traced.fields) == 1 else f"mode {mode}"
        for name, e, gone in zip(traced.state_names, field, lacking, strict=True):
            if not gone:
                lines.append((head, f"{name}' = {write_expression(e, names)}"))
                head = ""
    if loads is not None:
        lines += [("elements" if k == 0 else "", f"{one.name}: {one.text}") for k, one in enumerate(loads.elements)]
    n = len((traced if given else description.traced).indicators)  # those derived for a band are named by their formula
    for name, e in zip(traced.indicator_names[:n], traced.indicators, strict=False):
        lines.append((f"indicator {name}", write_expression(e, names)))
    for surface in surfaces:
        text = f"{traced.mode_names[surface.below]} | {traced.mode_names[surface.above]}, crossed or slid on"
        if surface.static is not None:
            text += f", static {write_expression(surface.static, names)}"
        lines.append((f"surface {traced.indicator_names[surface.indicator]}", text))
    either_side = {frozenset((surface.below, surface.above)) for surface in surfaces}
    head = "transitions"
    for jump in (traced if given else system.declared).transitions:
        if frozenset((jump.source, jump.target)) not in either_side:
            lines.append((head, _jump(jump, traced, names)))
            head = ""
    if patterns is not None:
        lines.append(("combinations", f"{len(patterns.visited)} of contact states visited so far"))
    elif short:
        count = f"{len(system.modes)}, with {len(system.declared.transitions)} transitions"
        lines.append(("modes", f"{count}: print(system.summary(verbose=True)) shows them"))
    if system.outputs:
        lines.append(("outputs", listed(system.outputs)))
    lines.append(("period", _period(system, names)))
    if system.is_smoothed:
        lines.append(("smoothing", f"eta = {system.eta}, {system.band} band"))
    return lines


def _period(system: System, names: dict[sp.Symbol, str]) -> str:
    period = system.traced.period
    if period is not None:
        text, value = write_expression(period, names), f"{system.period():.9g}"
        return text if text == value else f"{text} = {value}"
    return "none: depends on the time, not periodically" if system.explicit_time else "none (autonomous)"


def latex(system: System) -> str:
    """Return the equations as an ``align*`` environment: fields by mode, indicators, transitions."""
    system.refuse_patterns("to_latex")
    traced, parameters = system.traced, system.parameters
    names = {symbol: latex_name(name) for symbol, name in traced.named().items()}
    names |= dict(zip(traced.p, (one.symbol for one in parameters.values()), strict=True))

    def write(expression: sp.Expr) -> str:
        return str(sp.latex(expression, symbol_names=names))

    def word(text: str) -> str:
        return r"\text{" + text.replace("_", r"\_") + "}"

    lines = []
    for mode, field, lacking in zip(traced.mode_names, traced.fields, traced.lacking, strict=True):
        if mode.endswith(NOT_UNIQUE):
            continue
        label = rf"&& {word(mode)}"
        for symbol, e, gone in zip(traced.u, field, lacking, strict=True):
            if not gone:
                lines.append(rf"\dot{{{names[symbol]}}} &= {write(e)} {label}".rstrip())
                label = ""
    lines += [
        rf"h_{{{word(name)}}} &= {write(e)}" for name, e in zip(traced.indicator_names, traced.indicators, strict=True)
    ]
    for jump in traced.transitions:
        if traced.ends(jump):
            continue
        arrow = rf"{word(traced.mode_names[jump.source])} &\to {word(traced.mode_names[jump.target])}"
        if jump.at is not None:
            condition = "t / T = " + (f"{jump.at:g}" if isinstance(jump.at, int | float) else write(jump.at))
        else:
            signs = (
                (">" if r.sign > 0 else "<") if r.strict else (r"\ge" if r.sign > 0 else r"\le") for r in jump.rows
            )
            condition = r",\ ".join(
                rf"h_{{{word(traced.indicator_names[row.indicator])}}} {sign} 0"
                for row, sign in zip(jump.rows, signs, strict=True)
            )
        reset = zip(traced.u, jump.reset or traced.u, traced.lacking[jump.target], strict=True)
        after = [(symbol, e) for symbol, e, gone in reset if e != symbol and not gone]
        after += [(traced.m[i], e) for i, e in jump.writes]
        lines.append(rf"{arrow} && " + r",\quad ".join([condition, *(rf"{names[x]}^+ = {write(e)}" for x, e in after)]))
    body = " \\\\\n".join(lines)
    return f"\\begin{{align*}}\n{body}\n\\end{{align*}}"
