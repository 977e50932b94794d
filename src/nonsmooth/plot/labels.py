"""Axis labels and columns of a result by the name of a state, an output or a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nonsmooth.system.parameter import latex_name

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["column", "first_states", "label", "name_with_unit", "only_states", "variable_along", "words_of_flags"]


def label(result: xr.Dataset, name: str) -> str:
    """``$\\rho$ (N)``: the symbol in italics and the unit, for a state, a parameter or an output."""
    symbol, unit = "", "1"
    if "state" in result.coords and name in result["state"].values:
        at = result["state"].values.tolist().index(name)
        unit = str(result["state_unit"].values[at]) if "state_unit" in result.coords else "1"
        symbol = str(result["state_symbol"].values[at]) if "state_symbol" in result.coords else ""
    elif name in result.variables:
        attrs = result[name].attrs
        unit, symbol = attrs.get("units", "1"), attrs.get("symbol", "")
    return name_with_unit("t" if name == "time" else name, unit, symbol)


def name_with_unit(name: str, unit: str, symbol: str = "") -> str:
    """The label itself, where there is no result to look the unit and the symbol up in."""
    text = f"${symbol}$" if symbol else _plain(name)
    return text if unit in ("", "1") else f"{text} ({unit})"


def column(result: xr.Dataset, variable: str, name: str) -> xr.DataArray:
    """The state ``name`` of ``variable`` (``u``, ``section``, ``maximum``, ...), or the output of that name.

    Raises
    ------
    ValueError
        If ``name`` is neither; the message lists what there is.
    """
    states = result["state"].values.tolist() if "state" in result.coords else []
    if name in states:
        return result[variable].isel(state=states.index(name))
    along = result[variable].dims[0]
    others = [str(key) for key, array in result.data_vars.items() if array.dims == (along,) and variable == "u"]
    if name in others:
        return result[name]
    raise ValueError(f"{name!r} is neither a state nor an output of this result; states: {states}; others: {others}")


def variable_along(result: xr.Dataset, variable: str, verb: str) -> None:
    """Check that ``result`` is of the kind a plot needs; an error names the verb that makes such results."""
    if not hasattr(result, "data_vars"):
        raise TypeError(f"this plot draws the result of {verb}, not {type(result).__name__}")
    if variable not in result:
        held = sorted(map(str, result.data_vars))
        raise ValueError(f"this result has no {variable!r}: it is not the result of {verb}; it holds {held}")


def first_states(result: xr.Dataset, *names: str | None) -> list[str]:
    """The names given, and for those left None the states in their order.

    Raises
    ------
    ValueError
        If the system has fewer states than needed.
    """
    states = [str(name) for name in result["state"].values]
    if len(states) < len(names):
        raise ValueError(f"this plot needs {len(names)} states; the system has {states}")
    return [name if name is not None else states[i] for i, name in enumerate(names)]


def only_states(result: xr.Dataset, *names: str | None) -> list[str]:
    """The same for a result that holds nothing but states.

    Raises
    ------
    ValueError
        If the system has fewer states than needed, or none of that name.
    """
    states = [str(name) for name in result["state"].values]
    found = first_states(result, *names)
    for name in found:
        if name not in states:
            raise ValueError(f"{name!r} is not a state of this result; states: {states}")
    return found


def words_of_flags(array: xr.DataArray) -> list[str]:
    """The words of a variable's ``flag_meanings``: the modes' names, the transitions' labels."""
    return str(array.attrs["flag_meanings"]).split()


def _plain(name: str) -> str:
    """A name without a symbol of its own: ``rho`` and ``k_s`` as mathematics, ``contact_force`` as words."""
    latex = latex_name(name)
    return name.replace("_", " ") if latex.startswith(r"\mathrm") else f"${latex}$"
