"""Arguments of verbs: what each may be stands in the signature, and one decorator, :func:`checked`, reads it.

What verbs share is a ``TypedDict`` of such declarations, a group: a verb takes it as ``**options: Unpack[Group]``, its
users write plain keywords, signature and docstring show them, and the verb receives one record with all its keys.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Mapping
from functools import cached_property, wraps
from inspect import Parameter
from typing import Any, TypeVar, cast, get_args, get_type_hints, overload
from typing import is_typeddict as is_group

from nonsmooth.errors import shortened, unknown
from nonsmooth.system.kinds import Default, Reader, reader_of

Verb = Callable[..., Any]
F = TypeVar("F", bound=Verb)

_NEEDED = Parameter.empty  # the default of what must be given


def check_system(system: Any, verb: str, inputs: bool = False) -> Any:
    """``system``; TypeError for what is none (a name, a model's function that was not called), ValueError for one with
    ``inputs`` where the verb takes none."""
    from nonsmooth.system.system import System

    if isinstance(system, System):
        if system.inputs and not inputs:
            raise ValueError(
                f"{verb} takes systems without inputs; {system.name!r} has {', '.join(map(repr, system.inputs))}: "
                "simulate, sensitivity, fit, compare, select_model and plan_experiment take their course; elsewhere "
                "write it as a function of t and p"
            )
        return system
    name = getattr(system, "__name__", None)
    hint = f"; call it: {name}()" if callable(system) and name else ""
    if hasattr(system, "data_vars"):
        hint = "; ns.system_of(result) is that of a result"
    elif isinstance(getattr(system, "system", None), System):
        hint = "; orbit.system is that of an orbit"
    elif isinstance(system, str):
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

        @wraps(function)
        def called(*given: Any, **named: Any) -> Any:
            if door.by_name:
                return function(**door.read(given, named))
            bound = door.fit(given, named)
            for name in bound.arguments.keys() & door.readers.keys():
                bound.arguments[name] = door.readers[name](bound.arguments[name], name)
            return function(*bound.args, **bound.kwargs)

        if not read:
            door.readers, door.by_name = {}, False

        called.__doc__ = door.documentation()
        called.__signature__, called.door = door.signature, door  # type: ignore[attr-defined]
        return cast(F, called)

    def outer(one: Any) -> Any:
        if not isinstance(one, type):
            return decorated(one)
        one.__init__ = decorated(one.__init__)  # type: ignore[misc]  # a class: the arguments of its objects
        return one

    return outer if function is None else outer(function)


class _Door:
    """The arguments of a verb: its own, those of its group or of the verb behind it, and the reader of each."""

    def __init__(self, function: Verb, of: Verb | None, defaults: Mapping[str, Any]) -> None:
        own = inspect.signature(function)
        self.function, self.verb = function, function.__qualname__.removesuffix(".__init__")
        self.items = dict(own.parameters)
        rest = next((item for item in self.items.values() if item.kind is item.VAR_KEYWORD), None)
        parts = () if rest is None else get_args(_evaluated(rest.annotation, function))
        self.group = parts[0] if parts and is_group(parts[0]) else None  # of ``**options: Unpack[Group]``
        self.behind: _Door | None = getattr(of, "door", None)
        others = inspect.signature(of).parameters.values() if of else _parameters(self.group, defaults)
        self.shared = {item.name: item.default for item in others if item.name not in self.items}
        if rest is not None and self.shared:
            del self.items[rest.name]
            added = {item.name: item.replace(kind=item.KEYWORD_ONLY) for item in others}
            self.items |= {name: item for name, item in added.items() if name in self.shared}
        self.signature = own.replace(parameters=[*self.items.values()])
        more = (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)
        self.named = {name: item for name, item in self.items.items() if name != "self" and item.kind not in more}
        self.needed = {name for name, item in self.items.items() if item.default is _NEEDED}
        self.by_name = all(one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY) for one in self.items.values())
        self.first = [name for name, item in self.items.items() if item.kind is item.POSITIONAL_OR_KEYWORD]

    def fit(self, given: tuple[Any, ...], named: Mapping[str, Any]) -> inspect.BoundArguments:
        """The arguments by name; TypeError for a call that does not fit the signature."""
        try:
            return self.signature.bind(*given, **named)
        except TypeError as error:
            raise TypeError(self.misfit(given, named, str(error))) from None

    def read(self, given: tuple[Any, ...], named: dict[str, Any]) -> dict[str, Any]:
        """The arguments as read, in the order in which they were given, behind defaults of what is shared."""
        values = dict(zip(self.first, given, strict=False)) | named
        whole = len(values) == len(given) + len(named)
        if not (whole and self.needed <= values.keys() <= self.items.keys()):
            self.fit(given, named)
        readers = self.readers
        read = {name: readers[name](value, name) if name in readers else value for name, value in values.items()}
        read = self.shared | read
        if "system" in read and "method" in read:
            read["system"] = read["system"].as_solved_by(read)
        return read

    @cached_property
    def kinds(self) -> dict[str, Any]:
        """The type of each argument, as its annotation says."""
        shared = get_type_hints(self.group, include_extras=True) if self.group else {}
        if self.behind:
            shared = {name: self.behind.kinds[name] for name in self.shared}
        own = {name: item.annotation for name, item in self.named.items() if name not in shared}
        return {name: _evaluated(annotation, self.function) for name, annotation in own.items()} | shared

    @cached_property
    def readers(self) -> dict[str, Reader]:
        """The reader of each argument; made in the first call."""
        found = {name: reader_of(kind) for name, kind in self.kinds.items()}
        if "system" in found:
            driven = "inputs" in self.items or "ax" in self.items  # figures draw them too
            standard = self.items["system"].default
            found["system"] = lambda value, _: value if value is standard else check_system(value, self.verb, driven)
        return found

    def misfit(self, given: tuple[Any, ...], named: Mapping[str, Any], error: str) -> str:
        """The sentence for a call that does not fit the signature."""
        items = self.named
        given = given["self" in self.items :]
        options = [name for name, item in items.items() if item.kind is item.KEYWORD_ONLY]
        first = [name for name in items if name not in options]
        usage = f"{self.verb}({', '.join([*first, *(f'{name}=' for name in options or ['name'])])})"
        if len(given) > len(first):
            count = f"{len(first) or 'no'} argument{'s' * (len(first) != 1)}"
            over = shortened(given[len(first)])
            return f"{self.verb} takes {count} by position, not {len(given)}: give {over} by its name; {usage}"
        there = {*first[: len(given)], *named}
        if missing := [name for name, item in items.items() if item.default is _NEEDED and name not in there]:
            return f"{self.verb} needs {' and '.join(missing)}: {usage}"
        system = named.get("system", given[0] if given else None)
        for name in named.keys() - items.keys():
            if name in getattr(system, "parameters", ()):
                return (
                    f"`{name}` is a parameter of {getattr(system, 'name', '')!r}, not an option of {self.verb}: "
                    f"set it with system.with_parameters({name}=...)"
                )
            return unknown(name, "an option", self.verb, [one for one in items if one != "system"])
        return f"{self.verb}: {error}; {usage}"

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


def declared(verb: Any) -> dict[str, Any]:
    """The values that each argument of a verb, or of a class, may have, as declared."""
    return dict((vars(verb)["__init__"] if isinstance(verb, type) else verb).door.kinds)


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


def _parameters(group: Any, defaults: Mapping[str, Any]) -> list[Parameter]:
    """The options of a group as keywords of a signature, annotated as they are written."""
    found = []
    for name, hint in get_type_hints(group, include_extras=True).items() if group else ():
        default = next((mark.value for mark in get_args(hint) if isinstance(mark, Default)), None)
        written = str(getattr(group.__annotations__[name], "__forward_arg__", hint))
        written = re.sub(r"Annotated\[(\w+|Literal\[.*\]), Default\(.*\)\]|, Default\(.*?\)", r"\1", written)
        default = defaults.get(name, default)
        found.append(Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=written))
    return found
