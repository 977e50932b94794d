"""Axis labels and columns of a result by the name of a state, an output or a parameter."""

from __future__ import annotations

import re
from collections.abc import Iterable
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.plot.prefixes import together
from nonsmooth.system.parameter import latex_name

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


#: The name of one state, output or quantity.
Name = Annotated[str, "it is one name: draw each by a call of its own, into the same axes with ax="]


def name_and_unit(result: xr.Dataset, name: str) -> tuple[str, str]:
    """``("$\\rho$", "N")``: symbol and unit of a state, a parameter or an output, the unit being that of its values."""
    symbol, unit = "", "1"
    if "state" in result.coords and name in result["state"].values:
        at = result["state"].values.tolist().index(name)
        unit = str(result["state_unit"].values[at]) if "state_unit" in result.coords else "1"
        symbol = str(result["state_symbol"].values[at]) if "state_symbol" in result.coords else ""
    elif name in result.variables:
        attrs = result[name].attrs
        unit, symbol = attrs.get("units", "1"), attrs.get("symbol", "")
    return symbol_of("t" if name == "time" else name, symbol), unit


def with_unit(text: str, unit: str) -> str:
    """``text (unit)``; of what has no unit the text alone."""
    return text if unit in ("", "1") else f"{text} ({unit})"


def in_lines(words: str, longest: int) -> str:
    """Words in lines of at most ``longest`` characters, a condition broken before each ``and`` and ``or``."""
    parts = [words] if len(words) <= longest else re.split(r" (?=and |or )", words)
    return "\n".join(fill(part, longest) for part in parts)


def name_axes(ax: Axes, x: tuple[str, str] | None = None, y: tuple[str, str] | None = None) -> None:
    """Label the axes with quantities and units, in the prefixes that suit what is drawn."""
    from nonsmooth.plot.units import name_axis

    named = [(axis, *one) for axis, one in ((ax.xaxis, x), (ax.yaxis, y)) if one is not None]
    largest = together([(unit, float(np.abs(axis.get_view_interval()).max())) for axis, _, unit in named])
    for one, most in zip(named, largest, strict=True):
        name_axis(*one, most)


def name_plane(ax: Axes, result: xr.Dataset, x: str, y: str, before: str = "") -> None:
    """Label the axes with two quantities of a result, in the prefixes that suit what is drawn; call it at the end.

    Parameters
    ----------
    ax
    result
    x, y : str
        States, parameters or outputs of the result, or ``"time"``.
    before : str
        Words before the name of ``y``.
    """
    text, unit = name_and_unit(result, y)
    name_axes(ax, name_and_unit(result, x), (before + text, unit))


def symbol_of(name: str, symbol: str = "") -> str:
    """``$x$``: the symbol in italics, made from the name where none is given; ``contact force`` stays words."""
    if symbol:
        return f"${symbol}$"
    latex = latex_name(name)
    return name.replace("_", " ") if latex.startswith(r"\mathrm") else f"${latex}$"


def column(result: xr.Dataset, variable: str, name: str) -> xr.DataArray:
    """The state ``name`` of ``variable`` (``u``, ``section``, ``maximum``, ...), or the output of that name.

    ValueError: if ``name`` is neither; the message lists what there is."""
    states = result["state"].values.tolist() if "state" in result.coords else []
    if name in states:
        return result[variable].isel(state=states.index(name))
    along = result[variable].dims[0]
    others = [str(key) for key, array in result.data_vars.items() if array.dims == (along,) and variable == "u"]
    if name in others:
        return result[name]
    raise ValueError(f"{name!r} is neither a state nor an output of this result; states: {states}; others: {others}")


def columns(result: xr.Dataset, variable: str, names: Iterable[str]) -> list[Any]:
    """The values of several states or outputs, as :func:`column` finds each."""
    return [column(result, variable, name).values for name in names]


def by_direction(result: xr.Dataset, array: xr.DataArray) -> list[tuple[str, xr.DataArray]]:
    """A quantity of a sweep in each of its directions."""
    words = np.atleast_1d(result["direction"].values).astype(str).tolist()
    return [(word, one_of(array, "direction", i, "direction")) for i, word in enumerate(words)]


def variable_along(result: xr.Dataset, variable: str, verb: str) -> None:
    """Check that ``result`` is of the kind a plot needs; an error names the verb that makes such results."""
    if not hasattr(result, "data_vars"):
        kind = type(result).__name__
        instead = {"Orbit": "; an orbit is drawn by ns.plot.orbit", "System": f"; call ns.{verb} with it first"}
        raise TypeError(f"this plot draws the result of {verb}, not {kind}{instead.get(kind, '')}")
    if "state" in result.coords and not result["state"].dims:
        one = str(result["state"].values)
        raise ValueError(
            f"one state was taken out of this result: keep the others, or the dimension by sel(state=[{one!r}])"
        )
    if variable not in result:
        held = sorted(map(str, result.data_vars))
        raise ValueError(f"this result has no {variable!r}: it is not the result of {verb}; it holds {held}")


def one_of(array: Any, dim: str, at: int, name: str) -> Any:
    """An array, or a result, at one place of a dimension that it may have; ``name`` is that of the argument."""
    size = array.sizes.get(dim, 1)
    if at >= size:
        raise ValueError(f"{name} = {at}: this result has {size}; allowed: {', '.join(map(str, range(size)))}")
    return array.isel({dim: at}) if dim in array.dims else array


def first_states(result: Any, *names: str | None) -> list[str]:
    """The names given, and for those left None the states in their order.

    ValueError: if the system has fewer states than needed."""
    states = _states(result)
    if len(states) < len(names):
        raise ValueError(f"this plot needs {len(names)} states; the system has {states}")
    return [name if name is not None else states[i] for i, name in enumerate(names)]


def only_states(result: Any, *names: str | None) -> list[str]:
    """The same for a result that holds nothing but states, or for a system.

    ValueError: if the system has fewer states than needed, or none of that name."""
    found, states = first_states(result, *names), _states(result)
    for name in found:
        if name not in states:
            raise ValueError(f"{name!r} is not a state; states: {states}")
    return found


def _states(result: Any) -> list[str]:
    """The states of a result, or of a system."""
    return [str(name) for name in (result["state"].values if hasattr(result, "data_vars") else result.states)]
