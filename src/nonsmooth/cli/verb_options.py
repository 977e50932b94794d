"""The verbs of study files and their options, read off the verbs themselves: what each may be, defaults, sentences.

So that a new option of a verb needs no change here, and what a study file may hold, its JSON Schema and a file that
``nonsmooth init`` writes cannot disagree.
"""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass
from typing import Any

VERBS = ("simulate", "sweep", "frequency_response", "poincare", "chart", "basins", "basin_fractions")
#: Arguments of verbs that belong to the command line, or that a file cannot hold.
_NOT_IN_FILES = ("system", "inputs", "progress", "client", "store")  # `inputs` are arrays


@dataclass(frozen=True)
class Option:
    """An option of a verb.

    Attributes
    ----------
    kind : Any
        What it may be, as the verb declares it.
    text : str
        What the documentation says of it, in plain text.
    """

    name: str
    kind: Any
    default: Any
    text: str = ""

    @property
    def required(self) -> bool:
        """Return whether a study file must give it."""
        return self.default is inspect.Parameter.empty


def options_of(verb: str) -> dict[str, Option]:
    """The options that a table of a study file may hold, in the order of the verb's arguments."""
    import nonsmooth
    from nonsmooth.system.arguments import declared, entries

    function = getattr(nonsmooth, verb)
    kinds, texts = declared(function), dict[str, str]()
    for names, (_, lines) in entries(function.__doc__).items():
        texts |= dict.fromkeys(names, _plain(" ".join(line.strip() for line in lines)))
    return {
        name: Option(name, kinds[name], item.default, texts.get(name, ""))
        for name, item in inspect.signature(function).parameters.items()
        if name not in _NOT_IN_FILES
    }


def _plain(text: str) -> str:
    """Text without the marks of reStructuredText."""
    text = re.sub(r":\w+:`~?(?:nonsmooth\.)?([^`]*)`", r"\1", text)
    return text.replace("``", "`").strip()
