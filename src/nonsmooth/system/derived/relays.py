r"""Several surfaces whose vector fields add up, as relays that decide together.

Where the modes either side of m surfaces are all 2^m and

.. math:: x' = f + \sum_i b_i s_i, \qquad s_i = \operatorname{sgn} h_i,

each surface is a force between -1 and 1: dry friction on h_i where b_i acts on its rate, a preloaded spring on h_i
where it acts on the second derivative only (relative degree two). There crossings accumulate where surfaces meet, and
motion at their intersection is decided as that of contacts is (:mod:`nonsmooth.system.derived.deciding`). Surfaces
that all have relative degree one stay what Filippov's construction makes of them (:mod:`.sliding`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import sympy as sp

from nonsmooth.system.derived.elements import Coulomb, Element, PreloadedSpring
from nonsmooth.system.derived.elements.element import CREEP
from nonsmooth.system.symbolic.scalar import Scalar
from nonsmooth.system.symbolic.traced import along
from nonsmooth.system.symbolic.tracing import Symbols, call_scalar, call_vector
from nonsmooth.system.transition import Mode, Surface

Field = tuple[sp.Expr, ...]
Signs = tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class SecondOrderRelay(PreloadedSpring):
    """A relay whose force acts on the second derivative of its indicator; entered only as slowly as a contact rests."""

    slow = CREEP


@dataclass(frozen=True)
class Relays:
    """The field between all surfaces, the relays by their indicators, the user's mode for each choice of signs, and
    what must not be negative for relays to push towards their surfaces, each with its sentence."""

    field: Mode
    elements: Mapping[str, Element]
    modes: Mapping[Signs, str]
    ranges: Sequence[tuple[sp.Expr, str]] = ()

    def name(self, phases: Sequence[str]) -> str:
        """The name of a combination of their phases."""
        held = [phase in ("stick", "held") for phase in phases]
        sides = tuple(1 if phase in ("forward", "above") else -1 for phase in phases)
        if not any(held):
            return self.modes[sides]
        every = list(zip(self.elements, held, sides, strict=True))
        beside = [f"{'above' if side > 0 else 'below'}_{key}" for key, holds, side in every if not holds]
        return "_".join([*(key for key, holds, _ in every if holds), "sliding", *beside])


def relays_of(symbols: Symbols, given: Mapping[str, Any], values: Mapping[sp.Symbol, float]) -> Relays | None:
    """The relays that a system's surfaces are; None where they are not, or all have relative degree one.

    They push towards their surfaces at the present ``values`` of the parameters."""
    modes, where, transitions = given["modes"], given["indicators"], given["transitions"]
    if len(modes) < 4 or not transitions or not all(isinstance(item, Surface) for item in transitions):
        return None
    if any(item.static is not None or item.field is not None or item.mode for item in transitions):
        return None
    tables = (function for function, _ in given["outputs"].values())
    if any(mode.states for mode in modes.values()) or any(isinstance(one, Mapping) for one in tables):
        return None
    keys = list(dict.fromkeys(item.indicator for item in transitions))
    signs = _signs(keys, modes, transitions)
    if signs is None or any(key not in where for key in keys):
        return None
    arguments = symbols.arguments()
    u = tuple(symbols.u.values())
    fields = {
        sides: call_vector(modes[mode].field, arguments, tuple(symbols.u), f"the vector field of mode {mode!r}")
        for sides, mode in signs.items()
    }
    middle = tuple(sp.expand(sp.Add(*column) / len(fields)) for column in zip(*fields.values(), strict=True))
    pushes: list[Field] = []
    for i in range(len(keys)):
        halves = {
            tuple(sp.expand((a - b) / 2) for a, b in zip(fields[sides], fields[_turned(sides, i)], strict=True))
            for sides in fields
            if sides[i] > 0
        }
        if len(halves) != 1:
            return None
        pushes.append(halves.pop())
    degrees: list[int] = []
    elements: dict[str, Element] = {}
    ranges: list[tuple[sp.Expr, str]] = []
    for key, b in zip(keys, pushes, strict=True):
        h = call_scalar(where[key], arguments, f"indicator {key!r}")
        rate = along(h, symbols.t, u, middle)
        first, second = (
            sp.simplify(sum(sp.diff(e, symbol) * part for symbol, part in zip(u, b, strict=True))) for e in (h, rate)
        )
        acts = first if first != 0 else second
        now = acts.subs(values)
        if not now.is_number or not now < 0:
            return None
        if acts.free_symbols:
            says = f"the relay at {key!r} pushes towards its surface; where it does not, define another system"
            ranges.append((-acts, says))
        degrees.append(1 if first != 0 else 2)
        # its strength is the bound of a force that changes a rate by 1: what several hold is then shared by numbers
        on = {name: _given(sp.cancel(part / acts)) for name, part in zip(symbols.u, b, strict=True) if part != 0}
        strength = _given(-acts)
        if degrees[-1] == 1:
            elements[key] = Coulomb(speed=where[key], friction=strength, on=on)
        else:
            elements[key] = SecondOrderRelay(displacement=where[key], preload=strength, on=on)
    if 2 not in degrees:
        return None
    entries = [Scalar(sp.sympify(e)) for e in middle]
    return Relays(Mode(lambda t, u, p: entries), elements, signs, ranges)


def _signs(keys: Sequence[str], modes: Mapping[str, Any], surfaces: Sequence[Surface]) -> dict[Signs, str] | None:
    """The mode for each choice of sides; None where the surfaces do not connect all of them."""
    sides: dict[str, dict[str, int]] = {mode: {} for mode in modes}
    for item in surfaces:
        if item.below not in sides or item.above not in sides:
            return None
        sides[item.below][item.indicator], sides[item.above][item.indicator] = -1, 1
    found = {tuple(own.get(key, 0) for key in keys): mode for mode, own in sides.items()}
    every = set(product((1, -1), repeat=len(keys)))
    pairs = {(item.indicator, item.below, item.above) for item in surfaces}
    if set(found) != every or len(found) != len(modes) or len(pairs) != len(keys) * len(every) // 2:
        return None
    whole = all((key, found[_turned(s, i)], found[s]) in pairs for i, key in enumerate(keys) for s in every if s[i] > 0)
    return found if whole else None


def _turned(sides: Signs, i: int) -> Signs:
    return (*sides[:i], -sides[i], *sides[i + 1 :])


def _given(expression: sp.Expr) -> Any:
    return lambda t, u, p: Scalar(sp.sympify(expression))
