"""The form of a view that a page can show in one of its panels: its settings, requests, computation and drawing.

One class per file beside this one. Its ``compute`` runs in the worker's process, which needs no Bokeh; everything else
in the page's. Bokeh is therefore imported where a view is built.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.work import Heard
    from nonsmooth.system.system import System

__all__ = ["Given", "Setting", "View"]

#: Value of a setting: a number, one of some words, or None where the view chooses.
Given = float | str | None


@dataclass(frozen=True)
class Setting:
    """A value that a page holds for one view.

    Attributes
    ----------
    label : str
        Text before its field; no field where empty.
    default : function of system and state
    choices : function of system and state, optional
        Allowed words, each with the text that a person reads; a number where not given.
    also : tuple of str
        Settings that return to their defaults when this one changes.
    """

    label: str
    default: Callable[[System, State], Given]
    choices: Callable[[System, State], Mapping[str, str]] | None = None
    also: tuple[str, ...] = ()


class View(ABC):
    """A view; the base has the common part.

    Attributes
    ----------
    name, title, panel : str
        ``panel`` is the field of the state that says which view that panel shows.
    stages : mapping
        Names of its requests in the order of computing; True for short work.
    settings : mapping
        By full name, ``view.setting``.
    saved : tuple of str, optional
        Name of the result that it saves, and the function of ``nonsmooth.plot`` that draws it.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    panel: ClassVar[str]
    stages: ClassVar[Mapping[str, bool]]
    settings: ClassVar[Mapping[str, Setting]] = {}
    saved: ClassVar[tuple[str, str] | None] = None
    hint: ClassVar[str] = ""

    def __init__(self) -> None:
        self.results: dict[str, Any] = {}

    @staticmethod
    def depends(old: tuple[str, str], new: tuple[str, str]) -> bool:
        """Return whether its results are of no use after a change of the model or of the diagram's parameter."""
        return old[0] != new[0]

    def shown(self, system: System, state: State) -> bool:
        """Return whether the page shows this view."""
        return bool(getattr(state, self.panel) == self.name)

    @classmethod
    def value(cls, name: str, system: System, state: State) -> Any:
        """The value of a setting, by its name without the view's."""
        full = f"{cls.name}.{name}"
        setting, value = cls.settings[full], state.settings.get(full)
        if value is None or (setting.choices is not None and value not in setting.choices(system, state)):
            return setting.default(system, state)
        return value

    @abstractmethod
    def requests(self, system: System, state: State, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Requests by stage, the quick first; ``base`` holds what all of them have."""

    @staticmethod
    @abstractmethod
    def compute(system: System, job: Mapping[str, Any], options: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
        """Results by name, in the worker."""

    @abstractmethod
    def build(self, page: Session) -> Any:
        """Make the figure, and return its plot; None where the view lies in another one's."""

    def show(self, job: Mapping[str, Any], found: Mapping[str, Any], system: System, state: State) -> None:
        """Take results, and draw them."""
        self.results.update(found)
        self.redraw(system, state)

    @abstractmethod
    def redraw(self, system: System, state: State) -> None:
        """Draw what is there, as for other axes."""

    def place(self, system: System, state: State) -> None:  # noqa: B027  most views mark nothing
        """Mark where the page is."""

    def clear(self) -> None:
        """Show nothing, as when another model was chosen."""
        self.results.clear()

    def paint(self, dark: bool) -> None:  # noqa: B027  most colours show on either ground
        """Take the colours that show on a light or a dark ground."""

    def legend(self, system: System, state: State) -> list[tuple[str, str]]:
        """Words and colours."""
        return []

    @staticmethod
    def axes(state: State) -> dict[str, str]:
        """Options of the function that draws a saved figure."""
        return {}

    def tapped(self, x: float, y: float, system: System, state: State) -> State:
        """The state after a click."""
        return state

    def zoomed(self, x: tuple[float, float], y: tuple[float, float], system: System, state: State) -> State:
        """The state after a zoom."""
        return state

    def unzoomed(self, system: System, state: State) -> State:
        """The state after the zoom was reset."""
        return state
