"""The frame of every figure: a check of what is drawn, axes where none are given, and the options that all have."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any

from nonsmooth.errors import unknown
from nonsmooth.plot import style
from nonsmooth.plot.labels import variable_along

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LINE = ("alpha", "color", "linestyle", "linewidth", "marker", "markersize", "rasterized", "zorder")
_COMMON = {"title": None, "legend": True, "unit": None}
_KEYWORD = inspect.Parameter.KEYWORD_ONLY


def figure(verb: str = "", *variables: str, **size: float) -> Callable[[Callable[..., None]], Callable[..., Axes]]:
    """Make a figure ``(result, ax=None, ...) -> ax`` of a function ``(ax, result, ...)`` that draws on axes.

    The result must be a Dataset with the ``variables`` that those of a ``verb`` have. A new figure has the ``size``
    that ``style.axes`` takes. ``title=``, ``legend=False``, ``unit=`` and properties of lines are applied when all is
    drawn.
    """

    def made(draw: Callable[..., None]) -> Callable[..., Axes]:
        known = inspect.signature(draw).parameters
        own, *others = known.values()
        many = any(one.kind is one.VAR_POSITIONAL for one in others)  # results, among which the axes may stand
        at = next((i for i, one in enumerate(others) if one.kind is _KEYWORD), len(others))
        others.insert(at, own.replace(default=None, annotation="Axes | None", kind=_KEYWORD if many else own.kind))
        taken = inspect.Signature(others)

        @wraps(draw)
        def drawn(*given: Any, **options: Any) -> Axes:
            common = _COMMON | {name: options.pop(name) for name in _COMMON if name in options and name not in known}
            looks = {key: options.pop(key) for key in [*options] if key not in known}
            for key in looks:
                if key not in _LINE:
                    raise TypeError(unknown(key, "an option", draw.__name__, [*known, *_COMMON, *_LINE]))
            if many:
                for one in given[1:]:
                    if one is not None and not hasattr(one, "data_vars"):
                        options["ax"] = one
                given = given[:1] + tuple(one for one in given[1:] if hasattr(one, "data_vars"))
            try:
                bound = taken.bind(*given, **options)
            except TypeError as error:
                raise TypeError(f"{draw.__name__}: {error}") from None
            ax = bound.arguments.pop("ax", None)
            for variable in variables:
                variable_along(bound.args[0], variable, verb)
            there = {*getattr(ax, "lines", ())}
            with style.axes(ax, **size) as paper:
                draw(paper, *bound.args, **bound.kwargs)
            _finish(paper, [line for line in paper.lines if line not in there], looks, **common)
            return paper

        added = [
            inspect.Parameter(name, _KEYWORD, default=value) for name, value in _COMMON.items() if name not in known
        ]
        every = [*others, *added, inspect.Parameter("line", inspect.Parameter.VAR_KEYWORD)]
        drawn.__signature__ = taken.replace(parameters=every)  # type: ignore[attr-defined]
        return drawn

    return made


def _finish(
    ax: Axes,
    lines: list[Any],
    looks: dict[str, Any],
    title: str | None,
    legend: bool,
    unit: str | Mapping[str, str] | None,
) -> None:
    """Apply the options that all figures have."""
    shown = ax.get_legend()
    if looks:
        signs = [] if shown is None else [one for one in shown.legend_handles if hasattr(one, "get_markersize")]
        for line in (*lines, *signs):
            line.set(**looks)
            if "marker" in looks:  # at all points; a cross is nothing but an edge
                line.set(markevery=None, markeredgewidth=0.7)
    if unit is not None:
        from nonsmooth.plot.units import in_unit

        for name, wanted in ({"y": unit} if isinstance(unit, str) else unit).items():
            if name not in ("x", "y"):
                raise ValueError(f"unit = {unit!r}: a unit of the ordinate, or {{'x': 'mm', 'y': 'mm/s'}}")
            in_unit(ax.xaxis if name == "x" else ax.yaxis, wanted)
    if title is not None:
        said = ax.get_title(loc="left")  # of contours and regions: the title stands above it
        ax.set_title(title + "\n" * len(said.splitlines()))
    if not legend and shown is not None:
        shown.remove()
