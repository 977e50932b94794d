"""Expressions of a user's system, from calling its functions with symbols.

Everything below the system room reads this record and nothing else: the linearity test, the
derivatives, the code generator, the smoothed switch and the text form.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from nonsmooth.system.derived.decider import Decider
    from nonsmooth.system.derived.patterns import Patterns

ALONE, ASKED, TOGETHER, FOUND = "alone", "asked", "together", "found"  # kinds of transitions of elements
ENDS = ("not_unique", "no_motion")  # of a question without an answer, in the order of their statuses' codes
OWN, ASKS_BEHIND = "own", "asks behind"  # of the system's own beside elements that are asked
NOT_UNIQUE = "_not_unique"  # ends the name of a derived mode from which motion has no unique way on


def along(expression: Expr, t: Symbol, u: Iterable[Symbol], field: Iterable[Expr]) -> Expr:
    """The derivative in time of an expression along a vector field: h_t + h_u f."""
    return expression.diff(t) + sum(expression.diff(symbol) * entry for symbol, entry in zip(u, field, strict=True))


class TracedCondition(NamedTuple):
    """One sign condition: ``sign * indicator > 0`` (``>= 0`` where not strict).

    A non-strict row settles a tie in derived systems (the smoothed switch, the regions of a map): it also holds where
    the indicator vanishes identically.
    """

    indicator: int
    sign: int
    strict: bool = True


@dataclass(frozen=True)
class TracedTransition:
    """An allowed jump from mode ``source`` to mode ``target``.

    It fires at the instant all ``rows`` hold (``rows``), or at the forcing phase ``at`` (in periods, 0..1: a number,
    or an expression of the parameters); one of the two is empty. ``reset`` has one expression per state, or is None
    (identity). ``writes`` are (memory index, expression) pairs, evaluated with the state just before the jump.
    ``contact`` marks the transitions by which a contact begins.
    ``kind`` is that of a transition of elements: ``ALONE`` where one decides by itself what it does next, ``ASKED``
    where several do so together (where it leads is found when it happens), ``TOGETHER`` what is asked where those of
    the rows vanish together with another; ``FOUND`` where such a question has led, one of ``ENDS`` where it has no
    answer: it never fires by its rows. Beside these the system's own are ``OWN``, or ``ASKS_BEHIND`` where they have a
    reset: behind it elements are asked.
    """

    source: int
    target: int
    rows: tuple[TracedCondition, ...]
    at: float | Expr | None = None
    reset: tuple[Expr, ...] | None = None
    writes: tuple[tuple[int, Expr], ...] = ()
    contact: bool = False
    label: str = ""
    kind: str = ""

    @property
    def fires(self) -> bool:
        """Return whether it happens by its rows or at its phase: an answer to a question follows another one."""
        return self.kind not in (TOGETHER, FOUND, *ENDS)


@dataclass(frozen=True)
class Traced:
    """The expressions of a system in its symbols ``t``, ``u``, ``p`` (parameters) and ``m`` (memory).

    ``fields[mode][state]`` is du/dt (0 where ``lacking[mode][state]``: the mode does not have that state),
    ``indicators[i]``, ``outputs[i][mode]``. ``period`` is the forcing period in ``p`` (None: autonomous). Modes behind
    the declared ones may keep indicators at zero: ``along[mode]``. Those of ``idle[mode]`` are of other modes, and
    may have no value in this one.
    """

    name: str
    t: Symbol
    u: tuple[Symbol, ...]
    p: tuple[Symbol, ...]
    m: tuple[Symbol, ...]
    state_names: tuple[str, ...]
    parameter_names: tuple[str, ...]
    memory_names: tuple[str, ...]
    mode_names: tuple[str, ...]
    indicator_names: tuple[str, ...]
    output_names: tuple[str, ...]
    fields: tuple[tuple[Expr, ...], ...]
    lacking: tuple[tuple[bool, ...], ...]
    indicators: tuple[Expr, ...]
    transitions: tuple[TracedTransition, ...]
    outputs: tuple[tuple[Expr, ...], ...]
    period: Expr | None
    along: tuple[frozenset[int], ...] = ()
    idle: tuple[frozenset[int], ...] = ()
    patterns: Patterns | None = field(default=None, repr=False)  # modes are made when they are visited
    decider: Decider | None = field(default=None, compare=False, repr=False)  # what elements decide together

    @property
    def is_map(self) -> bool:
        """Return whether the states change by transitions alone, and the period is 1."""
        return self.period == 1 and all(entry == 0 for field in self.fields for entry in field)

    @property
    def asks(self) -> bool:
        """Return whether elements are asked what they do together (:mod:`nonsmooth.system.derived.deciding`)."""
        return self.known is not None

    @property
    def known(self) -> Any:
        """The keeper of modes and transitions found on the way; None where all stand from the first."""
        return self.patterns or self.decider

    def __hash__(self) -> int:
        """A hash of names and counts: one of all expressions takes milliseconds where there are many modes."""
        names = self.name, self.state_names, self.parameter_names
        return hash((*names, len(self.mode_names), len(self.transitions)))

    def __eq__(self, other: object) -> bool:
        """Compared once, entry by entry: two that are equal remember it, since caches ask again and again."""
        if self is other or not isinstance(other, Traced):
            return self is other
        mine, its = (one.__dict__.get("_mark") for one in (self, other))
        if mine is None or mine is not its:
            if any(getattr(self, one.name) != getattr(other, one.name) for one in fields(self) if one.compare):
                return False
            mark = mine or its or object()
            for one in (self, other):
                object.__setattr__(one, "_mark", mark)
        return True

    def without_answers(self, rows: bool = False) -> tuple[Traced, tuple[int, ...]]:
        """The system without the answers that change states as a transition before them, with ``rows`` one by the same
        conditions, so that nothing is compiled anew; and for each transition the one there that reads the same."""
        if self.decider is None:
            return self, tuple(range(len(self.transitions)))
        kept: list[TracedTransition] = []
        stands: list[int] = []
        known: dict[tuple[object, ...], int] = {}
        for jump in self.transitions:
            key = (jump.reset, *((jump.source, jump.rows) if rows else ()))
            like = known.get(key) if jump.kind == FOUND else None
            stands.append(len(kept) if like is None else like)
            if like is None:
                if not jump.writes:
                    known.setdefault(key, len(kept))
                kept.append(jump)
        return replace(self, transitions=tuple(kept)), tuple(stands)

    def named(self, u: str = "", p: str = "") -> dict[Symbol, str]:
        """Names of the symbols in text; those of states begin with ``u``, those of parameters and memory with ``p``."""
        names = (
            *(u + name for name in self.state_names),
            *(p + n for n in (*self.parameter_names, *self.memory_names)),
        )
        return {self.t: "t", **dict(zip((*self.u, *self.p, *self.m), names, strict=True))}

    def alike(self, k: int, row: int) -> list[int]:
        """Transitions that lead to the same mode by the same map as transition ``k`` where the same row fires: their
        conditions are parts of one. Where a question leads is not known: it is like no other."""
        jump, known = self.transitions[k], self.patterns.changes if self.patterns else []
        if jump.kind in (ASKED, TOGETHER):
            return [k]
        asked = jump.source, jump.target, jump.kind, jump.reset, jump.writes
        return [
            j
            for j, other in enumerate(self.transitions)
            if (other.source, other.target, other.kind, other.reset, other.writes) == asked
            and jump.rows[row] in other.rows
            and (not known or known[j] == known[k])
        ]

    def first_alike(self, k: int, row: int) -> tuple[int, int]:
        """The first of the transitions that are alike, and its row that fires."""
        first = self.alike(k, row)[0]
        return first, self.transitions[first].rows.index(self.transitions[k].rows[row])

    def keeps_at_zero(self, mode: int, indicator: int) -> bool:
        """Return whether motion in a mode slides along the surface of an indicator."""
        return mode < len(self.along) and indicator in self.along[mode]

    def phase_text(self, jump: TracedTransition) -> str:
        """The phase of a transition as it was written."""
        if isinstance(jump.at, int | float):
            return f"{jump.at:g}"
        from nonsmooth.system.symbolic.expressions import write_expression

        assert jump.at is not None
        return write_expression(jump.at, self.named())

    def ends(self, jump: TracedTransition) -> bool:
        """Return whether motion is not unique behind a transition, so that a run ends there."""
        return self.mode_names[jump.target].endswith(NOT_UNIQUE)

    def keeps(self, jump: TracedTransition) -> bool:
        """Return whether a transition leaves every state of its source as it is; states that it lacks may begin."""
        if jump.reset is None:
            return True
        both = zip(jump.reset, self.u, self.lacking[jump.source], self.lacking[jump.target], strict=True)
        return all(before or (new == old and not after) for new, old, before, after in both)
