"""Figure 2: the regions of the sharp and of the smoothed system in the plane of the states."""

from __future__ import annotations

from nonsmooth import plot
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure
from nonsmooth_savi2007.flows import ETA, EXACT, SMOOTHED


def _draw(canvas: Canvas, data: Datasets) -> None:
    left, right = canvas.subplots(1, 2)
    for ax, flow in ((left, EXACT), (right, SMOOTHED)):
        plot.regions(flow.system(g=0.0), ax, xlim=(-5 * ETA, 5 * ETA), ylim=(-0.12, 0.12))
    left.set_title("(a) non-smooth system, Eqs. 4-5")
    right.set_title(r"(b) smoothed system, $\eta = 10$ µm, Eqs. 9-10")
    for ax in (left, right):
        ax.set_xlabel(ax.get_xlabel().replace("$x$", "$x - g$"))


def _caption(data: Datasets) -> str:
    return (
        "Regions of the state plane with Table 1's support, near x = g: (a) without contact (white) and in contact "
        "(blue), parted by the surfaces S_a (x = g) and S_b (the support's force vanishes); (b) the bands of half "
        "width eta of the smoothed system in their place. Drawn from the system's own conditions."
    )


FIGURES = (Figure("fig02", 2, "Regions and surfaces", lambda settings: {}, _draw, _caption, (1.0, 0.42)),)
