"""A system as text and back: JSON with the equations as strings.

Data only. Expressions are read with a white list (`expressions`), and what was read goes through the same
checks as what a user writes, because it is handed to them as functions that return expressions.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.description import Description
from nonsmooth.system.inputs import input_states
from nonsmooth.system.symbolic.expressions import read_expression, write_expression
from nonsmooth.system.symbolic.scalar import Scalar
from nonsmooth.system.symbolic.traced import TracedCondition
from nonsmooth.system.symbolic.tracing import KnownFunction, Symbols
from nonsmooth.system.transition import Band, Mode, Surface, Transition, condition_text

if TYPE_CHECKING:
    from nonsmooth.system.derived.loads import Load
    from nonsmooth.system.system import System

_FORMAT = "nonsmooth system"
_VERSION = 2
_CHANGED = {"elements", "loads"}  # are written in another way than by version 1
_SAID = 1000  # characters of what is wrong with a text


_GAP = "\0value\0"  # stands where a number is to be written; no name or unit holds it


def write_system(system: System, values: bool = True) -> str:
    """Return the system as text; without ``values`` only what copies share (for the hash of the equations)."""
    description, eta = system._description, system.eta
    bands = sorted(eta) if isinstance(eta, Mapping) else [] if eta is None else ["all"]
    # Every result holds this text: what copies share is put together once.
    key = ("text", values, system.band, *bands)
    if key not in description.variants:
        description.variants[key] = _pieces(description, eta, system.band, values)
    pieces = description.variants[key]
    if not values:
        return "".join(pieces)
    now = system.values
    numbers = [now[name] for name in description.parameters]
    numbers += eta.values() if isinstance(eta, Mapping) else [] if eta is None else [eta]
    text = [pieces[0]]
    for number, piece in zip(numbers, pieces[1:], strict=True):
        text += (repr(number), piece)
    return "".join(text)


def _pieces(
    description: Description, eta: float | Mapping[str, float] | None, band: str | None, values: bool
) -> list[str]:
    """The text between the values of the parameters, and of the widths of the bands after them."""
    content = _content(description)
    if values:
        content["parameters"] = {key: {"value": _GAP, **rest} for key, rest in content["parameters"].items()}
    if eta is not None:
        kind = sorted(eta) if isinstance(eta, Mapping) else "all"
        gaps = dict.fromkeys(eta, _GAP) if isinstance(eta, Mapping) else _GAP
        content["smoothing"] = {"eta": gaps} if values else {"bands": kind}
        if band != "linear":
            content["smoothing"]["band"] = band
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False).split(json.dumps(_GAP))


def _content(d: Description) -> dict[str, Any]:
    """A system with elements as it was given: its equations without them, and the elements; what it has not is left
    out."""
    from nonsmooth.system.derived.expressions import SPEED

    t, surfaces = (d.traced, d.surfaces) if d.plain is None else d.plain()
    names = {**d.traced.named("u.", "p."), SPEED: "speed"}

    def text(expression: sp.Expr) -> str:
        return write_expression(expression, names)

    def states(vector: Sequence[sp.Expr], mode: int) -> dict[str, str]:
        own = zip(t.state_names, vector, t.lacking[mode], strict=True)
        return {state: text(e) for state, e, gone in own if not gone}

    upward = {(s.below, s.above, (TracedCondition(s.indicator, 1),)): s for s in surfaces}
    downward = {(s.above, s.below, (TracedCondition(s.indicator, -1),)) for s in surfaces}
    transitions: list[dict[str, Any]] = []
    for jump in t.transitions:
        entry: dict[str, Any]
        crossing, at = (jump.source, jump.target, jump.rows), jump.at
        if crossing in downward:  # the second half of a surface
            continue
        if crossing in upward:
            surface = upward[crossing]
            entry = {
                "surface": t.indicator_names[surface.indicator],
                "below": t.mode_names[surface.below],
                "above": t.mode_names[surface.above],
                "mode": surface.mode,
                "static": None if surface.static is None else text(surface.static),
                "field": None if surface.field is None else states(surface.field, surface.below),
            }
        else:
            rows = [(t.indicator_names[row.indicator], row.sign, row.strict) for row in jump.rows]
            usual = jump.source == 0 or jump.reset is not None
            entry = {
                "source": t.mode_names[jump.source],
                "target": t.mode_names[jump.target],
                "when": condition_text(rows) if at is None else None,
                "at": at if at is None else float(at) if isinstance(at, int | float) else text(at),
                "reset": None if jump.reset is None else states(jump.reset, jump.target),
                "write": {t.memory_names[i]: text(value) for i, value in jump.writes} or None,
                "contact": None if jump.contact == usual else jump.contact,
            }
        transitions.append(_known(entry))
    loads, patterns, symmetry = d.loads, d.traced.patterns, d.symmetry
    return _known(
        {
            "format": _FORMAT,
            "version": _VERSION,
            "name": d.name,
            "states": dict(d.states),
            "scale": dict(d.scale),
            "parameters": {k: {"unit": v.unit, "symbol": v.symbol} for k, v in d.parameters.items()},
            "memory": {k: {"value": value, "unit": unit} for k, (value, unit) in d.memory.items()},
            "modes": {
                mode: states(field, i) for i, (mode, field) in enumerate(zip(t.mode_names, t.fields, strict=True))
            },
            "indicators": dict(zip(t.indicator_names, map(text, t.indicators), strict=True)),
            "transitions": transitions,
            "outputs": {
                k: {"unit": d.outputs[k], "modes": {m: text(e) for m, e in zip(t.mode_names, row, strict=True)}}
                for k, row in zip(t.output_names, t.outputs, strict=True)
            },
            "inputs": dict(d.inputs) or None,
            "period": None if d.traced.period is None else text(d.traced.period),
            "symmetry": symmetry
            and {
                "map": {s: text(e) for s, e in zip(t.state_names, symmetry.map, strict=True)},
                "shift": symmetry.shift,
                "modes": {d.traced.mode_names[i]: d.traced.mode_names[j] for i, j in enumerate(symmetry.modes)},
            },
            "impacts": "sequential" if patterns is not None and patterns.make.sequential else None,
            "elements": loads and {load.name: _element_content(load, t.state_names, text) for load in loads.elements},
            "powers": loads and {name: text(power) for name, power in loads.powers.items()},
            "energy": loads and loads.energy,
            "ranges": [{"not negative": text(e), "else": sentence} for e, sentence in d.ranges] or None,
            "bands": {d.traced.indicator_names[band.indicator]: _band_content(band, d) for band in d.bands} or None,
        }
    )


def _known(entry: dict[str, Any]) -> dict[str, Any]:
    """The entries that are there."""
    return {key: one for key, one in entry.items() if one is not None}


def _element_content(element: Load, states: Sequence[str], text: Callable[[sp.Expr], str]) -> dict[str, Any]:
    """Return an element with its expressions as text."""
    return {
        "kind": element.kind,
        "given": element.text,
        "options": {key: one.item() if isinstance(one, np.generic) else one for key, one in element.options.items()},
        "where": text(element.where),
        "on": {states[i]: text(e) for i, e in element.direction.items() if e != 0},
        "laws": {name: text(law) for name, law in element.laws.items()},
    }


def _band_content(band: Any, d: Description) -> dict[str, Any]:
    names = (
        d.traced.named("u.", "p.") | {band.eta: "p.eta"} | {symbol: f"p.{name}" for name, _, symbol, _ in band.memory}
    )
    t = d.traced
    return {
        "field": {s: write_expression(e, names) for s, e in zip(t.state_names, band.field, strict=True)},
        "write": {n: {"unit": unit, "value": write_expression(e, names)} for n, unit, _, e in band.memory},
        "outputs": {t.output_names[i]: write_expression(e, names) for i, e in band.outputs.items()},
    }


def read_system(text: str) -> System:
    """Return the system written by `write_system`; see `System.from_text`."""
    from nonsmooth.system.system import System

    try:
        content = json.loads(text, parse_constant=_no_constant)
    except (ValueError, TypeError, RecursionError) as error:
        raise SystemDefinitionError(f"this is not the text of a system (JSON expected): {error}") from None
    if not isinstance(content, dict) or content.get("format") != _FORMAT:
        raise SystemDefinitionError(f'this is not the text of a system: "format": "{_FORMAT}" is missing')
    version = content.get("version")
    if version != _VERSION and (version != 1 or _CHANGED & content.keys()):
        raise SystemDefinitionError(
            f"the text of the system has version {shortened(version)}; this version of nonsmooth reads {_VERSION}, and "
            "1 of systems without elements and not made by ns.mechanical: define the system anew, and write it again"
        )
    try:
        reader = _Reader(content)
        system = reader.refined(System(**reader.arguments()))
        smoothing = content.get("smoothing")
        return system if smoothing is None else system.smoothed(smoothing["eta"], smoothing.get("band", "linear"))
    except SystemDefinitionError as error:  # names and units in it may be of any length
        raise SystemDefinitionError(shortened(error, quoted=False, most=_SAID)) from error
    except (KeyError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else shortened(error, quoted=False, most=_SAID)
        name = shortened(content.get("name"))
        raise SystemDefinitionError(f"the text of the system {name} is damaged: {what}") from error


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a finite number")


def _check_kinds(expression: Any, text: str, condition: bool = False) -> None:
    """ValueError where a condition stands for a number, or a number for a condition; SymPy takes some of them."""
    if condition == isinstance(expression, sp.Expr):
        wanted = ("a number", "a condition such as u.x > 0")[condition]
        given = shortened(expression, quoted=False)
        raise ValueError(f"`{given}` stands where {wanted} is wanted (in the expression {shortened(text)})")
    if isinstance(expression, sp.Piecewise):
        for value, when in expression.args:
            _check_kinds(value, text)
            _check_kinds(when, text, condition=True)
    else:
        of_conditions = isinstance(expression, sp.And | sp.Or | sp.Not)
        for part in expression.args:
            _check_kinds(part, text, of_conditions)


class _Reader:
    """Turns the content into the arguments of `System`."""

    def __init__(self, content: Mapping[str, Any]) -> None:
        self.content = content
        self.bands = content.get("bands", {})
        self.driven = [name for own in input_states(content.get("inputs", {})).values() for name in own]
        memory = {key: entry["unit"] for key, entry in content.get("memory", {}).items()}
        parameters = {key: entry["unit"] for key, entry in content["parameters"].items()}
        symbols = Symbols(content["name"], content["states"], parameters, memory)
        self.symbols = {"t": symbols.t} | {f"u.{key}": s for key, s in symbols.u.items()}
        self.symbols |= {f"p.{key}": s for key, s in (symbols.p | symbols.m).items()}

    def expression(self, text: str, extra: Mapping[str, sp.Symbol] | None = None) -> sp.Expr:
        found = read_expression(text, self.symbols | dict(extra or {}))
        _check_kinds(found, text)
        return found

    def function(self, text: str, extra: Mapping[str, sp.Symbol] | None = None) -> KnownFunction:
        return KnownFunction(self.expression(text, extra))

    def vector(self, texts: Mapping[str, str], extra: Mapping[str, sp.Symbol] | None = None) -> KnownFunction:
        return KnownFunction([self.expression(text, extra) for text in texts.values()])

    def own(self, texts: Mapping[str, str]) -> KnownFunction:
        """A vector without the entries of inputs, whose motion is that of all inputs."""
        return self.vector({state: text for state, text in texts.items() if state not in self.driven})

    def arguments(self) -> dict[str, Any]:
        c = self.content
        memory = c.get("memory", {})
        symmetry = c.get("symmetry")
        own = [name for name in c["states"] if name not in self.driven]
        return {
            "name": c["name"],
            "states": {name: c["states"][name] for name in own},
            "inputs": c.get("inputs"),
            "scale": c["scale"],
            "parameters": {k: (e["value"], e["unit"], e["symbol"]) for k, e in c["parameters"].items()},
            "memory": {k: (e["value"], e["unit"]) for k, e in memory.items()},
            "modes": {k: Mode(self.own(e), states=[s for s in e if s in own]) for k, e in c["modes"].items()},
            "indicators": {k: self.function(e) for k, e in c["indicators"].items()},
            "transitions": [self.transition(e) for e in c["transitions"]],
            "outputs": {
                k: ({mode: self.function(text) for mode, text in e["modes"].items()}, e["unit"])
                for k, e in c.get("outputs", {}).items()
            },
            "period": self.function(c["period"]) if "period" in c else None,
            "symmetry": symmetry and (self.vector(symmetry["map"]), symmetry["shift"], symmetry["modes"]),
            "bands": {k: self.band(e) for k, e in self.bands.items()},
            "elements": {k: self.element(e) for k, e in c.get("elements", {}).items()} or None,
            "impacts": c.get("impacts", "simultaneous"),
        }

    def element(self, entry: Mapping[str, Any]) -> Any:
        from nonsmooth.system.derived import elements
        from nonsmooth.system.derived.expressions import SPEED

        name = entry["kind"]
        if name not in elements.__all__ or name == "Element":
            raise SystemDefinitionError(f"there is no element {shortened(name)}")
        kind = getattr(elements, name)

        def law(text: str) -> Callable[..., Any]:
            expression = self.expression(text, {"speed": SPEED})
            if SPEED not in expression.free_symbols:
                return lambda t, u, p: Scalar(expression)
            return lambda v, p: Scalar(expression.subs(SPEED, v.expression))

        made = kind(
            **entry["options"],
            **{key: law(text) for key, text in entry["laws"].items()},
            **{kind.kinematics: law(entry["where"])},
            on={key: law(text) for key, text in entry["on"].items()},
        )
        object.__setattr__(made, "given", str(entry["given"]))
        return made

    def refined(self, system: System) -> System:
        """The system with the powers of a mechanical one, and with what its parameters must fulfil beyond what its
        equations say."""
        ranges = [(self.expression(e["not negative"]), e["else"]) for e in self.content.get("ranges", [])]
        powers = {name: self.expression(power) for name, power in self.content.get("powers", {}).items()}
        return system._of(system._description.refined(powers, str(self.content.get("energy", "")), ranges))

    def transition(self, entry: Mapping[str, Any]) -> Transition | Surface:
        if "surface" in entry:
            return Surface(
                entry["surface"],
                below=entry["below"],
                above=entry["above"],
                mode=entry.get("mode"),
                static=self.function(entry["static"]) if "static" in entry else None,
                field=self.own(entry["field"]) if "field" in entry else None,
            )
        return Transition(
            entry["source"],
            entry["target"],
            when=entry.get("when"),
            at=self.function(entry["at"]) if isinstance(entry.get("at"), str) else entry.get("at"),
            reset=self.own(entry["reset"]) if "reset" in entry else None,
            write={k: self.function(e) for k, e in entry["write"].items()} if "write" in entry else None,
            contact=entry.get("contact"),
        )

    def band(self, entry: Mapping[str, Any]) -> Band:
        extra = {"p.eta": sp.Symbol("p_eta", real=True)}
        extra |= {f"p.{name}": sp.Symbol(f"m_{name}", real=True) for name in entry["write"]}
        return Band(
            self.vector(entry["field"], extra),
            write={k: (self.function(e["value"], extra), e["unit"]) for k, e in entry["write"].items()},
            outputs={k: self.function(e, extra) for k, e in entry["outputs"].items()},
        )
