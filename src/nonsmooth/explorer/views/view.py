"""The common part of all views: a figure, results, and what a person does to it. Their data are in ``kinds``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from nonsmooth.explorer.kinds import KINDS, setting
from nonsmooth.explorer.labels import symbols_of

if TYPE_CHECKING:
    from nonsmooth.explorer.sheet import Sheet
    from nonsmooth.explorer.state import PageState
    from nonsmooth.system.system import System

Request = dict[str, Any]
Requests = Mapping[str, Request]
Results = Mapping[str, Any]
Legend = list[tuple[str, ...]]
Ends = tuple[float, float]


class View:
    """A view of a sheet; see :data:`nonsmooth.explorer.kinds.KINDS` for its requests and settings.

    Attributes
    ----------
    results : dict
        By name, as the worker gave them.
    figure : Panel, optional
        None where the view lies in another one's.
    over : bool
        Whether its results are of the diagram's parameter.
    ends : tuple of str
        Settings that hold the window which it shows.
    """

    name: ClassVar[str]
    over: ClassVar[bool] = False
    ends: ClassVar[tuple[str, ...]] = ()

    def __init__(self, sheet: Sheet) -> None:
        self.page, self.kind, self.results = sheet.page, KINDS[self.name], dict[str, Any]()
        self.sheet = sheet
        self.figure: Any = None
        self._inked: list[tuple[Any, str, tuple[Any, ...]]] = []
        self.build()
        self.paint(dark=False)

    @property
    def state(self) -> PageState:
        """The state of the page."""
        return self.page.state

    @property
    def system(self) -> System:
        """The system of the page, at its own parameters."""
        return self.page.system

    @property
    def start(self) -> dict[str, float]:
        """Initial values of the states."""
        return dict(zip(self.system.states, self.state.start, strict=True))

    def setting(self, name: str) -> Any:
        """The value of a setting, by its name without the view's."""
        return setting(f"{self.name}.{name}", self.system, self.state)

    def quantity(self, name: str) -> tuple[str, str]:
        """Symbol and unit of a state or a parameter."""
        parameter = self.system.parameters.get(name)
        return symbols_of(self.system)[name], self.system.states[name] if parameter is None else parameter.unit

    def name_axes(self, x: str, y: str, of: str = "") -> None:
        """Label the axes with states or parameters; ``of``: words before the ordinate."""
        self.figure.x.name(*self.quantity(x))
        self.figure.y.name(*self.quantity(y), of)

    def ink(self, colors: tuple[str, str], *renderers: Any, field: str = "line_color") -> None:
        """Draw in one colour on a light ground, and in another on a dark one."""
        self._inked += [(renderer.glyph, field, colors) for renderer in renderers]

    def paint(self, dark: bool) -> None:
        """Take the colours that show on a light or a dark ground."""
        self.dark = dark
        for glyph, field, colors in self._inked:
            glyph.update(**{field: colors[dark]})

    def depends(self, old: tuple[str, str], new: tuple[str, str]) -> bool:
        """Return whether its results are of no use after a change of the model or of the diagram's parameter."""
        return old != new if self.over else old[0] != new[0]

    @property
    def shown(self) -> bool:
        """Return whether the page shows this view."""
        return not self.kind.panel or getattr(self.state, self.kind.panel) == self.name

    def requests(self, base: Requests) -> Requests:
        """Requests by stage, the quick first; ``base`` holds what all of them have."""
        return {}

    def each(self, request: Request) -> Requests:
        """The same request for every stage."""
        return {stage: {**request, "view": stage} for stage in self.kind.stages}

    def build(self) -> None:
        """Make the figure."""

    def show(self, job: Request, found: Results) -> None:
        """Draw results, which the sheet has kept."""
        self.redraw()

    def redraw(self) -> None:
        """Draw what is there, as for other axes."""
        if (result := self.results.get(self.name)) is not None:
            self.draw(result)

    def draw(self, result: Any) -> None:
        """Draw the result that has the name of the view."""

    def place(self) -> None:
        """Mark where the page is."""

    def clear(self) -> None:
        """Show nothing, as when another model was chosen."""
        self.results.clear()
        if self.figure is not None:
            self.figure.clear()

    def legend(self) -> Legend:
        """Words and colours; a sign in place of a dot where a third text says so."""
        return []

    def tapped(self, x: float, y: float) -> PageState:
        """The state after a click."""
        return self.state

    def started(self, **values: float) -> PageState:
        """The state with other initial values of some states."""
        return self.state.but("start", tuple((self.start | values).values()))

    def zoomed(self, x: Ends, y: Ends) -> PageState:
        """The state after a zoom."""
        return self.state

    def unzoomed(self) -> PageState:
        """The state after the zoom was reset: the first window."""
        return self.state.with_settings({f"{self.name}.{end}": None for end in self.ends})
