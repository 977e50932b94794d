"""The labels a result takes from its system: names, units, symbols, equations.

Results lie below the system room, so they read a system through this one record. ``labels_of`` is the
only place that knows which attributes a ``System`` has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class QuantityLabel:
    """A unit and a LaTeX symbol (without dollar signs); a value where it is a parameter."""

    unit: str = "1"
    symbol: str = ""
    value: float | None = None


@dataclass(frozen=True)
class Labels:
    """Names in the order of the arrays' columns, with units; ``text`` is the system's data-only text form."""

    name: str
    states: Mapping[str, QuantityLabel]
    parameters: Mapping[str, QuantityLabel]
    modes: tuple[str, ...]
    transitions: tuple[tuple[int, int], ...]
    indicators: tuple[str, ...]
    outputs: Mapping[str, QuantityLabel] = field(default_factory=dict)
    memory: Mapping[str, QuantityLabel] = field(default_factory=dict)
    time_unit: str = "s"
    is_map: bool = False  # the time counts iterates
    text: str = ""

    @property
    def turn(self) -> str:
        """Word for the time between two returns to a section at a phase."""
        return "iterate" if self.is_map else "forcing period"

    @property
    def transition_labels(self) -> tuple[str, ...]:
        """``source_to_target``, numbered where two transitions join the same modes."""
        plain = [f"{self.modes[a]}_to_{self.modes[b]}" for a, b in self.transitions]
        return tuple(
            label if plain.count(label) == 1 else f"{label}_{plain[: i + 1].count(label)}"
            for i, label in enumerate(plain)
        )


def labels_of(system: Any) -> Labels:
    """The labels of a ``System`` with its present parameter values."""
    states = {name: QuantityLabel(unit or "1") for name, unit in system.states.items()}
    return Labels(
        name=system.name,
        states=states,
        parameters={name: QuantityLabel(p.unit or "1", p.symbol, p.value) for name, p in system.parameters.items()},
        modes=tuple(system.modes),
        transitions=tuple((item.source, item.target) for item in system.transitions),
        indicators=tuple(system.indicators),
        outputs={name: QuantityLabel(unit or "1") for name, unit in system.outputs.items()},
        memory={name: QuantityLabel(unit or "1") for name, unit in system.memory.items()},
        # A system whose states have no units is written in a scaled time; that of a map counts iterates.
        time_unit="s" if any(quantity.unit != "1" for quantity in states.values()) and not system.is_map else "1",
        is_map=system.is_map,
        text=system.to_text(),
    )


def kind_of(period: int, chaotic: bool) -> str:
    """An attractor in a word or two."""
    if period > 0:
        return f"period {period}"
    return "chaos" if chaotic else "no period"


def labelled(dims: Any, values: Any, words: str, unit: str | None = None) -> tuple[Any, Any, dict[str, str]]:
    """A variable of a Dataset with its long name, and its unit where it has one."""
    return dims, values, {"long_name": words} | ({} if unit is None else {"units": unit})
