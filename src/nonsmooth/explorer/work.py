"""Computations of the views by the public verbs, one function for each request; they run in the worker's process."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.measured import fitted, laid_over, read
from nonsmooth.explorer.sketch import moving

#: Hears the fraction done and says whether the work is still wanted.
Heard = Callable[[float], bool]
Results = dict[str, Any]  # by name

_CHAOTIC = 40  # periods drawn of an orbit without a period
_LONGEST = 12  # periods drawn of one that has a long one
_POINTS = 3000  # of a section
_PICTURES, _MOST_MOVED = 36, 4  # of the sketch in a period, and periods of it
_STARTS = 8
_MEASURED = 1000  # periods over which exponents are measured
_CHARTS = {"first chart": (40, 30), "chart": (144, 108), "exponents": (48, 36), "fine chart": (288, 216)}
_RETURNS = 200  # over which an exponent of a chart is measured
_BASINS = {"first basins": 24, "basins": 72, "fine basins": 180}
_BUDGET = 60.0  # seconds of processor time for branches; what is found by then is shown


@dataclass(frozen=True)
class Job:
    """A request with the system that it is of, and the options of its integrator."""

    system: ns.System
    asked: Mapping[str, Any]
    heard: Heard

    def __getitem__(self, name: str) -> Any:
        return self.asked[name]

    @property
    def options(self) -> dict[str, Any]:
        """Options of every verb that integrates."""
        return {"method": "rkf45"} if self["method"] == "rkf45" else {}

    @property
    def forced(self) -> bool:
        """Return whether the system has a forcing period."""
        return self.system.period() is not None

    @property
    def values(self) -> Any:
        """Values of the parameter that is varied."""
        return np.linspace(self["low"], self["high"], self["columns"])

    def span(self, shown: int, duration: float, transient: float) -> dict[str, Any]:
        """Forcing periods of a run, behind the page's transient; of a system without forcing its times."""
        if self.forced:
            return {"periods": shown, "transient": self["transient"]}
        return {"duration": duration, "transient": transient}

    def section(self, phase: float = 0.0) -> Any:
        """Stroboscopic at a phase; where nothing forces the system, its first indicator rising."""
        return ns.Stroboscopic(phase) if self.forced else ns.Poincare(self.system.indicators[0])

    def run(self, verb: Callable[..., Any], *given: Any, **named: Any) -> Any:
        """The result of a verb on the system, with what all of them are given unless ``named`` says otherwise."""
        usual = {"section": self.section(), "transient": self["transient"], "progress": self.heard, **self.options}
        return verb(self.system, *given, **{**usual, **named})


def compute(asked: Mapping[str, Any], heard: Heard) -> Results:
    """The results of a view, by name; Datasets as the verbs return them.

    Parameters
    ----------
    asked : mapping
        ``view``, the ``text`` of the system, its ``values``, ``method``, ``eta`` and the view's own options; a file
        that is to be read has its ``content`` and ``name``.
    heard : function
        Hears the fraction done; False cancels.
    """
    if asked["view"] == "read":
        return read(asked)
    system = _system(asked["text"]).with_parameters(asked["values"])
    if asked["method"] == "smoothed":
        system = system.smoothed(asked["eta"])
    return _WORK[asked["view"]](Job(system.as_solved_by(asked), asked, heard))


@lru_cache(maxsize=8)
def _system(text: str) -> ns.System:
    return ns.System.from_text(text)


def _at_one_point(job: Job, **named: Any) -> Any:
    """A sweep of the parameters as they are."""
    name, value = next(iter(job.system.values.items()))
    return job.run(ns.sweep, name, [value], direction=None, **named)


def _orbit(job: Job) -> Results:
    """The motion reached from a start: its period number and residual, and a record of it."""
    system, start, transient = job.system, job["start"], job["transient"]
    judged = _at_one_point(job, start=start, keep=job["keep"])
    shown = periods_shown(int(judged["period_number"].values[0]))
    span = job.span(shown, 0.0, 0.0)
    if not job.forced:
        times = ns.poincare(
            system, section=job.section(), n=shown + 1, transient=transient, start=start, **job.options
        )["time"].values
        span = {"duration": float(times[-1] - times[0]), "transient": float(times[0])}
    return {"judged": judged, "run": ns.simulate(system, start=start, **span, **job.options)}


def periods_shown(period: int) -> int:
    """Forcing periods of a motion of this period number (0: none) that are drawn."""
    return 2 * min(period, _LONGEST) if period else _CHAOTIC


def _section(job: Job) -> Results:
    """Section points of the motion from a start, at a phase, and which of the last are apart."""
    from nonsmooth.flow.engines.methods import engine_for

    job.heard(0.0)
    exact = engine_for(job.system, **job.options).name == "exact"
    found = ns.poincare(
        job.system,
        section=job.section(job["phase"]),
        n=_POINTS if exact else _POINTS // 5,
        transient=job["transient"],
        start=job["start"],
        **job.options,
    )
    return {"section": found, "apart": distinct(found["section"].values)}


def distinct(points: Any) -> Any:
    """Marks of the points among the last 256 that differ from those before them by 1e-5 of their size or more."""
    last = points[-256:]
    close = 1e-5 * np.maximum(np.ptp(last, axis=0), np.abs(last).max(axis=0))
    apart = np.ones(len(last), dtype=bool)
    for k in range(1, len(last)):
        apart[k] = not (np.abs(last[:k][apart[:k]] - last[k]) <= close).all(axis=1).any()
    return apart


def _sketch(job: Job) -> Results:
    """Pictures of the mechanism over one period of the motion, or some periods where it has none."""
    period, system = job["period"], _system(job["text"]).with_parameters(job["values"])
    shown = min(period, _MOST_MOVED) or 3
    span = job.span(shown, job["span"] * shown / periods_shown(period), 10 * job["span"])
    pictures = _PICTURES * shown
    run = ns.simulate(job.system, start=job["start"], samples=pictures + 1, **span, **job.options)
    time = run["time"].values
    instants = np.linspace(time[0], time[-1], pictures + 1)[:-1]
    return {"sketch": moving(system, run.isel(time=np.searchsorted(time, instants, side="right") - 1))}


def _stability(job: Job) -> Results:
    """Floquet multipliers of a periodic orbit, or the Lyapunov exponents of a motion without a period."""
    if job["period"]:
        orbit = ns.find_orbit(
            job.system,
            start=job["start"],
            period_number=job["period"] if job.forced else None,
            transient=job["transient"],
            budget=10.0,
            progress=job.heard,
        )
        return {"multipliers": np.asarray(orbit.floquet_multipliers)}
    span = job.span(_MEASURED, _MEASURED / _CHAOTIC * job["span"], job["span"])
    return {"exponents": ns.lyapunov(job.system, start=job["start"], progress=job.heard, **span, **job.options)}


def _first_look(job: Job) -> Results:
    """A diagram that nothing judged yet, every column from the same state, on all cores."""
    fast: dict[str, Any] = {"direction": None, "judge": False, "extremes": False}
    return {"diagram": job.run(ns.sweep, job["over"], job.values, start=job["begin"], keep=job["keep"], **fast)}


def _diagram(job: Job) -> Results:
    """The diagram with period numbers and statuses."""
    over, direction, start, keep = (job[name] for name in ("over", "direction", "begin", "keep"))
    if direction == "many":
        few = np.linspace(job["low"], job["high"], 12)
        look = job.run(ns.sweep, over, few, direction=None, start=start, keep=keep, judge=False, progress=False)
        low, high = look["minimum"].min(over).values, look["maximum"].max(over).values
        start = ns.random_starts(_STARTS, (1.5 * low - 0.5 * high).tolist(), (1.5 * high - 0.5 * low).tolist(), seed=1)
    direction = None if direction in ("many", "rest") else direction
    return {"diagram": job.run(ns.sweep, over, job.values, direction=direction, start=start, keep=keep)}


def _branches(job: Job) -> Results:
    """A ``bifurcation_diagram``; of a system without forcing the branch of one cycle."""
    over, ends = job["over"], (job["low"], job["high"])
    common = {"transient": job["transient"], "budget": _BUDGET, "progress": job.heard}
    if "start" not in job.asked:
        return {"branches": ns.bifurcation_diagram(job.system, over, ends, start=job["begin"], **common)}
    return {"cycle": ns.continue_orbit(ns.find_orbit(job.system, start=job["start"], **common), over, ends)}


def _response(job: Job) -> Results:
    """A ``frequency_response``."""
    named = {"parameter": job["over"], "start": job["begin"], "keep": job["keep"]}
    return {"response": job.run(ns.frequency_response, job.values, **named)}


def _chart(job: Job) -> Results:
    """A ``chart``; the finer ones infer what lies far from all boundaries."""
    view = job["view"]
    if not job["across"]:
        raise ValueError(f"{job.system.name!r} has one parameter; a chart needs two")
    n, m = _CHARTS[view]
    grid = {
        job["over"]: np.linspace(job["low"], job["high"], n),
        job["across"]: np.linspace(job["bottom"], job["top"], m),
    }
    if view == "exponents":
        return {view: job.run(ns.chart, grid, start=job["begin"], lyapunov=_RETURNS, extremes=False)}
    return {"chart": job.run(ns.chart, grid, start=job["begin"], refine=view != "first chart")}


def _basins(job: Job) -> Results:
    """``basins`` of the window; where none is given, of one around the motion from rest."""
    names, window = (job["x"], job["y"]), job["window"]
    if names[0] == names[1]:
        raise ValueError("both axes of the phase plane show one state; choose two for its basins")
    if None in window:
        window = _around(job, names)
    ends = {name: window[2 * k : 2 * k + 2] for k, name in enumerate(names)}
    grid = {name: np.linspace(low, high, _BASINS[job["view"]]) for name, (low, high) in ends.items()}
    return {"basins": job.run(ns.basins, grid, fixed=job["fixed"] or None)}


def _around(job: Job, names: tuple[str, str]) -> list[float]:
    """A window about the motion from rest, with room as wide as it is on each side, its ends rounded."""
    run = _at_one_point(job, start=job["begin"], keep=40, judge=False, progress=False)
    ends: list[float] = []
    for state in names:
        low, high = (float(run[which].sel(state=state).values.ravel()[0]) for which in ("minimum", "maximum"))
        if not (np.isfinite([low, high]).all() and high > low):
            high = float(job.system.scale[state])
            low = -high
        step = 10.0 ** math.floor(math.log10(high - low)) / 2  # so that it stays while a parameter is moved
        ends += [math.floor((2 * low - high) / step) * step, math.ceil((2 * high - low) / step) * step]
    return ends


_WORK: dict[str, Callable[[Job], Results]] = {
    "orbit": _orbit,
    "section": _section,
    "sketch": _sketch,
    "stability": _stability,
    "first look": _first_look,
    "diagram": _diagram,
    "branches": _branches,
    "first response": _response,
    "response": _response,
    **dict.fromkeys(_CHARTS, _chart),
    **dict.fromkeys(_BASINS, _basins),
    "spectrum": lambda job: {"spectrum": job.run(ns.amplitude_spectrum, start=job["start"])},
    "recording": lambda job: {"laid": laid_over(job)},
    "fit": fitted,
}
