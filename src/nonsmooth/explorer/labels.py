"""Symbols and units in plain text, for axes and controls that have no formulas."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from sympy.printing.pretty.pretty_symbology import greek_unicode, sub

from nonsmooth.plot.labels import with_unit
from nonsmooth.plot.prefixes import PREFIXES, prefixed
from nonsmooth.system.parameter import latex_name

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def symbols_of(system: System) -> dict[str, str]:
    """LaTeX of every parameter and state, by name."""
    return {name: p.symbol or latex_name(name) for name, p in system.parameters.items()} | {
        name: latex_name(name) for name in system.states
    }


def rows_of(system: System) -> list[dict[str, str]]:
    """The states as the page lists them: name, symbol and unit."""
    return [{"name": name, "html": html_of(latex_name(name)), "unit": unit} for name, unit in system.states.items()]


def plain_of(latex: str) -> str:
    """``k_{s}`` as ``kₛ``: Unicode has a few letters as subscripts; with others the underscore stays."""
    stem, below = parts_of(latex)
    if not below:
        return stem
    small = "".join(sub.get(letter, "") for letter in below)
    return stem + (small if len(small) == len(below) else f"_{below}")


def html_of(latex: str) -> str:
    """``k_{s}`` as ``<i>k</i><sub>s</sub>``; the letters are those of an identifier or of our own table."""
    stem, below = (re.sub(r"[<>&]", "", part) for part in parts_of(latex))
    return f"<i>{stem}</i>" + (f"<sub>{below}</sub>" if below else "")


def parts_of(latex: str) -> tuple[str, str]:
    """Stem and subscript in plain text: ``k_{s}`` as ``("k", "s")``."""
    text = re.sub(r"\\mathrm\{([^{}]*)\}", r"\1", latex)
    text = re.sub(r"\\(?:var)?([A-Za-z]+)", lambda found: greek_unicode.get(found[1], found[1]), text).replace("\\", "")
    stem, _, below = text.partition("_")
    return stem.strip("{}"), below.strip("{}").replace("{", "").replace("}", "")


def axis_label(latex: str, unit: str, power: int = 0) -> str:
    """``ρ (N)``; the symbol alone of what has no unit."""
    return with_unit(plain_of(latex), PREFIXES[power] + unit)


def number(value: float, unit: str = "", digits: int = 4) -> str:
    """A value with its unit, in the prefix that suits it: ``−4.5 mm``."""
    text, unit = prefixed(value, unit, digits)
    return text if unit in ("", "1") else f"{text} {unit}"
