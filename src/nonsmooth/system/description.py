"""From what the user wrote to a checked description made of expressions only.

Every inconsistency is found here, before anything is compiled; what remains holds no functions, so that
it can be stored as text and read back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened, unknown
from nonsmooth.system.equations import (
    TracedBand,
    TracedSurface,
    sliding_mode,
    trace_band,
    trace_surface,
    trace_system,
)
from nonsmooth.system.inputs import input_states, read_inputs, with_inputs
from nonsmooth.system.kinds import real_number
from nonsmooth.system.names import check_names
from nonsmooth.system.parameter import Parameter
from nonsmooth.system.symbolic.domain import Domain, check_period, forcing_period, repeating, timed_expressions
from nonsmooth.system.symbolic.scalar import to_expression
from nonsmooth.system.symbolic.traced import Traced
from nonsmooth.system.symbolic.tracing import Symbols, call_scalar
from nonsmooth.system.symmetry import Symmetry, trace_symmetry
from nonsmooth.system.transition import Band, Mode, Surface

if TYPE_CHECKING:
    from nonsmooth.system.derived.loads import Loads

LOADS = ("force", "impulse", "impact_speed", "impacts", "energy", "energy_lost")  # of an element, in results
IMPACTS = ("simultaneous", "sequential")
EXAMPLES = {
    "parameters": '{"m": (0.838, "kg"), "k": 8.47}',
    "modes": '{"free": free, "contact": contact}',
    "indicators": '{"gap": lambda t, u, p: u.x - p.g}',
    "outputs": '{"energy": lambda t, u, p: u.v**2 / 2}',
}


@dataclass(frozen=True)
class Description:
    """A system without the present values of its parameters: what all its copies share."""

    name: str
    states: Mapping[str, str]
    parameters: Mapping[str, Parameter]  # with the values first given
    memory: Mapping[str, tuple[float, str]]
    scale: Mapping[str, float]
    outputs: Mapping[str, str]
    traced: Traced
    surfaces: tuple[TracedSurface, ...] = ()
    bands: tuple[TracedBand, ...] = ()
    symmetry: Symmetry | None = None
    explicit_time: bool = False  # depends on the time, and not periodically
    ranges: tuple[tuple[sp.Expr, str], ...] = ()  # of the parameters: what must not be negative, and what to say
    plain: Callable[[], tuple[Traced, tuple[TracedSurface, ...]]] | None = field(
        default=None, compare=False, repr=False
    )  # without elements
    loads: Loads | None = None  # of a system with elements
    inputs: Mapping[str, Any] = field(default_factory=dict)  # the unit of each, with "smooth" where it is so
    written: Callable[[], Description] | None = field(default=None, compare=False, repr=False)
    variants: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)  # a cache, see variant.py

    @cached_property
    def driven(self) -> Mapping[str, Mapping[str, str]]:
        """Of each input, names and units of the states that stand for it: the last ones of all."""
        return input_states(self.inputs)

    @cached_property
    def n_own(self) -> int:
        """Number of the states before those of inputs."""
        return len(self.states) - sum(map(len, self.driven.values()))

    def written_out(self) -> Description:
        """The description with a mode for each combination of its elements' phases, made once."""
        if self.written is None or self.loads is None:
            return self
        if "written out" not in self.variants:
            self.variants["written out"] = replace(self.written().with_loads(self.loads), ranges=self.ranges)
        written: Description = self.variants["written out"]
        return written

    def with_loads(self, loads: Loads) -> Description:
        """Return the description with these loads, and the units of forces that follow from all others."""
        forces = {f"{name}_force": units[0] for name, units in loads.units(self.symbol_units).items()}
        return replace(self, loads=loads, outputs={**self.outputs, **forces})

    def refined(self, powers: Mapping[str, sp.Expr], energy: str, ranges: Sequence[tuple[sp.Expr, str]]) -> Description:
        """Return the description with the powers of a mechanical system and the unit of their work, and with what must
        not be negative."""
        from nonsmooth.system.derived.loads import Loads

        loads = self.loads or Loads((), dict(zip(self.traced.mode_names, self.traced.fields, strict=True)))
        new = self.with_loads(replace(loads, powers=powers, energy=energy)) if powers else self
        return replace(new, ranges=tuple(ranges), variants={}) if ranges else new

    @property
    def symbol_units(self) -> dict[sp.Symbol, str]:
        """Units of the symbols of states, parameters and memory; the time's is s where a state has a unit."""
        t = self.traced
        units = [*self.states.values(), *(parameter.unit for parameter in self.parameters.values())]
        units += [unit for _, unit in self.memory.values()]
        time = "s" if any(self.states.values()) else ""
        return {**dict(zip((*t.u, *t.p, *t.m), units, strict=True)), t.t: time}


def describe(asked: Mapping[str, Any], written: bool = False) -> Description:
    """Check all arguments of a system, call each function once with symbols, and return the description.

    Elements that decide together are ``written`` out as modes where that is asked for, or has to be.
    """
    name = asked["name"]
    given = {**asked, "written": written, "states": _units(asked["states"], "states", name)}
    given |= {key: asked[key] or {} for key in ("indicators", "outputs", "bands")}
    given["inputs"] = read_inputs(_units(asked["inputs"] or {}, "inputs", name, raw=True), name)
    _check_kinds(given)
    given["modes"] = {key: mode if isinstance(mode, Mode) else Mode(mode) for key, mode in given["modes"].items()}
    given["outputs"] = {key: _output(key, one) for key, one in given["outputs"].items()}
    own = given["states"]
    driven = [key for states in input_states(given["inputs"]).values() for key in states]
    if driven:
        check_names({"state": own, "input": driven}, name)
        given |= with_inputs(given)
    known = {key: Parameter.read(key, one) for key, one in given["parameters"].items()}
    remembered = {
        key: _memory(key, one) for key, one in _units(asked["memory"] or {}, "memory", name, raw=True).items()
    }
    symbols = Symbols(
        name,
        given["states"],
        {key: parameter.unit for key, parameter in known.items()},
        {key: unit for key, (_, unit) in remembered.items()},
        tuple(driven),
    )
    values = {symbol: known[key].value for key, symbol in symbols.p.items()}
    given |= {"scale": _scale(given["scale"], given["states"], name)}
    made = _with_elements(symbols, given, values)
    make: Any = made.get("make")
    before, own_parts = given, make.parts if given["elements"] else ()
    given = given | made  # `plain` goes on with what was given
    shown, bands, symmetry = given["outputs"], given["bands"], given["symmetry"]
    for key, band in bands.items():
        if not isinstance(band, Band):
            raise SystemDefinitionError(f"{name!r}: the band of {key!r} must be an ns.Band, not {band!r}")
    check_names(
        {
            "state": own,
            "input": driven,
            "parameter": known,
            "memory": remembered,
            "mode": given["modes"],
            "indicator": before["indicators"],
            "output": before["outputs"],
            "condition of an element": make.indicators if make else (),
            "load of an element": [f"{part.name}_{load}" for part in own_parts for load in LOADS],
            "memory of a band": sorted({key for band in bands.values() for key in (band.write or {})}),
            "sliding mode": [mode for _, mode in _slid(given["transitions"])],
        },
        name,
    )
    traced, surfaces = _traced(symbols, given)
    _check_phases(traced)
    traced, explicit, repeats = _with_period(traced, symbols, values, given["period"])
    if symmetry is not None:
        Domain(traced).check({key: parameter.value for key, parameter in known.items()})
    if made.get("bind") is not None:
        traced = made["bind"](traced)
    units_out = {key: unit for key, (_, unit) in shown.items()}
    loads = None
    if given["elements"]:
        from nonsmooth.system.derived.loads import loads_of

        loads = loads_of(make)
        units_out |= {f"{load.name}_force": "" for load in loads.elements}
    description = Description(
        name=name,
        states=given["states"],
        parameters=known,
        memory=remembered,
        scale=given["scale"],
        outputs=units_out,
        traced=traced,
        surfaces=surfaces,
        bands=tuple(trace_band(key, band, traced, symbols, shown, known) for key, band in bands.items()),
        symmetry=None if symmetry is None else trace_symmetry(symmetry, traced, symbols, values),
        explicit_time=explicit,
        ranges=(*made.get("ranges", ()), *repeats),
        plain=made.get("plain"),
        loads=loads,
        inputs=given["inputs"],
        written=partial(describe, asked, written=True) if made.get("also written") else None,
    )
    return description if loads is None else description.with_loads(loads)


def _check_kinds(given: Mapping[str, Any]) -> None:
    """Refuse what has no name, no state or no mode, and what should be a mapping and is none."""
    name, impacts = given["name"], given["impacts"]
    if not isinstance(name, str) or not name:
        raise SystemDefinitionError(f"`name` must be a string, not {name!r}")
    if impacts not in IMPACTS:
        raise SystemDefinitionError(f"{name!r}: `impacts` is one of {', '.join(map(repr, IMPACTS))}, not {impacts!r}")
    if not given["states"]:
        raise SystemDefinitionError(f"{name!r}: a system needs at least one state")
    for what, example in EXAMPLES.items():
        if not isinstance(one := given[what], Mapping):
            raise SystemDefinitionError(f"{name!r}: `{what}` must be a mapping such as {example}, not {shortened(one)}")
    if not given["modes"]:
        raise SystemDefinitionError(f"{name!r}: a system needs at least one mode")


def _with_elements(symbols: Symbols, given: Mapping[str, Any], values: Mapping[sp.Symbol, float]) -> dict[str, Any]:
    """The parts of a system with its elements, or with surfaces that are relays; nothing where it has none."""
    from nonsmooth.system.derived.combinations import assembled
    from nonsmooth.system.derived.relays import relays_of

    if given["elements"]:
        relays, made = None, assembled(symbols, given, values)
    elif (relays := relays_of(symbols, given, values)) is not None:
        between = {"modes": {"all": relays.field}, "elements": relays.elements, "transitions": ()}
        made = assembled(symbols, {**given, **between}, values, relays.name)
    else:
        return {}
    ranges = [*(relays.ranges if relays else ()), *made["ranges"]]
    return made | {"ranges": ranges, "plain": partial(_traced, symbols, given)}


def _traced(symbols: Symbols, given: Mapping[str, Any]) -> tuple[Traced, tuple[TracedSurface, ...]]:
    """The equations as they are given, elements put aside, and their surfaces."""
    kinds = {key: _mode(mode, key, given["states"]) for key, mode in given["modes"].items()}
    transitions = given["transitions"]
    traced = trace_system(given["name"], symbols, kinds, dict(given["indicators"]), transitions, given["outputs"])
    return traced, tuple(trace_surface(item, mode, traced, symbols) for item, mode in _slid(transitions))


def _slid(transitions: Any) -> list[tuple[Surface, str]]:
    """The surfaces among what may yet turn out to be no list, each with the name of its sliding mode."""
    some = transitions if isinstance(transitions, Iterable) else ()
    return [(item, sliding_mode(item, some)) for item in some if isinstance(item, Surface)]


def _units(given: Any, what: str, system: str, raw: bool = False) -> dict[str, Any]:
    """Names with units from a mapping, or from a sequence of names (no units)."""
    if isinstance(given, str) or not isinstance(given, (Mapping, Sequence)):
        raise SystemDefinitionError(
            f'{system!r}: `{what}` must map names to units, as {{"x": "m"}}, or be a list of names; '
            f"not {shortened(given)}"
        )
    if not isinstance(given, Mapping):
        if len({*given}) < len(given):
            raise SystemDefinitionError(f"{system!r}: `{what}` = {given}: one name is given twice")
        return dict.fromkeys(given, "")
    for key, unit in given.items():
        if not raw and not isinstance(unit, str):
            raise SystemDefinitionError(f"{system!r}: the unit of {key!r} must be a string, not {unit!r}")
    return dict(given)


def _memory(key: str, given: Any) -> tuple[float, str]:
    """``"m/s"`` or ``(initial value, "m/s")``."""
    if isinstance(given, str):
        return 0.0, given
    read = Parameter.read(key, given)
    return read.value, read.unit


def _output(key: str, given: Any) -> tuple[Any, str]:
    """A function or a mapping mode -> function, alone or with a unit."""
    function, unit = (given if len(given) == 2 else (None, None)) if isinstance(given, (tuple, list)) else (given, "")
    if not (callable(function) or isinstance(function, Mapping)) or not isinstance(unit, str):
        raise SystemDefinitionError(
            f"output {key!r} must be a function f(t, u, p) or a mapping mode -> function, alone or as "
            f"(function, unit); not {shortened(given)}"
        )
    return function, unit


def _mode(mode: Mode, key: str, states: Mapping[str, str]) -> tuple[Callable[..., Any], tuple[str, ...]]:
    own = tuple(states) if mode.states is None else tuple(mode.states)
    for name in own:
        if name not in states:
            raise SystemDefinitionError(f"mode {key!r}: {unknown(name, 'a state', 'the system', states)}")
    if not own or len(set(own)) != len(own):
        raise SystemDefinitionError(f"mode {key!r}: its states {list(own)} must be at least one, all different")
    return mode.field, own


def _scale(given: Mapping[str, float] | None, states: Mapping[str, str], system: str) -> dict[str, float]:
    scale = dict.fromkeys(states, 1.0)
    for key, value in (given or {}).items():
        if key not in states:
            raise SystemDefinitionError(f"scale: {unknown(key, 'a state', repr(system), states)}")
        scale[key] = real_number(value, f"the scale of {key!r}")
        if scale[key] <= 0:
            raise SystemDefinitionError(f"the scale of {key!r} is its typical size and must be positive, not {value}")
    return scale


def _with_period(
    traced: Traced, symbols: Symbols, values: Mapping[sp.Symbol, float], given: Any
) -> tuple[Traced, bool, list[tuple[sp.Expr, str]]]:
    """Return the system with its period, whether it depends on the time without one, and what must not be negative for
    it to repeat at other values of the parameters."""
    expressions = timed_expressions(traced)
    timed = any(traced.t in expression.free_symbols for _, expression in expressions)
    found = forcing_period([expression for _, expression in expressions], traced.t, values)
    if given is None:
        period = found
    elif callable(given):
        period = call_scalar(given, (symbols.parameters(),), "`period`")
        if not period.free_symbols <= set(symbols.p.values()):
            raise SystemDefinitionError(f"`period` may depend on the parameters only, not {period}")
    else:
        number = real_number(given, "`period`")
        if number <= 0:
            raise SystemDefinitionError(f"`period` must be positive, not {number}")
        period = to_expression(number)
    if period is None and (jump := next((j for j in traced.transitions if j.at is not None), None)):
        raise SystemDefinitionError(
            f"transition {jump.label}: `at` is a phase of the forcing, but no forcing period can be read off the "
            f"equations; give period= (a number, or a function of p)"
        )
    traced, repeats = replace(traced, period=period), list[tuple[sp.Expr, str]]()
    if period is not None and timed and period != found:
        Domain(traced).check({name: values[symbol] for name, symbol in symbols.p.items()})
        plain = str(period.subs({symbol: sp.Symbol(name) for name, symbol in symbols.p.items()}))
        check_period(traced, expressions, [*values.values()], float(period.subs(values)), plain)
        says = f"the equations do not repeat after the period {plain}: give it as a function of p"
        repeats = [(e, says) for e in repeating((e for _, e in expressions), traced.t, period, values)]
    return traced, timed and period is None, repeats


def _check_phases(traced: Traced) -> None:
    """Of two transitions from one mode at one phase only the first would ever be taken."""
    met: dict[tuple[int, Any], str] = {}
    for jump in traced.transitions:
        if jump.at is None:
            continue
        place = (jump.source, jump.at)
        if place in met:
            raise SystemDefinitionError(
                f"transitions {met[place]} and {jump.label} both leave mode {traced.mode_names[jump.source]!r} at "
                f"phase {traced.phase_text(jump)}: only the first would be taken. Put what both do into one reset, or "
                "give them different phases"
            )
        met[place] = jump.label
