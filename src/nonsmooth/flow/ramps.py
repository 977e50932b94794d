"""Parameters as functions of time within one run: p(t) put into the equations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonsmooth.system.system import System
    from nonsmooth.system.traced import Traced

__all__ = ["with_ramps"]


def with_ramps(system: System, ramps: Mapping[str, Any], t_begin: float, t_end: float) -> Traced:
    """The system's equations with some parameters replaced by functions of time.

    Parameters
    ----------
    ramps : mapping of parameter to (float, float) or callable
        ``(first, last)``: linear from ``t_begin`` to ``t_end``; a function of the time ``t``, called once with a
        symbol, like the fields of a system.

    Returns
    -------
    Traced
        Without a period: time is absolute.
    """
    from sympy import Float

    from nonsmooth.system.names import unknown
    from nonsmooth.system.scalar import Scalar
    from nonsmooth.system.tracing import call_scalar

    traced = system.traced
    changes: dict[Any, Any] = {}
    for name, ramp in ramps.items():
        if name not in traced.parameter_names:
            raise ValueError(unknown(name, "a parameter", repr(system.name), traced.parameter_names))
        symbol = traced.p[traced.parameter_names.index(name)]
        if isinstance(ramp, Callable):  # type: ignore[arg-type]
            changes[symbol] = call_scalar(ramp, (Scalar(traced.t),), f"ramp of {name!r}")
        else:
            try:
                first, last = (float(value) for value in ramp)
            except (TypeError, ValueError):
                raise TypeError(
                    f"ramps[{name!r}] must be (first, last) or a function of time, not {ramp!r}"
                ) from None
            slope = Float((last - first) / (t_end - t_begin))
            changes[symbol] = Float(first) + slope * (traced.t - Float(t_begin))

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
    return replace(
        traced,
        fields=tuple(put(field) for field in traced.fields),
        indicators=put(traced.indicators),
        transitions=transitions,
        outputs=tuple(put(output) for output in traced.outputs),
        period=None,
    )
