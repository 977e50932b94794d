"""A system of masses, springs, stops and friction from the numbers and choices of a form, and the Python that makes it.

Nothing that a browser sent becomes code: of a form only numbers and words of :data:`KINDS` are taken, and every name in
the Python is made here.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import nonsmooth as ns
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.explorer.state import number_of
from nonsmooth.system.kinds import Limit, above, at_least, reader_of

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Page
    from nonsmooth.system.system import System

_MOST = 4  # masses, and elements
_ANY = at_least(-np.inf)
_KEPT = 50  # models that a page may have made


@dataclass(frozen=True)
class FormNumber:
    """A number of the form: what a person reads, its unit, its first value, and the letter of its parameter."""

    label: str
    unit: str
    value: float
    letter: str
    limit: Limit = _ANY


@dataclass(frozen=True)
class ElementKind:
    """A kind of element: what a person reads, its name in ``nonsmooth.elements``, and its arguments."""

    label: str
    element: str
    arguments: Mapping[str, FormNumber]
    sided: bool = False


#: Of a mass: its own, and of the spring, the damper and the force at it.
LINK: Mapping[str, FormNumber] = {
    "m": FormNumber("mass", "kg", 1.0, "m", above(0.0)),
    "k": FormNumber("stiffness", "N/m", 1.0, "k", at_least(0.0)),
    "c": FormNumber("damping", "N s/m", 0.1, "c", at_least(0.0)),
    "F": FormNumber("force", "N", 0.0, "F"),
}
_OMEGA = FormNumber("forcing frequency", "rad/s", 1.0, "omega", above(0.0))
_POSITION = {"position": FormNumber("position", "m", 0.5, "d")}
_STIFFNESS = {"stiffness": FormNumber("stiffness", "N/m", 20.0, "s", at_least(0.0))}
_RESTITUTION = {"restitution": FormNumber("restitution", "1", 0.7, "e", at_least(0.0, 1.0))}
_DAMPING = {"damping": FormNumber("damping", "N s/m", 0.1, "b", at_least(0.0))}
_FRICTION = {"friction": FormNumber("friction force", "N", 0.2, "f", at_least(0.0))}
_BELT = {"belt": FormNumber("speed of the ground", "m/s", 0.0, "w")}
_PLAY = {"half_width": FormNumber("half width", "m", 0.2, "h", at_least(0.0))}
_PRELOAD = {"preload": FormNumber("preload", "N", 0.2, "P")}
KINDS: Mapping[str, ElementKind] = {
    "stop": ElementKind("rigid stop", "Stop", _POSITION | _RESTITUTION, sided=True),
    "elastic": ElementKind("elastic stop", "ElasticStop", _POSITION | _STIFFNESS | _DAMPING, sided=True),
    "friction": ElementKind("dry friction", "Coulomb", _FRICTION | _BELT),
    "backlash": ElementKind("backlash", "Backlash", _PLAY | _STIFFNESS),
    "preloaded": ElementKind("preloaded spring", "PreloadedSpring", _PRELOAD | _STIFFNESS),
}


@dataclass(frozen=True)
class MassChain:
    """A chain of masses, each joined to the one before it (the first to the ground) by a spring and a damper.

    Attributes
    ----------
    links : tuple of mapping
        Numbers of each mass.
    elements : tuple of (kind, arguments, numbers)
        Arguments as data: ``at`` and ``side``; parameters have their names from the numbers.
    """

    links: tuple[Mapping[str, float], ...]
    elements: tuple[tuple[str, Mapping[str, Any], Mapping[str, float]], ...]
    omega: float

    @property
    def parameters(self) -> dict[str, tuple[float, str]]:
        """Value and unit of every parameter, by its name: ``k2`` is the spring before the second mass."""
        found = {
            f"{quantity.letter}{i}": (link[key], quantity.unit)
            for i, link in enumerate(self.links, 1)
            for key, quantity in LINK.items()
            if key != "F" or link["F"]
        }
        if self._forced:
            found["omega"] = (self.omega, "rad/s")
        for i, (kind, _, numbers) in enumerate(self.elements, 1):
            for key, quantity in KINDS[kind].arguments.items():
                found[f"{quantity.letter}_{i}"] = (numbers[key], quantity.unit)
        return found

    @property
    def _forced(self) -> list[int]:
        """Numbers of the masses that a force drives."""
        return [i for i, link in enumerate(self.links, 1) if link["F"]]

    @property
    def _calls(self) -> dict[str, tuple[str, dict[str, Any]]]:
        """Class and arguments of every element, by its name."""
        return {
            f"{kind}{i}": (
                KINDS[kind].element,
                {**given, **{key: f"{quantity.letter}_{i}" for key, quantity in KINDS[kind].arguments.items()}},
            )
            for i, (kind, given, _) in enumerate(self.elements, 1)
        }

    @property
    def name(self) -> str:
        """A name of the system."""
        parts = dict.fromkeys(KINDS[kind].label for kind, *_ in self.elements)
        masses = "one mass" if len(self.links) == 1 else f"{len(self.links)} masses"
        return masses + (f" with {', '.join(parts)}" if parts else "")

    def system(self) -> System:
        """The system, made by :func:`nonsmooth.mechanical`."""
        n = len(self.links)

        def force(i: int) -> Callable[..., Any]:
            return lambda t, p: getattr(p, f"F{i}") * np.cos(p.omega * t)

        return ns.mechanical(
            *(lambda p, letter=letter: _matrix(p, letter, n) for letter in "mck"),
            parameters=self.parameters,
            coordinates={f"x{i}": "m" for i in range(1, n + 1)},
            forcing={f"x{i}": force(i) for i in self._forced},
            elements={key: getattr(ns.elements, kind)(**given) for key, (kind, given) in self._calls.items()} or None,
            name=self.name,
        )

    def python(self) -> str:
        """The Python that makes the same system."""
        n = len(self.links)
        calls = {
            key: f"ns.elements.{kind}({', '.join(f'{name}={json.dumps(value)}' for name, value in given.items())})"
            for key, (kind, given) in self._calls.items()
        }
        blocks = {
            "parameters": {name: f'({value!r}, "{unit}")' for name, (value, unit) in self.parameters.items()},
            "coordinates": {f"x{i}": '"m"' for i in range(1, n + 1)},
            "forcing": {f"x{i}": f"lambda t, p: p.F{i} * np.cos(p.omega * t)" for i in self._forced},
            "elements": calls,
        }
        lines = [f'"""{self.name[0].upper()}{self.name[1:]}."""', ""]
        lines += ["import numpy as np", "", "import nonsmooth as ns", "", "system = ns.mechanical("]
        lines += [f"    lambda p: {_matrix(_Names(), letter, n)}," for letter in "mck"]
        for block, entries in blocks.items():
            if entries:
                rows = (f'        "{name}": {text},' for name, text in entries.items())
                lines += [f"    {block}={{", *rows, "    },"]
        return "\n".join([*lines, f'    name="{self.name}",', ")"]) + "\n"


def read_plan(form: Mapping[str, Any]) -> MassChain:
    """The plan of a form: texts of ``masses``, ``elements`` and ``omega``.

    ValueError: whatever is no number within its limits; the message names the row."""
    links = tuple(_numbers(LINK, row, f"mass {i}") for i, row in enumerate(form["masses"], 1))
    elements = []
    for i, row in enumerate(form["elements"], 1):
        where, kind = f"element {i}", KINDS[row["kind"]]
        at, other = (int(_number(row.get(key, 0), FormNumber(key, "", 0, ""), where)) for key in ("at", "other"))
        if not (0 < at <= len(links) and 0 <= other <= len(links)):
            raise ValueError(f"{where}: there is no mass {max(at, other)}")
        if at == other:
            raise ValueError(f"{where} joins mass {at} with itself; choose the ground or another mass")
        given: dict[str, Any] = {"at": {f"x{at}": 1, f"x{other}": -1} if other else f"x{at}"}
        if kind.sided:
            given["side"] = -1 if row.get("side") == "below" else 1
        elements.append((row["kind"], given, _numbers(kind.arguments, row, where)))
    return MassChain(links, tuple(elements), _number(form["omega"], _OMEGA, "the force"))


def _numbers(quantities: Mapping[str, FormNumber], row: Mapping[str, Any], where: str) -> dict[str, float]:
    return {key: _number(row.get(key, one.value), one, where) for key, one in quantities.items()}


def _number(value: Any, quantity: FormNumber, where: str) -> float:
    name = f"{where}, {quantity.label}"
    return float(reader_of(Annotated[float, quantity.limit])(number_of(value, name), name))


def _matrix(p: Any, letter: str, n: int) -> list[list[Any]]:
    """The matrix of a chain, of the parameters ``letter1`` to ``letterN``; that of the masses is diagonal."""

    def entry(i: int, j: int) -> Any:
        own = getattr(p, f"{letter}{max(i, j)}")
        if abs(i - j) > 1 or (letter == "m" and i != j):
            return 0
        if i != j:
            return -own
        return own if i == n or letter == "m" else own + getattr(p, f"{letter}{i + 1}")

    return [[entry(i, j) for j in range(1, n + 1)] for i in range(1, n + 1)]


class _Names:
    """Parameters as the Python of a form writes them."""

    def __getattr__(self, name: str) -> Any:
        from sympy import Symbol

        return Symbol(f"p.{name}")


class Workshop:
    """Models that were made in a page, as "built 1", "built 2" and so on, and what stands in the form of the next."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self._made: dict[str, str] = {}  # the name of a model, by its Python
        self._python, self._shown = "", 0
        self._form: dict[str, Any] = {"masses": [], "elements": [], "omega": "1"}
        self._add("mass", None)
        self._add("stop", None)
        self._form["masses"][0]["F"] = "0.5"

    @property
    def actions(self) -> dict[str, Callable[[str, Any], object]]:
        """Messages of the page that concern the form."""
        return {
            "build": self._build,
            "build form": lambda *_: self._write(),
            "build add": self._add,
            "build remove": self._remove,
        }

    def set(self, name: str, value: Any) -> None:
        """Take the text of a field, ``build.omega`` or ``build.masses.0.k``."""
        row, key = self._form, name.removeprefix("build.")
        if key != "omega":
            kind, at, key = key.split(".")
            row = self._form[kind][int(at)]
        if key not in row or key == "kind":
            raise ValueError(f"{name[:40]!r} is no field of the form")
        row[key] = str(value)[:60]
        self._write()

    def _add(self, name: str, value: Any) -> None:
        quantities, row = LINK, dict[str, str]()
        if name != "mass":
            quantities = KINDS[name].arguments
            row = {"kind": name, "at": "1", "other": "0"} | ({"side": "above"} if KINDS[name].sided else {})
        rows = self._form["elements" if row else "masses"]
        if len(rows) >= _MOST:
            raise ValueError(f"the form makes at most {_MOST} masses and as many elements, Python any number")
        rows.append(row | {key: f"{quantity.value:g}" for key, quantity in quantities.items()})
        self._write()

    def _remove(self, name: str, value: Any) -> None:
        kind, _, at = name.partition(".")
        if name == "masses.0" and len(self._form["masses"]) == 1:
            raise ValueError("a system needs a mass")
        del self._form[kind][int(at)]
        for row in self._form["elements"]:  # those at a mass that is gone come to the first, or to the ground
            gone = {key for key in ("at", "other") if int(row[key]) > len(self._form["masses"])}
            row |= {key: one for key, one in (("at", "1"), ("other", "0")) if key in gone}
        self._write()

    def _write(self) -> None:
        """Show the Python of the form, or what does not fit in it."""
        self._python = ""
        self.page.notes.pop("building", None)
        try:
            self._python = read_plan(self._form).python()
        except ValueError as error:
            self.page.notes["building"] = str(error)

    def _build(self, name: str, value: Any) -> None:
        """Make the system, and show it."""
        plan = read_plan(self._form)
        python = plan.python()
        if python not in self._made:
            if len(self._made) >= _KEPT:
                raise ValueError(f"this page has made {_KEPT} systems; save the Python, and open a page of its own")
            try:
                system = plan.system()
            except SystemDefinitionError as error:
                raise ValueError(str(error)) from None
            name = self._made[python] = f"built_{len(self._made) + 1}"
            self.page.catalogue.add(name, system)
        self.page.show_model(self._made[python])
        self._shown += 1

    def _fields(self) -> dict[str, list[list[tuple[str, str, str, str]]]]:
        """Of each row its fields: name, text, words before it and unit; a choice has no words."""
        return {
            kind: [
                [
                    (f"build.{kind}.{i}.{key}", text, one.label if one else "", one.unit if one else "")
                    for key, text in row.items()
                    if key != "kind"
                    for one in [(KINDS[row["kind"]].arguments if "kind" in row else LINK).get(key)]
                ]
                for i, row in enumerate(self._form[kind])
            ]
            for kind in ("masses", "elements")
        }

    def fields(self) -> tuple[dict[str, str], dict[str, dict[str, str]]]:
        """Texts of all fields, and the choices of those that have some."""
        texts = {name: text for rows in self._fields().values() for row in rows for name, text, *_ in row}
        masses = {str(i): f"mass {i}" for i in range(1, len(self._form["masses"]) + 1)}
        words = {"at": masses, "other": {"0": "the ground", **masses}}
        words["side"] = {"above": "above it", "below": "below it"}
        choices = {name: words[key] for name in texts if (key := name.rpartition(".")[2]) in words}
        return {**texts, "build.omega": self._form["omega"]}, choices

    def tell(self) -> None:
        """The form as it is now."""
        rows = {
            kind: [[(name, *words) for name, _, *words in row] for row in some] for kind, some in self._fields().items()
        }
        labels = [KINDS[row["kind"]].label for row in self._form["elements"]]
        told = {"python": self._python, "built": self._shown, "most": _MOST, "labels": labels, **rows}
        self.page.tell("building", told)
