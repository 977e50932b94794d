"""Arguments of verbs: what each may be stands in the signature, and one decorator, :func:`checked`, reads it.

==============================================  =======================================================
``keep: Annotated[int, at_least(2)] = 100``     a whole number; 3.0 passes for 3; 2.5, True, "3" and NaN do not
``budget: Annotated[float, above(0)] = 60``     a finite number; ``at_least``, ``within`` as well
``judge: bool = True``                          yes or no, also 0 and 1 or of NumPy; no word
``side: Literal["up", "down", None] = "up"``    one of these
``rtol: float | None = None``                   that, or None
``range: Range``                                two ends, (low, high)
``box: Mapping[str, float]``                    by name; what it holds is read too
``orbit: Orbit``                                one of a class
``name: Annotated[str, "its name in quotes"]``  with what to do, for the sentence
``start: Any``                                  not read here
==============================================  =======================================================

What verbs share is a ``TypedDict`` of such declarations, a group: a verb takes it as ``**options: Unpack[Group]``, its
users write plain keywords, signature and docstring show them, and the verb receives one record with all its keys.
"""

from __future__ import annotations

import inspect
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from inspect import Parameter
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints, overload
from typing import is_typeddict as is_group

import numpy as np

from nonsmooth.errors import shortened
from nonsmooth.system.names import unknown
from nonsmooth.system.parameter import finite_number as real_number

__all__ = [
    "Default",
    "above",
    "at_least",
    "check_system",
    "checked",
    "declared",
    "entries",
    "reader_of",
    "real_number",
    "whole_number",
    "within",
    "yes_or_no",
]  # fmt: skip

Verb = Callable[..., Any]
F = TypeVar("F", bound=Verb)
Reader = Callable[[Any, str], Any]  # (what was given, the name of the argument) -> what the verb gets

_MOST = 2**53  # whole numbers up to here are exact in floating point
_NEEDED = Parameter.empty  # the default of what must be given


@dataclass(frozen=True)
class Default:
    """The value of an option of a group that is not given; None of one that may be None needs no mark."""

    value: Any


@dataclass(frozen=True)
class Limit:
    """The least and the largest of a number, in words too."""

    words: str
    low: float = -math.inf
    high: float = math.inf
    without_low: bool = False

    def holds(self, number: float) -> bool:
        """Return whether a number is within."""
        return self.low < number <= self.high if self.without_low else self.low <= number <= self.high


#: Two ends, the first below the second.
Range = Annotated[tuple[float, float], "rising"]


def at_least(low: float) -> Limit:
    """No less than ``low``."""
    return Limit(f"at least {low:g}" if low else "zero or more", low)


def above(low: float) -> Limit:
    """More than ``low``."""
    return Limit(f"above {low:g}" if low else "positive", low, without_low=True)


def within(low: float, high: float) -> Limit:
    """From ``low`` to ``high``, both included."""
    return Limit(f"within {low:g} ... {high:g}", low, high)


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
    if not isinstance(value, bool | np.bool_ | int | float | np.number) or value not in (0, 1):
        raise TypeError(f"{name} = {shortened(value)}; allowed: True, False")
    return bool(value)


def check_system(system: Any, verb: str, inputs: bool = False) -> Any:
    """``system``; TypeError for what is none (a name, a model's function that was not called), ValueError for one with
    ``inputs`` where the verb takes none."""
    from nonsmooth.system.system import System

    if isinstance(system, System):
        if system.inputs and not inputs:
            raise ValueError(
                f"{verb} takes systems without inputs; {system.name!r} has {', '.join(map(repr, system.inputs))}: "
                "simulate, sensitivity and fit take their course; elsewhere write it as a function of t and p"
            )
        return system
    name = getattr(system, "__name__", None)
    hint = f"; call it: {name}()" if callable(system) and name else ""
    if isinstance(system, str):
        hint = f"; a ready model is called by its name: ns.models.{system}()"
    raise TypeError(f"{verb} takes an ns.System, not {shortened(system)}{hint}")


@overload
def checked(function: F) -> F: ...
@overload
def checked(*, of: Verb | None = None, read: bool = True, **defaults: Any) -> Callable[[F], F]: ...


def checked(function: Any = None, *, of: Verb | None = None, read: bool = True, **defaults: Any) -> Any:
    """Decorate a verb: its arguments are read as its signature declares them, or refused in a sentence.

    A call that does not fit is answered with how the verb is called, a misspelt name with the nearest.

    Parameters
    ----------
    function : callable
        An argument ``system: System`` is checked by :func:`check_system`.
    of : callable, optional
        A checked verb whose further arguments are this one's ``**options``.
    read : bool
        False: names are checked alone, what is given is the function's own to read.
    **defaults
        Of options of the group, where they differ in this verb.
    """

    def decorated(function: F) -> F:
        door = _Door(function, of, defaults)
        if not read:
            door.readers = {}

        @wraps(function)
        def called(*given: Any, **named: Any) -> Any:
            n = len(door.nameless)
            return function(*given[:n], **door.read(given[n:], named))

        called.__doc__ = door.documentation()
        called.__signature__, called.door = door.signature, door  # type: ignore[attr-defined]
        return cast(F, called)

    if isinstance(function, type):  # a class: the arguments of its objects
        function.__init__ = decorated(function.__init__)  # type: ignore[misc]
        return function
    return decorated if function is None else decorated(function)


class _Door:
    """The arguments of a verb: its own, those of its group or of the verb behind it, and the reader of each."""

    def __init__(self, function: Verb, of: Verb | None, defaults: Mapping[str, Any]) -> None:
        own = inspect.signature(function)
        self.function, self.verb = function, function.__qualname__.removesuffix(".__init__")
        self.nameless = [name for name, item in own.parameters.items() if item.kind is item.POSITIONAL_ONLY]
        self.items = {name: item for name, item in own.parameters.items() if name not in self.nameless}
        rest = next((item for item in self.items.values() if item.kind is item.VAR_KEYWORD), None)
        self.items.pop(rest.name if rest else "", None)
        self.group = None if rest is None else _group(rest.annotation, function)
        self.behind: _Door | None = getattr(of, "door", None)
        others = inspect.signature(of).parameters.values() if of else _parameters(self.group, defaults)
        others = [item.replace(kind=item.KEYWORD_ONLY) for item in others if item.name not in self.items]
        self.items |= {item.name: item for item in others}
        self.takes_any = rest is not None and not others
        first, last = [own.parameters[name] for name in self.nameless], [rest] if rest and self.takes_any else []
        self.signature = own.replace(parameters=[*first, *self.items.values(), *last])
        self.shared = {item.name: item.default for item in others}
        self.positional = [name for name, item in self.items.items() if item.kind is not item.KEYWORD_ONLY]
        self.needed = [name for name, item in self.items.items() if item.default is _NEEDED]

    def read(self, given: tuple[Any, ...], named: Mapping[str, Any]) -> dict[str, Any]:
        """The arguments as read, with defaults of what is shared."""
        values = dict(zip(self.positional, given, strict=False))
        twice = values.keys() & named
        values |= named
        unknown_ = not self.takes_any and not values.keys() <= self.items.keys()
        if twice or unknown_ or len(given) > len(self.positional) or not values.keys() >= set(self.needed):
            raise TypeError(self.misfit(given, named, values))
        readers = self.readers
        return self.shared | {
            name: readers[name](value, name) if name in readers else value for name, value in values.items()
        }  # no reader: of a verb that takes any names

    @cached_property
    def kinds(self) -> dict[str, Any]:
        """The type of each argument, as its annotation says."""
        shared = get_type_hints(self.group, include_extras=True) if self.group else {}
        if self.behind:
            shared = {name: self.behind.kinds[name] for name in self.shared}
        own = {name: item.annotation for name, item in self.items.items() if name not in shared and name != "self"}
        return {name: _evaluated(annotation, self.function) for name, annotation in own.items()} | shared

    @cached_property
    def readers(self) -> dict[str, Reader]:
        """The reader of each argument; made in the first call."""
        found = {name: reader_of(kind) for name, kind in self.kinds.items()}
        if "system" in found:
            found["system"] = lambda value, _: check_system(value, self.verb, "inputs" in self.items)
        return found

    def misfit(self, given: tuple[Any, ...], named: Mapping[str, Any], values: Mapping[str, Any]) -> str:
        """The sentence for a call that does not fit the signature."""
        own = [name for name in (*self.nameless, *self.positional) if name != "self"]
        options = [name for name in self.items if name not in self.positional]
        usage = f"{self.verb}({', '.join([*own, *(f'{name}=' for name in options or ['name'])])})"
        if len(given) > len(self.positional):
            count = f"{len(own) or 'no'} argument{'s' * (len(own) != 1)}"
            number = len(given) + len(own) - len(self.positional)
            over = shortened(given[len(self.positional)])
            return f"{self.verb} takes {count} by position, not {number}: give {over} by its name; {usage}"
        if missing := [name for name in self.needed if name not in values]:
            return f"{self.verb} needs {' and '.join(missing)}: {usage}"
        for name in named:
            if name not in self.items and not self.takes_any:
                system = values.get("system")
                if name in getattr(system, "parameters", ()):
                    return (
                        f"`{name}` is a parameter of {getattr(system, 'name', '')!r}, not an option of {self.verb}: "
                        f"set it with system.with_parameters({name}=...)"
                    )
                known = [one for one in self.items if one not in ("self", "system")]
                return unknown(name, "an option", self.verb, known)
        twice = next(name for name in named if name in self.positional[: len(given)])
        return f"{self.verb}: {twice} is given twice, by position and by its name; {usage}"

    def documentation(self) -> str | None:
        """The docstring, with what is shared written into its list of parameters."""
        text = inspect.cleandoc(self.function.__doc__ or "")
        behind = None if self.behind is None else self.behind.documentation()
        groups = vars(sys.modules[self.group.__module__]).values() if self.group else ()
        there = {name for names in entries(text) for name in names}
        added = [
            "\n".join([head, *lines])
            for doc in (behind, *(one.__doc__ for one in groups if is_group(one)))
            for names, (head, lines) in entries(doc).items()
            if names[0] in self.items and names[0] not in there
        ]
        parameters = _PARAMETERS.search(text)
        if not added or parameters is None:
            return text or None
        return "\n".join([text[: parameters.end()].rstrip(), *added]) + text[parameters.end() :]


_PARAMETERS = re.compile(r"^Parameters\n-+\n(?:(?!\n+\w[\w ]*\n-{3,}).)*", re.MULTILINE | re.DOTALL)


def declared(function: Verb) -> dict[str, Any]:
    """The values that each argument of a verb, or of a class, may have, as declared."""
    door = getattr(getattr(function, "__init__") if isinstance(function, type) else function, "door", None)  # noqa: B009
    return get_type_hints(function, include_extras=True) if door is None else dict(door.kinds)


def entries(doc: str | None) -> dict[tuple[str, ...], tuple[str, list[str]]]:
    """The list of parameters of a numpydoc docstring: names -> (head, lines of text)."""
    section = _PARAMETERS.search(inspect.cleandoc(doc or ""))
    found: dict[tuple[str, ...], tuple[str, list[str]]] = {}
    names: tuple[str, ...] = ()
    for line in section.group().splitlines()[2:] if section else ():
        if line and not line.startswith(" "):
            names = tuple(name.strip() for name in line.partition(" : ")[0].split(","))
            found[names] = (line, [])
        elif names:
            found[names][1].append(line)
    return found


def _evaluated(annotation: Any, function: Verb) -> Any:
    """The type that an annotation means; Any where it names what is imported for type checkers alone."""
    try:
        return eval(annotation, inspect.unwrap(function).__globals__) if isinstance(annotation, str) else annotation
    except NameError:
        return Any


def _group(annotation: Any, function: Verb) -> Any:
    """The group of ``**options: Unpack[Group]``."""
    parts = get_args(_evaluated(annotation, function))
    return parts[0] if parts and is_group(parts[0]) else None


def _parameters(group: Any, defaults: Mapping[str, Any]) -> list[Parameter]:
    """The options of a group as keywords of a signature, annotated as they are written."""
    found = []
    for name, hint in get_type_hints(group, include_extras=True).items() if group else ():
        default = next((mark.value for mark in get_args(hint) if isinstance(mark, Default)), None)
        written = str(getattr(group.__annotations__[name], "__forward_arg__", hint))
        written = re.sub(r"Annotated\[(.*), Default\(.*\)\]", r"\1", written)
        written = f"Annotated[{written}]" if any(isinstance(mark, Limit) for mark in get_args(hint)) else written
        default = defaults.get(name, default)
        found.append(Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=written))
    return found


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
        return lambda value, name: _mapping(value, name, reader_of(parts[1]))
    if origin is Literal:
        return lambda value, name: _chosen(value, name, parts)
    if what is bool:
        return yes_or_no
    if what in (int, float):
        return _number(what, Limit("", -_MOST))
    kind = origin or what
    if kind in (Any, Sequence) or getattr(kind, "_is_protocol", False) or not isinstance(kind, type):
        return lambda value, name: value
    return lambda value, name: _instance(value, name, kind, what)


def _number(kind: type, limit: Limit) -> Reader:
    def read(value: Any, name: str) -> Any:
        number = whole_number(value, name, int(limit.low)) if kind is int else real_number(value, name)
        if not limit.holds(number):
            raise ValueError(f"{name} = {shortened(value)} must be {limit.words}")
        return value if type(value) is int else number

    return read


def _two_numbers(value: Any, name: str) -> tuple[float, float]:
    if not isinstance(value, list | tuple | np.ndarray) or len(value) != 2:
        raise ValueError(f"{name} = {shortened(value)}: give its two ends, (low, high)")
    low, high = (real_number(end, f"an end of {name}") for end in value)
    return low, high


def _rising(value: Any, name: str) -> tuple[float, float]:
    low, high = _two_numbers(value, name)
    if not low < high:
        raise ValueError(f"{name} = {shortened(value)}: the first end must be below the second")
    return low, high


def _mapping(value: Any, name: str, reader: Reader) -> dict[Any, Any]:
    return {key: reader(one, f"{name}[{key!r}]") for key, one in _instance(value, name, Mapping, Mapping).items()}


def _hinted(reader: Reader, hint: str) -> Reader:
    def read(value: Any, name: str) -> Any:
        try:
            return reader(value, name)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{error}; {hint}") from None

    return read


def _one_of(kinds: list[Any]) -> Reader:
    """The first that takes the value; a number is no bool here."""
    readers = [reader_of(kind) for kind in kinds]

    def read(value: Any, name: str) -> Any:
        wrong: Exception = TypeError(f"{name} must be {' or '.join(map(_words, kinds))}, not {shortened(value)}")
        for kind, reader in zip(kinds, readers, strict=True):
            if kind is bool and not isinstance(value, bool | np.bool_):
                continue
            try:
                return reader(value, name)
            except ValueError as error:  # of this kind, but beyond its limits
                wrong = wrong if isinstance(wrong, ValueError) else error
            except TypeError:
                pass
        raise wrong

    return read


def _chosen(value: Any, name: str, choices: tuple[Any, ...]) -> Any:
    if not isinstance(value, str | None) or value not in choices:
        raise ValueError(f"{name} = {shortened(value)}; allowed: {', '.join(map(repr, choices))}")
    return value


def _instance(value: Any, name: str, kind: type, what: Any) -> Any:
    if not isinstance(value, kind):
        raise TypeError(f"{name} must be {_words(what)}, not {shortened(value)}")
    return value


def _words(what: Any) -> str:
    """Name in words what an annotation allows."""
    kind = get_origin(what) or what
    if kind is Annotated:
        return _words(get_args(what)[0])
    known: dict[Any, str] = {
        bool: "True, False", int: "a whole number", float: "a real number", str: "text", Mapping: "a mapping",
        Callable: "a function",
    }  # fmt: skip
    return known.get(kind) or f"ns.{kind.__name__}(...)"
