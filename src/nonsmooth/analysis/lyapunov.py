r"""``lyapunov``: how fast neighbouring motions part or come together, with all saltation matrices.

.. math:: \lambda_1 \ge \dots \ge \lambda_n, \qquad
    \lambda_1 + \dots + \lambda_k = \lim_{t\to\infty} \tfrac1t \log \operatorname{vol}_k(\Phi(t) Q_0)

The sum of all is known independently, :math:`\frac1t(\int \operatorname{div} f\,dt + \sum\log|\det S|)`; the difference
is reported as ``trace_defect`` and must be rounding. It sees determinants only, not a wrong entry of S.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.analysis.sweep import DIRECTIONS, swept_values
from nonsmooth.errors import SolveError
from nonsmooth.flow.arguments import check_options, check_system, real_number, whole_number
from nonsmooth.flow.devices import on_gpu
from nonsmooth.flow.engine import Chain, Engine, FloatArray, SectionPlan, State
from nonsmooth.flow.methods import engine_for
from nonsmooth.flow.poincare import result_status
from nonsmooth.flow.simulate import BEYOND_STOP
from nonsmooth.flow.spectrum import frame_for
from nonsmooth.flow.starts import first_state, is_one_start, plain_start
from nonsmooth.kernels import codes
from nonsmooth.results.progress import progress as progress_bar

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["kaplan_yorke", "lyapunov"]

BATCHES = 32
UNITS = 4096  # pieces into which a duration is cut
ALIGN = 100  # units of the transient in which the frame turns into the directions of growth
GOOD = (codes.OK, codes.NOT_GUARANTEED)


def lyapunov(
    system: System,
    *,
    parameter: str | None = None,
    values: Any = None,
    direction: str | None = "up",
    periods: int | None = None,
    duration: float | None = None,
    transient: float | None = None,
    start: Any = None,
    mode: str | None = None,
    method: str = "auto",
    rtol: float | None = None,
    atol: Any = None,
    device: str = "cpu",
    progress: bool = True,
    **expert: Any,
) -> xr.Dataset:
    r"""Lyapunov exponents, all of them, at one parameter point or along a sweep.

    Parameters
    ----------
    system : System
    parameter, values : str, array (P,), optional
        A parameter that is varied, and its values.
    direction : {"up", "down", None}
        Carry the state along with rising or falling values (at equal phase of the forcing), or begin every point at
        ``start``.
    periods, duration : int, float
        Length in forcing periods (10 000 where neither is given), or in time: needed where there is no period.
    transient : float, optional
        Passed over before, in the same unit: 500 periods, or a twentieth of the duration.
    start, mode
        First state and mode, as in :func:`nonsmooth.simulate`.
    method, rtol, atol
        Of the trajectory; see :func:`nonsmooth.flow.methods.engine_for`. Its derivatives are accurate to rounding.
    device : {"cpu", "cuda"}
        ``"cuda"`` runs a sweep with ``direction=None`` on an NVIDIA GPU, one point per thread, for
        systems with the planar exact flow: see the guide "A chart on a GPU".
    progress : bool
        A bar on a terminal.

    Returns
    -------
    xarray.Dataset
        Over the parameter where one is given: ``exponents(exponent)``, descending, per unit time; ``standard_error``
        (from 32 batches of equal length); ``running(batch, exponent)``, the estimate after each batch;
        ``trace_defect``, their sum less what the trace identity demands; ``kaplan_yorke``; ``nearest_graze``, the least
        \|h'\| / (\|h_u\| \|u'\|) of all crossings; ``status``.

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
    There are as many exponents as states and memory. One is minus infinity where a transition has a saltation matrix
    without full rank (sticking, a plastic impact, memory that is written anew): such a direction is lost in finite
    time. One is NaN, and comes last, for memory that is never written or a state of modes that are never visited: it
    is constant. The phase of the forcing is no state, so a forced limit cycle has negative exponents only; an
    autonomous motion that does not end in an equilibrium has one exponent zero.

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
    check_system(system, "lyapunov")
    check_options(system, expert, lyapunov)
    if (parameter is None) != (values is None):
        raise ValueError("parameter and values belong together: give both for a sweep, or neither")
    if not isinstance(direction, str | None) or direction not in DIRECTIONS or direction == "both":
        raise ValueError(f"direction = {direction!r}; allowed: 'up', 'down', None")
    if not is_one_start(start):
        raise ValueError("lyapunov follows one trajectory: give one start")
    numbers = None if parameter is None else swept_values(system, parameter, values)
    points = system.parameter_points({} if numbers is None else {str(parameter): numbers})
    forced = system.period() is not None
    count, length, wait = _length(system, periods, duration, transient, forced)
    engine = engine_for(system, method, rtol, atol, **expert)
    options = {
        "parameter": parameter, "values": values, "direction": direction, "periods": periods, "duration": duration,
        "transient": transient, "start": plain_start(system, start), "mode": mode, "method": method, "rtol": rtol,
        "atol": atol, **({"device": device} if device != "cpu" else {}), **expert,
    }  # fmt: skip
    if on_gpu(device, "lyapunov", engine, None, carried=numbers is not None and direction is not None):
        if numbers is None or not forced or duration is not None:
            raise ValueError(
                'lyapunov with device="cuda" takes a sweep (parameter, values, direction=None) counted in forcing '
                'periods: a single trajectory is one thread, which a processor runs faster; use device="cpu"'
            )
        with progress_bar(len(points), "lyapunov", progress) as advance:
            done = _on_gpu(system, engine, points, first_state(system, start, mode), count, int(wait), advance)
        return _dataset(system, engine.name, options, parameter, numbers, done)
    tables = engine.prepare(points)
    order = np.arange(len(points)) if numbers is None else np.argsort(numbers, kind="stable")
    if direction == "down":
        order = order[::-1]
    found: list[_Spectrum | None] = [None] * len(points)
    state: State | None = None
    with progress_bar(len(points), "lyapunov", progress and numbers is not None) as advance:
        for i in order:
            if state is None or direction is None:
                state = first_state(system, start, mode)
            kept = state.copy()
            here = system.period_at(points[i]) if forced else None
            unit = length if here is None or duration is not None else here
            found[i] = one = _spectrum(system, engine, tables, int(i), state, here, unit, count, wait)
            if one.status not in GOOD:
                state = kept if i != order[0] else None
            advance(1)
    done = [one for one in found if one is not None]
    if numbers is None and done[0].status not in GOOD:
        from nonsmooth.results.statuses import by_code

        if done[0].status == codes.BEYOND_STOP:
            raise SolveError(BEYOND_STOP, status="beyond_stop")
        status = by_code(result_status(done[0].status))
        raise SolveError(status.sentence, status=status.name)
    return _dataset(system, engine.name, options, parameter, numbers, done)


@dataclass(frozen=True)
class _Spectrum:
    """The exponents of one trajectory."""

    exponents: FloatArray  # (n,)
    error: FloatArray  # (n,)
    running: FloatArray  # (BATCHES, n)
    defect: float
    dimension: float
    nearest: float
    elapsed: float
    status: int


def _length(
    system: System, periods: Any, duration: Any, transient: Any, forced: bool
) -> tuple[int, float, int]:
    """(units of time, the length of one where it is not the period, units of the transient)."""
    if periods is not None and duration is not None:
        raise ValueError("give the length of the run once: periods=... or duration=...")
    if periods is not None and not forced:
        raise ValueError(f"{system.name!r} has no forcing period: give duration=... in place of periods")
    if duration is None:
        if not forced:
            raise ValueError(f"{system.name!r} has no forcing period: give the length of the run, duration=...")
        count = whole_number(10_000 if periods is None else periods, "periods", 1)
        return count, 0.0, whole_number(500 if transient is None else transient, "transient", 0)
    time = real_number(duration, "duration")
    if time <= 0:
        raise ValueError(f"duration = {duration!r}: the length of a run must be positive")
    before = 0.05 * time if transient is None else real_number(transient, "transient")
    if before < 0:
        raise ValueError(f"transient = {transient!r} must be zero or more")
    return UNITS, time / UNITS, int(np.ceil(before / (time / UNITS)))


def _spectrum(
    system: System, engine: Engine, tables: Any, i: int, state: State, period: float | None, unit: float, count: int,
    wait: int,
) -> _Spectrum:  # fmt: skip
    """Run row i from ``state`` on: the transient, its last part with the frame, then ``count`` units."""
    if period is not None:
        state.keep_phase(period, 0.0)
    state.settled = False
    status = codes.OK
    align = min(ALIGN, wait)
    if wait > align:
        status = _run_on(system, engine, tables, i, state, period, unit, wait - align)
    frame = frame_for(system, engine, tables, i)
    if status in GOOD and align:
        status = frame.advance(state, align, unit).status
    if status in GOOD:
        growth = frame.advance(state, count, unit)
        status = growth.status
    n = len(frame.active)
    if status not in GOOD:
        return _failed(n, count * unit, status)
    if period is not None:
        state.clock[2] = period
    used = int(frame.active.sum())
    logs = growth.logarithms[:, :used]
    batches = np.add.reduceat(logs, _edges(count)[:-1]) if count >= BATCHES else None
    return _evaluated(
        n, logs.mean(axis=0) / unit, batches, count, unit, growth.defect, growth.nearest, status, period is not None
    )


def _edges(count: int) -> NDArray[np.int64]:
    """Ends of the batches of a run of ``count`` units."""
    return np.linspace(0, count, BATCHES + 1).astype(np.int64)


def _failed(n: int, elapsed: float, status: int) -> _Spectrum:
    nan = np.full(n, np.nan)
    return _Spectrum(nan, nan, np.full((BATCHES, n), np.nan), np.nan, np.nan, np.nan, elapsed, status)


def _evaluated(
    n: int, mean: FloatArray, batches: FloatArray | None, count: int, unit: float, defect: float, nearest: float,
    status: int, forced: bool,
) -> _Spectrum:  # fmt: skip
    """Exponents from the mean growth per unit time, their errors from that of the batches."""
    used = len(mean)
    exponents, error, running = np.full(n, np.nan), np.full(n, np.nan), np.full((BATCHES, n), np.nan)
    order = np.argsort(-mean, kind="stable")
    exponents[:used] = mean[order]
    edges = _edges(count)
    if batches is not None:
        with np.errstate(invalid="ignore"):
            sums = batches[:, order]
            means = sums / (np.diff(edges)[:, None] * unit)
            error[:used] = means.std(axis=0, ddof=1) / np.sqrt(BATCHES)
            running[:, :used] = np.cumsum(sums, axis=0) / (edges[1:, None] * unit)
        error[:used][~np.isfinite(exponents[:used])] = 0.0
    # In an autonomous system one exponent is zero, and its estimate of the order of 1/t.
    zero = 0.0 if forced else float(np.nanmax([0.0, *(3 * error[:used])]) + 3.0 / (count * unit))
    return _Spectrum(
        exponents, error, running, defect / (count * unit), kaplan_yorke(exponents[:used], zero), nearest,
        count * unit, status,
    )  # fmt: skip


def _on_gpu(
    system: System, engine: Any, points: FloatArray, state: State, count: int, wait: int, advance: Any
) -> list[_Spectrum]:
    """Every point from one start, on the GPU."""
    from nonsmooth.analysis.lyapunov_cuda import growth_on_gpu

    edges = _edges(count) if count >= BATCHES else np.array([0, count], dtype=np.int64)
    growth, sums, status = growth_on_gpu(
        engine, points, state.u, int(state.counters[0]), system.scale_vector(), min(ALIGN, wait), wait, edges, advance
    )
    found = []
    for i, logs in enumerate(growth):
        unit = float(system.period_at(points[i]) or np.nan)
        if status[i] not in GOOD:
            found.append(_failed(2, count * unit, int(status[i])))
            continue
        total, demanded = float(logs.sum()), float(sums[i, 0] + sums[i, 1])
        defect = 0.0 if total == demanded else total - demanded
        found.append(_evaluated(
            2, logs.sum(axis=0) / (count * unit), logs if count >= BATCHES else None, count, unit, defect,
            float(sums[i, 3]), int(status[i]), True,
        ))  # fmt: skip
    return found


def _run_on(
    system: System, engine: Engine, tables: Any, i: int, state: State, period: float | None, unit: float, count: int
) -> int:
    """Pass over ``count`` units of time."""
    traced = system.traced
    if period is not None and unit == period:
        sizes = len(traced.u), len(traced.indicators), len(traced.outputs)
        out = Chain.empty(i + 1, 1, *sizes)
        phase = state.clock[0] / period
        plan = SectionPlan(phase=float(phase % 1.0), extremes=False)
        engine.chain(tables, i, i + 1, state, None, plan, count - 1, 1, out)
        return int(out.status[i])
    return frame_for(system, engine, tables, i).advance(state, count, unit).status


def kaplan_yorke(exponents: FloatArray, zero: float = 0.0) -> float:
    r"""The Kaplan-Yorke dimension :math:`j + (\lambda_1 + \dots + \lambda_j) / |\lambda_{j+1}|` of a spectrum.

    j is the largest number of exponents, taken in descending order, whose sum is not negative. Where the sum of all is
    not negative it is their number; where the first is negative, 0 (a point of the section).

    Parameters
    ----------
    exponents : array (n,)
        Descending; minus infinity allowed.
    zero : float
        Exponents of at most this size count as zero.

    References
    ----------
    J.L. Kaplan, J.A. Yorke, Lecture Notes in Mathematics 730 (1979) 204-227; P. Frederickson et al., J. Differential
    Equations 49 (1983) 185-207.
    """
    rounded = np.where(np.abs(exponents) <= zero, 0.0, exponents)
    sums = np.cumsum(rounded)
    j = int(np.count_nonzero(sums >= 0.0)) if len(sums) else 0
    if j == len(sums):
        return float(j)
    above = float(sums[j - 1]) if j else 0.0
    return float(j + above / abs(rounded[j]))


def _dataset(
    system: System, method: str, options: Mapping[str, Any], parameter: str | None, numbers: FloatArray | None,
    found: list[_Spectrum],
) -> xr.Dataset:  # fmt: skip
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.variations import spectrum

    labels = labels_of(system)
    return spectrum(
        labels, provenance(labels, "lyapunov", options, method=method), parameter, numbers,
        exponents=[one.exponents for one in found], standard_error=[one.error for one in found],
        running=[one.running for one in found], trace_defect=[one.defect for one in found],
        kaplan_yorke=[one.dimension for one in found], nearest_graze=[one.nearest for one in found],
        elapsed=[one.elapsed for one in found], status=[result_status(one.status) for one in found],
    )  # fmt: skip
