"""Options that every figure has: a title, a legend or none, the unit of an axis, properties of the lines."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any

from nonsmooth.system.names import unknown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["finished"]

_LINE = ("alpha", "color", "linestyle", "linewidth", "marker", "markersize", "rasterized", "zorder")
_OWN = ("title", "legend", "unit")


def finished(draw: Callable[..., Axes]) -> Callable[..., Axes]:
    """The figure with these options, which are applied when all is drawn."""
    signature = inspect.signature(draw)
    known = signature.parameters

    @wraps(draw)
    def drawn(
        *given: Any, title: str | None = None, legend: bool = True, unit: str | Mapping[str, str] | None = None,
        **options: Any,
    ) -> Axes:  # fmt: skip
        looks = {key: value for key, value in options.items() if key not in known}
        for key in looks:
            if key not in _LINE:
                raise TypeError(unknown(key, "an option", draw.__name__, [*known, *_OWN, *_LINE]))
        every = [*given, *options.values()]
        there = {line for one in every if hasattr(one, "get_legend") for line in one.lines}
        ax = draw(*given, **{key: value for key, value in options.items() if key in known})
        shown = ax.get_legend()
        if looks:
            signs = [] if shown is None else [one for one in shown.legend_handles if hasattr(one, "get_markersize")]
            lines: list[Any] = [*(one for one in ax.lines if one not in there), *signs]
            for line in lines:
                line.set(**looks)
        if unit is not None:
            from nonsmooth.plot.units import in_unit

            for name, wanted in ({"y": unit} if isinstance(unit, str) else unit).items():
                if name not in ("x", "y"):
                    raise ValueError(f"unit = {unit!r}: a unit of the ordinate, or {{'x': 'mm', 'y': 'mm/s'}}")
                in_unit(ax.xaxis if name == "x" else ax.yaxis, wanted)
        if title is not None:
            ax.set_title(title)
        if not legend and shown is not None:
            shown.remove()
        return ax

    added = [
        inspect.Parameter("title", inspect.Parameter.KEYWORD_ONLY, default=None),
        inspect.Parameter("legend", inspect.Parameter.KEYWORD_ONLY, default=True),
        inspect.Parameter("unit", inspect.Parameter.KEYWORD_ONLY, default=None),
        inspect.Parameter("line", inspect.Parameter.VAR_KEYWORD),
    ]
    drawn.__signature__ = signature.replace(parameters=[*known.values(), *added])  # type: ignore[attr-defined]
    return drawn
