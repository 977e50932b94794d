"""Calling the user's functions: from checked parts of a description to expressions and integers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened, unknown
from nonsmooth.system.parameter import Parameter
from nonsmooth.system.symbolic.scalar import Scalar, as_written, to_expression
from nonsmooth.system.symbolic.traced import Traced, TracedCondition, TracedTransition
from nonsmooth.system.symbolic.tracing import KnownFunction, Symbols, call_scalar, call_vector, refuse_corners
from nonsmooth.system.transition import Band, Surface, Transition, read_condition


@dataclass(frozen=True)
class TracedSurface:
    """A Filippov surface in integers: where ``indicator`` is negative the mode is ``below``.

    ``mode`` names the sliding mode ("": after its indicators); ``static`` is the ratio of the static value to the
    kinetic one, ``field`` what is given in place of Filippov's field (None: not given)."""

    indicator: int
    below: int
    above: int
    mode: str
    static: sp.Expr | None = None
    field: tuple[sp.Expr, ...] | None = None


@dataclass(frozen=True)
class TracedBand:
    """The prescribed field in the band of an indicator; ``eta`` and ``memory`` are its own symbols."""

    indicator: int
    eta: sp.Symbol
    field: tuple[sp.Expr, ...]
    memory: tuple[tuple[str, str, sp.Symbol, sp.Expr], ...]  # name, unit, symbol, written at entry
    outputs: Mapping[int, sp.Expr]


def trace_system(
    name: str,
    symbols: Symbols,
    modes: Mapping[str, tuple[Callable[..., Any], tuple[str, ...]]],
    indicators: Mapping[str, Callable[..., Any]],
    transitions: Sequence[Transition | Surface],
    outputs: Mapping[str, tuple[Any, str]],
) -> Traced:
    """Trace everything but the period. ``modes``: name -> (function, its states); ``outputs``: name -> (f, unit)."""
    moving = {symbols.t, *symbols.u.values()}
    everything = tuple(symbols.u)
    fields, lacking = [], []
    for key, (function, own) in modes.items():
        arguments = symbols.arguments(own, f"mode {key!r}")
        fields.append(_states(function, arguments, own, f"the vector field of mode {key!r}", everything, moving))
        lacking.append(tuple(state not in own for state in everything))
    surfaces_of = []
    for key, function in indicators.items():
        what = f"indicator {key!r}"
        expression = call_scalar(function, symbols.arguments(), what)
        refuse_corners(expression, moving, what)
        if not isinstance(function, KnownFunction) and not expression.free_symbols & set(symbols.u.values()):
            raise SystemDefinitionError(
                f"{what} never involves the state ({as_written(expression)}): nothing can cross it. "
                f"For a switch at a given time use Transition(..., at=phase)"
            )
        surfaces_of.append(expression)
    owned = {key: own for key, (_, own) in modes.items()}
    if isinstance(transitions, Transition | Surface):
        raise SystemDefinitionError(
            f"{name!r}: `transitions` is a list of ns.Transition and ns.Surface, not {transitions.label} alone: put it "
            "into [ ]"
        )
    jumps = []
    for item in transitions:
        if isinstance(item, Surface):
            jumps += _surface_jumps(item, owned, indicators)
        elif isinstance(item, Transition):
            jumps.append(_jump(item, symbols, owned, indicators))
        else:
            raise SystemDefinitionError(
                f"{name!r}: `transitions` is a list of ns.Transition and ns.Surface, not {shortened(item)}; "
                'write ns.Transition("free", "contact", when="gap > 0")'
            )
    for jump in jumps:
        mode = list(modes)[jump.source]
        for row, state in product(jump.rows, everything):
            if state not in owned[mode] and surfaces_of[row.indicator].has(symbols.u[state]):
                raise SystemDefinitionError(
                    f"transition {jump.label}: the indicator {list(indicators)[row.indicator]!r} involves the state "
                    f"{state!r}, which mode {mode!r} does not have"
                )
    return Traced(
        name=name,
        **symbols.of_traced(),
        mode_names=tuple(modes),
        indicator_names=tuple(indicators),
        output_names=tuple(outputs),
        fields=tuple(fields),
        lacking=tuple(lacking),
        indicators=tuple(surfaces_of),
        transitions=tuple(jumps),
        outputs=tuple(_trace_output(k, f, symbols, owned) for k, (f, _) in outputs.items()),
        period=None,
    )


def _states(
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    own: tuple[str, ...],
    what: str,
    every: Iterable[str],
    moving: set[sp.Symbol],
) -> tuple[sp.Expr, ...]:
    """One expression for every state, 0 for those that a function has not among its ``own``; none has a corner in what
    is ``moving``."""
    whole = dict(zip(own, call_vector(function, arguments, own, what), strict=True))
    for entry in whole.values():
        refuse_corners(entry, moving, what)
    return tuple(whole.get(state, sp.Integer(0)) for state in every)


def _mode_index(name: str, label: str, modes: Mapping[str, Any]) -> int:
    if name not in modes:
        raise SystemDefinitionError(f"transition {label}: {unknown(name, 'a mode', 'this system', list(modes))}")
    return list(modes).index(name)


def _surface_jumps(
    item: Surface, modes: Mapping[str, tuple[str, ...]], indicators: Mapping[str, Any]
) -> list[TracedTransition]:
    below, above = (_mode_index(end, item.label, modes) for end in (item.below, item.above))
    if item.indicator not in indicators:
        raise SystemDefinitionError(
            f"{item.label}: {unknown(item.indicator, 'an indicator', 'this system', list(indicators))}"
        )
    if set(modes[item.below]) != set(modes[item.above]):
        raise SystemDefinitionError(f"{item.label}: both modes must have the same states")
    i, names = list(indicators).index(item.indicator), list(modes)
    return [
        TracedTransition(a, b, (TracedCondition(i, sign),), contact=a == 0, label=f"{names[a]} -> {names[b]}")
        for a, b, sign in ((below, above, 1), (above, below, -1))
    ]


def sliding_mode(item: Surface, transitions: Iterable[Transition | Surface]) -> str:
    """Name of the mode in which motion slides along a surface."""
    alike = [one for one in transitions if isinstance(one, Surface) and one.indicator == item.indicator]
    default = f"{item.indicator}_sliding" + (f"_{item.below}_{item.above}" if len(alike) > 1 else "")
    return item.mode or default


def trace_surface(item: Surface, mode: str, traced: Traced, symbols: Symbols) -> TracedSurface:
    """Return a surface in integers; its names were checked when its transitions were made."""
    modes, moving = traced.mode_names, {symbols.t, *symbols.u.values()}
    below = modes.index(item.below)
    own = tuple(n for n, gone in zip(traced.state_names, traced.lacking[below], strict=True) if not gone)
    arguments = symbols.arguments(own, f"mode {item.below!r}")
    static, field = item.static, None
    if callable(static):
        static = call_scalar(static, arguments, f"`static` of {item.label}")
        refuse_corners(static, moving, f"`static` of {item.label}")
    elif static is not None:
        static = to_expression(static)
    if item.field is not None:
        field = _states(item.field, arguments, own, f"the field of {item.label}", traced.state_names, moving)
    i = traced.indicator_names.index(item.indicator)
    return TracedSurface(i, below, modes.index(item.above), mode, static, field)


def _jump(
    item: Transition,
    symbols: Symbols,
    modes: Mapping[str, tuple[str, ...]],
    indicators: Mapping[str, Any],
) -> TracedTransition:
    label = f"transition {item.label}"
    source, target = (_mode_index(end, item.label, modes) for end in (item.source, item.target))
    before, after, order = modes[item.source], modes[item.target], list(indicators)
    rows: tuple[TracedCondition, ...] = ()
    if item.when is not None:
        conditions = read_condition(item.when, order, label)
        rows = tuple(TracedCondition(order.index(key), sign, strict) for key, sign, strict in conditions)
    arguments = symbols.arguments(before, f"mode {item.source!r}")
    reset = None
    if item.reset is not None:
        reset = _states(item.reset, arguments, after, f"the reset of {label}", symbols.u, set())
    elif not set(after) <= set(before):
        new = [state for state in after if state not in before]
        raise SystemDefinitionError(
            f"{label}: mode {item.target!r} has states that mode {item.source!r} lacks ({', '.join(new)}); "
            f"give a `reset` that returns all of {', '.join(after)}"
        )
    writes = []
    for key, function in (item.write or {}).items():
        if key not in symbols.m:
            raise SystemDefinitionError(f"{label}: {unknown(key, 'memory', 'this system', list(symbols.m))}")
        value = call_scalar(function, arguments, f"what {label} writes to {key!r}")
        writes.append((list(symbols.m).index(key), value))
    contact = item.begins_contact(next(iter(modes)))
    at = _phase(item.at, label, symbols) if callable(item.at) else item.at
    return TracedTransition(source, target, rows, at, reset, tuple(writes), contact, item.label)


def _phase(given: Callable[..., Any], label: str, symbols: Symbols) -> float | sp.Expr:
    """The phase of a transition as an expression of the parameters; a number where it depends on none."""
    phase = call_scalar(given, (symbols.parameters(),), f"`at` of {label}")
    if not phase.free_symbols:
        number = float(phase)
        if not 0 <= number < 1:
            raise SystemDefinitionError(f"{label}: `at` is a phase in forcing periods, 0 <= at < 1; not {number!r}")
        return number
    if not phase.free_symbols <= set(symbols.p.values()):
        raise SystemDefinitionError(f"{label}: `at` may depend on the parameters only, not on {as_written(phase)}")
    return phase


def _trace_output(key: str, given: Any, symbols: Symbols, modes: Mapping[str, tuple[str, ...]]) -> tuple[sp.Expr, ...]:
    if isinstance(given, Mapping):
        for mode in given:
            if mode not in modes:
                raise SystemDefinitionError(f"output {key!r}: {unknown(mode, 'a mode', 'this system', list(modes))}")
        if missing := [mode for mode in modes if mode not in given]:
            raise SystemDefinitionError(f"output {key!r} is not given in mode {missing[0]!r}")
        return tuple(
            call_scalar(given[mode], symbols.arguments(own, f"mode {mode!r}"), f"output {key!r} in {mode!r}")
            for mode, own in modes.items()
        )
    expression = call_scalar(given, symbols.arguments(), f"output {key!r}")
    for mode, own in modes.items():
        if expression.free_symbols & {symbol for state, symbol in symbols.u.items() if state not in own}:
            raise SystemDefinitionError(
                f"output {key!r} uses a state that mode {mode!r} does not have; give a mapping mode -> function"
            )
    return (expression,) * len(modes)


def trace_band(
    key: str,
    band: Band,
    traced: Traced,
    symbols: Symbols,
    outputs: Mapping[str, Any],
    parameters: Mapping[str, Parameter],
) -> TracedBand:
    """Trace the field, memory and outputs prescribed in the band of the indicator ``key``."""
    what = f"the band of {key!r}"
    if key not in traced.indicator_names:
        raise SystemDefinitionError(f"bands: {unknown(key, 'an indicator', 'this system', traced.indicator_names)}")
    if "eta" in parameters:
        raise SystemDefinitionError(f"{what}: `eta` is the width of the band; the parameter `eta` must be renamed")
    eta = sp.Symbol("p_eta", real=True)
    own, time = {}, Scalar(symbols.t)
    plain = symbols.parameters({"eta": eta})
    memory = []
    for name, given in (band.write or {}).items():
        function, unit = given if isinstance(given, tuple) else (given, "")
        own[name] = sp.Symbol(f"m_{name}", real=True)
        value = call_scalar(function, (time, symbols.states(), plain), f"what {what} writes to {name!r}")
        memory.append((name, unit, own[name], value))
    p = symbols.parameters({"eta": eta, **own})
    vector = call_vector(band.field, (time, symbols.states(), p), tuple(symbols.u), what)
    for entry in vector:
        refuse_corners(entry, {symbols.t, *symbols.u.values()}, what)
    shown = {}
    for name, function in (band.outputs or {}).items():
        if name not in outputs:
            raise SystemDefinitionError(f"{what}: {unknown(name, 'an output', 'this system', list(outputs))}")
        expression = call_scalar(function, (time, symbols.states(), p), f"output {name!r} in {what}")
        shown[list(outputs).index(name)] = expression
    return TracedBand(traced.indicator_names.index(key), eta, vector, tuple(memory), shown)
