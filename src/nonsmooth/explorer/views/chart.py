"""Chart of period numbers over two parameters: coarse at once, then finer, and again wherever one zooms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.labels import plain_of, symbols_of
from nonsmooth.explorer.views.cells import Cells
from nonsmooth.explorer.views.view import Setting, View

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.work import Heard
    from nonsmooth.system.system import System

__all__ = ["Chart"]

_SIZES = {"first chart": (40, 30), "chart": (144, 108), "exponents": (48, 36), "fine chart": (288, 216)}
_RETURNS = 200  # over which an exponent of the chart is measured


def _others(system: System, state: State) -> dict[str, str]:
    return {name: plain_of(symbols_of(system)[name]) for name in system.parameters if name != state.over}


def _other(system: System, state: State) -> str:
    from nonsmooth.explorer.presets import USUAL  # presets are states, and states have settings of views

    others = _others(system, state)
    return next((name for name in USUAL if name in others), next(iter(others), ""))


def _end(factor: float) -> Any:
    def default(system: System, state: State) -> float:
        """Around the model's own value, so that the range stays while the parameter is moved."""
        from nonsmooth.explorer.presets import first_state

        name = Chart.value("across", system, state)
        own = first_state(state.model, system).values.get(name, 0.0)
        return own + factor * (abs(own) or 1.0)

    return default


class Chart(View):
    """Period numbers over the diagram's parameter and a second one, from the initial state at rest."""

    name, title, panel = "chart", "Chart", "upper"
    stages: ClassVar = {"first chart": True, "chart": False, "exponents": False, "fine chart": False}
    settings: ClassVar = {
        "chart.across": Setting("and", _other, _others, also=("chart.low", "chart.high")),
        "chart.low": Setting("from", _end(-0.4)), "chart.high": Setting("to", _end(0.4)),
    }  # fmt: skip
    saved = ("chart", "chart")

    @staticmethod
    def depends(old: tuple[str, str], new: tuple[str, str]) -> bool:
        """Return whether either changed: the chart's abscissa is the diagram's."""
        return old != new

    def requests(self, system: System, state: State, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Each finer than the one before it, and exponents on a grid of their own."""
        across, low, high = (self.value(name, system, state) for name in ("across", "low", "high"))
        sweep = base["first look"]
        values = {name: low if name == across else value for name, value in sweep["values"].items()}
        job = {**sweep, "values": values, "across": across, "bottom": min(low, high),
               "top": max(low, high), "columns": 0}  # fmt: skip
        return {stage: {**job, "view": stage} for stage in _SIZES}

    @staticmethod
    def compute(system: System, job: Mapping[str, Any], options: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
        """A ``chart``; the finer ones infer what lies far from all boundaries."""
        from nonsmooth.explorer.work import section_of

        if not job["across"]:
            raise ValueError(f"{system.name!r} has one parameter; a chart needs two")
        n, m = _SIZES[job["view"]]
        grid = {job["over"]: np.linspace(job["low"], job["high"], n),
                job["across"]: np.linspace(job["bottom"], job["top"], m)}  # fmt: skip
        exponents = job["view"] == "exponents"
        more = {"lyapunov": _RETURNS, "extremes": False} if exponents else {"refine": job["view"] != "first chart"}
        found = ns.chart(
            system, grid, start=list(job["begin"]), section=section_of(system), transient=job["transient"],
            progress=heard, **more, **options,
        )  # fmt: skip
        return {"exponents" if exponents else "chart": found}

    def build(self, page: Session) -> Any:
        """The image of the classes."""
        self._cells = Cells("chart")
        self._subject: dict[str, Any] = {}  # of which request the results are
        return self._cells.panel.plot

    def show(self, job: Mapping[str, Any], found: Mapping[str, Any], system: System, state: State) -> None:
        """Exponents of another range are of no use."""
        subject = {key: value for key, value in job.items() if key != "view"}
        if subject != self._subject:
            self.results.clear()
            self._subject = subject
        if job["view"] != "exponents":
            self._stage = job["view"]
        super().show(job, found, system, state)

    def redraw(self, system: System, state: State) -> None:
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
        after = "" if unit == "1" else f" {unit}"
        self._cells.put(x, y, classes, entries, self._stage, more, (", exponent near ", after))
        self._entries = [entries[k] for k in np.unique(classes)]
        panel = self._cells.panel
        panel.show((state.low, state.high), (float(y[0]), float(y[-1])))
        units = {name: one.unit for name, one in system.parameters.items()}
        self._cells.name_axes(symbols_of(system), (over, units[over]), (across, units[across]))
        self.place(system, state)

    def place(self, system: System, state: State) -> None:
        """Mark the parameters that the page is at."""
        across = self.value("across", system, state)
        if "chart" in self.results and across in state.values:
            self._cells.here.data = {"x": [state.values[state.over]], "y": [state.values[across]]}

    def clear(self) -> None:
        """Show nothing."""
        super().clear()
        self._cells.clear()

    def legend(self, system: System, state: State) -> list[tuple[str, str]]:
        """The classes that the chart has."""
        from nonsmooth.plot import palette

        if "chart" not in self.results:
            return []
        words = {color: words.removeprefix("period ") for words, color in reversed(self._entries)}
        if palette.LONGER in words:
            words[palette.LONGER] = f"above {len(palette.PERIODS)}"
        return [(words[color], color) for color in dict.fromkeys(color for _, color in self._entries)]

    def tapped(self, x: float, y: float, system: System, state: State) -> State:
        """Go to the nearest point of the chart, and start where its runs started."""
        from nonsmooth.explorer.presets import first_state

        result = self.results.get("chart")
        if result is None:
            return state
        over, across = (str(dim) for dim in result["status"].dims[:2])
        for name, value in ((over, x), (across, y)):
            state = state.with_value(name, float(result[name].sel({name: value}, method="nearest")))
        return replace(state, start=first_state(state.model, system).start)

    def zoomed(self, x: tuple[float, float], y: tuple[float, float], system: System, state: State) -> State:
        """Compute the range that is seen; the diagram's range is the same."""
        return replace(state, low=x[0], high=x[1]).with_settings(chart__low=y[0], chart__high=y[1])

    def unzoomed(self, system: System, state: State) -> State:
        """Return to the first range of the second parameter."""
        return state.with_settings(chart__low=None, chart__high=None)


def classes_of(result: Any) -> tuple[Any, list[tuple[str, str]]]:
    """Classes of a chart as numbers, and the words and the colour of each: colours of ``nonsmooth.plot.chart``."""
    from nonsmooth.explorer.figures import words_of
    from nonsmooth.plot import palette

    period, told = result["period_number"].values.astype(int), words_of(result["status"])
    most = max(int(period.max(initial=0)), len(palette.PERIODS))
    classes = period - 1
    classes[(period == 0) & (told == "not_periodic")] = most
    classes[(period == 0) & (told != "not_periodic")] = most + 1
    colors = [*palette.PERIODS, *[palette.LONGER] * (most - len(palette.PERIODS))]
    return classes, [
        *((f"period {p}", color) for p, color in enumerate(colors, start=1)), ("no period", palette.NO_PERIOD),
        ("not settled", palette.UNKNOWN),
    ]  # fmt: skip
