"""Curves of special points in the plane of two parameters, with their points of codimension two."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nonsmooth.plot import style
from nonsmooth.plot.branch import mark_special
from nonsmooth.plot.labels import name_plane, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["curve"]

#: Colour, line and words of each kind of curve.
KINDS = {
    "fold": ("first", "-", "fold"),
    "flip": ("second", "--", "flip"),
    "neimark_sacker": ("fourth", "-.", "Neimark-Sacker"),
    "grazing": ("section", ":", "grazing"),
}
#: Marker and words of each point of codimension two.
POINTS = {
    "cusp": ("v", "cusp"),
    "fold_flip": ("s", "fold-flip"),
    "resonance_1_1": ("D", "1:1 resonance"),
    "resonance_1_2": ("h", "1:2 resonance"),
    "resonance_1_3": ("^", "1:3 resonance"),
    "resonance_1_4": ("d", "1:4 resonance"),
    "grazing_fold": ("o", "grazing-fold"),
    "grazing_flip": ("p", "grazing-flip"),
    "grazing_neimark_sacker": ("8", "grazing-Neimark-Sacker"),
    "double_grazing": ("X", "double grazing"),
    "generalised_flip": ("*", "generalised flip"),
    "chenciner": ("<", "Chenciner"),
    "fold_neimark_sacker": (">", "fold-Neimark-Sacker"),
    "flip_neimark_sacker": ("H", "flip-Neimark-Sacker"),
    "corner": ("P", "corner"),
}


def curve(result: xr.Dataset, ax: Axes | None = None, *, special: bool = True, color: str | None = None) -> Axes:
    """Draw a curve of special points over its two parameters; call it again on the same axes for another curve.

    Parameters
    ----------
    result
        A ``continue_curve``. Folds are solid, flips dashed, Neimark-Sacker points dash-dotted, grazing points dotted.
    ax
        Where to draw; a new one-column figure if None.
    special
        Mark the points of codimension two, each kind with its own sign, named in the legend.
    color
        Colour of the line in place of that of its kind.
    """
    variable_along(result, "kind", "continue_curve")
    variable_along(result, "special_point", "continue_curve")
    # The two parameters are the only coordinates over the points, in the order in which they were given.
    names = [str(name) for name, values in result.coords.items() if values.dims == ("point",)]
    x, y = names
    shade, line, words = KINDS[str(result["kind"].values)]
    with style.axes(ax) as drawn:
        drawn.plot(
            result[x].values, result[y].values, line, color=color or style.COLORS[shade], linewidth=1.0, zorder=3,
            label=style.once(drawn, words), path_effects=style.halo(1.8) if _over_chart(drawn) else None,
        )  # fmt: skip
        if special:
            mark_special(drawn, result, result[x].values, result[y].values[None], POINTS)
        name_plane(drawn, result, x, y)
        _legend(drawn)
    return drawn


def _over_chart(ax: Axes) -> bool:
    from matplotlib.collections import QuadMesh

    return any(isinstance(item, QuadMesh) for item in ax.collections)


def _legend(ax: Axes) -> None:
    """The legend of the curves; that of a chart beneath them stays, and the new one stands below it."""
    own, before = ax.get_legend_handles_labels()[1], ax.get_legend()
    if before is not None and not {text.get_text() for text in before.get_texts()} <= set(own):
        ax.add_artist(before)
        before.set_clip_on(False)  # else the layout takes it for a thing within the axes, and cuts it
    if _over_chart(ax):
        ax.legend(loc="lower left", bbox_to_anchor=(1.01, 0.0), borderaxespad=0.0)
    else:
        ax.legend(loc="best")
