"""Tables of all options, and of what verbs answer to wrong ones: ``conf.py`` puts them into ``api/options.md``."""

from __future__ import annotations

import inspect
import re
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import nonsmooth as ns
from nonsmooth.errors import shortened
from nonsmooth.system.arguments import entries
from nonsmooth.system.kinds import in_words


def doors() -> dict[str, Any]:
    """Whatever is public and checked, by name: verbs, and classes by their constructors."""
    found = {name: getattr(ns, name) for name in ns.__all__}
    calls = {name: one.__init__ if isinstance(one, type) else one for name, one in found.items()}
    return {name: call.door for name, call in calls.items() if hasattr(call, "door") and call.door.readers}


DOORS = doors()


def answer(verb: str, /, **given: Any) -> Exception:
    """The error of a call with one argument, and with placeholders for all that it needs besides."""
    items = [item for name, item in DOORS[verb].items.items() if name in DOORS[verb].kinds]
    whole = {"verb": ns.sweep, "start": ns.models.impact_oscillator(), **given}
    first = [whole.pop(item.name, {}) for item in items if item.kind is item.POSITIONAL_ONLY]
    named = {name: value for name, value in given.items() if name in whole}
    needed = {item.name for item in items if item.default is item.empty and item.kind is not item.POSITIONAL_ONLY}
    try:
        getattr(ns, verb)(*first, **named, **dict.fromkeys(needed - named.keys(), object()))
    except (TypeError, ValueError) as error:
        return error
    raise AssertionError(f"{verb} takes {given}")


def options() -> str:
    """Every option with what it may be, its value where not given, and the verbs that take it."""
    rows = defaultdict(list)
    for verb, door in DOORS.items():
        texts = [_each(names, head) for names, (head, _) in entries(getattr(ns, verb).__doc__).items()]
        written = {name: text for pairs in texts for name, text in pairs}
        for name, kind in door.kinds.items():
            default = door.items[name].default
            allowed = in_words(ns.System if name == "system" else kind) or written[name]
            allowed = re.sub(r"('\w+'|``.*?``)", lambda found: f"`{found[0].strip('`')}`", allowed)
            default = "needed" if default is inspect.Parameter.empty else f"`{shortened(default)}`"
            rows[name, allowed, default].append(f"{{obj}}`~nonsmooth.{verb}`")
    sorted_rows = [
        [f"`{name}`", allowed, default, ", ".join(verbs)]
        for (name, allowed, default), verbs in sorted(rows.items(), key=lambda row: (row[0][0].lower(), *row[0][1:]))
    ]
    return table(["option", "allowed", "where not given", "taken by"], sorted_rows)


def _each(names: tuple[str, ...], head: str) -> list[tuple[str, str]]:
    """The text of a docstring for each name of an entry: `low, high : float; array` says it one by one."""
    text = head.partition(" : ")[2].removesuffix(", optional")
    parts = re.split("; " if ";" in text else ", ", text)
    return list(zip(names, parts if len(parts) == len(names) else [text] * len(names), strict=True))


def refusals() -> str:
    """The answers of each verb to a wrong type, a wrong value and a misspelt name, by really calling it."""
    rows = []
    for verb, door in DOORS.items():
        names = [name for name in door.readers if name != "system"]
        calls = [{f"{names[-1]}_": 1}]
        for kind in (ValueError, TypeError):
            tried = [(name, one) for name in names for one in ("many", -1)]
            calls[:0] = [{name: one} for name, one in tried if _raises(door.readers[name], one, name, kind)][:1]
        for given in calls:
            [(name, value)] = given.items()
            verb_once = f"{{obj}}`~nonsmooth.{verb}`" if given is calls[0] else ""
            rows.append([verb_once, f"`{name}={value!r}`", str(answer(verb, **given))])
    return table(["verb", "given", "answer"], rows)


def _raises(reader: Callable[..., Any], value: Any, name: str, kind: type[Exception]) -> bool:
    try:
        reader(value, name)
    except (TypeError, ValueError) as error:
        return type(error) is kind
    return False


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table of Markdown."""
    cells = [[cell.replace("|", "&#124;").replace("<", "&lt;") for cell in row] for row in rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *cells])
