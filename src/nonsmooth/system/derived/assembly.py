r"""The rules by which elements (:mod:`nonsmooth.system.derived.elements`) come together in one combination of phases.

The laws of the elements add to the field, ``f = f_0 + sum_e D_e F_e``, and the forces ``lambda`` of those that hold a
rate ``g_i`` at zero solve

    d g_i / dt = 0:   sum_j (grad g_i . D_j) lambda_j = -(g_i,t + grad g_i . f)

one linear system for all contacts that rest and all that stick (the field has terms besides that vanish on the
surface and bring a state back to it). Which rate vanishes where is known by construction; the states behind an impulse
are projections onto it. What an element does in its phase it says itself, at its :class:`Place`.

The rules are written once, over a calculus (:mod:`nonsmooth.system.derived.calculus`). A child of :class:`Assembler`
brings one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.derived.calculus import Calculus, Part, kept
from nonsmooth.system.derived.elements import Rubbing
from nonsmooth.system.derived.elements.element import CREEP, THROWN, Condition, Leaving, Place
from nonsmooth.system.derived.faces import as_sums, independent, least_within, linked, weakest

Pattern = tuple[int, ...]  # the phase of each element


class VaryingError(SystemDefinitionError):
    """By which sum of forces elements hold together depends on the state or on parameters."""

    def __init__(self, names: str, of: str = "the state or on parameters") -> None:
        self.names = names
        super().__init__(
            f"elements {names} hold together, and by which sum of forces depends on {of}: take fewer elements, or "
            "numbers in on="
        )


class Assembler(Calculus):
    """The fields, forces and impulses of combinations of phases, over a calculus."""

    sequential: bool = False  # impacts of one instant come one after the other
    resets: bool = False  # a transition of the system's own may change the place or the rate of an element at once
    asks: bool = False  # what several elements decide together is asked at each instant (``deciding``)
    draws: tuple[int, ...] = ()  # of states and parameters, at which numbers that must be constant are compared

    def gradient(self, k: int, mode: str, draw: int = 0) -> FloatArray:
        """The derivatives of an element's rate in the states, but for inputs, which no force changes."""
        found = self.slopes(self.rate(k, mode), draw).copy()
        found[self.inputs] = 0.0
        return found

    @kept
    def approach(self, k: int, mode: str) -> Any:
        """The derivative of an element's place, which no force changes at once."""
        part = self.parts[k]
        if any(not self.vanishes(self.across(part.where, other)) for other in self.parts):
            raise SystemDefinitionError(
                f"element {part.name!r}: a force changes its {part.element.kinematics} at once; it must depend on "
                f"positions, whose derivatives are speeds, and forces act on speeds"
            )
        return self.along(part.where, self.base(mode))

    def place(self, k: int, mode: str, pattern: Pattern) -> Place:
        """The place of element k in a combination of phases."""
        return Place(self, k, mode, pattern)

    def held(self, pattern: Pattern, some: Collection[int] | None = None) -> tuple[int, ...]:
        """Elements, of all or of some, whose force is that of a constraint."""
        each = ((k, self.parts[k].element) for k in (range(len(self.parts)) if some is None else some))
        return tuple(k for k, element in each if element.phases[pattern[k]] in element.held)

    def begins_contact(self, source: Pattern, target: Pattern, struck: Sequence[int] = ()) -> bool:
        """Return whether an element that is in no contact is struck or comes into one (``struck`` as in ``impact``)."""
        hit = {max(k, ~k) for k in struck}
        for k, element in enumerate(part.element for part in self.parts):
            open_before = element.phases[source[k]] not in element.touching
            if open_before and ((element.strikes and k in hit) or element.phases[target[k]] in element.touching):
                return True
        return False

    @kept
    def rate(self, k: int, mode: str) -> Any:
        """The rate that a constraint of element k holds at zero."""
        return self.parts[k].element.rate(self.place(k, mode, (0,) * len(self.parts)))

    @kept
    def apart(self, mode: str) -> list[list[int]]:
        """The elements apart by whose forces change whose rates: what one does depends on the phases of its group
        alone."""
        acts = np.array([self.touched(part) for part in self.parts])
        felt = acts.copy()
        for k, part in enumerate(self.parts):
            if part.element.held:
                felt[k] |= self.involved(self.rate(k, mode))
        speaks = np.array([[other.name in vars(part.element).values() for other in self.parts] for part in self.parts])
        return linked(felt @ acts.T | speaks)

    def with_group_of(self, k: int, mode: str) -> list[int]:
        """The elements of the group of one."""
        return next(some for some in self.apart(mode) if k in some)

    def meetings(self, mode: str, pattern: Pattern) -> list[tuple[int, Condition]]:
        """The elements that may be held and are not, with each condition at which they meet what holds them."""
        held = self.held(pattern)
        free = [k for k, part in enumerate(self.parts) if part.element.held and k not in held]
        return [(k, ways[0]) for k in free for ways in self.parts[k].element.meeting(self.place(k, mode, pattern))]

    def effects(self, some: Sequence[int], mode: str, parts: Sequence[Part] | None = None) -> list[list[Any]]:
        """Changes of the derivatives of the rates of some elements by their unit forces."""
        parts = parts or [self.parts[k] for k in some]
        return [[self.across(self.rate(i, mode), part) for part in parts] for i in some]

    def sharing(self, mode: str) -> list[int]:
        """Elements that may hold a rate together with others, so that their forces are not unique."""
        held = [k for k, part in enumerate(self.parts) if {*part.element.held} & {*part.element.phases}]
        rows = np.array([self.gradient(k, mode) for k in held])
        rows /= np.linalg.norm(rows, axis=-1, keepdims=True)
        rank = len(independent(rows, range(len(held)))[0])
        rest = (np.delete(rows, i, axis=0) for i in range(len(held)))
        return [k for k, one in zip(held, rest, strict=True) if len(independent(one, range(len(one)))[0]) == rank]

    @property
    def striking(self) -> list[int]:
        """The rigid stops."""
        return [k for k, part in enumerate(self.parts) if part.element.strikes]

    @cached_property
    def rubbing(self) -> dict[int, int]:
        """The friction of each rigid stop that rubs."""
        numbers = {part.name: k for k, part in enumerate(self.parts)}
        return {numbers[part.element.of]: k for k, part in enumerate(self.parts) if isinstance(part.element, Rubbing)}

    def pushing(self, k: int, mode: str, pattern: Pattern) -> Part:
        """An element with what its unit force brings along: a contact that slips, its friction."""
        part, r = self.parts[k], self.rubbing.get(k)
        side = 0 if r is None else self.place(r, mode, pattern).side
        return part if r is None or not side else self.joined(part, self.parts[r], -side * self.constant(r, "friction"))

    @kept
    def coupled(self, i: int, j: int, mode: str) -> bool:
        """Return whether a force of one of two elements changes the rate of the other at once."""
        rubs = self.rubbing.get(i) == j or self.rubbing.get(j) == i
        changes = (self.across(self.rate(a, mode), self.parts[b]) for a, b in ((i, j), (j, i)))
        return rubs or not all(map(self.vanishes, changes))

    def together(self, k: int, mode: str, pattern: Pattern) -> tuple[int, ...]:
        """The element and those of the held ones whose forces depend on its own."""
        found, held = [k], [j for j in self.held(pattern) if j != k]
        for i in found:
            found += [j for j in held if j not in found and self.coupled(i, j, mode)]
        return tuple(sorted(found))

    def basis(self, held: tuple[int, ...], mode: str, pattern: Pattern) -> tuple[list[int], FloatArray]:
        """Held elements whose rates are independent, and the forces of all of them as sums of those."""
        chosen, sums = self._basis(held, mode, pattern, 0)
        for draw in self.draws if len(chosen) < len(held) else ():
            if not np.allclose(sums, self._basis(held, mode, pattern, draw)[1], rtol=1e-9, atol=1e-9):
                raise VaryingError(", ".join(repr(self.parts[k].name) for k in held))
        return chosen, sums

    def _basis(self, held: Sequence[int], mode: str, pattern: Pattern, draw: int) -> tuple[list[int], FloatArray]:
        """The same in one state."""
        rows = np.array([self.gradient(k, mode, draw) for k in held])
        first = sorted(range(len(held)), key=lambda i: not self.parts[held[i]].element.bears)  # those with a place
        chosen, doubt = independent(rows / np.linalg.norm(rows, axis=1)[:, None], first)
        if doubt:
            names = ", ".join(repr(self.parts[k].name) for k in held)
            raise SystemDefinitionError(
                f"elements {names}: whether their rates are independent of each other cannot be told (a part of "
                f"{doubt:.1e} is left of one); write their at= or on= so that equal directions are equal"
            )
        if len(chosen) == len(held):
            return list(held), np.eye(len(held))
        ways = np.array([self.pushes(self.pushing(k, mode, pattern), draw) for k in held])
        return [held[i] for i in chosen], as_sums(ways, chosen)

    def flow(self, mode: str, pattern: Pattern, some: Collection[int] | None = None) -> tuple[Any, dict[int, Any]]:
        """The field of a combination of phases, and the force of each element in it; with ``some`` of these alone."""
        some = range(len(self.parts)) if some is None else some
        f, forces, held = self.base(mode), {}, self.held(pattern, some)
        for here in (self.place(k, mode, pattern) for k in some if k not in held):
            forces[here.k] = here.part.element.force(here)
            f = self.moved(f, here.part, forces[here.k])
        if held:
            chosen, sums = self.basis(held, mode, pattern) if self.asks else (list(held), np.zeros((0, 0)))
            parts = [self.pushing(k, mode, pattern) for k in chosen]
            matrix = self.effects(chosen, mode, parts)
            needed = self.solved(matrix, [-self.along(self.rate(k, mode), f) for k in chosen])
            pulls = [self.parts[k].element.pull(self.place(k, mode, pattern)) for k in chosen]
            for part, force, extra in zip(parts, needed, self.solved(matrix, pulls), strict=True):
                f = self.moved(f, part, force + extra)
            f = self.held_exactly(f, [(self.rate(k, mode), pull) for k, pull in zip(chosen, pulls, strict=True)])
            if len(chosen) == len(held):
                forces |= dict(zip(held, needed, strict=True))
            else:
                for k, of in zip(held, np.linalg.pinv(sums.T), strict=True):  # of least norm
                    forces[k] = sum((share.item() * force for share, force in zip(of, needed, strict=True) if share), 0)
            for k, r in self.rubbing.items():
                if k in held and (side := self.place(r, mode, pattern).side):
                    forces[r] = -side * self.constant(r, "friction") * forces[k]
        return f, {k: forces[k] for k in sorted(forces)}

    def shared(self, mode: str, pattern: Pattern, forces: FloatArray, value: Callable[[Any], FloatArray]) -> FloatArray:
        """The forces (N, elements) in a combination, those that are not unique of least norm within their bounds;
        ``value`` gives a law's (N,) values."""
        held = self.held(pattern)
        chosen, sums = self.basis(held, mode, pattern) if held else ([], np.zeros((0, 0)))
        if len(chosen) == len(held) or {*held} & {*self.rubbing.values()}:
            return forces
        most = [self.parts[k].element.most(self.place(k, mode, pattern)) for k in held]
        high = np.array([np.full(len(forces), np.inf) if m is None else value(m) for m in most]).T
        low = np.where(np.isinf(high), 0.0, -high)
        own, found = forces[:, held], forces.copy()
        rounding = 1e-12 * np.abs(own).max(axis=1, keepdims=True, initial=0.0)
        for i in np.flatnonzero(((own < low - rounding) | (own > high + rounding)).any(axis=1)):
            found[i, held] = least_within(sums, own[i] @ sums, low[i], high[i])
        return found

    def asked(self, k: int, mode: str, pattern: Pattern) -> list[Leaving]:
        """The instants at which what an element and others that are held do next is asked (:mod:`.deciding`)."""
        here = self.place(k, mode, pattern)
        if k not in self.held(pattern):
            return [Leaving(None, conditions) for conditions in here.element.meeting(here)]
        group = self.together(k, mode, pattern)
        if k != group[0]:
            return []
        sums = self.basis(group, mode, pattern)[1]
        forces = self.flow(mode, pattern)[1]
        names = [f"{self.parts[j].name}_{name}" for j in group for name in self.parts[j].element.conditions]
        names.sort(key=lambda name: not name.endswith(("over", "under", "opens")))
        bounds = {i: self.parts[j].element.most(self.place(j, mode, pattern)) for i, j in enumerate(group)}
        bounded = [i for i, j in enumerate(group) if bounds[i] is not None and j not in self.rubbing.values()]
        cones = [
            (i, group.index(r), self.constant(r, "friction"))
            for i, r in enumerate(map(self.rubbing.get, group))
            if r in group
        ]
        found: list[Leaving] = []
        for weights in weakest(sums, bounded, cones):
            beyond = sum((p.item() * forces[j] for p, j in zip(weights, group, strict=True) if p), 0)
            for i in bounded:
                if reach := weights[i].item():
                    beyond -= (reach if reach.real > 0.0 else -reach) * bounds[i]
            found.append(Leaving(None, [Condition(beyond, 1, names.pop(0))]))
        return found

    @kept
    def impact(self, some: tuple[int, ...], mode: str, factor: Any = None) -> Any:
        """States behind impulses of several elements that take their rates to -factor times these; without one, by the
        restitution of each, of ~k without any; then those of elements that have the number of all added, which take
        their rates to zero and contacts onto their places.

        Of those that keep their rate at zero, as at rest, the rate is zero before it as well."""
        still = tuple(k - len(self.parts) for k in some if k >= len(self.parts))
        some = tuple(k for k in some if k < len(self.parts))
        factors = [0 if k < 0 else self.law(k, "restitution") if factor is None else factor for k in some]
        some = tuple(max(k, ~k) for k in some)
        wanted = [-(1 + e) * self.rate(k, mode) for k, e in zip(some, factors, strict=True)]
        after = self.identity()
        for k, amount in zip(some, self.solved(self.effects(some, mode), wanted) if some else [], strict=True):
            after = self.moved(after, self.parts[k], amount)
        rates = [(self.rate(k, mode), -e * self.rate(k, mode)) for k, e in zip(some, factors, strict=True)]
        after = self.held_exactly(after, rates, states=True)
        after = self.mapped(self.impact(still, mode, 0), after) if still else after
        for k in still:
            after = self.shifted_back(after, self.parts[k].where) if self.parts[k].element.bears else after
        return self.tidy(after)

    def leaving(self, k: int, mode: str, pattern: Pattern) -> list[Leaving]:
        """The ways of element k out of its phase; those that it decides with others have none behind it."""
        here, together = self.place(k, mode, pattern), k in self.rubbing or len(self.together(k, mode, pattern)) > 1
        asked = self.asks and here.element.held and together
        return [*self.thrown(here), *(self.asked(k, mode, pattern) if asked else here.element.leaving(here))]

    def thrown(self, here: Place) -> list[Leaving]:
        """The ways of an element out of the phase in which it is held where an input makes the held rate jump."""
        if here.phase not in here.element.held or not self.driven(here.rate()):
            return []
        rate, off, prefix = here.rate(), CREEP * here.size(here.rate()), f"{here.name}_" if self.asks else ""
        return [
            Leaving(None if self.asks else side or here.element.phases[0], [Condition(rate - sign * off, sign, name)])
            for side, sign, name in zip(here.element.sides, (1, -1), [prefix + one for one in THROWN], strict=True)
        ]
