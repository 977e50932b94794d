"""The models that a page offers, each made when it is first shown, and first views of them, the paper's figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING

from nonsmooth import models
from nonsmooth.explorer.kinds import USUAL
from nonsmooth.explorer.state import PageState, from_query
from nonsmooth.studies import installed, study

if TYPE_CHECKING:
    from nonsmooth.system.system import System

PAPER = "discontinuous_support"
GIVEN = "given"  # the name of a model of one's own


@cache
def presets_of(model: str) -> Mapping[str, PageState]:
    """Named views of a model, by the studies that are installed: the figures of the paper for its oscillator."""
    views = {name: view for one in installed() for name, view in study(one, "views").VIEWS.get(model, {}).items()}
    if not views:
        return {}
    base = first_state(model, getattr(models, model)())  # whatever the page shows now
    found = {}
    for name, given in views.items():
        values = {key: given.get(key, value) for key, value in base.values.items()}
        found[name] = replace(base, values=values, **{key: given[key] for key in given.keys() - values.keys()})
    return found


@lru_cache(maxsize=64)
def text_of(system: System) -> str:
    """The system's text, as the worker takes it."""
    return system.to_text()


def first_state(model: str, system: System) -> PageState:
    """A view of a system at its own parameters, over the parameter that is usually varied."""
    names, states = list(system.parameters), list(system.states)
    values = {name: float(system.values[name]) for name in names}
    over = next((name for name in USUAL if name in values), names[0])
    value = values[over]
    half = 0.4 * abs(value) or 1.0
    low, high = (0.2, 0.5) if model == PAPER else (value - half, value + half)
    # the second axis of the phase plane: the velocity of the first state where its name says so
    likely = (f"v_{states[0]}", states[0].replace("x", "v", 1), "v", *states[1:], states[0])
    y = next(name for name in likely if name in (states[1:] or states))
    start = tuple(0.0 if system.period() is not None else 0.1 * s for s in system.scale_vector())
    return PageState(
        model=model,
        values=values,
        over=over,
        low=low,
        high=high,
        start=start,
        x=states[0],
        y=y,
        shown=y if model == PAPER else states[0],
    )


def slider_range(value: float, also: tuple[float, ...] = ()) -> tuple[float, float]:
    """Ends of a slider for a parameter that had this value first: from a twentieth of it to three times it.

    A negative one (a pressed gap) goes to as much on the other side. ``also``: values that must lie within.
    """
    if value > 0:
        ends = (0.05 * value, 3.0 * value)
    elif value < 0:
        ends = (2.0 * value, -2.0 * value)
    else:
        ends = (0.0, 1.0)
    return min(*ends, *also), max(*ends, *also)


class Catalogue:
    """Models by name: the one given first, then those of ``nonsmooth.models``.

    Parameters
    ----------
    makers : mapping
        Functions that make a system, by its name; see :meth:`of`.
    """

    def __init__(self, makers: Mapping[str, Callable[[], System]]) -> None:
        self._makers: dict[str, Callable[[], System]] = {name: cache(maker) for name, maker in makers.items()}

    @classmethod
    def of(cls, system: System | None) -> Catalogue:
        """The models of the package, behind a system of one's own where one is given."""
        found: dict[str, Callable[[], System]] = {name: getattr(models, name) for name in models.names()}
        return cls(found if system is None else {GIVEN: lambda: system, **found})

    def copy(self) -> Catalogue:
        """The same models, for a page that adds its own."""
        return Catalogue(self._makers)

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def add(self, name: str, system: System) -> None:
        """Offer a system that was made in the page."""
        self._makers[name] = lambda: system

    def system(self, name: str) -> System:
        """The system at its own parameters; ValueError where no model has this name."""
        if name not in self._makers:
            raise ValueError(f"{str(name)[:60]!r} is no model of this page; there are: {', '.join(self)}")
        return self._makers[name]()

    def first_state(self, name: str) -> PageState:
        """The first view of a model."""
        return first_state(name, self.system(name))

    def state_of(self, pairs: Sequence[tuple[str, str]]) -> PageState:
        """The state that a page's address describes; the first model's first view where it says nothing."""
        default = GIVEN if GIVEN in self._makers else PAPER
        name = next((value for key, value in pairs if key == "model"), default)
        state = self.first_state(name)
        if name == PAPER and not pairs:
            state = presets_of(state.model).get("Fig. 11", state)
        return from_query(pairs, state, list(self.system(name).states))
