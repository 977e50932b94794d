"""Modes, indicators and transitions that a derived system adds to the one it is made of."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import sympy as sp

from nonsmooth.system.symbolic.traced import Traced, TracedCondition, TracedTransition


class Additions:
    """A system as lists that grow; its own transitions are left out."""

    def __init__(self, traced: Traced) -> None:
        self.traced = traced
        self.modes, self.fields = list(traced.mode_names), list(traced.fields)
        self.outputs = [list(row) for row in traced.outputs]
        self.indicator_names, self.indicators = list(traced.indicator_names), list(traced.indicators)
        self.jumps: list[TracedTransition] = []

    def indicator(self, expression: sp.Expr, name: str) -> int:
        """Index of a derived indicator, added where it is new."""
        if name not in self.indicator_names:
            self.indicator_names.append(name)
            self.indicators.append(expression)
        return self.indicator_names.index(name)

    def jump(
        self, source: int, target: int, *rows: TracedCondition, writes: tuple[tuple[int, sp.Expr], ...] = ()
    ) -> None:
        """Add a transition."""
        label = f"{self.modes[source]} -> {self.modes[target]}"
        self.jumps.append(TracedTransition(source, target, rows, None, None, writes, source == 0, label))

    def put_in(self, **more: Any) -> Traced:
        """The derived system; ``more``: its other fields that differ."""
        return replace(
            self.traced,
            mode_names=tuple(self.modes),
            fields=tuple(self.fields),
            indicator_names=tuple(self.indicator_names),
            indicators=tuple(self.indicators),
            transitions=tuple(self.jumps),
            outputs=tuple(tuple(row) for row in self.outputs),
            **more,
        )
