"""A system of masses, springs, stops and friction from the numbers and choices of a form, and the Python that makes it.

Nothing that a browser sent becomes code: of a form only numbers and words of :data:`KINDS` are taken, and every name in
the Python is made here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import nonsmooth as ns
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.explorer.state import number_of

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.system.system import System

__all__ = ["KINDS", "LINK", "MOST", "Plan", "Workshop", "read_plan"]

MOST = 4  # masses, and elements


@dataclass(frozen=True)
class Quantity:
    """A number of the form: what a person reads, its unit, its first value, and the letter of its parameter."""

    label: str
    unit: str
    value: float
    letter: str
    least: float = -np.inf
    most: float = np.inf


@dataclass(frozen=True)
class Kind:
    """A kind of element: what a person reads, its name in ``nonsmooth.elements``, and its arguments."""

    label: str
    element: str
    arguments: Mapping[str, Quantity]
    sided: bool = False


#: Of a mass: its own, and of the spring, the damper and the force at it.
LINK: Mapping[str, Quantity] = {
    "m": Quantity("mass", "kg", 1.0, "m", least=1e-12),
    "k": Quantity("stiffness", "N/m", 1.0, "k", least=0.0),
    "c": Quantity("damping", "N s/m", 0.1, "c", least=0.0),
    "F": Quantity("force", "N", 0.0, "F"),
}
_POSITION = Quantity("position", "m", 0.5, "d")
_STIFFNESS = Quantity("stiffness", "N/m", 20.0, "s", least=0.0)
KINDS: Mapping[str, Kind] = {
    "stop": Kind("rigid stop", "Stop", {
        "position": _POSITION, "restitution": Quantity("restitution", "1", 0.7, "e", least=0.0, most=1.0),
    }, sided=True),
    "elastic": Kind("elastic stop", "ElasticStop", {
        "position": _POSITION, "stiffness": _STIFFNESS, "damping": Quantity("damping", "N s/m", 0.1, "b", least=0.0),
    }, sided=True),
    "friction": Kind("dry friction", "Coulomb", {
        "friction": Quantity("friction force", "N", 0.2, "f", least=0.0),
        "belt": Quantity("speed of the ground", "m/s", 0.0, "w"),
    }),
    "backlash": Kind("backlash", "Backlash", {
        "half_width": Quantity("half width", "m", 0.2, "h", least=0.0), "stiffness": _STIFFNESS,
    }),
    "preloaded": Kind("preloaded spring", "PreloadedSpring", {
        "preload": Quantity("preload", "N", 0.2, "P"), "stiffness": _STIFFNESS,
    }),
}  # fmt: skip


@dataclass(frozen=True)
class Placed:
    """An element of the form: its kind, the masses between which it is (the second 0: the ground), its side."""

    kind: str
    at: int
    other: int
    side: int
    numbers: Mapping[str, float]


@dataclass(frozen=True)
class Plan:
    """A chain of masses, each joined to the one before it (the first to the ground) by a spring and a damper."""

    links: tuple[Mapping[str, float], ...]
    elements: tuple[Placed, ...]
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
        if self.forced:
            found["omega"] = (self.omega, "rad/s")
        for i, placed in enumerate(self.elements, 1):
            for key, quantity in KINDS[placed.kind].arguments.items():
                found[f"{quantity.letter}_{i}"] = (placed.numbers[key], quantity.unit)
        return found

    @property
    def forced(self) -> list[int]:
        """Numbers of the masses that a force drives."""
        return [i for i, link in enumerate(self.links, 1) if link["F"]]

    def system(self) -> System:
        """The system, made by :func:`nonsmooth.mechanical`."""
        n = len(self.links)

        def force(i: int) -> Callable[..., Any]:
            return lambda t, p: getattr(p, f"F{i}") * np.cos(p.omega * t)

        elements = {}
        for i, placed in enumerate(self.elements, 1):
            kind = KINDS[placed.kind]
            given: dict[str, Any] = {key: f"{quantity.letter}_{i}" for key, quantity in kind.arguments.items()}
            if kind.sided:
                given["side"] = placed.side
            at = {f"x{placed.at}": 1, f"x{placed.other}": -1} if placed.other else f"x{placed.at}"
            elements[f"{placed.kind}{i}"] = getattr(ns.elements, kind.element)(at=at, **given)
        return ns.mechanical(
            lambda p: _matrix(p, "m", n), lambda p: _matrix(p, "c", n), lambda p: _matrix(p, "k", n),
            parameters=self.parameters, coordinates={f"x{i}": "m" for i in range(1, n + 1)},
            forcing={f"x{i}": force(i) for i in self.forced}, elements=elements or None, name=self.name,
        )  # fmt: skip

    @property
    def name(self) -> str:
        """A name of the system."""
        parts = [KINDS[placed.kind].label for placed in self.elements]
        masses = "one mass" if len(self.links) == 1 else f"{len(self.links)} masses"
        return masses + (f" with {', '.join(dict.fromkeys(parts))}" if parts else "")

    def python(self) -> str:
        """The Python that makes the same system."""
        n = len(self.links)
        rows = range(1, n + 1)
        lines = [f'"""{self.name[0].upper()}{self.name[1:]}."""', ""]
        lines += ["import numpy as np", "", "import nonsmooth as ns", "", "system = ns.mechanical("]
        lines += [f"    lambda p: {_matrix(_Names(), letter, n)}," for letter in "mck"]
        lines += ["    parameters={"]
        lines += [f'        "{name}": ({value!r}, "{unit}"),' for name, (value, unit) in self.parameters.items()]
        coordinates = ", ".join(f'"x{i}": "m"' for i in rows)
        lines += ["    },", f"    coordinates={{{coordinates}}},"]
        if self.forced:
            lines += ["    forcing={"]
            lines += [f'        "x{i}": lambda t, p: p.F{i} * np.cos(p.omega * t),' for i in self.forced]
            lines += ["    },"]
        if self.elements:
            lines += ["    elements={", *map(self._element, range(1, len(self.elements) + 1)), "    },"]
        return "\n".join([*lines, f'    name="{self.name}",', ")"]) + "\n"

    def _element(self, i: int) -> str:
        placed = self.elements[i - 1]
        kind = KINDS[placed.kind]
        at = f'{{"x{placed.at}": 1, "x{placed.other}": -1}}' if placed.other else f'"x{placed.at}"'
        given = [f"at={at}", *(f'{key}="{quantity.letter}_{i}"' for key, quantity in kind.arguments.items())]
        if kind.sided:
            given.append(f"side={placed.side}")
        return f'        "{placed.kind}{i}": ns.elements.{kind.element}({", ".join(given)}),'


def read_plan(form: Any) -> Plan:
    """The plan of a form as a browser sends it: ``masses``, ``elements`` and ``omega``.

    Raises
    ------
    ValueError
        Whatever is no number within its limits and no word of :data:`KINDS`; the message names the row.
    """
    if not isinstance(form, Mapping):
        raise ValueError("the form did not arrive whole; try again")
    masses, parts = (_rows(form.get(key), key) for key in ("masses", "elements"))
    if not masses:
        raise ValueError("a system needs a mass")
    links = tuple(
        {key: _number(row.get(key), quantity, f"mass {i}") for key, quantity in LINK.items()}
        for i, row in enumerate(masses, 1)
    )
    elements = []
    for i, row in enumerate(parts, 1):
        kind = str(row.get("kind"))
        if kind not in KINDS:
            raise ValueError(f"element {i}: {kind[:40]!r} is no kind; there are: {', '.join(KINDS)}")
        at, other = (_mass(row.get(key, 0), len(links), low, f"element {i}") for key, low in (("at", 1), ("other", 0)))
        if at == other:
            raise ValueError(f"element {i} joins mass {at} with itself; choose the ground or another mass")
        numbers = {
            key: _number(row.get(key, quantity.value), quantity, f"element {i}")
            for key, quantity in KINDS[kind].arguments.items()
        }
        elements.append(Placed(kind, at, other, -1 if row.get("side") == "below" else 1, numbers))
    omega = _number(form.get("omega"), Quantity("forcing frequency", "rad/s", 1.0, "omega", least=1e-9), "the force")
    return Plan(links, tuple(elements), omega)


def _rows(value: Any, what: str) -> Sequence[Mapping[str, Any]]:
    if not isinstance(value, list) or not all(isinstance(row, Mapping) for row in value):
        raise ValueError(f"{what}: the form did not arrive whole; try again")
    if len(value) > MOST:
        raise ValueError(f"{what}: {len(value)} of them; the form makes at most {MOST}, Python any number")
    return value


def _number(value: Any, quantity: Quantity, where: str) -> float:
    number = number_of(value, f"{where}, {quantity.label}")
    if not quantity.least <= number <= quantity.most:
        limits = f"at least {quantity.least:g}" + (f" and at most {quantity.most:g}" if quantity.most < np.inf else "")
        raise ValueError(f"{where}, {quantity.label} = {number:g}: give {limits}")
    return number


def _mass(value: Any, most: int, least: int, where: str) -> int:
    number = number_of(value, where)
    if number != int(number) or not least <= number <= most:
        raise ValueError(f"{where}: there is no mass {number:g}")
    return int(number)


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


_KEPT = 50  # models that a page may have made


class Workshop:
    """Models that were made in a page, as "built 1", "built 2" and so on."""

    def __init__(self, page: Session) -> None:
        self.page = page
        self._made: dict[str, str] = {}  # the name of a model, by its Python
        self._python, self._shown = "", 0

    @property
    def actions(self) -> dict[str, Callable[[str, Any], object]]:
        """Messages of the page that concern the form."""
        return {"form": self._write, "build": self._build}

    def _write(self, name: str, value: Any) -> None:
        """Show the Python of the form; none where something in it does not fit."""
        self._python = ""
        self._python = read_plan(value).python()

    def _build(self, name: str, value: Any) -> None:
        """Make the system, and show it."""
        plan = read_plan(value)
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

    def tell(self) -> None:
        """The form as it is now."""

        def quantity(one: Any) -> dict[str, Any]:
            return {"label": one.label, "unit": one.unit, "value": one.value}

        self.page.tell("building", {
            "python": self._python, "built": self._shown, "most": MOST,
            "link": {key: quantity(one) for key, one in LINK.items()},
            "kinds": {
                key: {"label": kind.label, "sided": kind.sided,
                      "arguments": {name: quantity(one) for name, one in kind.arguments.items()}}
                for key, kind in KINDS.items()
            },
        })  # fmt: skip
