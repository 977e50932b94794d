"""The experimental side of Figs. 11 and 12: a slow rise of the forcing on the virtual rig, and steady records."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import plot
from nonsmooth.plot.comparison_diagram import comparison_diagram
from nonsmooth.studies.savi2007.figure import Figure, sheet
from nonsmooth.studies.savi2007.flows import Settings
from nonsmooth.studies.savi2007.printed import FIGURE_12, NUMBERS
from nonsmooth.studies.savi2007.rig_motions import GRID, compared, draw_pairs, motions, said

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure as Canvas

__all__ = ["FIGURES", "RISES", "flips_said", "rate_of", "slowest"]

RISES = (450.0, 900.0, 1800.0)  # s, from 0.2 to 0.5 N; the second is drawn
_DRAWN = "900"
_PRINTED = [NUMBERS[f"period {n} from"].value for n in (4, 2, 1)]


def _compute_11(settings: Settings) -> dict[str, xr.Dataset]:
    bench, data = settings.bench, {}
    for duration in RISES[1:2] if settings.quick else RISES:
        session = bench.record(f"fig11_{duration:g}_s", bench.rig.figure(11, duration=duration))
        measured, set_ = bench.measured(session, "rise", bench.with_support(session, "rise"))
        fine = 121 if settings.quick else 301
        data[f"{duration:g}"] = bench.compare(
            measured, set_, parameter="rho", direction="up", values=np.linspace(0.2, 0.5, fine)
        ).assign_attrs(rise=f"{duration:g} s")
    return data


def _draw_11(data: Mapping[str, xr.Dataset]) -> Canvas:
    with plot.journal():
        canvas = sheet(0.72 * plot.PAGE, 0.5 * plot.PAGE)
        ax = canvas.subplots()
        comparison_diagram(data[_DRAWN], ax, y="v")
        for i, value in enumerate(_PRINTED):
            ax.axvline(
                value, color="black", linewidth=0.6, linestyle=":", zorder=0,
                label="printed in the paper" if i == 0 else None,
            )  # fmt: skip
        ax.legend(loc="lower right", markerscale=4)
    return canvas


def rate_of(rise: xr.Dataset) -> float:
    """The rate of a rise (N/s)."""
    return 0.3 / float(rise.attrs["rise"].split()[0])


def _caption_11(data: Mapping[str, xr.Dataset]) -> str:
    words = []
    for result in data.values():
        words.append(f"{1e3 * rate_of(result):.3f} mN/s: {flips_said(result, 'measured')}")
    return (
        "Velocity at the section while the forcing of the virtual rig (synthetic) rises slowly and evenly, 0.2 to "
        f"0.5 N in {_DRAWN} s, over the model's diagram with the parameters identified. Ticks above: flips of rig "
        f"(black) and model (blue). Flips of the rig in N at {len(words)} rates: {'; '.join(words)}. The model's: "
        f"{flips_said(data[_DRAWN], 'theory')}. Dotted: the paper's printed ends of chaos, period 4 and period 2."
    )


def slowest(data: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """The rise that took longest."""
    return min(data.values(), key=rate_of)


def flips_said(result: xr.Dataset, side: str) -> str:
    """``1-2 at 0.4013, 2-4 at 0.2698``: the flips of one side."""
    rows = zip(result["flip"].values, result[f"{side}_flip"].values, strict=True)
    return ", ".join(f"{name} at {value:.4f}" for name, value in rows) or "none found"


def _compute_12(settings: Settings) -> dict[str, xr.Dataset]:
    periods = 60 if settings.quick else 200
    return compared(settings.bench, motions(settings.bench, 12, tuple(FIGURE_12), periods=periods), grid=GRID)


def _caption_12(data: Mapping[str, xr.Dataset]) -> str:
    return (
        "State space with section points at four amplitudes of Fig. 11, the model with the parameters identified "
        "(above) and the virtual rig (synthetic, below); rings: the model's section points; contact zone shaded. "
        f"Rig: {said(data, FIGURE_12)}."
    )


FIGURES = (
    Figure("fig11_rig", 11, "Slow rise of the forcing", _compute_11, _draw_11, _caption_11,
           rig=True),
    Figure("fig12_rig", 12, "State space over the forcing amplitude", _compute_12,
           draw_pairs("N", r"\rho", FIGURE_12), _caption_12, rig=True),
)  # fmt: skip
