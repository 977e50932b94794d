"""Names, colours and marks that all pictures of a comparison share, and what is synthetic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nonsmooth.plot import style
from nonsmooth.plot.style import ABOVE

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["ABOVE", "MEASURED", "THEORY", "check_kind", "measured_label", "one_phase", "shade_reach"]

#: Theory is a blue line or cloud with a pale band, the experiment black points.
THEORY = style.COLORS["first"]
MEASURED = style.COLORS["section"]


def measured_label(result: xr.Dataset | Any, word: str = "measured") -> str:
    """The word for the measured side; it says ``synthetic`` where a virtual rig made the data."""
    attrs = getattr(result, "attrs", {})
    return "virtual rig (synthetic)" if str(attrs.get("synthetic", "no")) in ("yes", "True", "1") else word


def check_kind(result: xr.Dataset, *kinds: str) -> None:
    """ValueError where ``result`` is no comparison of one of these kinds."""
    kind = result.attrs.get("comparison", "")
    if kind not in kinds:
        what = f"a comparison of a {kind}" if kind else "no result of compare"
        raise ValueError(f"this picture needs a comparison of a {' or '.join(kinds)}; this is {what}")


def shade_reach(ax: Axes, result: xr.Dataset, x: Any, **looks: Any) -> None:
    """Shade the band of drawn parameters, where the comparison of one state and direction has one."""
    if "theory_low" in result:
        ax.fill_between(x, result["theory_low"], result["theory_high"], linewidth=0, **looks)


def one_phase(result: xr.Dataset, name: str, phase: int = 0) -> xr.DataArray:
    """A variable at one of the sections that were compared."""
    array = result[name]
    return array.isel(section_phase=phase) if "section_phase" in array.dims else array
