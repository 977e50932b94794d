"""Requests to the worker: one for each view of a state."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonsmooth.explorer.state import State

__all__ = ["base_of", "key_of", "motion_of"]


def base_of(text: str, state: State, start: Sequence[float]) -> dict[str, dict[str, Any]]:
    """Requests for the orbit and for a sweep from ``start``, of which views make theirs; ``text`` is the system's."""
    base = {
        "text": text, "values": dict(state.values), "method": state.method,
        "eta": state.eta if state.method == "smoothed" else 0.0, "transient": state.transient, "keep": state.keep,
    }  # fmt: skip
    orbit = {**base, "view": "orbit", "start": list(state.start)}
    sweep = {
        **base, "view": "first look", "values": {**state.values, state.over: state.low}, "over": state.over,
        "low": state.low, "high": state.high, "columns": state.columns,
        "begin": list(start),
    }  # fmt: skip
    return {"orbit": orbit, "first look": sweep}


def motion_of(orbit: Mapping[str, Any], results: Mapping[str, Any]) -> dict[str, Any]:
    """The request of the orbit, with its period number and the time that its record takes."""
    run = results["run"]["time"].values
    return {
        **orbit, "period": int(results["judged"]["period_number"].values[0]),
        "span": float(run[-1] - run[0]),
    }  # fmt: skip


def key_of(request: Mapping[str, Any]) -> str:
    """Text by which two requests are the same; a recording stands in it as its ``key``."""
    return json.dumps(request, sort_keys=True, default=lambda one: one.key)
