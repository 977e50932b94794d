"""`system_of`: from a result back to the system that it was computed with."""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.system.system import System


def system_of(result: Any) -> System:
    """Return the system that a result was computed with, at the result's parameters.

    Parameters
    ----------
    result : xarray.Dataset or Orbit
        A result of any verb that takes a system, from memory or from a file. Nothing in it is executed.

    Returns
    -------
    System
        Parameters that the result holds as scalars have these values, so that one point of a sweep or of a branch
        gives the system at that point: ``system_of(diagram.sel(rho=0.4))``. A parameter that varies over the result
        keeps the value it had in the system that the verb was given.

    Raises
    ------
    TypeError
        Something that is no result.
    ValueError
        A Dataset that holds no system: not made by this package, or made from recordings alone.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.impact_oscillator(), periods=2)
    >>> ns.system_of(run) == ns.models.impact_oscillator()
    True
    """
    from nonsmooth.results.provenance import read_provenance

    if not hasattr(result, "data_vars"):
        if isinstance(system := getattr(result, "system", None), System):
            return system
        raise TypeError(f"system_of takes a result (an xarray.Dataset or an Orbit), not {type(result).__name__}")
    record = read_provenance(result)
    if not isinstance(record.get("system"), dict):
        raise ValueError(f"this result (of {record.get('verb')!r}) was not computed with a system, so it holds none")
    system = recorded_system(record)
    here = {name: result.coords[name] for name in system.values if name in result.coords}
    return system.with_parameters(
        {name: float(array) for name, array in here.items() if array.ndim == 0 and np.isfinite(array)}
    )


def recorded_system(record: dict[str, Any]) -> System:
    """The system of a record of `read_provenance`, at the parameters of the record."""
    return System.from_text(record["system"]["text"]).with_parameters(record["system"]["parameters"])
