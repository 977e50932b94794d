r"""The smoothed switch (Savi et al. 2007, Eqs. 6-10, and its general form) as a derived hybrid system.

A pair of modes P and Q, Q where all the rows g_r > 0 of a condition hold, gets one more mode for each
row: its band, where g_r is the least of the rows and \|g_r\| < eta. With q = (g_r + eta) / (2 eta) the
field there is (1-q) f_P + q f_Q, or the one the model prescribes (`Band`). The regions

    P: min g <= -eta      band r: |g_r| < eta, g_r least      Q: min g >= eta

are a true partition; a tie of two rows belongs to the first (with c_s = 0 in the paper's system the
two rows are equal everywhere, hence the non-strict rows). The band's half width is a parameter of the
derived system, so that a change of it compiles nothing.

Pairs over other surfaces follow in turn. What led from P and from Q across another surface leads from band to band, so
that bands that cross are smoothed like modes, and each element does its part there.

That is the linear band. With q = (1 + tanh(g_r / eta)) / 2 the band is `REACH` half widths wide, where q is 0 or 1 to
rounding. With q = 1/2 + arctan(g_r / eta) / pi it has no end: one field, the mean of all weighted with products of the
q, holds in every mode, and the declared transitions only say on which side the state is.

Dry friction has a band too: a mode that sticks to the surface between two others is left out, and its friction is that
of the two fields in the band.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.derived.sticking import Additions, joined, without_sticking
from nonsmooth.system.description import Description
from nonsmooth.system.equations import TracedBand
from nonsmooth.system.symbolic.traced import Traced, TracedCondition, TracedTransition

BANDS = ("linear", "tanh", "arctan")
REACH = 19  # half widths beyond which tanh is 1 to rounding


@dataclass(frozen=True)
class Smoothed:
    """The derived system; ``etas`` are its additional parameters and their indicators (None: all),
    ``memory`` the (name, unit) of what the bands remember, and ``apart`` (expression, message) what must
    not be negative for the bands not to overlap."""

    traced: Traced
    etas: tuple[tuple[str, str | None], ...]
    memory: tuple[tuple[str, str], ...]
    apart: tuple[tuple[sp.Expr, str], ...]


@dataclass(frozen=True)
class _ModePair:
    """Two modes between which the field is interpolated, and the conditions by which the inner one is entered."""

    outer: int  # P
    inner: int  # Q, where all rows hold
    rows: tuple[TracedCondition, ...]
    contact: tuple[bool, bool]  # whether one begins where Q is entered, and where P is

    @property
    def ways(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Each mode, and that on the other side."""
        return (self.outer, self.inner), (self.inner, self.outer)


def _label(traced: Traced, a: int, b: int) -> str:
    return " and ".join(repr(traced.mode_names[mode]) for mode in sorted((a, b)))


def _pairs(traced: Traced, surface: Set[int] | None = None) -> list[_ModePair]:
    """Group the transitions into pairs of modes, or say which pair cannot be smoothed; with ``surface``: those whose
    rows are all of these indicators."""
    remaining = [
        jump for jump in traced.transitions if surface is None or all(row.indicator in surface for row in jump.rows)
    ]
    if not remaining:
        raise SystemDefinitionError(f"{traced.name!r} has no transitions: there is nothing to smooth")
    pairs = []
    while remaining:
        a, b = sorted((remaining[0].source, remaining[0].target))
        both = [jump for jump in remaining if {jump.source, jump.target} == {a, b}]
        remaining = [jump for jump in remaining if jump not in both]
        what = f"{traced.name!r} cannot be smoothed between {_label(traced, a, b)}"
        for jump in both:
            if jump.reset is not None:
                raise SystemDefinitionError(
                    f"{what}: {jump.label} has a reset, and a jump has no band; give a rigid stop a stiffness "
                    "(ns.elements.ElasticStop)"
                )
            if jump.at is not None:
                raise SystemDefinitionError(f"{what}: {jump.label} happens at a given time, not at an indicator")
            if jump.writes:
                raise SystemDefinitionError(f"{what}: {jump.label} writes memory, at an instant a band does not have")
        if any(any(traced.lacking[mode]) for mode in (a, b)):
            raise SystemDefinitionError(f"{what}: a mode with fewer states has no field to interpolate")
        ways = [way for way in (_oriented(a, b, both), _oriented(b, a, both)) if way is not None]
        if not ways:
            raise SystemDefinitionError(
                f"{what}: the smoothed switch needs one condition for one of the two modes and, for the way back, only "
                f"transitions that each reverse one sign of it (hysteresis has no band)"
            )
        pairs.append(max(ways, key=lambda way: way.rows[0].sign))  # of one row either will do
    return pairs


def _oriented(outer: int, inner: int, jumps: Sequence[TracedTransition]) -> _ModePair | None:
    """The pair if ``inner`` is entered by one condition and left by reversals of its rows."""
    enter = [jump for jump in jumps if jump.source == outer]
    leave = [jump for jump in jumps if jump.source == inner]
    if len(enter) != 1 or not leave:
        return None
    rows = enter[0].rows
    for jump in leave:
        if len(jump.rows) != 1 or TracedCondition(jump.rows[0].indicator, -jump.rows[0].sign) not in rows:
            return None
    return _ModePair(outer, inner, rows, (enter[0].contact, any(jump.contact for jump in leave)))


class _Bands(Additions):
    """The bands that are added to the sharp system."""

    def __init__(self, description: Description, names: Mapping[str, sp.Symbol], shape: str) -> None:
        super().__init__(description.traced)
        self.description, self.eta_of, self.shape = description, names, shape
        self.memory: list[tuple[str, str]] = []
        self.m = list(self.traced.m)
        self.reach = REACH if shape == "tanh" else 1

    def eta(self, row: TracedCondition) -> sp.Symbol:
        return self.eta_of[self.traced.indicator_names[row.indicator]]

    def share(self, row: TracedCondition) -> sp.Expr:
        """The share q of the field behind a row, at a distance from it."""
        margin, eta = self.margin(row), self.eta(row)
        if self.shape == "tanh":
            return (1 + sp.tanh(margin / eta)) / 2
        if self.shape == "arctan":
            return sp.Rational(1, 2) + sp.atan(margin / eta) / sp.pi
        return (margin + eta) / (2 * eta)

    def margin(self, row: TracedCondition) -> sp.Expr:
        return row.sign * self.traced.indicators[row.indicator]

    def beyond(self, row: TracedCondition, side: int, upward: int) -> TracedCondition:
        """The row ``upward * (g - side * eta) > 0``."""
        eta, times = self.eta(row), f"{self.reach}*" if self.reach > 1 else ""
        name = self.traced.indicator_names[row.indicator]
        shift = -side * row.sign * self.reach  # g - side eta = sign * (h - side * sign * eta)
        label = f"{name} {'+' if shift > 0 else '-'} {times}{str(eta)[2:]}"
        return TracedCondition(
            self.indicator(self.traced.indicators[row.indicator] + shift * eta, label), row.sign * upward
        )

    def least(self, rows: tuple[TracedCondition, ...], r: int) -> tuple[TracedCondition, ...]:
        """Rows saying that row r of these is the least; ties go to the first."""
        found = []
        for s in range(len(rows)):
            if s == r:
                continue
            first, second = (r, s) if r < s else (s, r)
            a, b = rows[first], rows[second]
            ratio = self.eta(a) / self.eta(b)
            names = self.traced.indicator_names
            label = f"{'' if a.sign > 0 else '-'}{names[a.indicator]} {'-' if b.sign > 0 else '+'} {names[b.indicator]}"
            if ratio != 1:
                label += f"*{str(self.eta(a))[2:]}/{str(self.eta(b))[2:]}"
            index = self.indicator(sp.expand(self.margin(a) - ratio * self.margin(b)), label)
            found.append(TracedCondition(index, -1, strict=False) if r < s else TracedCondition(index, 1))
        return tuple(found)

    def band(self, pair: _ModePair, row: TracedCondition) -> tuple[int, tuple[tuple[int, sp.Expr], ...]]:
        """Add the band's mode; return its index and what is written at an entry."""
        name = self.traced.indicator_names[row.indicator]
        label = f"{name}_band"
        if label in self.modes:
            label = f"{name}_band_{self.modes[pair.outer]}_{self.modes[pair.inner]}"
        eta, q = self.eta(row), self.share(row)
        given = self.description.bands if self.shape == "linear" else ()
        own: TracedBand | None = next((band for band in given if band.indicator == row.indicator), None)
        writes = []

        def mixed(a: sp.Expr, b: sp.Expr) -> sp.Expr:
            return a if a == b else (1 - q) * a + q * b

        if own is None:
            field = tuple(map(mixed, self.traced.fields[pair.outer], self.traced.fields[pair.inner]))
        else:
            field = tuple(entry.subs(own.eta, eta) for entry in own.field)
            for key, unit, symbol, value in own.memory:
                if symbol not in self.m:
                    self.m.append(symbol)
                    self.memory.append((key, unit))
                writes.append((self.m.index(symbol), value.subs(own.eta, eta)))
        shown = [mixed(row[pair.outer], row[pair.inner]) for row in self.outputs]
        if own is not None:
            for index, output in own.outputs.items():
                shown[index] = output.subs(own.eta, eta)
        self.mode(label, pair.outer, field, shown)
        return len(self.modes) - 1, tuple(writes)

    def add(self, pairs: Sequence[_ModePair]) -> None:
        """Add the bands of pairs over one surface; what crosses another surface on both sides does so in the band."""
        inside = [{pair.outer, pair.inner} for pair in pairs]
        others = [jump for jump in self.traced.transitions if {jump.source, jump.target} not in inside]
        bands = {(pair.outer, pair.inner): self.add_pair(pair) for pair in pairs}
        self.jumps += others
        leads = {(jump.source, jump.rows): jump.target for jump in others}
        for (outer, inner), own in bands.items():
            for jump in (jump for jump in others if jump.source == outer and (inner, jump.rows) in leads):
                beyond = bands.get((jump.target, leads[inner, jump.rows]), ())
                for source, target in zip(own, beyond, strict=False):
                    self.jump(source, target, *jump.rows, contact=jump.contact)
        self.traced, self.jumps = self.put_in(), []

    def add_pair(self, pair: _ModePair) -> list[int]:
        """Add the bands of a pair, whose modes are returned, and the transitions over their borders."""
        margins = [self.margin(row) for row in pair.rows]  # one that repeats another needs no band of its own
        kept = [r for r, m in enumerate(margins) if all(sp.expand(m - before) != 0 for before in margins[:r])]
        bands = {r: self.band(pair, pair.rows[r]) for r in kept}
        least = {r: self.least(tuple(pair.rows[s] for s in kept), k) for k, r in enumerate(kept)}
        # Between bands first: after a change of a parameter the band must be right before its border is.
        for r in kept:
            for s in kept:
                if r != s:
                    self.jump(bands[r][0], bands[s][0], *least[s], writes=bands[s][1], contact=False)
        for r in kept:
            row = pair.rows[r]
            band, writes = bands[r]
            entering, leaving = pair.contact
            self.jump(band, pair.outer, self.beyond(row, -1, -1), contact=False)
            self.jump(band, pair.inner, self.beyond(row, 1, 1), contact=False)
            self.jump(pair.outer, band, self.beyond(row, -1, 1), *least[r], writes=writes, contact=entering)
            self.jump(pair.inner, band, self.beyond(row, 1, -1), *least[r], writes=writes, contact=leaving)
        return [mode for mode, _ in bands.values()]

    def mix(self, pairs: Sequence[_ModePair]) -> None:
        """Give every mode the mean of all fields, weighted with the product of what each pair says of its mode.

        The weights sum to 1 where the regions are those of one pair or of pairs that cross; else they are divided by
        their sum."""
        known = [sp.Dummy() for _ in pairs]
        weights = [
            sp.Mul(
                *[
                    q if mode == pair.inner else 1 - q
                    for q, pair in zip(known, pairs, strict=True)
                    if mode in (pair.inner, pair.outer)
                ]
            )
            for mode in range(len(self.modes))
        ]
        shares = {q: sp.Mul(*[self.share(row) for row in pair.rows]) for q, pair in zip(known, pairs, strict=True)}
        total = sp.expand(sum(weights)).subs(shares)
        first, others = 0, [weight.subs(shares) / total for weight in weights[1:]]

        def mean(entries: Sequence[sp.Expr]) -> sp.Expr:
            rest = [w * sp.expand(e - entries[first]) for w, e in zip(others, entries[1:], strict=True)]
            return entries[first] + sp.Add(*rest)

        field = tuple(mean(entries) for entries in zip(*self.fields, strict=True))
        self.fields = [field] * len(self.modes)
        self.outputs = [[mean(row)] * len(self.modes) for row in self.outputs]
        self.jumps = list(self.traced.transitions)
        self.traced = self.put_in()


def smooth(description: Description, single: bool, shape: str = "linear") -> Smoothed:
    """Derive the smoothed system, with a ``single`` half width ``eta`` for all indicators or one for each,
    ``eta_<indicator>``, and a ``shape`` of `BANDS`; what cannot be smoothed is refused, the pair of modes named."""
    old, apart = without_sticking(description.traced)
    pairs = _pairs(old)
    wanted = list(dict.fromkeys(old.indicator_names[row.indicator] for pair in pairs for row in pair.rows))
    etas = (("eta", None),) if single else tuple((f"eta_{name}", name) for name in wanted)
    taken = {*description.parameters, *description.states, *description.memory}
    for name, _ in etas:
        if name in taken:
            raise SystemDefinitionError(
                f"{description.name!r} cannot be smoothed: {name!r} is the width of the band and already names "
                f"something else; rename that"
            )
    symbols = {name: sp.Symbol(f"p_{name}", real=True) for name, _ in etas}
    of = {name: symbols["eta" if single else f"eta_{name}"] for name in wanted}
    apart += _check_surfaces(description)
    build = _Bands(replace(description, traced=old), of, shape)
    if shape == "arctan":
        if alone := [name for i, name in enumerate(old.mode_names) if all(i not in (p.outer, p.inner) for p in pairs)]:
            raise SystemDefinitionError(f"{old.name!r} cannot be smoothed: no transition leads to or from {alone[0]!r}")
        build.mix(pairs)
    else:
        apart += _check_apart(build, pairs)
        for surface in joined({row.indicator for row in pair.rows} for pair in pairs):  # one step over each surface
            build.add(_pairs(build.traced, surface))
    traced = replace(
        build.traced,
        p=old.p + tuple(symbols.values()),
        parameter_names=old.parameter_names + tuple(symbols),
        m=tuple(build.m),
        memory_names=old.memory_names + tuple(name for name, _ in build.memory),
    )
    return Smoothed(traced, etas, tuple(build.memory), tuple(apart))


def _check_surfaces(description: Description) -> list[tuple[sp.Expr, str]]:
    """A band has neither static friction nor a field of its own: (expression, message) that must not be negative."""
    found = []
    for surface in description.surfaces:
        modes = _label(description.traced, surface.below, surface.above)
        what = f"{description.name!r} cannot be smoothed between {modes}"
        if surface.field is not None:
            raise SystemDefinitionError(f"{what}: the surface has a `field` of its own, and a band interpolates")
        if surface.static is None:
            continue
        above = f"{what}: the static value exceeds the kinetic one, which a band cannot; make them equal"
        excess = surface.static - 1
        if excess.is_positive or not excess.free_symbols <= set(description.traced.p):
            raise SystemDefinitionError(above)
        found.append((-excess, above))
    return found


def _check_apart(build: _Bands, pairs: Sequence[_ModePair]) -> list[tuple[sp.Expr, str]]:
    """Bands of two pairs that share a mode must cross (of all four modes about the crossing one is the other side of
    another), or be parallel, and then a distance apart."""
    found = []
    own = {band.indicator for band in build.description.bands} if build.shape == "linear" else set()
    for i, one in enumerate(pairs):
        for two in pairs[i + 1 :]:
            if not {one.outer, one.inner} & {two.outer, two.inner}:
                continue
            if not own & {row.indicator for row in one.rows + two.rows} and _cross(one, two, pairs):
                continue
            what = f"the bands between {_label(build.traced, one.outer, one.inner)} and between " + _label(
                build.traced, two.outer, two.inner
            )
            for a in one.rows:
                for b in two.rows:
                    ratio, distance = _distance(build, a, b)
                    if distance is None:
                        raise SystemDefinitionError(
                            f"{build.traced.name!r} cannot be smoothed: {what} overlap where the indicators "
                            f"{build.traced.indicator_names[a.indicator]!r} and "
                            f"{build.traced.indicator_names[b.indicator]!r} vanish together; bands may do so with "
                            'band="arctan"'
                        )
                    room = sp.Abs(distance) - build.reach * (build.eta(a) + sp.Abs(ratio) * build.eta(b))
                    half = f"{1 / (2 * build.reach):.2g} of" if build.reach > 1 else "half"
                    found.append((room, f"{what} overlap; make eta smaller than {half} their distance"))
    return found


def _cross(one: _ModePair, two: _ModePair, pairs: Sequence[_ModePair]) -> bool:
    """Return whether two pairs that share a mode are two sides of a square whose other sides have the same rows."""
    across = {(end, pair.rows, end == pair.inner): other for pair in pairs for end, other in pair.ways}
    (shared,) = {one.outer, one.inner} & {two.outer, two.inner}
    first, second = dict(one.ways)[shared], dict(two.ways)[shared]
    there = across.get((first, two.rows, shared == two.inner))
    return there is not None and there == across.get((second, one.rows, shared == one.inner))


def _distance(build: _Bands, a: TracedCondition, b: TracedCondition) -> tuple[sp.Expr, sp.Expr | None]:
    """Return (ratio, distance) with h_a = ratio * h_b + distance for all states, or distance None."""
    traced = build.traced
    first, second = traced.indicators[a.indicator], traced.indicators[b.indicator]
    symbol = next(iter(sorted(second.free_symbols & set(traced.u), key=str)))
    slope = sp.diff(second, symbol)
    ratio = sp.cancel(sp.diff(first, symbol) / slope)
    distance = sp.expand(first - ratio * second)
    moving = {traced.t, *traced.u, *traced.m}
    if (ratio.free_symbols | distance.free_symbols) & moving or ratio == 0:
        return ratio, None
    return ratio, distance
