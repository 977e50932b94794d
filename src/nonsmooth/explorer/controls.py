"""Content of the page's controls: models, parameters with their sliders, choices, legend."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.export import KINDS
from nonsmooth.explorer.kinds import SETTINGS, setting
from nonsmooth.explorer.labels import html_of, plain_of, symbols_of
from nonsmooth.explorer.presets import GIVEN, PAPER, first_state, presets_of, slider_range
from nonsmooth.explorer.state import CHOICES, to_query

if TYPE_CHECKING:
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.views.view import View
    from nonsmooth.system.system import System

__all__ = ["controls"]


def controls(system: System, state: State, models: Iterable[str], views: Mapping[str, View]) -> dict[str, Any]:
    """Content of the controls for a state."""
    fields = {name: one for name, one in SETTINGS.items() if one.label}
    symbols, first = symbols_of(system), first_state(state.model, system)
    rows = []
    for name, parameter in system.parameters.items():
        value = state.values[name]
        also = (value, state.low, state.high) if name == state.over else (value,)
        low, high = slider_range(first.values[name], also)
        rows.append({
            "name": name, "html": html_of(symbols[name]), "unit": parameter.unit, "value": value, "low": low,
            "high": high,
        })  # fmt: skip
    return {
        "models": {name: "your system" if name == GIVEN else name.replace("_", " ") for name in models},
        "presets": list(presets_of(state)), "paper": state.model == PAPER, "parameters": rows,
        "states": [
            {"name": name, "html": html_of(symbols[name]), "plain": plain_of(symbols[name]), "unit": unit,
             "value": value}
            for (name, unit), value in zip(system.states.items(), state.start, strict=True)
        ],
        "plain": {name: plain_of(symbols[name]) for name in system.parameters},
        "choices": CHOICES, "kinds": KINDS,
        "state": {key: value for key, value in vars(state).items() if key not in ("values", "settings")},
        "query": to_query(state), "forced": system.period() is not None,
        "legends": {name: view.legend() for name, view in views.items()},
        "settings": {name: setting(name, system, state) for name in fields},
        "words": {name: one.choices(system, state) for name, one in fields.items() if one.choices is not None},
    }  # fmt: skip
