"""The models that a page offers, each made when it is first shown, and first views of them, the paper's figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.kinds import USUAL
from nonsmooth.explorer.state import State, from_query
from nonsmooth.studies.savi2007 import printed

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["GIVEN", "PAPER", "Catalogue", "first_state", "presets_of", "slider_range"]

PAPER = "discontinuous_support"
GIVEN = "given"  # the name of a model of one's own
_GAP = {**printed.FIGURE_13, "over": "g", "low": -0.0015, "high": 0.002, "shown": "v"}
_AMPLITUDE = {**printed.FIGURE_11, "over": "rho", "low": 0.2, "high": 0.5, "shown": "v"}
_FREQUENCY = {**printed.FIGURE_17, "over": "omega", "low": 8.4, "high": 10.4, "shown": "v"}
#: Figures of the paper: parameters and fields of the state.
_FIGURES: Mapping[str, Mapping[str, Any]] = {
    "Fig. 9": {
        **printed.FIGURE_9, "omega": 4.8, "over": "omega", "low": 3.0, "high": 7.0, "shown": "x",
    },
    "Fig. 10": {
        **printed.FIGURE_10, "omega": 4.5, "over": "omega", "low": 2.4, "high": 7.4, "shown": "x",
    },
    "Fig. 11": {**_AMPLITUDE, "rho": 0.45},
    **{f"Fig. 12 {'abcd'[i]}": {**_AMPLITUDE, "rho": rho} for i, rho in enumerate(printed.FIGURE_12)},
    "Fig. 13": {**_GAP, "g": 0.0009},
    **{f"Fig. 14 {'abcd'[i]}": {**_GAP, "g": g} for i, g in enumerate(printed.FIGURE_14)},
    "Fig. 15": {**_GAP, "g": 0.0018},
    "Fig. 17": {**_FREQUENCY, "omega": 9.55},
    **{f"Fig. 18 {'abc'[i]}": {**_FREQUENCY, "omega": omega} for i, omega in enumerate(printed.FIGURE_18)},
}  # fmt: skip


def presets_of(state: State) -> dict[str, State]:
    """Named states of a model: the figures of the paper for its oscillator."""
    if state.model != PAPER:
        return {}
    base = first_of_paper(state)
    found = {}
    for name, given in _FIGURES.items():
        values = {key: value for key, value in given.items() if key in base.values}
        rest = {key: value for key, value in given.items() if key not in base.values}
        found[name] = replace(base, values={**base.values, **values}, **rest)
    return found


def first_of_paper(state: State) -> State:
    """The paper's oscillator at Table 1, whatever the page shows now."""
    from nonsmooth import models

    return first_state(PAPER, models.discontinuous_support())


def first_state(model: str, system: System) -> State:
    """A view of a system at its own parameters, over the parameter that is usually varied."""
    names, states = list(system.parameters), list(system.states)
    values = {name: float(system.values[name]) for name in names}
    over = next((name for name in USUAL if name in values), names[0])
    value = values[over]
    around = (value - 0.4 * abs(value), value + 0.4 * abs(value)) if value else (-1.0, 1.0)
    low, high = (0.2, 0.5) if model == PAPER else around
    # the second axis of the phase plane: the velocity of the first state where its name says so
    likely = (f"v_{states[0]}", states[0].replace("x", "v", 1), "v", *states[1:], states[0])
    y = next(name for name in likely if name in (states[1:] or states))
    start = tuple(0.0 if system.period() is not None else 0.1 * s for s in system.scale_vector())
    return State(
        model=model, values=values, over=over, low=low, high=high, start=start, x=states[0], y=y,
        shown=y if model == PAPER else states[0],
    )  # fmt: skip


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
        self._makers = dict(makers)
        self._systems: dict[str, System] = {}
        self._texts: dict[str, str] = {}

    @classmethod
    def of(cls, system: System | None) -> Catalogue:
        """The models of the package, behind a system of one's own where one is given."""
        from nonsmooth import models

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
        if name not in self._systems:
            self._systems[name] = self._makers[name]()
        return self._systems[name]

    def text(self, name: str) -> str:
        """The system's text, as the worker takes it."""
        if name not in self._texts:
            self._texts[name] = self.system(name).to_text()
        return self._texts[name]

    def first_state(self, name: str) -> State:
        """The first view of a model."""
        return first_state(name, self.system(name))

    def state_of(self, pairs: Sequence[tuple[str, str]]) -> State:
        """The state that a page's address describes; the first model's first view where it says nothing."""
        default = GIVEN if GIVEN in self._makers else PAPER
        name = next((value for key, value in pairs if key == "model"), default)
        state = self.first_state(name)
        if name == PAPER and not pairs:
            state = presets_of(state)["Fig. 11"]
        return from_query(pairs, state, list(self.system(name).states))
