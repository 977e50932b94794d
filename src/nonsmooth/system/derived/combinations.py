"""All combinations of the phases of a system's elements, written out as modes, indicators and transitions.

It is what a user would have written: each expression is one of SymPy, so that every verb, derivative and kernel knows
the system without a line for elements.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations, product
from typing import TYPE_CHECKING, Any

import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.derived.assembly import Pattern, VaryingError
from nonsmooth.system.derived.decider import Decider
from nonsmooth.system.derived.elements import Element
from nonsmooth.system.derived.expressions import Expressions
from nonsmooth.system.equations import sliding_mode
from nonsmooth.system.symbolic.traced import ALONE, ASKED, ASKS_BEHIND, OWN, TOGETHER
from nonsmooth.system.symbolic.tracing import KnownFunction, Symbols, call_vector
from nonsmooth.system.transition import Mode, Surface, Transition

if TYPE_CHECKING:
    from nonsmooth.system.derived.patterns import Patterns

MOST = 256  # modes that are written out
ALONE_WITH = ("transitions", "indicators", "memory", "symmetry", "bands")  # of one's own: modes are written out then


def _natural(item: tuple[Any, Any]) -> list[Any]:
    """The order of names in which s2 comes before s10."""
    return [int(word) if word.isdigit() else word for word in re.split(r"([0-9]+)", str(item[0]))]


def element_names(elements: Any) -> dict[str, Element]:
    """Elements by name, in the order of the names: no digit of a result depends on the order in which they are given.

    Those of a list are called after their kind.
    """
    if isinstance(elements, Mapping):
        found: dict[str, Element] = {}
        for name, element in sorted(elements.items(), key=_natural):
            if not (isinstance(name, str) and name.isidentifier() and name[0] != "_"):
                raise SystemDefinitionError(
                    f"elements: {shortened(name)} cannot name an element: modes and outputs are called after it "
                    "(left_stop_open), so it must be a Python identifier and not begin with an underscore"
                )
            own = element.parts(name) if isinstance(element, Element) else {name: element}
            if twice := own.keys() & found.keys():
                raise SystemDefinitionError(
                    f"elements: {shortened(*twice)} is the name of an element and of the friction at a stop; give the "
                    "element another name"
                )
            found |= own
        return found
    if isinstance(elements, (str, Element)) or not isinstance(elements, Sequence):
        raise SystemDefinitionError(
            'elements= maps names to elements, {"stop": ns.elements.Stop(...)}, or is a list of them; not '
            + shortened(elements)
        )
    found = {}
    for element in elements:
        name = first = type(element).__name__.lower()
        while name in found:
            name = f"{first}_{sum(other.startswith(first) for other in found) + 1}"
        found[name] = element
    return element_names(found)


def assembled(
    symbols: Symbols,
    given: Mapping[str, Any],
    values: Mapping[sp.Symbol, float],
    named: Callable[[list[str]], str] | None = None,
) -> dict[str, Any]:
    """Modes, indicators, transitions and outputs of a system with elements, as a user would give them, and what binds
    the equations that are traced of them to the elements.

    ``given`` is a system's own: its transitions go from each combination of phases to the same of the target.
    ``named`` gives the name of a combination, where elements are not the user's; these then have no outputs.
    """
    parts, modes = element_names(given["elements"]), given["modes"]
    for key, mode in modes.items():
        if set(mode.states or symbols.u) != set(symbols.u):
            raise SystemDefinitionError(f"mode {key!r}: a system with elements has all its states in every mode")
    base = {
        key: call_vector(mode.field, symbols.arguments(), tuple(symbols.u), f"the vector field of mode {key!r}")
        for key, mode in modes.items()
    }
    make = Expressions(symbols, base, parts, given["scale"], values)
    number = len(base) * math.prod(len(part.element.phases) for part in make.parts)
    make.sequential = given["impacts"] == "sequential" and len(make.striking) > 1
    if number > MOST or make.rubbing or make.sequential:
        why = f"have more than {MOST} combinations of phases"
        return _opened(make, given, "rub" if make.rubbing else "strike in sequence" if make.sequential else why)
    own = [item for item in given["transitions"] if isinstance(item, Transition)]
    written = {symbols.m[name] for item in own for name in item.write or () if name in symbols.m}
    make.resets = any(item.reset is not None for item in own) or not written.isdisjoint(make.feels())
    make.asks = _decide_together(make)
    visited = make.asks and not given["written"] and named is None and not any(given[key] for key in ALONE_WITH)
    if visited and (patterns := _affine(make, given)) is not None:
        return {**_opened(make, given, "decide together", patterns), "also written": True}
    try:
        return _written_out(make, given, named)
    except VaryingError as error:
        if named is not None or (patterns := _affine(make, given)) is None:
            raise
        why = f"hold together by sums of forces that depend on parameters ({error.names})"
        return _opened(make, given, why, patterns)


def _written_out(
    make: Expressions, given: Mapping[str, Any], named: Callable[[list[str]], str] | None
) -> dict[str, Any]:
    """A mode for each combination that may be."""
    base, phases = make.fields, [range(len(part.element.phases)) for part in make.parts]
    every = product(base, product(*phases))
    pairs = [pair for pair in every if make.may_hold(make.held(pair[1]), pair[0])]

    def name(mode: str, pattern: Pattern) -> str:
        if named is not None:
            return named([part.element.phases[k] for part, k in zip(make.parts, pattern, strict=True)])
        words = [f"{part.name}_{part.element.phases[k]}" for part, k in zip(make.parts, pattern, strict=True)]
        return "_".join(words if len(base) == 1 else [mode, *words])

    fields: dict[str, Mode] = {}
    forces: dict[str, dict[str, Any]] = {part.name: {} for part in make.parts}
    transitions: list[Transition | Surface] = []
    kinds: list[str] = []  # of the transitions
    asked: list[tuple[str, str, str, int]] = []  # mode, kind, condition, the element or -1
    for mode, pattern in pairs:
        here = name(mode, pattern)
        f, found = make.flow(mode, pattern)
        fields[here] = Mode(KnownFunction(f))
        for k, part in enumerate(make.parts):
            forces[part.name][here] = KnownFunction(found[k])
        for k, part in enumerate(make.parts):
            for way in make.leaving(k, mode, pattern):
                if way.phase is None:
                    owner = "" if k in make.held(pattern) else part.name
                    asked.append((here, ASKED, make.condition(way.conditions, owner), k))
                    continue
                there = make.place(k, mode, pattern).put(way.phase).pattern
                if (mode, there) not in pairs:
                    continue  # more contacts than can be held by forces of their own
                reset = None if way.states is None else KnownFunction(way.states)
                when = make.condition(way.conditions, part.name)
                contact = make.begins_contact(pattern, there, (k,) if reset else ()) if named is None else None
                transitions.append(Transition(here, name(mode, there), when=when, reset=reset, contact=contact))
                kinds.append(ALONE if make.asks and part.element.held else "")
        if make.asks:
            met = [make.condition([one], make.parts[k].name) for k, one in make.meetings(mode, pattern)]
            asked.append((here, TOGETHER, " and ".join(met), -1))
        for item in given["transitions"]:
            if isinstance(item, Surface) and item.below == mode:
                own = item.below, item.above, sliding_mode(item, given["transitions"])
                below, above, slid = (name(key, pattern) for key in own)
                transitions.append(replace(item, below=below, above=above, mode=slid))
                if make.asks:
                    raise SystemDefinitionError(
                        f"{item.label}: a surface on which motion may slide cannot stand beside elements whose forces "
                        "change the rates of each other; write it as an element (ns.elements.Coulomb), or as two "
                        "transitions"
                    )
            elif isinstance(item, Transition) and item.source == mode:
                ends = name(item.source, pattern), name(item.target, pattern)
                contact = item.begins_contact(next(iter(base)))
                transitions.append(Transition(*ends, item.when, item.at, item.reset, item.write, contact))
                kinds.append(OWN if item.reset is None and not item.write else ASKS_BEHIND)
    decider = Decider(make, pairs, _affine(make, given)) if make.asks else None
    outputs = {}
    for key, (function, unit) in given["outputs"].items():
        if isinstance(function, Mapping):
            function = {name(mode, pattern): function[mode] for mode, pattern in pairs}
        outputs[key] = function, unit
    return {
        "modes": fields,
        "transitions": transitions,
        "indicators": {**given["indicators"], **{key: KnownFunction(g) for key, g in make.indicators.items()}},
        "outputs": outputs if named else {**outputs, **{f"{key}_force": (row, "") for key, row in forces.items()}},
        "ranges": make.ranges(next(iter(base))),
        "bind": partial(decider.bind, kinds=kinds, asked=asked) if decider else None,
        "make": make,
    }


def _decide_together(make: Expressions) -> bool:
    """Return whether the force of one element that may be held changes the rate of another at once, or a transition of
    the system's own may."""
    bearing = [k for k, part in enumerate(make.parts) if part.element.held]
    for k in bearing:
        if any(make.vanishes(make.across(make.rate(k, mode), make.parts[k])) for mode in make.fields):
            raise SystemDefinitionError(
                f"element {make.parts[k].name!r}: its force does not change the rate that it holds at zero; on= names "
                "the state whose derivative it adds to, as the speed"
            )
    pairs = combinations(bearing, 2)
    return (bool(bearing) and make.resets) or any(make.coupled(i, j, mode) for i, j in pairs for mode in make.fields)


def _affine(make: Expressions, given: Mapping[str, Any]) -> Patterns | None:
    """Rows of numbers in place of expressions, where all is affine in the states; None where something is not."""
    from nonsmooth.system.derived.patterns import Patterns

    mode = next(iter(make.fields))
    bearing = [k for k, part in enumerate(make.parts) if part.element.held]
    known = {*make.values, make.symbols.t}
    if len(make.fields) > 1 or given["memory"]:
        return None
    if any(not sp.diff(make.rate(k, mode), x).free_symbols <= known for k in bearing for x in make.u):
        return None
    if any(not d.free_symbols <= known for k in bearing for d in make.parts[k].direction.values()):
        return None
    found = Patterns(make, mode)
    return found if found.is_affine(given["period"]) else None


def _opened(make: Expressions, given: Mapping[str, Any], why: str, patterns: Patterns | None = None) -> dict[str, Any]:
    """The system without its elements, with all that these need as indicators: modes are made when they are visited."""
    from nonsmooth.system.derived.patterns import Patterns

    make.asks = True
    if len(make.fields) > 1 or any(given[key] for key in ALONE_WITH):
        raise SystemDefinitionError(
            f"its elements {why}, so that their modes are made when they are visited: such a system has one mode and "
            "no indicators, transitions, memory, symmetry or bands of its own"
        )
    patterns = patterns or Patterns(make, next(iter(make.fields)))
    patterns.why = why
    return {
        "modes": {key: Mode(KnownFunction(list(field))) for key, field in make.fields.items()},
        "transitions": (),
        "indicators": {key: KnownFunction(e) for key, e in zip(patterns.labels, patterns.expressions, strict=True)},
        "outputs": given["outputs"],
        "ranges": make.ranges(patterns.mode),
        "bind": patterns.bind,
        "make": make,
    }
