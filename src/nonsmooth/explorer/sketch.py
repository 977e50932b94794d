"""The moving sketch and the equations of a system, as the page draws them: strokes, and MathML."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from html import escape
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nonsmooth.explorer.labels import parts_of, plain_of, symbols_of
from nonsmooth.plot.mechanism import sketch_of_run
from nonsmooth.system.derived.maps import ESCAPED
from nonsmooth.system.transition import condition_text

if TYPE_CHECKING:
    from nonsmooth.system.system import System

_LONGEST = 12  # of the equations' modes that are shown


def _short(part: Any) -> Any:
    """A part as JSON holds it: numbers with two digits behind the point, breaks of a line as None, plain words."""
    if isinstance(part, np.ndarray):
        return [_short(one) for one in part.tolist()]
    if isinstance(part, tuple | list):
        return [_short(one) for one in part]
    if isinstance(part, str):
        return _plain(part) if part.startswith("$") else part
    return part if isinstance(part, bool) else round(float(part), 2) if isfinite(part) else None


def _plain(latex: str) -> str:
    """A label in plain text; nothing of a formula that needs more than a line."""
    text = re.sub(r"(\\?[A-Za-z]+)_\{([^{}]*)\}", lambda found: plain_of(found[0]), latex.strip("$"))
    text = re.sub(r"\\[A-Za-z]+", lambda found: plain_of(found[0]), text.replace(r"\pm", "±").replace(r"\,", " "))
    return "" if re.search(r"[\\{}]|frac|left", text) else text.replace("-", "\N{MINUS SIGN}")


def moving(system: System, run: Any) -> dict[str, Any] | None:
    """Pictures at the instants of a run: the frame of the paper, what stands still, and what moves in each of them.

    None of a system that has no masses on a line.
    """
    made = sketch_of_run(system, run)
    if made is None or not np.isfinite(run["u"].values).all():
        return None
    sketch, parts = made
    drawn = [[(json.dumps(part), part) for part in map(_short, parts(k))] for k in range(run.sizes["time"])]
    still = set.intersection(*({text for text, _ in one} for one in drawn))
    return {
        "paper": [sketch.left - 0.1, sketch.right + 0.1, sketch.bottom, sketch.top],
        "still": [part for text, part in drawn[0] if text in still],
        "frames": [[part for text, part in one if text not in still] for one in drawn],
    }


@lru_cache(maxsize=16)
def equations_of(system: System) -> list[tuple[str, str]]:
    """The equations as the page shows them: a heading (a mode, an element) and MathML, or the words of an element."""
    patterns, loads = system.traced.patterns, system._description.loads
    traced = system.traced if patterns is None else patterns.plain
    latex = symbols_of(system)
    written = {traced.t: sp.Symbol("t")} | {
        symbol: sp.Symbol("_".join(parts_of(latex[name])).strip("_"))
        for symbols, known in ((traced.u, traced.state_names), (traced.p, traced.parameter_names))
        for symbol, name in zip(symbols, known, strict=True)
    }

    def mathml(e: Any) -> str:
        return str(sp.mathml(e, printer="presentation")).replace("<mo>-</mo>", "<mo>−</mo>")

    def equation(left: str, right: Any) -> str:
        """One formula for each term, so that a long equation goes on in the next line."""
        above, below = sp.fraction(sp.sympify(right).xreplace(written))
        terms = above.as_ordered_terms()
        shown = []
        for k, term in enumerate(terms if len(terms) > 1 else [above / below]):
            minus = k > 0 and term.could_extract_minus_sign()
            sign = ("−&nbsp;" if minus else "+&nbsp;") if k else ""
            shown.append(f"{sign}<math displaystyle='true'>{mathml(-term if minus else term)}</math>")
        text = " ".join(shown)
        if len(terms) > 1 and below != 1:
            text = f"({text})&nbsp;/&nbsp;<math>{mathml(below)}</math>"
        return f"<p><math>{left}</math>&nbsp;= {text}</p>"

    def rate(symbol: Any) -> str:
        if system.is_map:
            return f"<msup>{mathml(written[symbol])}<mo>′</mo></msup>"
        return f"<mover>{mathml(written[symbol])}<mo>˙</mo></mover>"

    fields = dict(zip(traced.mode_names, traced.fields, strict=True))
    if loads is not None and loads.elements:
        fields = dict(loads.fields)
    if system.is_map:  # between iterates its states stand still
        names = traced.indicator_names
        fields = {
            condition_text([(names[row[0]], *row[1:]) for row in one.rows]): image
            for one in traced.transitions
            if (image := one.reset) and image[0] != ESCAPED
        }
    found: list[tuple[str, str]] = []
    seen: set[tuple[Any, Any]] = set()
    for mode, field in [*fields.items()][:_LONGEST]:
        new = [pair for pair in zip(traced.u, field, strict=True) if pair not in seen]  # of the first mode all
        seen |= set(new)
        rows = "".join(equation(rate(symbol), e) for symbol, e in new)
        if rows:
            found.append(("" if len(fields) == 1 else mode.replace("_", " "), rows))
    if loads is not None and loads.elements:
        found += [(one.name, escape(one.text)) for one in loads.elements]
    else:
        indicators = [*zip(traced.indicator_names, traced.indicators, strict=True)][:_LONGEST]
        found.append(("changes at", "".join(equation("<mn>0</mn>", e) for _, e in indicators)))
    return found
