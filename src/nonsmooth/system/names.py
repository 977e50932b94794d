"""Names that may be used, and helpful answers to those that may not.

A parameter's name becomes a dim of a result and a state's name a coordinate, so that the names the
results use themselves are reserved.
"""

from __future__ import annotations

import difflib
import keyword
import unicodedata
from collections.abc import Iterable, Mapping

from nonsmooth.errors import SystemDefinitionError, shortened

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
    """Check that all names are identifiers, not reserved, and different across all ``groups``.

    Parameters
    ----------
    groups : mapping of str to iterable of str
        What the names are ("state", "parameter", ...) and the names.
    system : str
        Name of the system, for the message.
    """
    seen: dict[str, str] = {}
    extremes = {f"{o}_{which}": o for o in groups.get("output", ()) for which in ("maximum", "minimum")}
    for what, names in groups.items():
        for name in names:
            if not isinstance(name, str):
                raise SystemDefinitionError(f"{system!r}: the name of a {what} must be a string, not {name!r}")
            if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
                hint = f"; try {name}_" if keyword.iskeyword(name) else ""
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name a {what}: it must be a Python identifier that is no keyword "
                    f"and does not begin with an underscore{hint}"
                )
            if (read := unicodedata.normalize("NFKC", name)) != name:
                letters = ", ".join(unicodedata.name(a, "?") for a in name if a not in read)
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name a {what}: it holds {letters}, and in code Python reads the name "
                    f"as {read!r} (p.{name} is p.{read}). Name it {read!r}, or in plain letters (mu)"
                )
            if name in RESERVED:
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name a {what}: the results use this name themselves; "
                    f"try {name}_ or {what}_{name}. Reserved: {', '.join(sorted(RESERVED))}"
                )
            if name in extremes:
                raise SystemDefinitionError(
                    f"{system!r}: {name!r} cannot name a {what}: a sweep gives this name to an extreme of the output "
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


def check_keys(table: Iterable[str], allowed: Iterable[str], where: str, what: str) -> None:
    """Check the keys of a table that a user wrote; ``where`` names its place, ``what`` a key with its article."""
    known = list(allowed)
    for key in table:
        if key not in known:
            raise ValueError(f"{where}: {unknown(key, what, 'this place', known)}")


def unknown(name: object, what: str, of: str, known: Mapping[str, str] | Iterable[str]) -> str:
    """Return the sentence for a name that is not known: nearest first, then all.

    Parameters
    ----------
    name : object
        The name that was given.
    what : str
        What it should have been, with its article: "a parameter".
    of : str
        The owner as it shall be printed: "'discontinuous support'".
    known : mapping of name to unit, or iterable of names
        What is allowed.
    """
    units = known if isinstance(known, Mapping) else dict.fromkeys(known, "")
    ordered = sorted(units)
    text = f"`{shortened(name, quoted=False)}` is not {what} of {of}"
    for near in nearest(str(name), ordered)[:1]:
        text += f"; nearest: {near}" + (f" [{units[near]}]" if units[near] else "")
    return text + (f"; all: {', '.join(ordered)}" if ordered else f"; {of} has none")


#: Words of other programs for our options.
ELSEWHERE = {
    **dict.fromkeys(("x0", "y0", "u0", "z0", "initial", "initial_state"), "start"),
    **dict.fromkeys(("t_end", "tend", "t_final", "t_max", "tmax", "t_span", "tspan"), "duration"),
    **dict.fromkeys(("dt", "t_eval", "tout", "sampling"), "samples"),
    **dict.fromkeys(("tol", "reltol", "rel_tol"), "rtol"),
    **dict.fromkeys(("abstol", "abs_tol"), "atol"),
    **dict.fromkeys(("solver", "integrator", "algorithm"), "method"),
    **dict.fromkeys(("n_jobs", "workers", "processes", "cores"), "threads"),
    **dict.fromkeys(("sep", "separator"), "delimiter"),
    **dict.fromkeys(("skiprows", "skip_rows", "skiplines"), "skip"),
    **dict.fromkeys(("usecols", "names"), "columns"),
    **dict.fromkeys(("fps", "framerate", "frame_rate"), "rate"),
    **dict.fromkeys(("mu", "mu_k", "mu_d", "muk", "mud"), "friction"),
    **dict.fromkeys(("mu_s", "mus", "stiction"), "static"),
    "bounds": "parameters",  # of fit: {"k": (5.0, 12.0)}
    "cor": "restitution",
}


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """Return the known names that are like ``name``, the nearest first, at most three."""
    likeness = {candidate: _likeness(name[:100], candidate) for candidate in known}
    return sorted((one for one in likeness if likeness[one] >= 0.5), key=lambda one: -likeness[one])[:3]


def _likeness(given: str, candidate: str) -> float:
    """Similarity, 0 to about 1; the same beginning counts (``gap`` means g rather than omega)."""
    if ELSEWHERE.get(given.lower()) == candidate:
        return 2.0
    begins = given[:1].lower() == candidate[:1].lower()
    return difflib.SequenceMatcher(None, given.lower(), candidate.lower()).ratio() + 0.2 * begins
