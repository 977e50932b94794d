r"""The modes, indicators and transitions of a system with elements (:mod:`nonsmooth.system.elements`).

In a combination of phases the laws of the elements add to the field, ``f = f_0 + sum_e D_e F_e``, and the forces
``lambda`` of those that hold a rate ``g_i`` at zero solve

    d g_i / dt = 0:   sum_j (grad g_i . D_j) lambda_j = -(g_i,t + grad g_i . f)

one linear system for all contacts that rest and all that stick (the field has terms besides that vanish on the
surface and bring a state back to it). A contact opens where its force vanishes, friction
slips where its own leaves the range that it can have. Which rate vanishes where is known by construction; the resets
into rest and stick project onto it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.elements import (
    Backlash,
    Coulomb,
    ElasticStop,
    Element,
    Law,
    PreloadedSpring,
    Stop,
)
from nonsmooth.system.mode import Mode
from nonsmooth.system.names import unknown
from nonsmooth.system.scalar import Scalar, to_expression
from nonsmooth.system.tracing import Symbols, call_scalar, call_vector
from nonsmooth.system.transition import Surface, Transition

__all__ = ["assembled", "element_names"]

MOST = 256  # modes
SMALL = 1e-4  # of the states' scale: what a rate or a gap that is held at zero may be off where a run begins
CREEP = 1e-7  # of the same: the speed of approach below which impacts are not followed
Condition = tuple[sp.Expr, int, str]  # an expression, its sign, a name for it
Pattern = tuple[int, ...]  # the phase of each element


@dataclass
class _Part:
    """An element in expressions."""

    name: str
    element: Element
    direction: dict[int, sp.Expr]  # what a unit force adds to which state's derivative
    where: sp.Expr  # gap, displacement or speed
    laws: dict[str, sp.Expr] = field(default_factory=dict)


class _Assembler:
    """Expressions of one system with elements."""

    def __init__(
        self, symbols: Symbols, base: Mapping[str, tuple[sp.Expr, ...]], elements: Mapping[str, Element],
        scale: Mapping[str, float], values: Mapping[sp.Symbol, float], resets: bool,
    ) -> None:  # fmt: skip
        self.symbols, self.base, self.scale, self.values, self.resets = symbols, base, scale, values, resets
        self.u = tuple(symbols.u.values())
        self.names = list(symbols.u)
        self.parts = [self._part(name, element) for name, element in elements.items()]
        self.index = {part.name: k for k, part in enumerate(self.parts)}
        self.indicators: dict[str, sp.Expr] = {}
        self._known: dict[sp.Expr, str] = {}
        self._fields: dict[tuple[str, Pattern], tuple[list[sp.Expr], dict[int, sp.Expr]]] = {}

    # What the user gave, as expressions

    def _call(self, function: Any, what: str) -> sp.Expr:
        return call_scalar(function, (Scalar(self.symbols.t), self.symbols.states(), self.symbols.parameters()), what)

    def law(self, given: Law, what: str) -> sp.Expr:
        """A number, the name of a parameter or of memory, or a function of t, u, p."""
        if isinstance(given, str):
            known = {**self.symbols.p, **self.symbols.m}
            if given not in known:
                raise SystemDefinitionError(f"{what}: {unknown(given, 'a parameter', 'this system', list(known))}")
            return known[given]
        return self._call(given if callable(given) else (lambda t, u, p: given), what)

    def _part(self, name: str, element: Element) -> _Part:
        what = f"element {name!r}"
        if not isinstance(element, Element):
            raise SystemDefinitionError(f"{what} is one of nonsmooth.elements, not {shortened(element)}")
        if element.on is None:
            raise SystemDefinitionError(f"{what}: at= is for ns.mechanical; here give {element.kinematics}= and on=")
        direction = {}
        for state, given in element.on.items():
            if state not in self.symbols.u:
                raise SystemDefinitionError(f"{what}: {unknown(state, 'a state', 'this system', self.names)}")
            direction[self.names.index(state)] = self.law(given, f"on[{state!r}] of {what}")
        own = getattr(element, element.kinematics)
        return _Part(name, element, direction, self._call(own, f"{element.kinematics} of {what}"))

    def of(self, part: _Part, name: str) -> sp.Expr:
        """A law of an element by the name of its argument."""
        if name not in part.laws:
            part.laws[name] = self.law(getattr(part.element, name), f"{name} of element {part.name!r}")
        return part.laws[name]

    # Calculus

    def along(self, expression: sp.Expr, f: Sequence[sp.Expr]) -> sp.Expr:
        """The derivative in time along a field."""
        total = sp.diff(expression, self.symbols.t)
        for symbol, part in zip(self.u, f, strict=True):
            total += sp.diff(expression, symbol) * part
        return total

    def across(self, expression: sp.Expr, part: _Part) -> sp.Expr:
        """Change of the derivative of an expression by a unit force of an element."""
        return sp.Add(*[sp.diff(expression, self.u[i]) * d for i, d in part.direction.items()])

    def rate(self, part: _Part, mode: str) -> sp.Expr:
        """The rate that a constraint of the element holds at zero: of the gap, or the speed itself."""
        if isinstance(part.element, Coulomb):
            return part.where
        if any(sp.expand(self.across(part.where, other)) != 0 for other in self.parts):
            raise SystemDefinitionError(
                f"element {part.name!r}: a force changes its {part.element.kinematics} at once; it must depend on "
                f"positions, whose derivatives are speeds, and forces act on speeds"
            )
        return sp.expand(self.along(part.where, self.base[mode]))

    def force(self, part: _Part, phase: str, mode: str, pattern: Pattern) -> sp.Expr | None:
        """The force of an element by its law; None where a constraint gives it."""
        e = part.element
        if isinstance(e, Stop):
            return None if phase == "rest" else sp.Integer(0)
        if isinstance(e, ElasticStop):
            if phase == "open":
                return sp.Integer(0)
            return -self.of(part, "stiffness") * part.where + self.damped(part, mode)
        if isinstance(e, Backlash):
            if phase == "free":
                return sp.Integer(0)
            side = 1 if phase == "above" else -1
            pressed = part.where - side * self.of(part, "half_width")
            return -self.of(part, "stiffness") * pressed + self.damped(part, mode)
        if isinstance(e, PreloadedSpring):
            side = 1 if phase == "above" else -1
            return -side * self.of(part, "preload") - self.of(part, "stiffness") * part.where
        if phase == "stick":
            return None
        side = 1 if phase == "forward" else -1
        return -side * self.friction(part, side * part.where) * self.normal(part, mode, pattern)

    def damped(self, part: _Part, mode: str) -> sp.Expr:
        """The damper's force of an elastic contact; without one no speed is asked for, and states need not have one."""
        damping = self.of(part, "damping")
        return sp.Integer(0) if damping == 0 else -damping * self.rate(part, mode)

    def friction(self, part: _Part, speed: sp.Expr) -> sp.Expr:
        """The kinetic law at a magnitude of the speed."""
        given = part.element.friction  # type: ignore[attr-defined]
        if callable(given) and given.__code__.co_argcount == 2:
            what = f"friction of element {part.name!r}"
            return call_scalar(given, (Scalar(speed), self.symbols.parameters()), what)
        return self.of(part, "friction")

    def static(self, part: _Part) -> sp.Expr:
        """The largest force that holds, or its coefficient."""
        if part.element.static is None:  # type: ignore[attr-defined]
            return self.friction(part, sp.Integer(0))
        return self.of(part, "static")

    def normal(self, part: _Part, mode: str, pattern: Pattern) -> sp.Expr:
        given = part.element.normal  # type: ignore[attr-defined]
        if given is None:
            return sp.Integer(1)
        if not isinstance(given, str) or given not in self.index:
            return self.of(part, "normal")
        other = self.parts[self.index[given]]
        found = self.force(other, other.element.phases[pattern[self.index[given]]], mode, pattern)
        if found is None or not isinstance(other.element, ElasticStop):
            raise SystemDefinitionError(
                f"element {part.name!r}: normal={given!r} must name an ElasticStop; with the force of a rigid contact, "
                "which friction changes in turn, a motion need not exist or be unique (Painleve)"
            )
        return found

    def flow(self, mode: str, pattern: Pattern) -> tuple[list[sp.Expr], dict[int, sp.Expr]]:
        """The field of a combination of phases, and the force of each element in it."""
        key = mode, pattern
        if key in self._fields:
            return self._fields[key]
        phases = [part.element.phases[k] for part, k in zip(self.parts, pattern, strict=True)]
        f, forces, held = list(self.base[mode]), {}, self.held(pattern)
        for k, (part, phase) in enumerate(zip(self.parts, phases, strict=True)):
            law = self.force(part, phase, mode, pattern)
            if law is None:
                continue
            forces[k] = law
            for i, d in part.direction.items():
                f[i] += d * law
        if held:
            matrix = self.effects(held, mode)
            needed = sp.Matrix([-self.along(self.rate(self.parts[k], mode), f) for k in held])
            back = sp.Matrix([self.pull(self.parts[k], mode) for k in held])
            for k, value, extra in zip(held, matrix.LUsolve(needed), matrix.LUsolve(back), strict=True):
                forces[k] = sp.cancel(value) if len(held) > 1 else value
                for i, d in self.parts[k].direction.items():
                    f[i] += d * (forces[k] + extra)
        self._fields[key] = [sp.expand(part) for part in f], {k: sp.expand(forces[k]) for k in sorted(forces)}
        return self._fields[key]

    # What a user would have written

    def effects(self, some: Sequence[int], mode: str) -> sp.Matrix:
        """Changes of the derivatives of the rates of some elements by their unit forces."""
        parts = [self.parts[k] for k in some]
        return sp.Matrix([[self.across(self.rate(one, mode), other) for other in parts] for one in parts])

    def independent(self, some: Sequence[int], mode: str) -> bool:
        """Return whether the rates of some elements can be held at zero each by its own force."""
        return not some or sp.simplify(self.effects(some, mode).det()) != 0

    def held(self, pattern: Pattern) -> list[int]:
        """Elements whose force is that of a constraint."""
        phases = (part.element.phases[k] for part, k in zip(self.parts, pattern, strict=True))
        return [k for k, phase in enumerate(phases) if phase in ("rest", "stick")]

    def pull(self, part: _Part, mode: str) -> sp.Expr:
        """Force that brings a state back onto the surface, which rounding leaves; zero there (Baumgarte 1972)."""
        rate = self.rate(part, mode)
        if isinstance(part.element, Coulomb):
            return -rate
        kappa = to_expression(self.size(rate) / self.size(part.where))
        return -2 * kappa * rate - kappa**2 * part.where

    def size(self, expression: sp.Expr) -> float:
        """The scale of the states that an expression involves."""
        found = [self.scale[name] for name, symbol in self.symbols.u.items() if expression.has(symbol)]
        return max(found, default=1.0)

    def sign(self, effect: sp.Expr, one: _Part, other: _Part) -> int:
        """The sign of what one element's impulse does to another's gap, which must be the same in all states."""
        effect = sp.simplify(effect.subs(self.values))
        for number, holds in ((-1, effect.is_negative), (0, effect.is_zero), (1, effect.is_positive)):
            if holds:
                return number
        raise SystemDefinitionError(
            f"elements {one.name!r} and {other.name!r}: whether an impact of one opens the other depends on the state "
            f"({effect}), and that is decided once for all; give {one.name!r} rest=False"
        )

    def condition(self, rows: Sequence[Condition]) -> str:
        """The text of a condition; its expressions become indicators, equal ones the same."""
        words = []
        for expression, sign, name in rows:
            key = sp.expand(expression)
            if key not in self._known:
                unique, n = name, 1
                while unique in self.indicators:
                    n += 1
                    unique = f"{name}_{n}"
                self._known[key] = unique
                self.indicators[unique] = key
            words.append(f"{self._known[key]} {'>' if sign > 0 else '<'} 0")
        return " and ".join(words)

    def projected(self, k: int, factor: sp.Expr, held: Sequence[int], mode: str) -> list[sp.Expr]:
        """States behind an impulse of the element that takes its rate to -factor times it.

        What is held bears its part of it."""
        wanted = sp.Matrix([-(1 + factor) * self.rate(self.parts[k], mode), *([0] * len(held))])
        impulses = self.effects([k, *held], mode).LUsolve(wanted)
        after = list(self.u)
        for one, impulse in zip([k, *held], impulses, strict=True):
            for i, d in self.parts[one].direction.items():
                after[i] += d * impulse
        return [sp.expand(sp.cancel(state)) for state in after]

    def back_on(self, part: _Part, states: Sequence[sp.Expr]) -> list[sp.Expr]:
        """States moved onto the surface of a contact, the shortest way."""
        slopes = [sp.diff(part.where, symbol) for symbol in self.u]
        length = sp.Add(*[slope**2 for slope in slopes])
        return [sp.expand(sp.cancel(x - part.where * s / length)) for x, s in zip(states, slopes, strict=True)]

    def leaving(self, k: int, mode: str, pattern: Pattern) -> list[tuple[str, list[Condition], list[sp.Expr] | None]]:
        """Transitions of one element out of its phase: the phase behind, the condition, the states behind."""
        part = self.parts[k]
        e, name, phase = part.element, part.name, part.element.phases[pattern[k]]

        def with_phase(other: str) -> Pattern:
            return (*pattern[:k], e.phases.index(other), *pattern[k + 1 :])

        if isinstance(e, Stop):
            return self._leaving_stop(k, mode, pattern, with_phase("open"))
        if isinstance(e, ElasticStop):
            push = self.force(part, "contact", mode, pattern)
            gap, pushing = (part.where, 1, f"{name}_gap"), (push, 1, f"{name}_push")
            inside = (part.where, -1, f"{name}_gap")
            if e.pulls or self.of(part, "damping") == 0:
                return [("contact", [inside], None)] if phase == "open" else [("open", [gap], None)]
            if phase == "open":
                return [("contact", [inside, pushing], None)]
            return [("open", [(push, -1, f"{name}_push")], None)]
        if isinstance(e, Backlash):
            upper = (part.where - self.of(part, "half_width"), f"{name}_upper")
            lower = (part.where + self.of(part, "half_width"), f"{name}_lower")
            ways = {
                "free": [("above", upper, 1), ("below", lower, -1)], "above": [("free", upper, -1)],
                "below": [("free", lower, 1)],
            }  # fmt: skip
            return [(to, [(g, sign, label)], None) for to, (g, label), sign in ways[phase]]
        if isinstance(e, PreloadedSpring):
            to, sign = ("below", -1) if phase == "above" else ("above", 1)
            return [(to, [(part.where, sign, f"{name}_side")], None)]
        return self._leaving_friction(k, mode, pattern, with_phase("stick"))

    def _leaving_stop(
        self, k: int, mode: str, pattern: Pattern, opened: Pattern
    ) -> list[tuple[str, list[Condition], list[sp.Expr] | None]]:
        part = self.parts[k]
        e, name, w = part.element, part.name, self.rate(part, mode)
        assert isinstance(e, Stop)
        pull = (self.along(w, self.flow(mode, opened)[0]), f"{name}_opens")  # the acceleration without its force
        if e.phases[pattern[k]] == "rest":
            off = sp.Float(SMALL * self.size(part.where))
            beyond = [(part.where + off, -1, f"{name}_beyond")]
            same = self.back_on(part, self.projected(k, sp.Integer(0), (), mode))
            return [
                ("open", [(pull[0], 1, pull[1])], None), ("open", [(part.where - off, 1, f"{name}_off")], None),
                ("open", beyond, same),
            ]  # fmt: skip
        held = self._bearing(k, pattern, mode)
        if not self.independent([k, *held], mode):
            return []  # what rests and sticks leaves it no way to move
        rebound = self.projected(k, self.of(part, "restitution"), held, mode)
        closed: Condition = (part.where, -1, f"{name}_gap")
        if not e.rest:
            return [("open", [closed], rebound)]
        still = self.projected(k, sp.Integer(0), held, mode)
        closing = [closed, (w, -1, f"{name}_closing")]
        presses, lifts = (pull[0], -1, pull[1]), (pull[0], 1, pull[1])
        if self.of(part, "restitution") == 0:
            return [("rest", [*closing, presses], still), ("open", [*closing, lifts], still)]
        creep = sp.Float(e.creep if e.creep is not None else CREEP * self.size(w))
        slow = (w + creep, f"{name}_slow")
        return [
            ("open", [closed, (slow[0], -1, slow[1])], rebound),
            ("rest", [*closing, (slow[0], 1, slow[1]), presses], still),
            ("open", [*closing, (slow[0], 1, slow[1]), lifts], rebound),
        ]

    def _leaving_friction(
        self, k: int, mode: str, pattern: Pattern, stuck: Pattern
    ) -> list[tuple[str, list[Condition], list[sp.Expr] | None]]:
        part = self.parts[k]
        name, v = part.name, part.where
        phase = part.element.phases[pattern[k]]
        if not self.independent(self.held(stuck), mode):
            return []  # what rests and sticks leaves it no way to move
        hold, most = self.flow(mode, stuck)[1][k], self.static(part) * self.normal(part, mode, pattern)
        above, below = (hold - most, f"{name}_over"), (hold + most, f"{name}_under")
        if phase == "stick":
            off = sp.Float(SMALL * self.size(v))
            return [
                ("forward", [(v - off, 1, f"{name}_speed_above")], None),
                ("back", [(v + off, -1, f"{name}_speed_below")], None),
                ("back", [(above[0], 1, above[1])], None), ("forward", [(below[0], -1, below[1])], None),
            ]  # fmt: skip
        other = "back" if phase == "forward" else "forward"
        sign = -1 if phase == "forward" else 1
        stopped: Condition = (v, sign, f"{name}_speed")
        if sp.expand(most) == 0:
            return [(other, [stopped], None)]  # an open contact, which bears no friction
        held = [j for j in self.held(pattern) if sp.simplify(self.across(self.rate(self.parts[j], mode), part)) != 0]
        still = self.projected(k, sp.Integer(0), held, mode)
        off = -sign * sp.Float(CREEP * self.size(v))
        slow, turned = ((v + off, one * sign, f"{name}_turned_{phase}") for one in (-1, 1))
        within = [(above[0], -1, above[1]), (below[0], 1, below[1])]
        torn = (above[0], 1, above[1]) if phase == "forward" else (below[0], -1, below[1])
        if not self.is_struck(part):
            return [("stick", [stopped, *within], still), (other, [stopped, torn], None)]
        # An impact turns the speed round at once, and no finite force can stop it then.
        return [("stick", [stopped, slow, *within], still), (other, [stopped, torn], None), (other, [turned], None)]

    def is_struck(self, part: _Part) -> bool:
        """Return whether a speed may jump: by the impact of a stop, or by a reset of the system's own."""
        stops = (other for other in self.parts if isinstance(other.element, Stop))
        return self.resets or any(sp.simplify(self.across(part.where, other)) != 0 for other in stops)

    def _bearing(self, k: int, pattern: Pattern, mode: str) -> list[int]:
        """Of the contacts that rest those that take part in an impulse of element k.

        Those that it would pull open part instead; friction is finite and lets go of what it held."""

        def bears(j: int) -> bool:
            part = self.parts[j]
            if isinstance(part.element, Coulomb):
                return False
            return self.sign(self.across(self.rate(part, mode), self.parts[k]), part, self.parts[k]) < 0

        return [j for j in self.held(pattern) if j != k and bears(j)]


def element_names(elements: Any) -> dict[str, Element]:
    """Elements by name; those of a list are called after their kind."""
    if isinstance(elements, Mapping):
        return dict(elements)
    if isinstance(elements, (str, Element)) or not isinstance(elements, Sequence):
        raise SystemDefinitionError(
            'elements= maps names to elements, {"stop": ns.elements.Stop(...)}, or is a list of them; not '
            + shortened(elements)
        )
    found: dict[str, Element] = {}
    for element in elements:
        name = first = type(element).__name__.lower()
        while name in found:
            name = f"{first}_{sum(other.startswith(first) for other in found) + 1}"
        found[name] = element
    return found


def assembled(
    symbols: Symbols, modes: Mapping[str, Any], elements: Any, given: Mapping[str, Any], scale: Mapping[str, float],
    values: Mapping[sp.Symbol, float],
) -> dict[str, Any]:  # fmt: skip
    """Modes, indicators, transitions and outputs of a system with elements, as a user would give them.

    ``given`` are those without elements: its transitions go from each combination of phases to the same of the target.
    """
    parts = element_names(elements)
    for key, mode in modes.items():
        if isinstance(mode, Mode) and mode.states is not None:
            raise SystemDefinitionError(f"mode {key!r}: a system with elements has all its states in every mode")
    arguments = Scalar(symbols.t), symbols.states(), symbols.parameters()
    base = {
        key: call_vector(mode.field if isinstance(mode, Mode) else mode, arguments, tuple(symbols.u),
                         f"the vector field of mode {key!r}")
        for key, mode in modes.items()
    }  # fmt: skip
    resets = any(isinstance(item, Transition) and item.reset is not None for item in given["transitions"])
    make = _Assembler(symbols, base, parts, scale, values, resets)
    counts = [len(part.element.phases) for part in make.parts]
    number = len(base) * int(sp.prod(counts))
    if number > MOST:
        raise SystemDefinitionError(
            f"{len(parts)} elements have {number} combinations of phases; at most {MOST} are written out"
        )
    every = product(base, product(*[range(count) for count in counts]))
    pairs = [pair for pair in every if make.independent(make.held(pair[1]), pair[0])]

    def name(mode: str, pattern: Pattern) -> str:
        words = [f"{part.name}_{part.element.phases[k]}" for part, k in zip(make.parts, pattern, strict=True)]
        return "_".join(words if len(base) == 1 else [mode, *words])

    fields: dict[str, Any] = {}
    forces: dict[str, dict[str, Any]] = {part.name: {} for part in make.parts}
    transitions: list[Transition | Surface] = []
    for mode, pattern in pairs:
        here = name(mode, pattern)
        f, found = make.flow(mode, pattern)
        fields[here] = _returns(f)
        for k, part in enumerate(make.parts):
            forces[part.name][here] = _returns(found[k])
        for k, part in enumerate(make.parts):
            for phase, rows, states in make.leaving(k, mode, pattern):
                there = (*pattern[:k], part.element.phases.index(phase), *pattern[k + 1 :])
                if (mode, there) not in pairs:
                    continue  # more contacts than can be held by forces of their own
                reset = None if states is None else _returns(states)
                transitions.append(Transition(here, name(mode, there), when=make.condition(rows), reset=reset))
        for item in given["transitions"]:
            if isinstance(item, Surface) and item.below == mode:
                ends = name(item.below, pattern), name(item.above, pattern)
                transitions.append(replace(item, below=ends[0], above=ends[1]))
            elif isinstance(item, Transition) and item.source == mode:
                ends = name(item.source, pattern), name(item.target, pattern)
                transitions.append(Transition(*ends, item.when, item.at, item.reset, item.write))
    outputs = {}
    for key, output in (given["outputs"] or {}).items():
        function, unit = output if isinstance(output, (tuple, list)) else (output, "")
        if isinstance(function, Mapping):
            function = {name(mode, pattern): function[mode] for mode, pattern in pairs}
        outputs[key] = function, unit
    return {
        "modes": fields, "transitions": transitions,
        "indicators": {**(given["indicators"] or {}), **{key: _returns(g) for key, g in make.indicators.items()}},
        "outputs": {**outputs, **{f"{key}_force": (table, "") for key, table in forces.items()}},
    }  # fmt: skip


def _returns(found: Any) -> Callable[..., Any]:
    """A function of t, u, p that gives these expressions."""
    if isinstance(found, (list, tuple)):
        entries = [Scalar(one) for one in found]
        return lambda t, u, p: entries
    value = Scalar(found)
    return lambda t, u, p: value
