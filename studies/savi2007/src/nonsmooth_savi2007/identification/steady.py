"""Steady runs under the drive: amplitude and phase of the fundamental, mean and largest position, one row per run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.recordings.signals.harmonics import HarmonicFit
from nonsmooth.recordings.signals.harmonics import fit as harmonic_fit
from nonsmooth_savi2007.identification.evidence import Run

HARMONICS = 3
TURN = 36_000  # places of a turn: friction holds a car by a millimetre at most, so its side is known to 0.1 µm


@dataclass(frozen=True, eq=False)
class Steady:
    r"""Amplitudes and phases of steady runs, one entry per run.

    Attributes
    ----------
    omega : array (n,)
        The drive's frequency (rad/s), from the photogate.
    crank : array (n,)
        Length of the crank (m).
    amplitude, error : array (n,)
        Of the fundamental (m), and its standard uncertainty.
    response : complex array (n,)
        X with :math:`x_1 = \mathrm{Re}\, X e^{i \varphi}`, the crank's mean angle :math:`\varphi` counted from the
        photogate.
    mean, mean_error : array (n,)
        Mean position (m).
    highest : array (n,)
        Largest position of mean and harmonics together (m).
    lean : array (n,)
        Mean of the velocity's sign: even harmonics let the car go longer one way than the other.
    rest : array (n,)
        Standard deviation of what the harmonics leave (m): the sensor's own in free motion, more in contact.
    """

    runs: tuple[Run, ...]
    omega: FloatArray
    crank: FloatArray
    amplitude: FloatArray
    error: FloatArray
    response: ComplexArray
    mean: FloatArray
    mean_error: FloatArray
    highest: FloatArray
    rest: FloatArray
    lean: FloatArray

    def __len__(self) -> int:
        return len(self.runs)

    @property
    def samples(self) -> int:
        """Samples of all runs."""
        return sum(len(run.time) for run in self.runs)

    @property
    def resolution(self) -> float:
        """Length of a count (m)."""
        return self.runs[0].resolution

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the runs."""
        return tuple(run.name for run in self.runs)

    def only(self, chosen: Any) -> Steady:
        """The rows that a mask chooses."""
        rows = np.flatnonzero(chosen)
        return Steady(tuple(self.runs[i] for i in rows), *(getattr(self, one.name)[rows] for one in fields(self)[1:]))


def harmonics_of(run: Run, values: Any) -> HarmonicFit:
    """Harmonics of a channel of a run over whole turns."""
    time, drive = values["time"].values, run.drive
    whole = int(np.floor((time[-1] - time[0]) / drive.period))
    if whole < 2:
        raise ValueError(
            f"{run.label}: holds {whole} whole turns of the crank; a steady run needs two or more: record longer"
        )
    inside = time <= time[0] + whole * drive.period
    return harmonic_fit(time[inside], values[inside], drive.omega, HARMONICS)


def steady(runs: Sequence[Run]) -> Steady:
    """Fit mean and harmonics to each run over whole turns of the crank.

    Raises
    ------
    ValueError
        If a run lasts for less than two turns, or has no photogate.
    """
    rows: list[tuple[Any, ...]] = []
    order, turn = np.arange(1, HARMONICS + 1), np.linspace(0, 2 * np.pi, TURN, endpoint=False)
    for run in runs:
        fitted, drive = harmonics_of(run, run.x), run.drive
        # the gate's times to 0.1 ms each: all of them together tell the phase
        mark = (drive.turn_times - drive.period * drive.turns).mean()
        amplitude, shape = fitted.amplitudes[0], np.multiply.outer(turn, order) - fitted.phases
        rows.append(
            (
                drive.omega,
                run.crank,
                amplitude,
                fitted.amplitude_errors[0],
                amplitude * np.exp(1j * (drive.omega * mark - fitted.phases[0])),
                fitted.mean,
                fitted.mean_error,
                fitted.mean + (np.cos(shape) @ fitted.amplitudes).max(),
                fitted.residual,
                np.sign(-np.sin(shape) @ (order * fitted.amplitudes)).mean(),
            )
        )
    columns = [np.array(column) for column in zip(*rows, strict=True)] or [np.zeros(0)] * (len(fields(Steady)) - 1)
    return Steady(tuple(runs), *columns)
