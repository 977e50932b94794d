"""The experimental side of Figs. 9 and 10: frequency steps on the virtual rig over the model's response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nonsmooth.plot import comparison_response
from nonsmooth.studies.savi2007.figures.diagrams import shared_legend
from nonsmooth.studies.savi2007.figures.figure import Canvas, Compute, Datasets, Draw, Figure, drawn
from nonsmooth.studies.savi2007.figures.resonance import mark_printed
from nonsmooth.studies.savi2007.flows import Settings
from nonsmooth.studies.savi2007.laboratory import as_result
from nonsmooth.studies.savi2007.measure import measured_jumps, measured_periods
from nonsmooth.studies.savi2007.printed import NUMBERS

__all__ = ["FIGURES"]


def _compute(number: int) -> Compute:
    def compute(settings: Settings) -> Datasets:
        bench = settings.bench
        session = bench.record(f"fig{number:02d}", bench.rig.figure(number, **_steps(settings, number)))
        measured, set_ = bench.measured(session, "response", bench.with_support(session, "response"))
        return {"compared": bench.compare(measured, set_), "runs": as_result(measured, "response over frequency")}

    return compute


def _steps(settings: Settings, number: int) -> dict[str, Any]:
    """Steps of the frequency: the rig's own for Fig. 9; for Fig. 10 finer about its small jump; few for a quick run."""
    from nonsmooth.studies.savi2007.rig.motor import voltage_for

    if settings.quick:
        omegas, options = np.arange(2.5, 6.6, 0.25), {"duration": 14.0}
    elif number == 10:
        parts = ((2.4, 2.6, 0.05), (2.64, 2.78, 0.01), (2.8, 5.4, 0.1), (5.45, 6.65, 0.05), (6.7, 7.3, 0.1))
        omegas = np.concatenate([np.arange(low, high + step / 2, step) for low, high, step in parts])
        options = {}
    else:
        return {}
    return {"voltages": [voltage_for(settings.bench.rig, float(omega)) for omega in omegas], **options}


def _draw(printed: Mapping[str, float]) -> Draw:
    @drawn(0.72, 0.6)
    def draw(canvas: Canvas, data: Datasets) -> None:
        ax = canvas.subplots()
        comparison_response(data["compared"], ax)
        mark_printed(ax, printed)
        shared_legend(canvas, columns=2)

    return draw


def _caption(data: Datasets) -> str:
    runs, compared = data["runs"], data["compared"]
    words = []
    for direction, word in (("up", "rising"), ("down", "falling")):
        found = ", ".join(str(jump) for jump in measured_jumps(runs, direction)) or "none"
        words.append(f"{word}: {found} rad/s")
    doubled = int(np.count_nonzero(measured_periods(runs)[1] == 2))
    differences = 100 * np.abs(compared["relative_difference"].values)
    return (
        f"Frequency steps on the virtual rig (synthetic), {runs.sizes['run']} runs with rising and falling frequency, "
        f"over the model's response with the parameters identified, rho = {float(compared['rho']):.4f} N and g = "
        f"{1e3 * float(compared['g']):.3f} mm. Jumps of the rig, {'; '.join(words)}; {doubled} runs with period 2. "
        f"Half of the runs lie within {np.nanmedian(differences):.2f} % of the model, nine of ten within "
        f"{np.nanquantile(differences, 0.9):.1f} %. Diamonds: jumps measured (full) and predicted (open), with their "
        "difference."
    )


_PRINTED_9 = {key: NUMBERS[key].value for key in ("period 2 near", "jump rising", "jump falling")}

FIGURES = (
    Figure("fig09_rig", 9, "Frequency response with a period-2 range", _compute(9),
           _draw(_PRINTED_9), _caption, rig=True),
    Figure("fig10_rig", 10, "Frequency response with a small jump", _compute(10), _draw({}),
           _caption, rig=True),
)  # fmt: skip
