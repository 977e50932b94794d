"""Arguments that take more than a declaration: lists of numbers, ends, the values of a parameter that is varied."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.errors import shortened
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.system.kinds import real_number

if TYPE_CHECKING:
    from nonsmooth.system.system import System


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


def float_array(values: Any, name: str) -> FloatArray:
    """``values`` as an array of real numbers of any shape, NaN where they are masked; TypeError for words, complex
    numbers, ragged lists."""
    try:
        array = np.asarray(values)
        if array.dtype.kind in "fiu":
            found = np.array(array, dtype=float)
            found[np.ma.getmask(values)] = np.nan
            return found
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
    many = values[2] if isinstance(values, list | tuple) and len(values) == 3 else 0
    if isinstance(many, int) and many > 49.0 + 20.0 * np.abs(numbers[:2]).max():
        given = str([*values])[1:-1]
        words = f"{parameter} takes three values, {given}; for many from end to end write np.linspace({given})"
        warnings.warn(words, stacklevel=2)
    distinct, count = np.unique(numbers, return_counts=True)
    if (count > 1).any():
        twice = distinct[count > 1][0]
        raise ValueError(f"values of {parameter!r} must differ from each other; {twice} is there more than once")
    return numbers
