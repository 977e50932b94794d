"""Ways between patterns of phases: of one element out of its phase, and as transitions of the whole."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from nonsmooth.system.symbolic.traced import TracedCondition

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.elements.element import Leaving

Conditions = tuple[TracedCondition, ...]


class Out(NamedTuple):
    """A way of an element out of its phase, and its conditions by their numbers; ``way``: the first of the same map."""

    element: int
    way: int
    leaving: Leaving
    rows: Conditions


class Reset(NamedTuple):
    """The change of the states by a transition: the ``way``-th way of an element out of its phase, or an impact of
    several of them (~k: without restitution), with friction or one after the other where it ``rubs``."""

    elements: tuple[int, ...]
    way: int = -1
    rubs: bool = False


class Lead(NamedTuple):
    """A transition between patterns: by the conditions of which element (of one in ``ENDS``, the elements for which
    there is no answer), of what kind, and what it does to the states."""

    source: Pattern
    target: Pattern
    element: str
    rows: Conditions
    kind: str
    change: Reset | None = None
