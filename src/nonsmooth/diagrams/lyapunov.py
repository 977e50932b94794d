r"""``lyapunov``: how fast neighbouring motions part or come together, with all saltation matrices.

.. math:: \lambda_1 \ge \dots \ge \lambda_n, \qquad
    \lambda_1 + \dots + \lambda_k = \lim_{t\to\infty} \tfrac1t \log \operatorname{vol}_k(\Phi(t) Q_0)

The sum of all is known independently, :math:`\frac1t(\int \operatorname{div} f\,dt + \sum\log|\det S|)`; the difference
is reported as ``trace_defect`` and must be rounding. It sees determinants only, not a wrong entry of S.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Unpack

import numpy as np

from nonsmooth.diagrams.spectrum import (
    ALIGN,
    BATCHES,
    GOOD,
    FrameGrowth,
    Spectrum,
    at_rest,
    batch_ends,
    evaluated,
    failed_spectrum,
    spectrum_along,
)
from nonsmooth.flow.engines.devices import batch_size, on_gpu
from nonsmooth.flow.engines.engine import FloatArray, IntArray, State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.failure import beyond_stops, refuse_beyond_stops, solve_error, warn_if_slow
from nonsmooth.flow.options import LONGEST_RUN, Length, Solver, Varied, as_called, solver_of
from nonsmooth.flow.poincare import result_status
from nonsmooth.flow.starts import first_state, is_one_start
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.labels import EQUILIBRIA
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least, swept_values, whole_number

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.flow.engines.loop import Engine
    from nonsmooth.system.system import System

UNITS = 4096  # pieces into which a duration is cut


@checked
def lyapunov(
    system: System,
    *,
    parameter: Varied | None = None,
    values: Any = None,
    direction: Literal["up", "down", None] = "up",
    periods: Annotated[int, at_least(1)] | None = None,
    duration: Length | None = None,
    transient: Annotated[float, at_least(0, LONGEST_RUN)] | None = None,
    start: Any = None,
    mode: str | None = None,
    device: Literal["cpu", "cuda"] = "cpu",
    progress: Progress = True,
    **options: Unpack[Solver],
) -> xr.Dataset:
    r"""Lyapunov exponents, all of them, at one parameter point or along a sweep.

    Parameters
    ----------
    system : System
    parameter, values : str, array (P,), optional
        A parameter that is varied, and its values.
    direction : {"up", "down", None}
        Carry the state along with rising or falling values (at equal phase of the forcing), or begin every point at
        ``start``. Where a stop has moved past a carried state, that point begins at ``start`` too.
    periods, duration : int, float
        Length in forcing periods (10 000 where neither is given), or in time: needed where there is no period.
    transient : float, optional
        Passed over before, in the same unit: 500 periods, or a twentieth of the duration.
    start, mode : state, str, optional
        First state and mode, as in :func:`nonsmooth.simulate`.
    device : {"cpu", "cuda"}
        ``"cuda"`` runs a sweep with ``direction=None`` on an NVIDIA GPU, one point per thread, for
        systems with the planar exact flow: see the guide "A chart on a GPU".

    Returns
    -------
    xarray.Dataset
        Over the parameter where one is given: ``exponents(exponent)``, descending, per unit time; ``standard_error``
        (from 32 batches of equal length); ``running(batch, exponent)``, the estimate after each batch;
        ``trace_defect``, their sum less what the trace identity demands; ``kaplan_yorke``; ``nearest_graze``, the least
        \|h'\| / (\|h_u\| \|u'\|) of all crossings; ``equilibrium``, whether the run stayed at one; ``status``.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        A single run that could not be completed. In a sweep such a point keeps its status.
    ImportError, RuntimeError
        ``device="cuda"`` without the package numba-cuda, or without a GPU.

    Notes
    -----
    Derivatives are accurate to rounding where the flow is exact, else to a tenth of ``rtol`` and at least 1e-11 in
    every step.

    There are as many exponents as states and memory. One is minus infinity where a transition has a saltation matrix
    without full rank (sticking, a plastic impact, memory that is written anew): such a direction is lost in finite
    time. So it is for each constraint that elements hold where the measurement begins (a mass that sticks, two for a
    contact that rests): the frame is laid into what they leave free, and rates at which the equations bring rounding
    errors back to a constraint are no exponents. One is NaN, and comes last, for memory that is never written or a
    state of modes that are never visited: it is constant. All are NaN where several elements decide at an instant that
    is met at no speed, of which no derivative is known. The phase of the forcing is no state, so a forced limit cycle
    has negative exponents only; an autonomous motion that does not end in an equilibrium has one exponent zero.

    Of transitions at one instant each that the motion would have met there by itself has an instant of its own (two
    balls that bounce side by side); one to which another has led has that one's. Where both feel each other the
    exponents are those for the order in which they were taken: a warning and the attribute ``note`` say so.

    A run that stops at a stable equilibrium has the real parts of its eigenvalues, and the standard error is no
    less than the distance from them. A run that begins at an unstable one, as the start of zeros often is, stays there:
    its exponents are no attractor's. A warning names the equilibrium, ``equilibrium`` and the attribute ``note`` say it
    in the result, and ``standard_error`` and ``kaplan_yorke`` are NaN. Give ``start=``, a state beside it.

    The Kaplan-Yorke dimension is that of the attractor in the space of the states: for forced systems that of its
    stroboscopic section. Near an attractor whose leading exponents are equal, or the moduli of complex multipliers,
    single exponents settle like 1/t, their sum at once.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> chaos = ns.models.discontinuous_support().with_parameters(rho=0.33, g=0.0018, omega=11.15)
    >>> found = ns.lyapunov(chaos, periods=2000)
    >>> bool(found.exponents[0] > 0)
    True
    """
    asked = as_called(locals())
    if (parameter is None) != (values is None):
        raise ValueError("parameter and values belong together: give both for a sweep, or neither")
    if not is_one_start(start):
        raise ValueError("lyapunov follows one trajectory: give one start")
    numbers = None if parameter is None else swept_values(system, parameter, values)
    points = system.parameter_points({} if numbers is None else {str(parameter): numbers})
    length = _length(system, periods, duration, transient)
    first = first_state(system, start, mode)  # refused before anything is compiled
    engine = engine_for(system, **solver_of(options))
    if on_gpu(device, "lyapunov", engine, None, carried=numbers is not None and direction is not None):
        if numbers is None or length.unit is not None or system.period() is None:
            raise ValueError(
                'lyapunov with device="cuda" takes a sweep (parameter, values, direction=None) counted in forcing '
                'periods: a single trajectory is one thread, which a processor runs faster; use device="cpu"'
            )
        with progress_bar(len(points), "lyapunov", progress) as advance:
            done = _on_gpu(system, engine, points, first.copy(), length.units, length.wait, advance)
            done = [at_rest(one, system, at, first, first) for one, at in zip(done, points, strict=True)]
        return _dataset(system, engine.name, asked, numbers, done)
    if numbers is None:
        refuse_beyond_stops(system, first.u[None])
    order = np.arange(len(points)) if numbers is None else np.argsort(numbers, kind="stable")
    order = order[::-1] if direction == "down" else order
    with progress_bar(len(points), "lyapunov", progress if numbers is not None else False) as advance:
        done, sizes = _along(system, engine, points, order, first, length, direction is not None, advance)
    if numbers is None and done[0].status not in GOOD:
        raise solve_error(done[0].status, begun=(system, first.u))
    warn_if_slow(system, *sizes)
    return _dataset(system, engine.name, asked, numbers, done)


class _Length(NamedTuple):
    """Length of a run: units of time, that of one (None: the forcing period), and units of the transient."""

    units: int
    unit: float | None
    wait: int


def _length(system: System, periods: int | None, duration: float | None, transient: float | None) -> _Length:
    if periods is not None and duration is not None:
        raise ValueError("give the length of the run once: periods=... or duration=...")
    if periods is not None and system.period() is None:
        raise ValueError(f"{system.name!r} has no forcing period: give duration=... in place of periods")
    if duration is None:
        if system.period() is None:
            raise ValueError(f"{system.name!r} has no forcing period: give the length of the run, duration=...")
        return _Length(periods or 10_000, None, whole_number(500 if transient is None else transient, "transient", 0))
    unit = duration / UNITS
    before = 0.05 * duration if transient is None else transient
    return _Length(UNITS, unit, int(np.ceil(before / unit)))


def _along(
    system: System,
    engine: Engine,
    points: FloatArray,
    order: IntArray,
    first: State,
    length: _Length,
    carry: bool,
    advance: Callable[..., None],
) -> tuple[list[Spectrum], list[FloatArray]]:
    """The spectrum at each point, in the order in which a state is carried along; with the sizes of states met."""
    tables, sizes = engine.prepare(points), []
    found: dict[int, Spectrum] = {}
    beyond = beyond_stops(system, points, np.tile(first.u, (len(points), 1)))
    state, fresh = first.copy(), True
    for i in order:
        kept = state.copy() if carry else first.copy()
        here = system.period_at(points[i]) if system.period() is not None else None
        unit = length.unit or here or np.nan

        def run(begun: State, i: int = int(i), here: float | None = here, unit: float = unit) -> Spectrum:
            return spectrum_along(system, engine, tables, i, points[i], begun, here, unit, length.units, length.wait)

        state = kept.copy()
        one = failed_spectrum(len(first.u), 0.0, codes.BEYOND_STOP) if fresh and beyond[i] else run(state)
        if one.status == codes.BEYOND_STOP and carry and not fresh:
            # a stop has moved past it: it begins anew, as in a sweep
            kept, state = first.copy(), first.copy()
            one = run(state)
        found[int(i)] = one
        sizes.append(np.abs([kept.u, state.u]))
        fresh = fresh and not (carry and one.status in GOOD)
        if one.status not in GOOD:
            state = kept if len(found) > 1 else first.copy()
        advance(1)
    return [found[i] for i in range(len(points))], sizes


def _on_gpu(
    system: System, engine: Any, points: FloatArray, state: State, count: int, wait: int, advance: Any
) -> list[Spectrum]:
    """Every point from one start, on the GPU."""
    from nonsmooth.diagrams.lyapunov_cuda import growth_on_gpu

    edges = batch_ends(count) if count >= BATCHES else np.array([0, count], dtype=np.int64)
    mode, found = int(state.counters[0]), list[Spectrum]()
    for some in np.split(points, range(batch_size(), len(points), batch_size())):
        growth = growth_on_gpu(engine, some, state.u, mode, system.scale_vector(), min(ALIGN, wait), wait, edges)
        for at, logs, sums, status in zip(some, *growth, strict=True):
            unit = float(system.period_at(at) or np.nan)
            if status in GOOD:
                grown = FrameGrowth(logs, float(sums[0]), float(sums[1]), float(sums[3]), int(status))
                found.append(evaluated(2, grown, count, unit, forced=True))
            else:
                found.append(failed_spectrum(2, count * unit, int(status)))
        advance(len(some))
    return found


def _dataset(
    system: System, method: str, asked: Mapping[str, Any], numbers: FloatArray | None, found: list[Spectrum]
) -> xr.Dataset:
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.variations import spectrum

    labels, parameter = labels_of(system), asked["parameter"]
    attrs = provenance(labels, "lyapunov", asked, method=method)
    if note := _note(system, parameter, numbers, found):
        attrs = {**attrs, "note": note}
    return spectrum(
        labels,
        attrs,
        parameter,
        numbers,
        equilibrium=[EQUILIBRIA.index(one.rest.kind) if one.rest else 0 for one in found],
        exponents=[one.exponents for one in found],
        standard_error=[one.error for one in found],
        running=[one.running for one in found],
        trace_defect=[one.defect for one in found],
        kaplan_yorke=[one.dimension for one in found],
        nearest_graze=[one.nearest for one in found],
        elapsed=[one.elapsed for one in found],
        status=[result_status(one.status) for one in found],
    )


def _note(system: System, parameter: str | None, numbers: FloatArray | None, found: list[Spectrum]) -> str:
    """The equilibria at which runs stayed, in sentences; unstable ones in a warning too, and an order that matters."""
    told = []
    apart = [i for i, one in enumerate(found) if one.of_one_order]
    if apart:
        where = ""
        if numbers is not None:
            where = f" (at {len(apart)} of {len(found)} values, {numbers[apart[0]]:.6g} the first)"
        told.append(
            f"two transitions happen at one instant, each by itself{where}, and which of them a neighbouring motion "
            "meets first matters: the exponents are those of one order, and do not hold for the other"
        )
        warnings.warn(f"lyapunov of {system.name!r}: {told[0]}", RuntimeWarning, stacklevel=4)
    for kind in EQUILIBRIA[1:]:
        which = [i for i, one in enumerate(found) if one.rest is not None and one.rest.kind == kind]
        if not which:
            continue
        rest = found[which[0]].rest
        assert rest is not None
        where = ""
        if numbers is not None:
            values = [f"{numbers[i]:.6g}" for i in which]
            where = f", at {len(which)} of {len(found)} values of {parameter!r}, {values[0]} the first"
        text = f"{rest.words(list(system.states))}{where}: "
        if kind == "unstable":
            text += (
                "the run began there, and nothing but rounding errors leads away. These are the exponents of this "
                "equilibrium, not of an attractor; give start=, a state beside it"
            ) + (", and direction=None" if numbers is not None else "")
            warnings.warn(f"lyapunov of {system.name!r}: {text}", stacklevel=4)
        else:
            text += "the motion rests there" + (
                ", and the exponents are the real parts of its eigenvalues" if kind == "stable" else ""
            )
        told.append(text)
    return "; ".join(told)
