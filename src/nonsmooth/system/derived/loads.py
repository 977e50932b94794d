r"""Loads of elements, as expressions: along which speeds their forces work, and what else works on a mechanical system.

The force :math:`\lambda` of an element takes the power :math:`-\lambda\, w \cdot v` from the masses. Its rate is
:math:`w \cdot v` less the speed of what it acts against (a moving stop, a belt), so :math:`w \cdot v` is the sum of the
speeds that its force changes, each times the derivative of the rate in it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.derived import elements
from nonsmooth.system.derived.elements import Element
from nonsmooth.system.derived.elements.element import words_of
from nonsmooth.system.derived.elements.stop import RUBS
from nonsmooth.system.derived.expressions import SPEED, Expressions
from nonsmooth.system.symbolic.expressions import write_expression
from nonsmooth.system.units import Unit, product, read_unit, unit_of, write_unit


@dataclass(frozen=True, eq=False)
class Load:
    """An element: its kind, how it was given, where it is, its rate, what a unit force adds to states' derivatives, its
    laws (of the speed's magnitude in ``SPEED``), and what else was given, names of parameters and elements among it.

    ``rate`` is None where it has no meaning: where forces change its place at once, or where it differs between the
    modes of the system without elements."""

    name: str
    kind: str
    text: str
    where: sp.Expr
    rate: sp.Expr | None
    direction: Mapping[int, sp.Expr]
    laws: Mapping[str, sp.Expr]
    options: Mapping[str, Any]

    @property
    def rubs(self) -> str:
        """Of the friction at a rigid contact the name of that; else nothing."""
        return self.name.removesuffix(RUBS) if self.kind == "Rubbing" else ""

    @property
    def element(self) -> type[Element]:
        """Its class."""
        found: type[Element] = getattr(elements, self.kind)
        return found

    def moved(self, u: tuple[sp.Symbol, ...]) -> sp.Expr:
        """The speed w.v of the masses along the element."""
        return sp.Add(*[sp.diff(self.rate, u[i]) * u[i] for i in self.direction])


@dataclass(frozen=True, eq=False)
class Loads:
    """All elements of a system, its vector fields without them by mode, and the powers of a mechanical system that are
    not those of elements, with the unit of their work."""

    elements: tuple[Load, ...]
    fields: Mapping[str, tuple[sp.Expr, ...]]
    powers: Mapping[str, sp.Expr] = field(default_factory=dict)
    energy: str = ""

    def held(self, mode: str) -> list[Load]:
        """The elements that hold their rates at zero in a mode, by its name."""
        found = re.fullmatch("(?:.*_)?" + words_of({one.name: one.element for one in self.elements}), mode)
        phases = found.groups() if found else ()
        return [one for one, phase in zip(self.elements, phases, strict=False) if phase in one.element.held]

    def units(self, units: Mapping[sp.Symbol, str]) -> dict[str, tuple[str, str, str, str]]:
        """Units of force, rate, impulse and energy of each element, by those of states, parameters and time."""
        known = {symbol: read_unit(text) for symbol, text in units.items()}
        return {load.name: _units(load, [*units], known) for load in self.elements}


def _units(load: Load, u: list[sp.Symbol], known: Mapping[sp.Symbol, Unit | None]) -> tuple[str, str, str, str]:
    second: Unit = {"s": 1}
    rate = None if load.rate is None else unit_of(load.rate, known)
    force = None
    for i, entry in load.direction.items():
        if entry != 0 and force is None:
            of = unit_of(entry, known)
            force = product(known[u[i]], {"s": -1}, None if of is None else {k: -n for k, n in of.items()})
    turning = rate is not None and "m" not in rate
    return (
        write_unit(force, turning),
        write_unit(rate),
        write_unit(product(force, second)),
        write_unit(product(force, rate, second)),
    )


def loads_of(make: Expressions) -> Loads:
    """The loads of elements that are put together by expressions."""
    modes, found = list(make.fields), []
    for k, part in enumerate(make.parts):
        element = part.element
        laws = [name for name in element.laws if not isinstance(getattr(element, name), str | None)]
        apart = {"at", "on", element.kinematics, "position", "belt", *laws}
        try:
            rates = {sp.expand(make.rate(k, mode)) for mode in modes}
        except SystemDefinitionError:  # a force changes its place at once
            rates = set()
        found.append(
            Load(
                part.name,
                type(element).__name__,
                _text(make, k),
                part.where,
                rates.pop() if len(rates) == 1 else None,
                part.direction,
                {name: make.spoken(k, name) for name in laws},
                {one.name: getattr(element, one.name) for one in fields(element) if one.name not in apart},
            )
        )
    return Loads(tuple(found), {mode: tuple(make.fields[mode]) for mode in modes})


def _text(make: Expressions, k: int) -> str:
    """An element as it was given; functions as what they return."""
    part = make.parts[k]
    given = part.element.given or part.element
    if isinstance(given, str):
        return given
    symbols = make.symbols
    names = {symbol: name for name, symbol in {**symbols.u, **symbols.p, **symbols.m}.items()}
    names |= {symbols.t: "t", SPEED: "v"}

    def shown(name: str, value: Any) -> str:
        if isinstance(value, Mapping):
            return "{" + ", ".join(f"{shown(key, key)}: {shown('', one)}" for key, one in value.items()) + "}"
        if not callable(value):
            return f'"{value}"' if isinstance(value, str) else str(value)
        expression = make.spoken(k, name) if name in given.laws else make._given(value, name)
        return write_expression(expression, names)

    parts = [
        f"{one.name}={shown(one.name, getattr(given, one.name))}"
        for one in sorted(fields(given), key=lambda one: one.name not in ("at", given.kinematics))
        if (one.default if one.default is not MISSING else None) != getattr(given, one.name)
    ]
    return f"{type(given).__name__}({', '.join(parts)})"
