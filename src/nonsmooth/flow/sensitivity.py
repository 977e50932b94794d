"""``sensitivity``: how a whole run, through all its transitions, answers to its start and to parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.errors import SolveError
from nonsmooth.flow.arguments import check_system
from nonsmooth.flow.engine import FloatArray, Log, State
from nonsmooth.flow.methods import engine_for
from nonsmooth.flow.saltation import Jump
from nonsmooth.flow.simulate import run_length
from nonsmooth.flow.starts import first_state, plain_start
from nonsmooth.flow.variational import Legs, VariationalFlow
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["Variation", "sensitivity", "variation"]

RTOL = 1e-15


class Variation:
    """One run taken apart: its legs, the jumps between them, and their products.

    Attributes
    ----------
    modes : list of int, times : list of float
        Mode and beginning of each leg.
    legs : Legs
    jumps : list of Jump
        Between the legs; transitions at one instant are one.
    transitions : list of tuple of int
    Phi, P : array (n, n), (n, n_active)
        Derivatives of the end in the start and in the parameters, at fixed times.
    """

    def __init__(self, flow: VariationalFlow, values: FloatArray, log: Log, first: tuple[int, FloatArray],
                 t_begin: float, t_end: float) -> None:  # fmt: skip
        traced, n_u = flow.traced, flow.n_u
        self.modes, starts, self.times = [first[0]], [first[1]], [t_begin]
        self.transitions: list[tuple[int, ...]] = []
        before: list[FloatArray] = []
        memory = first[1][n_u:]
        for i, t in enumerate(log.crossing_time):
            k = int(log.crossing_transition[i])
            after = np.concatenate([np.nan_to_num(log.u_after[i]), log.memory_after[i]])
            if self.transitions and t == self.times[-1]:  # a chain at one instant
                self.transitions[-1] += (k,)
                self.modes[-1], starts[-1] = traced.transitions[k].target, after
            else:
                self.transitions.append((k,))
                before.append(np.concatenate([np.nan_to_num(log.u_before[i]), memory]))
                self.modes.append(traced.transitions[k].target)
                starts.append(after)
                self.times.append(float(t))
            memory = log.memory_after[i]
        taus = np.diff([*self.times, t_end])
        self.legs: Legs = flow.legs(values, self.modes, self.times, taus, starts)
        self.jumps: list[Jump] = [
            flow.jump(values, chain, t, z) for chain, t, z in zip(self.transitions, self.times[1:], before, strict=True)
        ]
        self.Phi, self.P = self.legs.Phi[0], self.legs.P[0]
        for i, jump in enumerate(self.jumps, start=1):
            self.Phi = self.legs.Phi[i] @ (jump.saltation @ self.Phi)
            self.P = self.legs.Phi[i] @ (jump.saltation @ self.P + jump.parameter_column) + self.legs.P[i]

    @property
    def log_determinant(self) -> float:
        """log\\|det Phi\\| from the determinants of the legs' matrices and of the saltation matrices."""
        legs = np.linalg.slogdet(self.legs.Phi)[1].sum()
        return float(legs + sum(jump.log_determinant for jump in self.jumps))

    @property
    def trace(self) -> float:
        """What it must be: the integral of div f, and log\\|det S\\| of every transition."""
        return float(self.legs.divergence.sum() + sum(jump.log_determinant for jump in self.jumps))


def variation(
    system: System, flow: VariationalFlow, state: State, t_end: float, method: str = "auto"
) -> tuple[Variation, Log]:
    """Run from ``state`` (t = 0) to ``t_end`` and take the run apart.

    Raises
    ------
    SolveError
        The run could not be completed.
    """
    engine = engine_for(system, method, None if _is_exact(system, method) else RTOL)
    values = system.parameter_vector()
    log = engine.record(engine.prepare(values[None, :]), state, t_end, np.zeros(1))
    if log.status not in (codes.OK, codes.NOT_GUARANTEED):
        from nonsmooth.results.statuses import by_code

        status = by_code(codes.NO_CONVERGENCE if log.status < 0 else log.status)
        raise SolveError(status.sentence, time=float(state.clock[0]), status=status.name)
    first = int(log.sample_mode[0]), np.concatenate([np.nan_to_num(log.sample_u[0]), log.sample_memory[0]])
    return Variation(flow, values, log, first, 0.0, t_end), log


def _is_exact(system: System, method: str) -> bool:
    from nonsmooth.system.linear import linear_form

    return method != "taylor" and not system.is_smoothed and linear_form(system.traced) is not None


def sensitivity(
    system: System,
    *,
    periods: float | None = None,
    duration: float | None = None,
    start: Any = None,
    mode: str | None = None,
    parameters: Sequence[str] = (),
) -> xr.Dataset:
    r"""Derivatives of a run's end in its start and in parameters, through every transition.

    .. math:: \Phi = \frac{\partial z(t)}{\partial z(0)}, \qquad P = \frac{\partial z(t)}{\partial p},
        \qquad z = (u, \text{memory})

    Parameters
    ----------
    system : System
    periods, duration : float
        Length of the run, one of the two. After ``periods`` the end is taken at fixed phase, so that P has the part
        that comes from dT/dp; after a ``duration``, at fixed time.
    start, mode
        As in :func:`nonsmooth.simulate`.
    parameters : sequence of str
        Parameters in which to differentiate.

    Returns
    -------
    xarray.Dataset
        ``Phi(state, initial_state)``, ``P(state, parameter)``, ``end(state)``; over ``crossing``: ``crossing_time``,
        ``crossing_transition``, ``saltation``, ``log_det_saltation`` and ``transversality``
        \|h'\| / (\|h_z\| \|f\|); ``log_det`` = log\|det Phi\|, ``divergence`` (integral of div f over the run) and
        ``trace_defect``, the difference that must be rounding: log\|det Phi\| - (divergence + sum of log\|det S\|).
        The states are followed by the memory.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        The run could not be completed.

    Notes
    -----
    Transitions taken at the same instant stand as one crossing, with the last one's number.
    """
    check_system(system, "sensitivity")
    names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
    flow = VariationalFlow.of(system, names)
    period = system.period()
    unit, length = run_length(system, periods, duration, period, 0.0)
    found, log = variation(system, flow, first_state(system, start, mode), length)
    parameter_part = found.P
    if periods is not None and names:
        _, gradient = flow.period(system.parameter_vector())
        parameter_part = parameter_part + np.outer(found.legs.f_end[-1], periods * gradient)
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.schema import derivatives_of_run

    labels = labels_of(system)
    options = {
        "periods": periods, "duration": duration, "start": plain_start(system, start), "mode": mode,
        "parameters": list(names),
    }  # fmt: skip
    n = flow.n
    return derivatives_of_run(
        labels, provenance(labels, "sensitivity", options, method="variational"), names,
        Phi=found.Phi, P=parameter_part, end=found.legs.z[-1], crossing_time=found.times[1:],
        crossing_transition=[chain[-1] for chain in found.transitions],
        saltation=np.array([jump.saltation for jump in found.jumps]).reshape(-1, n, n),
        log_det_saltation=[jump.log_determinant for jump in found.jumps],
        transversality=[jump.transversality for jump in found.jumps],
        log_det=found.log_determinant, divergence=float(found.legs.divergence.sum()), trace=found.trace,
        status=log.status,
    )  # fmt: skip
