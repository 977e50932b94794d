"""Parameters as functions of time within one run: p(t) put into the equations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.errors import shortened
from nonsmooth.system.kinds import real_number

if TYPE_CHECKING:
    from nonsmooth.arrays import FloatArray
    from nonsmooth.system.symbolic.traced import Traced
    from nonsmooth.system.system import System

WATCHED = 101  # values of a linear ramp that are checked to be allowed


def with_ramps(system: System, ramps: Mapping[str, Any], t_begin: float, t_end: float) -> Traced:
    """The system's equations with some parameters replaced by functions of time.

    Parameters
    ----------
    ramps : mapping of parameter to (float, float) or callable
        ``(first, last)``: linear from ``t_begin`` to ``t_end``; a function of the time ``t``, called once with a
        symbol, like the fields of a system. The value is put in as it stands: in ``cos(omega * t)`` a ramp of
        ``omega`` gives the phase omega(t) t, whose frequency is omega + t d omega/dt.

    Returns
    -------
    Traced
        Without a period: time is absolute.

    Raises
    ------
    ValueError, TypeError, SystemDefinitionError
        A parameter that does not exist, a ramp that is none of these, or has a corner, or passes through a value
        that the equations do not allow, or moves an element whose force or impacts depend on that speed.
    """
    from sympy import Float

    from nonsmooth.errors import unknown
    from nonsmooth.system.derived.sliding import slide
    from nonsmooth.system.symbolic.scalar import Scalar
    from nonsmooth.system.symbolic.tracing import call_scalar, refuse_corners

    traced = system.declared
    changes: dict[Any, Any] = {}
    for name, ramp in ramps.items():
        if name not in traced.parameter_names:
            raise ValueError(unknown(name, "a parameter", repr(system.name), traced.parameter_names))
        symbol = traced.p[traced.parameter_names.index(name)]
        if callable(ramp):
            changes[symbol] = call_scalar(ramp, (Scalar(traced.t),), f"the ramp of {name!r}")
            refuse_corners(changes[symbol], {traced.t}, f"the ramp of {name!r}")
        else:
            if np.shape(ramp) != (2,):
                raise TypeError(f"ramps[{name!r}] must be (first, last) or a function of time, not {shortened(ramp)}")
            first, last = (real_number(value, f"ramps[{name!r}]") for value in ramp)
            system.parameter_points({name: np.linspace(first, last, WATCHED)})
            slope = Float((last - first) / (t_end - t_begin))
            changes[symbol] = Float(first) + slope * (traced.t - Float(t_begin))

    loads = system._description.loads
    for load in loads.elements if loads else ():
        if load.where.free_symbols & set(changes) and (load.element.held or "damping" in load.text):
            raise ValueError(
                f"a ramp moves element {load.name!r}, whose equations know no speed that is not written in them: give "
                f"its {load.element.kinematics}, position or belt as a function of time, lambda t, u, p: p.a + p.b * t"
            )

    def put(expressions: Any) -> Any:
        return tuple(expression.xreplace(changes) for expression in expressions)

    transitions = tuple(
        replace(
            jump,
            reset=None if jump.reset is None else put(jump.reset),
            writes=tuple((i, expression.xreplace(changes)) for i, expression in jump.writes),
        )
        for jump in traced.transitions
    )
    if any(jump.at is not None for jump in transitions):
        raise ValueError("ramps cannot be combined with time-triggered transitions: their phase has no fixed period")
    moved = replace(
        traced,
        fields=tuple(put(field) for field in traced.fields),
        indicators=put(traced.indicators),
        transitions=transitions,
        outputs=tuple(put(output) for output in traced.outputs),
        period=None,
    )
    if traced.decider is not None:
        moved = traced.decider.with_changes(moved, changes)
    return slide(moved, system.surfaces, system.scale) if system.surfaces else moved


def values_along(
    system: System, ramps: Mapping[str, Any], t_begin: float, t_end: float, time: FloatArray
) -> FloatArray:
    """The parameters at some instants of a run with ramps, (N, n_parameters)."""
    values = np.tile(system.parameter_vector(), (len(time), 1))
    for name, ramp in ramps.items():
        column = ramp(time) if callable(ramp) else np.interp(time, (t_begin, t_end), ramp)
        values[:, list(system.values).index(name)] = column
    return values
