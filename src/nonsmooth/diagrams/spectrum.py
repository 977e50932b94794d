r"""The Lyapunov exponents of one trajectory: its growth in batches of time, their errors, the dimension they give."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.equilibria import Equilibrium, equilibrium_at
from nonsmooth.flow.loads import meter_of
from nonsmooth.flow.spectrum import Frame
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Section

if TYPE_CHECKING:
    from nonsmooth.system.system import System

BATCHES = 32
ALIGN = 100  # units of the transient in which the frame turns into the directions of growth
INDEPENDENT = 1e-7  # of the largest singular value of constraints
GOOD = (codes.OK, codes.NOT_GUARANTEED)


@dataclass(frozen=True)
class Spectrum:
    """The exponents of one trajectory."""

    exponents: FloatArray  # (n,)
    error: FloatArray  # (n,)
    running: FloatArray  # (BATCHES, n)
    defect: float
    dimension: float
    nearest: float
    elapsed: float
    status: int
    rest: Equilibrium | None = None  # where the trajectory stays, or began


def spectrum_along(
    system: System,
    engine: Engine,
    tables: Any,
    i: int,
    values: FloatArray,
    state: State,
    period: float | None,
    unit: float,
    count: int,
    wait: int,
) -> Spectrum:
    """Run row i (parameters ``values``) from ``state`` on: the transient, its end with the frame, ``count`` units."""
    if period is not None:
        state.keep_phase(period, 0.0)
    state.settled = False
    status = codes.OK
    align = min(ALIGN, wait)
    if wait > align:
        status = _run_on(system, engine, tables, i, state, period, unit, wait - align)
    frame = Frame(system, engine, tables, i)
    if status in GOOD and align:
        status = frame.advance(state, align, unit).status
    begun = state.copy()
    lost = _hold(system, frame, values, begun) if status in GOOD else 0
    if status in GOOD:
        growth = frame.advance(state, count, unit)
        status = growth.status
    n = len(frame.active)
    if status not in GOOD:
        return failed_spectrum(n, count * unit, status)
    if period is not None:
        state.clock[2] = period
    used = int(frame.active.sum())
    logs = growth.logarithms[:, :used]
    if lost:
        logs[:, used - lost :], growth.determinants = -np.inf, -np.inf
    batches = np.add.reduceat(logs, batch_ends(count)[:-1]) if count >= BATCHES else None
    found = evaluated(
        n, logs.mean(axis=0) / unit, batches, count, unit, growth.defect, growth.nearest, status, period is not None
    )
    return at_rest(found, system, values, begun, state)


def _hold(system: System, frame: Any, values: FloatArray, state: State) -> int:
    """Turn the frame so that what elements hold in the present mode stands in its last columns; their number.

    A held contact or friction takes each neighbour to its constraint in a finite time, so these directions are lost; at
    which rate the equations bring rounding errors back to it means nothing. The others stay within it."""
    meter = meter_of(system)
    if meter is None:
        return 0
    mode = system.modes[int(state.counters[0])]
    rows = meter.constraints(mode, values, float(state.clock[0]), state.u, state.memory) * system.scale_vector()
    active = frame.active[: rows.shape[1]]
    _, sizes, turned = np.linalg.svd(rows[:, active])
    lost = int((sizes > INDEPENDENT * sizes.max(initial=0.0)).sum())
    if lost:
        own, place = np.zeros((frame.Q.shape[0], len(turned))), np.flatnonzero(active)
        own[place] = turned.T
        within = own[:, lost:]
        rest = np.eye(frame.Q.shape[0])[:, len(active) :][:, frame.active[len(active) :]]  # memory
        within = np.hstack([within, rest])
        aligned = np.linalg.qr(within.T @ frame.Q)[0]
        frame.Q[:] = np.hstack([within @ aligned, own[:, :lost]])
    return lost


def at_rest(found: Spectrum, system: System, values: FloatArray, begun: State, ended: State) -> Spectrum:
    """The exponents with the equilibrium at which the run stayed, or began, and the errors they then have.

    Beside a stable equilibrium the true exponents are known, the real parts of its eigenvalues. Batches that are all
    alike say nothing of an exponent's error, and an equilibrium that no motion approaches has no dimension.
    """
    at = [
        equilibrium_at(system, one.u, int(one.counters[0]), values=values, memory=one.memory) for one in (ended, begun)
    ]
    if at[0] is not None and at[0].kind == "unstable" and at[1] is None:
        return found  # passes by
    rest = at[0] if at[0] is not None else at[1]
    if rest is not None and rest.kind == "undecided" and found.exponents[0] > 3.0 / found.elapsed:
        rest = replace(rest, kind="unstable")
    if rest is None or (at[0] is None and rest.kind != "unstable"):
        return found
    if rest.kind == "unstable":
        return replace(found, rest=rest, error=np.full_like(found.error, np.nan), dimension=np.nan)
    error, known = found.error, rest.eigenvalues.real
    if rest.kind == "stable" and len(known) == len(error):
        apart = np.abs(found.exponents - known) + np.finfo(float).eps * np.abs(known)
        error = np.maximum(error, np.where(np.isfinite(found.exponents), apart, 0.0))
    return replace(found, rest=rest, error=error)


def batch_ends(count: int) -> NDArray[np.int64]:
    """Ends of the batches of a run of ``count`` units."""
    return np.linspace(0, count, BATCHES + 1).astype(np.int64)


def failed_spectrum(n: int, elapsed: float, status: int) -> Spectrum:
    nan = np.full(n, np.nan)
    return Spectrum(nan, nan, np.full((BATCHES, n), np.nan), np.nan, np.nan, np.nan, elapsed, status)


def evaluated(
    n: int,
    mean: FloatArray,
    batches: FloatArray | None,
    count: int,
    unit: float,
    defect: float,
    nearest: float,
    status: int,
    forced: bool,
) -> Spectrum:
    """Exponents from the mean growth per unit time, their errors from that of the batches."""
    used = len(mean)
    exponents, error, running = np.full(n, np.nan), np.full(n, np.nan), np.full((BATCHES, n), np.nan)
    order = np.argsort(-mean, kind="stable")
    exponents[:used] = mean[order]
    edges = batch_ends(count)
    if batches is not None:
        with np.errstate(invalid="ignore"):
            sums = batches[:, order]
            means = sums / (np.diff(edges)[:, None] * unit)
            error[:used] = means.std(axis=0, ddof=1) / np.sqrt(BATCHES)
            running[:, :used] = np.cumsum(sums, axis=0) / (edges[1:, None] * unit)
        error[:used][~np.isfinite(exponents[:used])] = 0.0
    # In an autonomous system one exponent is zero, and its estimate of the order of 1/t.
    zero = 0.0 if forced else float(np.nanmax([0.0, *(3 * error[:used])]) + 3.0 / (count * unit))
    return Spectrum(
        exponents,
        error,
        running,
        defect / (count * unit),
        kaplan_yorke(exponents[:used], zero),
        nearest,
        count * unit,
        status,
    )


def _run_on(
    system: System, engine: Engine, tables: Any, i: int, state: State, period: float | None, unit: float, count: int
) -> int:
    """Pass over ``count`` units of time."""
    if period is not None and unit == period:
        out = engine.kept(i + 1, 1)
        phase = state.clock[0] / period
        plan = Section(phase=float(phase % 1.0), extremes=False)
        engine.chain(tables, i, i + 1, state, None, plan, count - 1, 1, out)
        return int(out.status[i])
    return Frame(system, engine, tables, i).advance(state, count, unit).status


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
