"""The engine that runs a system: the meaning of ``method=``, ``rtol=``, ``atol=`` and ``step=`` everywhere."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.system.kinds import float_array

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced
    from nonsmooth.system.system import System

RTOL = 1e-9
SHARPEST = 1e-15  # the relative tolerance of a Taylor series for linear modes beyond the exact flow's kernels


def engine_for(
    system: System,
    method: str = "auto",
    rtol: float | None = None,
    atol: Any = None,
    step: float | None = None,
    order: int | None = None,
    locate: bool = True,
    *,
    traced: Traced | None = None,
) -> Engine:
    """The engine for a system, and the options of :class:`nonsmooth.flow.options.Solver`.

    Parameters
    ----------
    step : float, optional
        A fixed step (``"taylor"`` and ``"rkf45"``).
    traced : Traced, optional
        Equations in place of the system's own (parameters that are functions of time).

    Raises
    ------
    ValueError, TypeError
        A method that does not fit, or tolerances for a method that has none.
    """
    tolerance = RTOL if rtol is None else rtol
    absolute = None if atol is None else _absolute(system, atol)
    expert: dict[str, Any] = ({} if order is None else {"order": order}) | ({} if locate else {"locate": False})
    if order is not None and method in ("exact", "rkf45"):
        raise ValueError(f'order is that of method="taylor"; method={method!r} has its own')
    equations = system.traced if traced is None else traced
    if equations.patterns is not None:
        tolerances = method == "exact" and (rtol is not None or atol is not None)
        return _of_patterns(system, method, tolerances or step is not None or bool(expert))
    form = None
    if method in ("auto", "exact") and traced is None:
        from nonsmooth.system.codegen.linear import linear_form

        form = linear_form(equations.without_answers()[0])
    if method == "exact":
        if form is None:
            raise ValueError(
                f"{system.name!r} has no exact flow: some mode is not linear with constant coefficients and harmonic "
                'forcing; use method="taylor" or "rkf45"'
            )
        if rtol is not None or atol is not None or step is not None:
            raise ValueError('method="exact" has no tolerance and no step; leave rtol, atol and step out')
    # A smoothed system runs by its series, also where its bands happen to be linear: one method for all of them.
    # A step or an order asks for a method that has one.
    if form is not None and not system.is_smoothed and step is None and "order" not in expert:
        from nonsmooth.flow.engines.linear import LinearEngine, PlanarEngine, is_linear

        if is_linear(equations, form) and not expert:
            plain = not equations.m and not any(map(any, equations.lacking))
            kind = PlanarEngine if plain and len(equations.u) == 2 else LinearEngine
            return kind(equations, form, system.scale_vector())
    if method == "exact":
        raise ValueError(
            f"{system.name!r} has linear modes, but {_beyond(system, form, expert)}: such a system runs by Taylor "
            f'series at rtol = {SHARPEST:g}, as exactly; leave method out, or use method="taylor"'
        )
    free = method == "auto" and rtol is None and step is None and order is None
    if form is not None and free and not system.is_smoothed:
        tolerance = SHARPEST  # what has linear modes is exact, whatever its indicators
    name = "taylor" if method == "auto" else method
    from nonsmooth.flow.engines.series import SeriesEngine

    return SeriesEngine(equations, system.scale_vector(), name, tolerance, absolute, step=step, **expert)


def _beyond(system: System, form: Any, expert: Mapping[str, Any]) -> str:
    """The reason why the exact flow does not take a system with linear modes."""
    if expert or system.is_smoothed:
        return "it is smoothed" if system.is_smoothed else f"{', '.join(sorted(expert))} belongs to a series"
    if not form.affine_indicators:
        return "some indicator is not affine"
    return "some reset is not affine" if not form.affine_resets else "too many modes and states for its tables"


def _of_patterns(system: System, method: str, options: bool) -> Engine:
    """The engine of a system whose patterns of phases are made when they are visited."""
    from nonsmooth.flow.engines.patterns import PatternEngine

    traced = system.traced
    assert traced.patterns is not None
    if method not in ("auto", "exact") or options:
        raise ValueError(
            f"the elements of {system.name!r} {traced.patterns.why}, so that a pattern of their phases is made when it "
            "is first visited; that is done by the exact flow alone: leave out method, rtol, atol, step, order and "
            "locate"
        )
    return PatternEngine(traced, traced.patterns, system.scale_vector())


def warn_if_coarse(system: System, engine: Engine, largest: FloatArray) -> None:
    """Warn where no state ever exceeds a hundred times its ``atol``: the tolerance is then as large as the motion.

    Parameters
    ----------
    largest : array (n,)
        The largest size of each state, that at the start included.
    """
    absolute = getattr(engine, "norms", (None, None))[1]
    if engine.name == "exact" or absolute is None or not (largest > 0).any():
        return
    if (largest[np.isfinite(largest)] < 100.0 * absolute[np.isfinite(largest)]).all():
        sizes = ", ".join(f"{name!r}: {size:.2g}" for name, size in zip(system.states, largest, strict=True))
        warnings.warn(
            f"{system.name!r}: the states stay below a hundred times atol, so they may be wrong by as much as they "
            f"are; give System(scale={{{sizes}}}), or atol",
            stacklevel=3,
        )


def _absolute(system: System, atol: Any) -> FloatArray:
    """Absolute tolerances per state."""
    names = list(system.states)
    if isinstance(atol, Mapping):
        missing = set(names) ^ set(atol)
        if missing:
            raise ValueError(f"atol must name each state of {names} once; wrong: {sorted(missing)}")
        atol = [atol[name] for name in names]
    values = float_array(atol, "atol")
    if values.shape not in ((), (1,), (len(names),)):
        raise ValueError(f"atol must be one number or one for each of {', '.join(names)}, not of shape {values.shape}")
    values = np.broadcast_to(values, (len(names),)).copy()
    if not (np.isfinite(values).all() and (values > 0).all()):
        raise ValueError(f"atol = {atol} must be positive and finite")
    return values
