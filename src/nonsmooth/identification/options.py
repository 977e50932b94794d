"""Options that the verbs of identification share: the recording and what is known beside it, and predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypedDict

from nonsmooth.flow.options import Solver
from nonsmooth.results.progress import Progress
from nonsmooth.system.kinds import Default, at_least


class Prior(TypedDict, total=False):
    """Knowledge from before a recording.

    Parameters
    ----------
    free_start : bool
        False: the motion begins exactly at ``start``.
    priors : mapping of str to (value, standard uncertainty), or ParameterSet, optional
        What is known before of the unknowns; a set tells of those that all runs share.
    """

    free_start: Annotated[bool, Default(True)]
    priors: Any


class Recorded(TypedDict, total=False):
    """A recording, and how often a fit to it is tried.

    Parameters
    ----------
    measured : mapping of str to str or Sensor, optional
        ``{"x": "position channel"}``: which channel shows which state or output of the system, or with which
        :class:`nonsmooth.Sensor`. Channels named as states or outputs where not given.
    settings : mapping or sequence, optional
        Parameters that were set in each run, ``{run: {"omega": 3.0}}``, or in all. One that is to be found is known
        in the runs in which it was set.
    runs : sequence of str, optional
        Runs of a ``Recording``; all where not given.
    time : str
        Name of the column or coordinate that holds the time.
    tries : int
        First guesses to try, the given one and others around it (or within the bounds), while none fits.
    seed : int
        Of the other first guesses.
    progress : bool, or function
        See :func:`nonsmooth.sweep`.
    """

    measured: Mapping[str, Any] | Sequence[str] | str | None
    settings: Any
    runs: Any
    time: Annotated[str, Default("time")]
    tries: Annotated[int, at_least(1), Default(8)]
    seed: Annotated[int, at_least(0), Default(0)]
    progress: Annotated[Progress, Default(True)]


class Fitting(Prior, Recorded, total=False):
    """All that a fit is told beside the model and the readings."""


class Comparing(Solver, total=False):
    """The way the theory is computed and laid over a measurement.

    Parameters
    ----------
    grid : int
        Samples of an orbit per forcing period.
    transient, max_period : int
        Section returns passed over, and the longest period number searched, as in :func:`nonsmooth.sweep`.
    draws : int, optional
        Parameter sets drawn for the band: 60 where something is uncertain, else 0 (a frequency known to
        1e-4 is not).
    level : float
        Of the band.
    direction : {"up", "down", "both"}
        Of the predicted diagram.
    splits : int
        Random halves drawn of each section cloud.
    seed : int
        Of all that is drawn at random.
    """

    grid: Annotated[int, at_least(8), Default(128)]
    transient: Annotated[int, at_least(0), Default(300)]
    max_period: Annotated[int, at_least(1), Default(16)]
    draws: Annotated[int, at_least(0)] | None
    level: Annotated[float, Default(0.95)]
    direction: Annotated[Literal["up", "down", "both"], Default("down")]
    splits: Annotated[int, at_least(20), Default(400)]
    seed: Annotated[int, at_least(0), Default(0)]
