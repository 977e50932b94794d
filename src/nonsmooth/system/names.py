"""Names that the parts of a system may have.

A parameter's name becomes a dim of a result and a state's name a coordinate, so that the names the
results use themselves are reserved.
"""

from __future__ import annotations

import keyword
import unicodedata
from collections.abc import Iterable, Mapping

from nonsmooth.errors import SystemDefinitionError

RESERVED = frozenset(
    [
        # dims of results
        "time",
        "state",
        "iterate",
        "point",
        "crossing",
        "touch",
        "direction",
        "start",
        "mode",
        "status",
        "method",
        "jump",
        "special",
        "multiplier",
        "exponent",
        "attractor",
        "segment",
        "indicator",
        "part",
        "memory",
        "sample",
        # variables of results
        "section",
        "maximum",
        "minimum",
        "amplitude",
        "residual",
        "period",
        "period_number",
        "crossings_per_period",
        "contacts_per_period",
        "clearance",
        "signature",
        "stable",
        "label",
        "kind",
        "transition",
        "floquet_multipliers",
        "exponents",
        "standard_error",
        "running",
        "batch",
        "trace_defect",
        "kaplan_yorke",
        "nearest_graze",
        "equilibrium",
        "elapsed",
        "fraction",
        "fraction_error",
        "minimal_shock",
        "start_state",
        "state_unit",
        "state_symbol",
        "provenance",
        # arguments of the user's functions
        "u",
        "t",
        "p",
    ]
)


def check_names(groups: Mapping[str, Iterable[str]], system: str) -> None:
    """Check that all names are identifiers, not reserved, and different across all ``groups``: the names by what they
    are ("state", "parameter", ...)."""
    seen: dict[str, str] = {}
    shown = (*groups.get("output", ()), *groups.get("load of an element", ()))
    extremes = {f"{o}_{which}": o for o in shown for which in ("maximum", "minimum")}
    for what, names in groups.items():
        one = f"{'an' if what[0] in 'aeiou' else 'a'} {what}"
        for name in names:
            if not isinstance(name, str):
                raise SystemDefinitionError(f"{system!r}: the name of {one} must be a string, not {name!r}")
            if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
                hint = f"; try {name}_" if keyword.iskeyword(name) else ""
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name {one}: it must be a Python identifier that is no keyword "
                    f"and does not begin with an underscore{hint}"
                )
            if (read := unicodedata.normalize("NFKC", name)) != name:
                letters = ", ".join(unicodedata.name(a, "?") for a in name if a not in read)
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name {one}: it holds {letters}, and in code Python reads the name "
                    f"as {read!r} (p.{name} is p.{read}). Name it {read!r}, or in plain letters (mu)"
                )
            if name in RESERVED:
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name {one}: the results use this name themselves; "
                    f"try {name}_ or {what}_{name}. Reserved: {', '.join(sorted(RESERVED))}"
                )
            if name in extremes:
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name {one}: a sweep gives this name to an extreme of the output "
                    f"{extremes[name]!r}; try {name}_ or {what}_{name}"
                )
            if name in seen:
                raise SystemDefinitionError(
                    f"{system!r}: the name {name!r} is given to {_a(seen[name])} and to {_a(what)}; "
                    f"all names of a system must be different"
                )
            seen[name] = what


def _a(word: str) -> str:
    return f"an {word}" if word[0] in "aeio" else f"a {word}"
