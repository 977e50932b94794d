"""``amplitude_spectrum``: the harmonics and subharmonics of a motion.

The record of a periodic motion is as long as its period, so that each line is the Fourier coefficient itself, without
leakage: a motion of period p has lines at multiples of 1/p of the forcing frequency. A motion without a period gets a
Hann window, and its lines are as wide as the record is short.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Annotated, Any, Unpack

import numpy as np

from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.equilibria import refuse_resting
from nonsmooth.flow.failure import warn_if_small
from nonsmooth.flow.options import Solver, as_called, longest_period, solver_of
from nonsmooth.flow.poincare import poincare
from nonsmooth.flow.sections import Poincare, Stroboscopic, section_plan
from nonsmooth.flow.simulate import simulate
from nonsmooth.flow.starts import first_state, is_one_start
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.flow.engines.loop import Engine
    from nonsmooth.system.system import System

CLOSED = 1e-7  # of the motion's range: what a period may leave open
KEPT = 100  # section points by which a motion is judged
PATIENCE = (1, 2, 4, 8)  # transients tried until the record closes
LEAST = 4096  # samples of a motion of a short period; more raise the highest line


@checked
def amplitude_spectrum(
    system: System,
    *,
    start: Any = None,
    section: Stroboscopic | Poincare | None = None,
    transient: Annotated[int, at_least(0)] = 500,
    periods: Annotated[int, at_least(8)] = 256,
    samples: Annotated[int, at_least(8)] = 512,
    progress: Progress = False,
    **options: Unpack[Solver],
) -> xr.Dataset:
    r"""Amplitude of every state over frequency, for the motion that a start leads to.

    .. math:: A_k = \frac{2}{N} \Bigl| \sum_{j<N} u_j e^{-2\pi i jk/N} \Bigr|

    over p periods of a motion of period number p; with a Hann window over ``periods`` of one that has none.

    Parameters
    ----------
    system : System
    start : state, optional
        Zeros where not given.
    section : Stroboscopic or Poincare, optional
        What counts a period; ``Stroboscopic(0)`` where the system has a period, and needed where it has none.
    transient : int
        Section returns passed over; up to eight times as many where the record of a periodic motion does not close to
        1e-7 of its range, and a warning where it does not even then.
    periods : int
        Length of the record of a motion without a period number, in section returns.
    samples : int
        Per period of the forcing, or per return: lines up to half as many times the base frequency.

    Returns
    -------
    xarray.Dataset
        Over ``frequency`` (per unit of time) and ``state``: ``amplitude``, that of a sinusoid of this frequency in the
        state's unit, the mean at 0; ``order``, the frequency over ``base_frequency``, which is that of the forcing or
        the mean one of the returns; ``period_number`` (0: none found, and the lines are not sharp).

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        A motion that does not get as far.

    Examples
    --------
    A motion of period 4 has lines at quarters of the forcing frequency.

    >>> import nonsmooth as ns
    >>> found = ns.amplitude_spectrum(ns.models.discontinuous_support(rho=0.26))
    >>> int(found.period_number), bool(found.amplitude.sel(state="x")[1] > 1e-4)
    (4, True)
    """
    asked = as_called(locals())
    if not is_one_start(start):
        raise ValueError("amplitude_spectrum follows one trajectory: give one start")
    how = solver_of(options)
    engine = engine_for(system, **how)
    with progress_bar(1, "amplitude_spectrum", progress) as advance:
        count = _period_number(system, engine, section, start, transient)
        advance(1)
    length = count or periods
    each = max(samples, -(-LEAST // length)) if count else samples
    for patience in PATIENCE:  # the judge may have passed over as many transients
        wait = patience * transient
        if system.is_map:
            number = -(-LEAST // length) * length
            values = poincare(system, n=number + 1, transient=wait, start=start, **how)["section"].values
            base = rate = 1.0
        else:
            begin, span = _stretch(system, start, section, wait, length, how)
            rate, base = length * each / span, length / span
            values = _sampled(system, start, begin, span, length * each, how)
        apart = np.abs(values[-1] - values[0])
        if not count or not (apart > CLOSED * np.ptp(values, axis=0)).any():
            break
    else:
        warnings.warn(
            f"{system.name!r}: the record of {length} period(s) does not close ({np.nanmax(apart):.2g} apart), so its "
            f"lines are off by as much; give a longer transient than {transient}",
            stacklevel=2,
        )
    values = values[:-1]
    window = np.ones(len(values)) if count else np.hanning(len(values) + 1)[:-1]
    amplitude = 2.0 * np.abs(np.fft.rfft(values * window[:, None], axis=0)) / window.sum()
    amplitude[0] /= 2.0
    if len(values) % 2 == 0:
        amplitude[-1] /= 2.0
    frequency = np.arange(len(amplitude), dtype=np.float64) * (rate / len(values))
    from nonsmooth.results.labels import labelled, labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.schema import dataset

    labels = labels_of(system)
    per = "per iterate" if labels.is_map else "Hz" if labels.time_unit == "s" else "1"
    return dataset(
        labels,
        provenance(labels, "amplitude_spectrum", asked, method=engine.name),
        {
            "amplitude": labelled(("frequency", "state"), amplitude, "amplitude"),
            "base_frequency": labelled((), base, "frequency of the forcing, or of the returns", per),
            "period_number": labelled((), np.int64(count), "period number (0: none found)"),
        },
        frequency=labelled("frequency", frequency, "frequency", per),
        order=labelled("frequency", frequency / base, "frequency over the base frequency"),
    )


def _period_number(system: System, engine: Engine, section: Any, start: Any, transient: int) -> int:
    """The period number of the attractor that a start leads to, as a sweep finds it."""
    plan, state = section_plan(system, section)[1], first_state(system, start)
    points = system.parameter_vector()[None, :]
    if plan.indicator >= 0:
        refuse_resting(system, [state], points, "amplitude_spectrum")
    settler = Settler(system, engine, plan, transient, KEPT, longest_period(KEPT, None), False)
    found = settler.run(points, [0], state.place[None], modes=[state.counters[0]])
    warn_if_small(system, state.u, found.maximum, found.minimum)
    return int(found.period_number[0])


def _stretch(system: System, start: Any, section: Any, transient: int, length: int, how: Solver) -> tuple[float, float]:
    """Begin and duration of so many periods, or section returns."""
    period = system.period()
    if period is not None and not isinstance(section, Poincare):
        return transient * period, length * period
    times = poincare(system, section=section, n=length + 1, transient=transient, start=start, **how)["time"].values
    return float(times[0]), float(times[-1] - times[0])


def _sampled(system: System, start: Any, begin: float, span: float, number: int, how: Solver) -> FloatArray:
    """The states at ``number`` even instants, and at the end of the record, where a periodic motion is back."""
    times = begin + np.linspace(0.0, span, number + 1)
    run = simulate(system, duration=span * (1.0 + 1e-12), transient=begin, start=start, samples=times, **how)
    at = np.searchsorted(run["time"].values, times).clip(0, run.sizes["time"] - 1)
    return np.asarray(run["u"].values[at])
