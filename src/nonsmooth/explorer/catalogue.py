"""The models that a page offers, each made when it is first shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from nonsmooth.explorer.presets import GIVEN, PAPER, first_state, presets_of
from nonsmooth.explorer.state import State, from_query

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Catalogue"]


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
