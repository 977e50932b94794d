"""Chart of period numbers over two parameters: coarse at once, then finer, and again wherever one zooms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.presets import first_state
from nonsmooth.explorer.views.cells import Cells
from nonsmooth.explorer.views.view import Request
from nonsmooth.plot.planes import classes_of, legend_of

if TYPE_CHECKING:
    from nonsmooth.explorer.state import State

__all__ = ["Chart"]


class Chart(Cells):
    """Period numbers over the diagram's parameter and a second one, from the initial state at rest."""

    name = "chart"

    def depends(self, old: tuple[str, str], new: tuple[str, str]) -> bool:
        """Return whether either changed: the chart's abscissa is the diagram's."""
        return old != new

    def requests(self, base: Mapping[str, Request]) -> dict[str, Request]:
        """Each finer than the one before it, and exponents on a grid of their own."""
        across, low, high = (self.setting(name) for name in ("across", "low", "high"))
        sweep = base["first look"]
        values = {name: low if name == across else value for name, value in sweep["values"].items()}
        ends = {"bottom": min(low, high), "top": max(low, high)}
        return self.each({**sweep, "values": values, "across": across, **ends, "columns": 0})

    def build(self) -> None:
        """The image of the classes."""
        super().build()
        self._subject: dict[str, Any] = {}  # of which request the results are

    def show(self, job: Request, found: Mapping[str, Any]) -> None:
        """Exponents of another range are of no use."""
        subject = {key: value for key, value in job.items() if key != "view"}
        if subject != self._subject:
            self.results.clear()
            self._subject = subject
        if job["view"] != "exponents":
            self._stage = job["view"]
        super().show(job, found)

    def redraw(self) -> None:
        """Draw the period numbers, and tell the exponents of the nearest points where they are known."""
        result = self.results.get("chart")
        if result is None:
            return
        over, across = (str(dim) for dim in result["status"].dims[:2])
        x, y = result[over].values, result[across].values
        classes, entries = classes_of(result.transpose(across, over, ...))
        more, unit = None, "1"
        if "exponents" in self.results:
            known = self.results["exponents"]["lyapunov"]
            more = known.sel({over: x, across: y}, method="nearest").transpose(across, over).values
            unit = str(known.attrs.get("units", "1"))
        self.put(x, y, classes, entries, self._stage, more, unit)
        self._legend = legend_of(classes, entries)
        self.figure.show((self.state.low, self.state.high), (float(y[0]), float(y[-1])))
        self.name_axes(over, across)
        self.place()

    def place(self) -> None:
        """Mark the parameters that the page is at."""
        values, across = self.state.values, self.setting("across")
        if "chart" in self.results and across in values:
            self.here.data = {"x": [values[self.state.over]], "y": [values[across]]}

    def legend(self) -> list[tuple[str, str]]:
        """The classes that the chart has."""
        return self._legend if "chart" in self.results else []

    def tapped(self, x: float, y: float) -> State:
        """Go to the nearest point of the chart, and start where its runs started."""
        state, result = self.state, self.results.get("chart")
        if result is None:
            return state
        for dim, value in zip(result["status"].dims[:2], (x, y), strict=True):
            state = state.with_value(str(dim), float(result[dim].sel({dim: value}, method="nearest")))
        return replace(state, start=first_state(state.model, self.system).start)

    def zoomed(self, x: tuple[float, float], y: tuple[float, float]) -> State:
        """Compute the range that is seen; the diagram's range is the same."""
        return replace(self.state, low=x[0], high=x[1]).with_settings(chart__low=y[0], chart__high=y[1])

    def unzoomed(self) -> State:
        """Return to the first range of the second parameter."""
        return self.state.with_settings(chart__low=None, chart__high=None)
