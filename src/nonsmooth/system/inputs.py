"""Inputs of a system: functions of time that come with a run, such as a measured force.

An input stands as two states, its value and its rate, at the end of a system's own: what is linear between samples is a
motion like any other, and a run changes both at the samples. Functions read them as ``p.<input>``, ``p.<input>_rate``.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.mode import Mode
from nonsmooth.system.transition import Surface, Transition

RATE = "_rate"


def input_states(inputs: Mapping[str, str]) -> dict[str, str]:
    """Names and units of the states that stand for inputs."""
    return {
        name: unit
        for key, own in inputs.items()
        for name, unit in ((key, own), (key + RATE, f"{own}/s" if own else ""))
    }


def with_inputs(given: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a system (``describe``) that have the states of its inputs and their motion."""
    name, inputs = given["name"], given["inputs"]
    for what in ("symmetry", "bands"):
        if given[what]:
            raise SystemDefinitionError(f"{name!r}: a system with inputs has no `{what}`: leave it out")
    more = input_states(inputs)
    rates = [rate for key in inputs for rate in (key + RATE, None)]

    def moved(function: Callable[..., Any]) -> Callable[..., Any]:
        return _longer(function, lambda p: [0.0 if rate is None else p[rate] for rate in rates])

    def kept(function: Callable[..., Any]) -> Callable[..., Any]:
        return _longer(function, lambda p: [p[key] for key in more])

    def of_mode(mode: Any) -> Any:
        if not isinstance(mode, Mode):
            return moved(mode)
        return Mode(moved(mode.field), states=None if mode.states is None else [*mode.states, *more])

    def of_transition(item: Any) -> Any:
        if isinstance(item, Transition) and item.reset is not None:
            return replace(item, reset=kept(item.reset))
        if isinstance(item, Surface) and item.field is not None:
            return replace(item, field=moved(item.field))
        return item

    modes, transitions = given["modes"], given["transitions"]
    return {
        "states": given["states"] | more,
        "modes": {key: of_mode(mode) for key, mode in modes.items()} if isinstance(modes, Mapping) else modes,
        "transitions": [*map(of_transition, transitions)] if isinstance(transitions, Sequence) else transitions,
    }


def _longer(function: Callable[..., Any], more: Callable[[Any], list[Any]]) -> Callable[..., Any]:
    """A function with a vector as its result, and the entries of inputs behind those."""
    if not callable(function):
        return function

    @functools.wraps(function)
    def whole(*arguments: Any) -> Any:
        found = function(*arguments)
        entries = list(found) if hasattr(found, "__iter__") else [found]
        return [*entries, *more(arguments[-1])]

    return whole
