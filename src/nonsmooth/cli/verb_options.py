"""The verbs of study files and their options, read off the verbs themselves: names, types, defaults, sentences.

So that a new option of a verb needs no change here, and what a study file may hold, its JSON Schema and a file that
``nonsmooth init`` writes cannot disagree.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

__all__ = ["VERBS", "Option", "options_of"]

VERBS = ("simulate", "sweep", "frequency_response", "poincare", "chart", "basins", "basin_fractions")
#: Arguments of verbs that belong to the command line, or that a file cannot hold.
_NOT_IN_FILES = ("system", "inputs", "progress", "client", "store")  # `inputs` are arrays
#: A verb that hands its further options on to another takes that one's keys too.
_HANDS_ON_TO = {"frequency_response": "sweep"}


@dataclass(frozen=True)
class Option:
    """An option of a verb.

    Attributes
    ----------
    annotation : str
        Of the argument: ``"float | None"``.
    kind : str
        The type in words, as the verb's documentation has it: ``"array (P,)"``, ``'{"up", "down", "both", None}'``.
    text : str
        What the documentation says of it, in plain text.
    """

    name: str
    annotation: str
    default: Any
    kind: str = ""
    text: str = ""

    @property
    def required(self) -> bool:
        """Return whether a study file must give it."""
        return self.default is inspect.Parameter.empty


def options_of(verb: str) -> dict[str, Option]:
    """The options that a table of a study file may hold, in the order of the verb's arguments."""
    import nonsmooth

    found: dict[str, Option] = {}
    for owner in (_HANDS_ON_TO.get(verb), verb):  # the verb's own defaults win
        if owner is None:
            continue
        function = getattr(nonsmooth, owner)
        texts = _documented(function)
        for name, item in inspect.signature(function).parameters.items():
            if name not in _NOT_IN_FILES and item.kind is not inspect.Parameter.VAR_KEYWORD:
                kind, text = texts.get(name, ("", ""))
                earlier = found.get(name)
                if earlier is not None and text.startswith("See "):
                    kind, text = earlier.kind, earlier.text
                found[name] = Option(name, str(item.annotation).strip("'"), item.default, kind, text)
    return found


def _documented(function: Callable[..., Any]) -> Mapping[str, tuple[str, str]]:
    """Type and text of each parameter in a numpydoc docstring, taken from elsewhere where it only says "See ..."."""
    lines = inspect.cleandoc(function.__doc__ or "").splitlines()
    if "Parameters" not in lines:
        return {}
    begin = lines.index("Parameters") + 2
    end = next((i - 1 for i in range(begin, len(lines)) if lines[i].startswith("----")), len(lines))
    found: dict[str, tuple[str, str]] = {}
    names: list[str] = []
    for line in lines[begin:end]:
        if line and not line.startswith(" "):
            head, _, kind = line.partition(" : ")
            names = [name.strip() for name in head.split(",")]
            found |= dict.fromkeys(names, (kind, ""))
        elif line:
            for name in names:
                kind, text = found[name]
                found[name] = (kind, f"{text} {line.strip()}".strip())
    return {name: _followed(name, kind, text) for name, (kind, text) in found.items()}


def _followed(name: str, kind: str, text: str) -> tuple[str, str]:
    if link := re.fullmatch(r"See :func:`(nonsmooth[\w.]*)\.(\w+)`\.?(.*)", text):
        module, function, rest = link.groups()
        there = _documented(getattr(import_module(module), function)).get(name)
        if there is not None:
            return kind or there[0], f"{there[1]}{rest}"
    return kind, _plain(text)


def _plain(text: str) -> str:
    """Text without the marks of reStructuredText."""
    text = re.sub(r":\w+:`~?(?:nonsmooth\.)?([^`]*)`", r"\1", text)
    return text.replace("``", "`")
