"""A system as masses on a line and what joins them, read off its equations and its elements.

A coordinate is a state whose derivative is another state, its speed. Springs and dampers are what is linear in the
accelerations: with a diagonal mass matrix entry (i, j) of the stiffness joins the masses i and j, and what a row adds
up to joins its mass to the ground. Contacts and friction are the system's elements or, where it has none, its
transitions: one with a reset at a border of positions is a rigid stop, one without an elastic stop, a surface in speeds
is friction.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import sympy as sp

from nonsmooth.plot.pen import GROUND, Link, Scheme
from nonsmooth.system.derived.expressions import SPEED
from nonsmooth.system.parameter import latex_name

if TYPE_CHECKING:
    from nonsmooth.system.system import System

_LONGEST = 18  # characters of a label that is drawn


def scheme_of(system: System) -> Scheme:
    """The masses and links of a system; ValueError where it has none on a line."""
    return _SchemeReader(system).read()


class _SchemeReader:
    """The equations of a system, from which its masses and links are read."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.loads = loads = system._description.loads
        self.elements, self.powers = ((), {}) if loads is None else (loads.elements, loads.powers)
        t = system._description.traced
        self.t, self.u, self.p = t.t, list(t.u), list(t.p)
        first = self._smooth(t)
        names, driven = list(system.states), set(self.u[system._description.n_own :])
        pairs = [(i, self.u.index(e)) for i, e in enumerate(first) if e in self.u and self.u[i] not in driven | {e}]
        if not pairs:
            raise ValueError(
                f"{system.name!r} has no mass to draw: no state whose derivative is another state, its speed"
            )
        self.names = [(names[i], names[j]) for i, j in pairs]
        self.q, self.v = [self.u[i] for i, _ in pairs], [self.u[j] for _, j in pairs]
        self.acceleration = [first[j] for _, j in pairs]
        self.speeds = [j for _, j in pairs]
        self.still = {one: 0 for one in self.u if one not in driven}
        self.p_of = dict(zip(t.parameter_names, self.p, strict=True))
        self.values = {self.p_of[name]: system.values[name] for name in self.p_of}
        self.latex = {name: one.symbol or latex_name(name) for name, one in system.parameters.items()}
        named = {self.p_of[name]: self.latex[name] for name in self.p_of}
        inputs = {one: latex_name(name) for one, name in zip(self.u, names, strict=True) if one in driven}
        self.symbols = {**named, **inputs, self.t: "t"}

    def _smooth(self, t: Any) -> tuple[Any, ...]:
        """The vector field without contacts: of a system whose surfaces slide what both sides have in common."""
        if self.loads is not None:
            return tuple(next(iter(self.loads.fields.values())))
        if not (surfaces := self.system.surfaces):
            return tuple(t.fields[0])
        sides = zip(t.fields[surfaces[0].below], t.fields[surfaces[0].above], strict=True)
        parts = [[set(sp.Add.make_args(sp.expand(e))) for e in pair] for pair in sides]
        return tuple(sp.Add(*(below & above)) for below, above in parts)

    def read(self) -> Scheme:
        size = len(self.q)
        stiffness, damping = (
            [[-sp.diff(a, x).subs(self.still) for x in some] for a in self.acceleration] for some in (self.q, self.v)
        )
        masses = self.masses = self._masses(stiffness, damping)
        self.scheme = Scheme(self.names, [self.text(m) if m is not None else "" for m in masses])
        for kind, table in (("spring", stiffness), ("damper", damping)):
            for i in range(size):
                of = masses[i] if masses[i] is not None else sp.Integer(1)
                row = [sp.expand(of * entry) for entry in table[i]]
                if not self.is_zero(*row):
                    self.join(kind, GROUND, i, self.text(sp.expand(sp.Add(*row))))
                for j in range(i):
                    if not self.is_zero(row[j]):
                        self.join(kind, j, i, self.text(-row[j]))
        self._forces()
        for load in self.elements:
            self._element(load)
        if not self.elements:
            self._transitions()
        if not self.scheme.links:
            raise self._off("nothing joins them")
        return self.scheme

    def join(self, *given: Any, **more: Any) -> None:
        """Add a link."""
        self.scheme.links.append(Link(*given, **more))

    # Expressions

    def text(self, e: Any) -> str:
        """An expression as LaTeX without dollar signs, numbers with four digits; nothing where it is long."""
        e = sp.sympify(e)
        if e.is_number:
            return f"{float(e):.4g}"
        four = {n: float(f"{float(n):.4g}") for n in e.atoms(sp.Float)}
        short = {n: sp.Integer(int(v)) if v == int(v) else sp.Float(v, 4) for n, v in four.items()}
        found = str(sp.latex(e.xreplace(short), symbol_names=self.symbols, fold_short_frac=True, mul_symbol=r"\,"))
        seen = re.sub(r"\\[a-zA-Z]+", "x", re.sub(r"\\(left|right|mathrm|frac|(?=cos|sin))", "", found))
        return found if len(re.sub(r"[{}_^ ]|\\,", "", seen)) <= _LONGEST else ""

    def is_zero(self, *terms: Any) -> bool:
        """Return whether a sum of terms is zero within rounding."""
        parts = [sp.expand(e).as_coefficients_dict() for e in map(sp.sympify, terms)]
        sums = [[part[one] for part in parts] for one in {one for part in parts for one in part}]
        return bool(all(abs(sum(each)) <= 1e-12 * max(map(abs, each)) for each in sums)) or sp.simplify(sum(terms)) == 0

    def number(self, e: Any) -> float:
        """The value at the present parameters and t = 0; NaN where it has none."""
        try:
            return float(sp.sympify(e).subs({**self.values, **self.still, self.t: 0}))
        except TypeError:
            return float("nan")

    # Masses

    def _masses(self, stiffness: Any, damping: Any) -> list[Any]:
        """The masses where a force, a damper or an element tells them, else the denominators of the accelerations."""
        size = len(self.q)
        found: list[Any] = [None] * size
        powers = self.powers
        if powers:
            drag, push = powers.get("damping", sp.Integer(0)), powers.get("forcing", sp.Integer(0))
            table = [[sp.diff(drag, a, b) / 2 for b in self.v] for a in self.v]
            for i, v in enumerate(self.v):
                loaded = self.acceleration[i].subs(self.still)
                if table[i][i] != 0 and damping[i][i] != 0:
                    found[i] = sp.simplify(table[i][i] / damping[i][i])
                elif loaded != 0 and "base" not in powers:
                    found[i] = sp.simplify(sp.diff(push, v) / loaded)
            pairs = [(i, j) for i in range(size) for j in range(size) if found[i] is not None]
            if 0 in found or not all(self.is_zero(table[i][j], -found[i] * damping[i][j]) for i, j in pairs):
                raise self._off("its mass matrix is not diagonal")
        for load in self.elements:
            if load.kind == "Rubbing":
                raise self._off(f"the contact {load.rubs!r} rubs along another coordinate")
            along = self.v if load.element.kinematics == "speed" else self.q
            for i in range(size):
                weight, effect = sp.diff(load.where, along[i]), load.direction.get(self.speeds[i], 0)
                if powers and (weight == 0) != (effect == 0):
                    raise self._off("its mass matrix is not diagonal")
                if found[i] is None and weight != 0 and effect != 0:
                    found[i] = sp.simplify(weight / effect)
        for _ in range(size):  # a spring between two masses tells one from the other
            for i in range(size):
                for j in range(size):
                    a, b = stiffness[i][j], stiffness[j][i]
                    if i != j and found[i] is None and found[j] is not None and a != 0 and b != 0:
                        found[i] = sp.simplify(found[j] * b / a)
        if not powers:
            for i, a in enumerate(self.acceleration):
                if found[i] is None:
                    found[i] = sp.denom(sp.together(a))
        return [m if m is not None and m.free_symbols <= set(self.p) else None for m in found]

    def _off(self, why: str) -> ValueError:
        return ValueError(f"{self.system.name!r} has no sketch, its coordinates are no masses on a line: {why}")

    def _forces(self) -> None:
        """Forces on masses, and the motion of the base."""
        if "base" in self.powers:
            self.scheme.base = r"\ddot y"
        for i, v in enumerate(self.v):
            if "forcing" in self.powers:
                force = sp.diff(self.powers["forcing"], v)
            else:
                force = sp.expand(self.acceleration[i].subs(self.still) * (self.masses[i] or 1))
            if force != 0 and not force.has(sp.zoo, sp.nan):
                self.scheme.forces[i] = self.text(force) or "F(t)"

    # Elements

    def _element(self, load: Any) -> None:
        speed = load.element.kinematics == "speed"
        place = self._place(load.where, self.v if speed else self.q)
        if place is None:
            if any(sp.diff(load.where, x).has(*self.u) for x in (*self.q, *self.v)):
                raise self._off(f"the element {load.name!r} follows a curve")
            self.scheme.others.append(f"{load.name}: {load.text}")
            return
        weights, rest = place
        left, right = self._ends(weights)
        named = {key: self.p_of.get(load.options.get(key)) for key in load.element.laws}
        laws = {key: e for key, e in {**named, **load.laws}.items() if e is not None}
        law = {key: "f(v)" if sp.sympify(e).has(SPEED) else self.text(e) for key, e in laws.items()}
        match load.kind:
            case "Stop" | "ElasticStop":
                kind, key = ("stop", "restitution") if load.kind == "Stop" else ("elastic", "stiffness")
                label = f"e = {law[key]}" if kind == "stop" and law[key][:1].isdigit() else law[key]
                self._contact(kind, weights, rest, label, laws.get("damping", 0) != 0)
            case "Coulomb":
                words = "" if self.is_zero(rest) else self.text(-rest)
                self.join("friction", left, right, law["friction"], words=words)
            case "Backlash":
                half, words = self.number(laws["half_width"]), law["half_width"]
                self.join("backlash", left, right, law["stiffness"], words=words, half=half)
            case "PreloadedSpring":
                label = r",\ ".join(filter(None, (law["preload"], law["stiffness"])))
                self.join("preload", left, right, label)

    def _place(self, where: Any, along: list[Any]) -> tuple[dict[int, int], Any] | None:
        """Weights of one or two masses, of size one, and what is left; None for all else."""
        weights = {i: sp.simplify(sp.diff(where, x)) for i, x in enumerate(along)}
        weights = {i: w for i, w in weights.items() if w != 0}
        signs = {i: int(w) for i, w in weights.items() if w in (1, -1)}
        fits = len(signs) == len(weights) in (1, 2) and (len(signs) == 1 or sum(signs.values()) == 0)
        rest = sp.expand(where - sp.Add(*[w * along[i] for i, w in weights.items()]))
        return (signs, rest) if fits and not rest.free_symbols & set(self.u) else None

    @staticmethod
    def _ends(weights: dict[int, int]) -> tuple[int, int]:
        return (GROUND, next(iter(weights))) if len(weights) == 1 else (min(weights), max(weights))

    def _contact(self, kind: str, weights: dict[int, int], rest: Any, label: str, damped: bool) -> None:
        """Add a contact by its gap: that of one mass is on its right where the gap falls with the coordinate."""
        left, right = self._ends(weights)
        pulls = False
        if left == GROUND:
            left, right = (right, GROUND) if weights[right] < 0 else (GROUND, right)
        else:
            pulls = weights[right] < 0
        moves = (lambda t: self.number(rest.subs(self.t, t))) if rest.has(self.t) else None
        words = self.text(rest) if rest != 0 else ""
        self.join(kind, left, right, label, self.number(rest), words, damped=damped, pulls=pulls, gap_at=moves)

    # Transitions of a system's own

    def _transitions(self) -> None:
        t = self.system._description.traced
        seen: set[Any] = set()
        for jump in t.transitions:
            for row in jump.rows:
                h = row.sign * t.indicators[row.indicator]
                if h in seen or -h in seen or h.has(*self.v):
                    continue
                place = self._place(-h, self.q)
                if place is None or not (jump.reset is not None or jump.source == 0):
                    continue
                seen.add(h)
                i = max(place[0])
                if jump.reset is not None:
                    e = -sp.diff(jump.reset[self.speeds[i]], self.v[i])
                    label = self.text(e)
                    self._contact("stop", *place, f"e = {label}" if e.is_number else label, False)
                    continue
                force = sp.expand(t.fields[jump.target][self.speeds[i]] - t.fields[jump.source][self.speeds[i]])
                stiff = -sp.diff(force, self.q[i]) * (self.masses[i] or 1)
                label = self.text(sp.simplify(stiff))
                self._contact("elastic", *place, label, force.has(*self.v))
        for surface in self.system.surfaces:
            place = self._place(t.indicators[surface.indicator], self.v)
            if place is not None:
                words = "" if self.is_zero(place[1]) else self.text(-place[1])
                self.join("friction", *self._ends(place[0]), "", words=words)
