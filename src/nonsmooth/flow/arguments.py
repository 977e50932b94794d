"""Arguments of verbs: each check names the argument, what it was, what is allowed and what to do."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.errors import shortened
from nonsmooth.flow.engines.engine import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = [
    "check_options", "check_system", "ends", "float_array", "real_number", "swept_values", "whole_number", "yes_or_no",
]  # fmt: skip

_MOST = 2**53  # whole numbers up to here are exact in floating point


def check_system(system: Any, verb: str, inputs: bool = False) -> None:
    """TypeError where ``system`` is no System: a name, or a model's function that was not called. ValueError where it
    has ``inputs`` and the verb takes none."""
    from nonsmooth.system.system import System

    if isinstance(system, System):
        if system.inputs and not inputs:
            raise ValueError(
                f"{verb} takes systems without inputs; {system.name!r} has {', '.join(map(repr, system.inputs))}: "
                "simulate, sensitivity and fit take their course; elsewhere write it as a function of t and p"
            )
        return
    name = getattr(system, "__name__", None)
    hint = f"; call it: {name}()" if callable(system) and name else ""
    if isinstance(system, str):
        hint = f"; a ready model is called by its name: ns.models.{system}()"
    raise TypeError(f"{verb} takes an ns.System, not {shortened(system)}{hint}")


def check_options(system: System, given: Mapping[str, Any], verb: Callable[..., Any]) -> None:
    """TypeError for options that are neither the verb's nor an engine's.

    Parameters
    ----------
    given : mapping
        What the verb's own arguments left over.
    verb : callable
        Its signature names what is allowed.
    """
    from nonsmooth.flow.engines.methods import EXPERT
    from nonsmooth.system.names import unknown

    for name in given:
        if name in EXPERT:
            continue
        if name in system.parameters:
            raise TypeError(
                f"`{name}` is a parameter of {system.name!r}, not an option of {verb.__name__}: "
                f"set it with system.with_parameters({name}=...)"
            )
        kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        allowed = [key for key, item in inspect.signature(verb).parameters.items() if item.kind in kinds]
        raise TypeError(unknown(name, "an option", verb.__name__, [*allowed[1:], *EXPERT]))


def real_number(value: Any, name: str) -> float:
    """``value`` as a finite float: TypeError for what is no real number, ValueError for NaN and infinity."""
    from nonsmooth.system.parameter import finite_number

    return finite_number(value, name)


def ends(pair: Any, name: str) -> tuple[float, float]:
    """``pair`` as (low, high), None for no end; TypeError, ValueError for what is none."""
    if not isinstance(pair, list | tuple) or len(pair) != 2:
        raise TypeError(f"bounds of {name!r}: allowed is (low, high), None for no end; not {shortened(pair)}")
    low, high = (
        sign * np.inf if end is None else real_number(end, f"bounds of {name!r}")
        for end, sign in zip(pair, (-1, 1), strict=True)
    )
    if not low < high:
        raise ValueError(f"bounds of {name!r}: {low:g} must be below {high:g}")
    return low, high


def whole_number(value: Any, name: str, least: int) -> int:
    """``value`` as an integer of at least ``least``; 3.0 passes, 2.5, True, "3" and NaN do not."""
    number = real_number(value, name)
    if number != int(number) or number < least:
        raise ValueError(f"{name} = {shortened(value)} must be a whole number, at least {least}")
    if number > _MOST:
        raise ValueError(f"{name} = {shortened(value)} is more than can be counted: at most {_MOST}")
    return int(number)


def yes_or_no(value: Any, name: str) -> bool:
    """``value`` as a bool: a word would pass for True, whatever it says."""
    if not isinstance(value, bool | np.bool_) and value not in (0, 1):
        raise TypeError(f"{name} = {shortened(value)}; allowed: True, False")
    return bool(value)


def float_array(values: Any, name: str) -> FloatArray:
    """``values`` as an array of real numbers of any shape; TypeError for words, complex numbers, ragged lists."""
    try:
        array = np.asarray(values)
        if array.dtype.kind in "fiu":
            return np.array(array, dtype=float)
        if array.dtype.kind == "O":
            return np.array([real_number(value, name) for value in array.ravel()]).reshape(array.shape)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{name} must be real numbers, not {shortened(values)} ({error})") from None
    raise TypeError(f"{name} must be real numbers, not {shortened(values)}")


def swept_values(system: System, parameter: str, values: Any) -> FloatArray:
    """The values of a parameter that is varied, as an array.

    Raises
    ------
    ValueError, TypeError
        A parameter that does not exist; values that are no list of finite numbers, each there once.
    """
    if not isinstance(parameter, str):
        raise TypeError(
            f'the parameter that is varied is given by its name in quotes, as "{next(iter(system.values), "rho")}", '
            f"before its values; not {shortened(parameter)}"
        )
    if parameter not in system.values:
        system.with_parameters({parameter: 0.0})  # raises with the names there are
    numbers = float_array(values, f"values of {parameter!r}")
    if numbers.ndim != 1 or not len(numbers):
        hints = ["for one value write [value]", "give at least one", "give one axis, no mesh of two"]
        hint = f"; {hints[min(numbers.ndim, 2)]}"
        raise ValueError(f"values of {parameter!r} must be a list of numbers, not of shape {numbers.shape}{hint}")
    if not np.isfinite(numbers).all():
        where = int(np.argmin(np.isfinite(numbers)))
        raise ValueError(f"values of {parameter!r} must be finite; number {where} is {numbers[where]}")
    distinct, count = np.unique(numbers, return_counts=True)
    if (count > 1).any():
        twice = distinct[count > 1][0]
        raise ValueError(f"values of {parameter!r} must differ from each other; {twice} is there more than once")
    return numbers
