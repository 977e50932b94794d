"""Computations of the views by the public verbs, one function each; they run in the worker's process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.measured import fitted, laid_over, read
from nonsmooth.explorer.views import CHOSEN

__all__ = ["VIEWS", "Heard", "compute", "periods_shown"]

#: Hears the fraction done and says whether the work is still wanted.
Heard = Callable[[float], bool]

_CHAOTIC = 40  # periods drawn of an orbit without a period
_LONGEST = 12  # periods drawn of one that has a long one
_POINTS = 3000  # of a section
_STARTS = 8
_MEASURED = 1000  # periods over which exponents are measured


def compute(job: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
    """The results of a view, by name; Datasets as the verbs return them.

    Parameters
    ----------
    job : mapping
        ``view``, the ``text`` of the system, its ``values``, ``method``, ``eta`` and the view's own options; a file
        that is to be read has its ``content`` and ``name``.
    heard : function
        Hears the fraction done; False cancels.
    """
    if job["view"] == "read":
        return read(job)
    system = _system(job["text"]).with_parameters(job["values"])
    if job["method"] == "smoothed":
        system = system.smoothed(job["eta"])
    options = {"method": "rkf45"} if job["method"] == "rkf45" else {}
    return VIEWS[job["view"]](system, job, options, heard)


@lru_cache(maxsize=8)
def _system(text: str) -> ns.System:
    return ns.System.from_text(text)


def section_of(system: ns.System, phase: float = 0.0) -> Any:
    """Stroboscopic at a phase; where nothing forces the system, its first indicator rising."""
    return ns.Stroboscopic(phase) if system.period() is not None else ns.Poincare(system.indicators[0])


def _orbit(system: ns.System, job: Mapping[str, Any], options: dict[str, Any], heard: Heard) -> dict[str, Any]:
    """The motion reached from a start: its period number and residual, and a record of it."""
    start, transient = list(job["start"]), job["transient"]
    name = next(iter(system.parameters))
    judged = ns.sweep(
        system, name, [system.values[name]], direction=None, start=start, section=section_of(system),
        transient=transient, keep=job["keep"], progress=heard, **options,
    )  # fmt: skip
    period = int(judged["period_number"].values[0])
    shown = periods_shown(period)
    if system.period() is not None:
        run = ns.simulate(system, periods=shown, transient=transient, start=start, **options)
    else:
        section = section_of(system)
        times = ns.poincare(system, section=section, n=shown + 1, transient=transient, start=start, **options)
        begin, end = (float(times["time"].values[k]) for k in (0, -1))
        run = ns.simulate(system, duration=end - begin, transient=begin, start=start, **options)
    return {"judged": judged, "run": run}


def periods_shown(period: int) -> int:
    """Forcing periods of a motion of this period number (0: none) that are drawn."""
    return 2 * min(period, _LONGEST) if period else _CHAOTIC


def _section(system: ns.System, job: Mapping[str, Any], options: dict[str, Any], heard: Heard) -> dict[str, Any]:
    """Section points of the motion from a start, at a phase."""
    heard(0.0)
    points = ns.poincare(
        system, section=section_of(system, job["phase"]), n=_POINTS if _is_exact(system, options) else _POINTS // 5,
        transient=job["transient"], start=list(job["start"]), **options,
    )  # fmt: skip
    return {"section": points}


def _stability(system: ns.System, job: Mapping[str, Any], options: dict[str, Any], heard: Heard) -> dict[str, Any]:
    """Floquet multipliers of a periodic orbit, or the Lyapunov exponents of a motion without a period."""
    if job["period"]:
        orbit = ns.find_orbit(
            system, start=list(job["start"]), period_number=job["period"] if system.period() is not None else None,
            transient=job["transient"], budget=10.0, progress=heard,
        )  # fmt: skip
        return {"multipliers": np.asarray(orbit.floquet_multipliers)}
    forced = system.period() is not None
    found = ns.lyapunov(
        system, start=list(job["start"]), transient=job["transient"] if forced else job["span"], progress=heard,
        periods=_MEASURED if forced else None, duration=None if forced else _MEASURED / _CHAOTIC * job["span"],
        **options,
    )  # fmt: skip
    return {"exponents": found}


def _first_look(system: ns.System, job: Mapping[str, Any], options: dict[str, Any], heard: Heard) -> dict[str, Any]:
    """A diagram that nothing judged yet, every column from the same state, on all cores."""
    return {"diagram": ns.sweep(
        system, job["over"], _values(job), direction=None, start=list(job["begin"]), section=section_of(system),
        transient=job["transient"], keep=job["keep"], judge=False, extremes=False, progress=heard,
        **options,
    )}  # fmt: skip


def _diagram(system: ns.System, job: Mapping[str, Any], options: dict[str, Any], heard: Heard) -> dict[str, Any]:
    """The diagram with period numbers and statuses."""
    direction, start = job["direction"], list(job["begin"])
    common = {"section": section_of(system), "transient": job["transient"], "keep": job["keep"], **options}
    if direction == "many":
        few = _values({**job, "columns": 12})
        look = ns.sweep(system, job["over"], few, direction=None, start=start, judge=False, progress=False, **common)
        low, high = look["minimum"].min(job["over"]).values, look["maximum"].max(job["over"]).values
        start = ns.random_starts(_STARTS, (1.5 * low - 0.5 * high).tolist(), (1.5 * high - 0.5 * low).tolist(), seed=1)
    return {"diagram": ns.sweep(
        system, job["over"], _values(job), direction=None if direction in ("many", "rest") else direction, start=start,
        progress=heard, **common,
    )}  # fmt: skip


def _values(job: Mapping[str, Any]) -> np.ndarray:
    return np.linspace(job["low"], job["high"], job["columns"])


def _is_exact(system: ns.System, options: Mapping[str, Any]) -> bool:
    from nonsmooth.flow.engines.methods import engine_for

    return engine_for(system, **options).name == "exact"


VIEWS: dict[str, Callable[..., dict[str, Any]]] = {
    "orbit": _orbit, "section": _section, "stability": _stability, "first look": _first_look, "diagram": _diagram,
    **{stage: view.compute for stage, view in CHOSEN.items()},
    "recording": laid_over, "fit": fitted,
}  # fmt: skip
