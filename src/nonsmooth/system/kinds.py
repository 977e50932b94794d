"""Kinds of arguments, as signatures declare them or verbs ask, and the readers that refuse the rest in a sentence.

==============================================  =======================================================
``keep: Annotated[int, at_least(2)] = 100``     a whole number; 3.0 passes for 3; 2.5, True, "3" and NaN do not
``budget: Annotated[float, above(0)] = 60``     a finite number; ``at_least`` as well, both with a largest
``size: Positive``, ``phase: Count``            the usual ones have names
``judge: bool = True``                          yes or no, also 0 and 1 or of NumPy; no word
``side: Literal["up", "down", None] = "up"``    one of these
``rtol: float | None = None``                   that, or None
``range: Range``                                two ends, (low, high)
``box: Mapping[str, float]``                    by name; what it holds is read too
``per_run: Sequence[str]``                      a list, likewise
``orbit: Orbit``                                one of a class
``name: Annotated[str, "its name in quotes"]``  with what to do, for the sentence
``start: Any``                                  not read here
==============================================  =======================================================
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from numbers import Real
from os import PathLike
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import shortened

if TYPE_CHECKING:
    from nonsmooth.system.system import System


Reader = Callable[[Any, str], Any]  # (what was given, the name of the argument) -> what the verb gets

_MOST = 2**53  # whole numbers up to here are exact in floating point


@dataclass(frozen=True)
class Default:
    """The value of an option of a group that is not given; None of one that may be None needs no mark."""

    value: Any


@dataclass(frozen=True)
class Limit:
    """The least and the largest of a number."""

    low: float
    high: float = math.inf
    without_low: bool = False

    def holds(self, number: float) -> bool:
        """Return whether a number is within."""
        return self.low < number <= self.high if self.without_low else self.low <= number <= self.high

    @property
    def words(self) -> str:
        """The limits in words."""
        least = f"above {self.low:g}" if self.without_low else f"at least {self.low:g}"
        least = {"above 0": "positive", "at least 0": "zero or more"}.get(least, least)
        return least if self.high == math.inf else f"{least} and at most {self.high:g}"


#: Two ends, the first below the second.
Range = Annotated[tuple[float, float], "rising"]


def at_least(low: float, most: float = math.inf) -> Limit:
    """No less than ``low``."""
    return Limit(low, most)


def above(low: float, most: float = math.inf) -> Limit:
    """More than ``low``."""
    return Limit(low, most, without_low=True)


#: A number above 0; whole numbers from 0 and from 1 on.
Positive = Annotated[float, above(0)]
Count = Annotated[int, at_least(0)]
Natural = Annotated[int, at_least(1)]


def real_number(value: Any, what: str, kind: str = "a real number") -> float:
    """Return ``value`` as a float, or raise: TypeError for what is no real number, ValueError for NaN and inf."""
    one = getattr(value, "ndim", 0) == 0 and not isinstance(value, str | bytes | complex)  # 0-d arrays are
    if isinstance(value, bool) or not (isinstance(value, Real) or (hasattr(value, "__float__") and one)):
        raise TypeError(f"{what} must be {kind}, not {shortened(value)}")
    try:
        number = float(value)
    except OverflowError:  # a whole number of hundreds of digits
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{what} must be finite, not {number}")
    return number


def whole_number(value: Any, name: str, least: int) -> int:
    """``value`` as an integer of at least ``least``; 3.0 passes, 2.5, True, "3" and NaN do not."""
    number = real_number(value, name, "a whole number")
    if number != int(number) or number < least:
        raise ValueError(f"{name} = {shortened(value)} must be a whole number, at least {least}")
    if number > _MOST:
        raise ValueError(f"{name} = {shortened(value)} is more than can be counted: at most {_MOST}")
    return int(number)


def yes_or_no(value: Any, name: str) -> bool:
    """``value`` as a bool: a word would pass for True, whatever it says."""
    if not isinstance(value, bool | np.bool_ | int | float | np.number) or value not in (0, 1):
        raise TypeError(f"{name} = {shortened(value)}; allowed: True, False")
    return bool(value)


def reader_of(what: Any) -> Reader:
    """The reader of what an annotation allows."""
    origin, parts = get_origin(what), get_args(what)
    if origin is Annotated:
        limit = next((mark for mark in parts if isinstance(mark, Limit)), None)
        hint = next((mark for mark in parts if isinstance(mark, str)), None)
        read = reader_of(parts[0]) if limit is None else _number(parts[0], limit)
        return read if hint is None else _rising if hint == "rising" else _hinted(read, hint)
    if origin in (Union, UnionType):
        some = [part for part in parts if part is not NoneType]
        one = reader_of(some[0]) if len(some) == 1 else _one_of(some)
        return one if len(some) == len(parts) else lambda value, name: None if value is None else one(value, name)
    if origin is tuple:
        return _two_numbers
    if origin is Mapping and parts[1] is not Any:
        of = reader_of(parts[1])
        entries = partial(_instance, kind=Mapping, words="a mapping")
        return lambda value, name: {key: of(one, f"{name}[{key!r}]") for key, one in entries(value, name).items()}
    if origin is Sequence:
        return partial(_sequence, reader=reader_of(parts[0]), words=in_words(what), names=parts[0] is str)
    if origin is Literal:
        return partial(_chosen, choices=parts)
    if what is bool:
        return yes_or_no
    if what in (int, float):
        return _number(what, Limit(-math.inf if what is float else -_MOST))
    kind = origin or what
    if kind is Any or getattr(kind, "_is_protocol", False) or not isinstance(kind, type):
        return lambda value, name: value
    return partial(_instance, kind=kind, words=in_words(what))


def _number(kind: type, limit: Limit) -> Reader:
    def read(value: Any, name: str) -> Any:
        number = whole_number(value, name, int(limit.low)) if kind is int else real_number(value, name)
        if not limit.holds(number):
            raise ValueError(f"{name} = {shortened(value)} must be {limit.words}")
        return value if type(value) is int else number

    return read


def _two_numbers(value: Any, name: str) -> tuple[float, float]:
    if not isinstance(value, list | tuple | np.ndarray) or getattr(value, "shape", None) == () or len(value) != 2:
        raise ValueError(f"{name} = {shortened(value)}: give its two ends, (low, high)")
    low, high = (real_number(end, f"an end of {name}") for end in value)
    return low, high


def _rising(value: Any, name: str) -> tuple[float, float]:
    low, high = _two_numbers(value, name)
    if not low < high:
        raise ValueError(f"{name} = {shortened(value)}: the first end must be below the second")
    return low, high


def _sequence(value: Any, name: str, reader: Reader, words: str, names: bool) -> Sequence[Any]:
    if names and isinstance(value, str):  # one name is a list of one
        return [value]
    if isinstance(value, str | bytes) or not np.iterable(value):
        raise TypeError(f"{name} must be {words}, not {shortened(value)}")
    return [reader(one, f"an entry of {name}") for one in value]


def _hinted(reader: Reader, hint: str) -> Reader:
    def read(value: Any, name: str) -> Any:
        try:
            return reader(value, name)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{error}; {hint}") from None

    return read


def _one_of(kinds: list[Any]) -> Reader:
    """The first that takes the value; a number is no bool here."""
    readers = {kind: reader_of(kind) for kind in kinds}

    def read(value: Any, name: str) -> Any:
        beyond = None
        for kind, reader in readers.items():
            if kind is bool and not isinstance(value, bool | np.bool_):
                continue
            try:
                return reader(value, name)
            except ValueError as error:  # of this kind, but beyond its limits
                beyond = beyond or error
            except TypeError:
                pass
        raise beyond or TypeError(f"{name} must be {' or '.join(map(in_words, kinds))}, not {shortened(value)}")

    return read


def _chosen(value: Any, name: str, choices: tuple[Any, ...]) -> Any:
    if not isinstance(value, str | None) or value not in choices:
        raise ValueError(f"{name} = {shortened(value)}; allowed: {', '.join(map(repr, choices))}")
    return value


def _instance(value: Any, name: str, kind: type, words: str) -> Any:
    if not isinstance(value, kind):
        raise TypeError(f"{name} must be {words}, not {shortened(value)}")
    return value


def in_words(what: Any) -> str:
    """The values that an annotation allows; empty where anything is."""
    origin, parts = get_origin(what), get_args(what)
    if origin is Annotated:
        limits = [f" ({mark.words})" for mark in parts if isinstance(mark, Limit)]
        return "".join([in_words(parts[0]), *limits, *([" (low, high)"] if "rising" in parts else [])])
    if origin in (Union, UnionType):
        return " or ".join(map(in_words, parts))
    if origin is Literal:
        return ", ".join(map(repr, parts))
    if origin in (Mapping, Sequence):
        held = in_words(parts[-1])
        return {Mapping: "a mapping", Sequence: "a list"}[origin] + (f" of {held}" if held else "")
    known: dict[Any, str] = {
        bool: "True, False",
        int: "a whole number",
        float: "a real number",
        str: "text",
        Mapping: "a mapping",
        Callable: "a function",
        PathLike: "a path",
        tuple: "two numbers",
        NoneType: "None",
        Any: "",
    }
    kind = origin or what
    package = kind.__module__.partition(".")[0].replace("nonsmooth", "ns")
    return known.get(kind, f"{package}.{kind.__name__}(...)")


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
    seconds = ": give seconds, (t - t[0]) / np.timedelta64(1, 's')" if array.dtype.kind in "mM" else ""
    raise TypeError(f"{name} must be real numbers, not {shortened(values)}{seconds}")


def swept_values(system: System, parameter: str, values: Any) -> FloatArray:
    """The values of a parameter that is varied, as an array; ValueError, TypeError for one that does not exist, and for
    what is no list of finite numbers, each there once."""
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
