"""Inputs of a system: functions of time that come with a run, such as a measured force.

An input stands as states at the end of a system's own, its value and its derivatives: two of what is linear between
samples, four of a smooth one, which is a cubic spline. So its course is a motion like any other, and a run changes
these states at the samples. Functions read them as ``p.<input>``, ``p.<input>_rate``, ``p.<input>_rate2``.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.transition import Mode, Surface, Transition

RATES = ("", "_rate", "_rate2", "_rate3")
TIMES = ("", "/s", "/s^2", "/s^3")


def read_inputs(given: Mapping[str, Any], system: str) -> dict[str, Any]:
    """Inputs by their unit, or by it and ``"smooth"``."""
    found: dict[str, Any] = {}
    for key, one in given.items():
        match one:
            case str():
                found[key] = one
                continue
            case [str(), "smooth"]:
                found[key] = tuple(one)
                continue
        raise SystemDefinitionError(
            f"{system!r}: the input {key!r} is given as its unit, or as (unit, 'smooth') where its course is smooth; "
            f"not {shortened(one)}"
        )
    return found


def input_states(inputs: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Of each input, names and units of the states that stand for it."""
    found = {}
    for key, one in inputs.items():
        unit, count = (one, 2) if isinstance(one, str) else (one[0], 4)
        found[key] = {key + r: unit and unit + t for r, t in zip(RATES[:count], TIMES, strict=False)}
    return found


def with_inputs(given: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a system (``describe``) that have the states of its inputs and their motion."""
    name, inputs = given["name"], given["inputs"]
    for what in ("symmetry", "bands"):
        if given[what]:
            raise SystemDefinitionError(f"{name!r}: a system with inputs has no `{what}`: leave it out")
    states = input_states(inputs).values()
    more = {name: unit for own in states for name, unit in own.items()}
    rates = {key: rate for own in states for key, rate in zip(own, (*list(own)[1:], None), strict=True)}

    def moved(function: Callable[..., Any]) -> Callable[..., Any]:
        return _longer(function, lambda p: {key: 0.0 if rate is None else p[rate] for key, rate in rates.items()})

    def kept(function: Callable[..., Any]) -> Callable[..., Any]:
        return _longer(function, lambda p: {key: p[key] for key in more})

    def of_mode(mode: Mode) -> Mode:
        return Mode(moved(mode.field), states=None if mode.states is None else [*mode.states, *more])

    def of_transition(item: Any) -> Any:
        if isinstance(item, Transition) and item.reset is not None:
            return replace(item, reset=kept(item.reset))
        if isinstance(item, Surface) and item.field is not None:
            return replace(item, field=moved(item.field))
        return item

    transitions = given["transitions"]
    return {
        "states": given["states"] | more,
        "modes": {key: of_mode(mode) for key, mode in given["modes"].items()},
        "transitions": [*map(of_transition, transitions)] if isinstance(transitions, Sequence) else transitions,
    }


def _longer(function: Callable[..., Any], more: Callable[[Any], dict[str, Any]]) -> Callable[..., Any]:
    """A function with a vector as its result, and the entries of inputs behind those."""
    if not callable(function):
        return function

    @functools.wraps(function)
    def whole(*arguments: Any) -> Any:
        found = function(*arguments)
        if isinstance(found, Mapping):
            return {**found, **more(arguments[-1])}
        entries = list(found) if hasattr(found, "__iter__") else [found]
        return [*entries, *more(arguments[-1]).values()]

    return whole
