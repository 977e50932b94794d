"""``control_based_continuation``: the branch of a rig's periodic motions over a drive's settings, without a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nonsmooth.control.holding import UNKNOWN, Held, Holder, Holding
from nonsmooth.control.holding import release as let_go
from nonsmooth.control.march import Continuation, MeasuredPoint
from nonsmooth.control.outcome import Names, branch_dataset
from nonsmooth.control.rig import Guard, Rig
from nonsmooth.errors import Interrupted, SolveError, shortened, unknown
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as bar
from nonsmooth.results.provenance import options_as_data, package_version
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Natural, Positive, Range

if TYPE_CHECKING:
    import xarray as xr


PER_HARMONIC = 2.5  # samples
MOST_HARMONICS = 20


@checked
def control_based_continuation(
    rig: Rig,
    parameter: str,
    range: Range,
    *,
    frequency: Positive,
    amplitude: float,
    direction: Literal["up", "down"] = "up",
    step: Positive = 0.1,
    points: Natural = 100,
    holding: Holding = Holding(),  # noqa: B008  it is frozen
    progress: Progress = True,
) -> xr.Dataset:
    r"""Follow the periodic motions of an experiment in a parameter of its drive, through folds, stable or not.

    A controller holds the motion to a periodic reference,

    .. math:: F = K_p (r - x) + K_d (\dot r - \dot x), \qquad r = \mathrm{Re} \sum_{h=0}^{H} c_h e^{i h \omega t}

    and the reference is changed until the controller has nothing left to do: then :math:`x = r`, F is noise, and the
    motion is one of the rig without a controller. Its stability does not matter, since it is held.

    Parameters
    ----------
    rig : Rig
        An object with the methods ``set_drive(frequency, amplitude)``, ``apply_force(force)`` and ``read()``; see
        :class:`nonsmooth.control.rig.Rig`. ``ns.SimulatedRig(system)`` is one, ``VirtualRig(...).live(...)`` another.
    parameter : {"frequency", "amplitude"}
        What is varied, of the drive; the rig's own names of both are taken too.
    range : (low, high)
        Its range. The branch is followed until it leaves it, through folds.
    frequency, amplitude : float
        The drive at the beginning, where a motion that is stable without control is measured first. The one that is
        not the parameter stays.
    direction : {"up", "down"}
        Direction of the parameter at the beginning.
    step : float
        The largest step along the branch, in units of the range and of the first motion.
    points : int
        The largest number of points.
    holding : Holding
        Gains and limits of the controller, harmonics of the reference, and the turns that each measurement takes:
        :class:`nonsmooth.Holding`.
    progress : bool or callable
        A bar of the points, or a function that hears the fraction done and may return False to cancel.

    Returns
    -------
    xarray.Dataset
        Over ``point``, in order along the branch: the parameter, ``section`` (state at phase 0 of the drive),
        ``maximum``, ``minimum``, ``period``; ``amplitude`` (half the peak-to-peak value) with
        ``amplitude_uncertainty``, ``parameter_uncertainty``; ``position_cosine`` and ``position_sine`` over
        ``harmonic``; ``control_effort`` (rms of the control force that repeats with each turn) with
        ``control_effort_noise`` (what noise alone would show) and ``control_effort_first`` (before the first
        correction), ``control_rms``; ``stability`` of the motion displaced by 1 % and let go: 1 where it came back
        to a third of that or less, 0 where it left to three times that, -1 where neither was seen, and ``growth``, the
        mean factor per turn. Over ``special`` the folds: ``special_value`` with ``special_value_uncertainty``.
        ``ended_because`` in a sentence.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        The first motion does not repeat with each turn of the drive, or no longer does under control; or what stops a
        measurement (below) came before the first point.
    Interrupted
        Ctrl-C; its ``result`` is the branch that was measured until then. The control force is then off.

    Notes
    -----
    A measurement stops where a force or a position is beyond its limit, where a reading is no number, where the sensor
    shows the same for a whole turn, and where a method of the rig raises an exception. The force is set to zero before
    the next reading; the branch ends there, and ``ended_because`` says why.

    Gains: with :math:`K_d = m \omega` the controller adds half of critical damping at the drive's frequency: a small
    difference from the reference falls by exp(-pi) per turn, faster than any resonance with light damping can make it
    grow. A force against the velocity takes energy out of impacts and contacts, whatever their stiffness. There
    is no :math:`K_p`, which with the delay of a sampled controller would put energy in. The measured velocity is
    low-passed at five times the drive's frequency. A motion with a Floquet multiplier beyond exp(pi) per turn needs
    more.

    ``stability`` is what was seen, no multiplier: beside a fold it is -1. Bifurcations to longer periods are not
    detected: the motion of the drive's period is held beyond them too, and it leaves when it is let go.

    References
    ----------
    J. Sieber, B. Krauskopf, Nonlinear Dynamics 51 (2008) 365-377, doi:10.1007/s11071-007-9217-2.
    D.A.W. Barton, J. Sieber, Phys. Rev. E 87 (2013) 052916, doi:10.1103/PhysRevE.87.052916.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> rig = ns.SimulatedRig(ns.models.discontinuous_support(g=0.02), noise=1e-5)
    >>> branch = ns.control_based_continuation(
    ...     rig, "frequency", (4.9, 6.0), frequency=5.0, amplitude=0.14)  # doctest: +SKIP
    """
    names = _names(rig)
    course = course_of(names, parameter, range, frequency, amplitude, direction)
    guard = Guard(rig, *holding.positions)
    branch = _MeasuredBranch(Holder(guard, holding, holding.mass_of(rig)), course, names)
    options = options_as_data({**asdict(course), "step": step, "points": points, "holding": asdict(holding)})
    record: dict[str, Any] = {"version": package_version(), "verb": "control_based_continuation"}
    record |= {"rig": type(rig).__name__, "options": options}
    try:
        branch.begin()
        with bar(points, "control-based continuation", progress) as advance:
            ending = branch.follow(step, points, advance)
    except KeyboardInterrupt as error:
        if not branch.points:
            raise
        words = f"interrupted: {len(branch.points)} points were measured"
        raise Interrupted(words, branch.dataset("interrupted", record)) from error
    except Exception as error:
        if not branch.points:
            raise
        ending = f"{error}" if isinstance(error, SolveError) else f"stopped: {type(error).__name__}: {error}"
    finally:
        guard.off()
    return branch.dataset(ending, record)


@dataclass
class _MeasuredBranch:
    """A branch as far as it has been measured, point by point."""

    holder: Holder
    course: Course
    names: Names
    points: list[MeasuredPoint] = field(default_factory=list)
    released: list[tuple[int, float]] = field(default_factory=list)
    free: Held = field(init=False)
    march: Continuation = field(init=False)

    def begin(self) -> None:
        """Measure the motion at the beginning, without control."""
        self.free = _first(self.holder, self.course)
        size, width = float(abs(self.free.position.c[1])), self.course.high - self.course.low
        self.holder.size = float(np.linalg.norm(self.free.position.c[1:]))
        tolerance = self.holder.holding.tolerance
        self.march = Continuation(self.holder, self.course.setting, self.course.of, width, size, tolerance)

    def follow(self, step: float, most: int, advance: Callable[[], None]) -> str:
        """Measure points until the branch ends or there are enough; returns how it ended."""
        march, turns = self.march, self.holder.holding.release
        way = march.points(march.start(self.free), step, self.course.inside, self.course.rising)
        while len(self.points) < most:
            try:
                point = next(way)
            except StopIteration as last:
                return str(last.value)
            self.points.append(point)
            self.released.append((UNKNOWN, float("nan")))
            if turns:
                self.released[-1] = let_go(self.holder, point.held, turns)
            advance()
        return "points"

    def dataset(self, ending: str, record: dict[str, Any]) -> xr.Dataset:
        """The points as a result."""
        parameter = getattr(self.names, self.course.parameter)
        return branch_dataset(self.march, self.points, self.released, self.names, parameter, ending, record)


def _first(holder: Holder, course: Course) -> Held:
    """The motion at the beginning, measured without control; the number of harmonics follows from the samples."""
    holding = holder.holding
    frequency, amplitude = holder.rig.set_drive(course.frequency, course.amplitude)
    if holding.transient:
        holder.run(frequency, None, holding.transient)
    per_turn = len(holder.run(frequency, None, 4).phase) / 4
    allowed = int(per_turn / PER_HARMONIC)
    if allowed < 1:
        raise ValueError(f"the rig is read {per_turn:.3g} times per turn of the drive: at least 3 are needed")
    asked = holding.harmonics or min(MOST_HARMONICS, allowed)
    if asked > allowed:
        raise ValueError(
            f"harmonics = {asked} cannot be told apart by {per_turn:.3g} samples per turn of the drive: at most "
            f"{allowed}"
        )
    holder.harmonics = asked
    free = holder.hold(frequency, amplitude, None)
    if not free.repeats:
        size, scatter = abs(free.position.c[1]), free.position.u[1]
        raise SolveError(
            f"the motion at frequency = {frequency:g}, amplitude = {amplitude:g} does not repeat with each turn of the "
            f"drive (first harmonic {size:.3g}, scatter {scatter:.2g}): begin where a motion of the drive's period is "
            "stable, or give a longer transient",
            status="not_periodic",
        )
    return free


def _names(rig: Any) -> Names:
    """Names and units of the rig's quantities; TypeError for what is no rig."""
    missing = [name for name in ("set_drive", "apply_force", "read") if not callable(getattr(rig, name, None))]
    if missing:
        hint = ""
        if type(rig).__name__ == "System":
            hint = "; a system becomes a rig by ns.SimulatedRig(system)"
        elif callable(getattr(rig, "live", None)):
            hint = "; a VirtualRig becomes one by its method live"
        raise TypeError(
            f"control_based_continuation takes a rig, an object with the methods set_drive, apply_force and read; "
            f"{shortened(rig)} has no {' and no '.join(missing)}{hint}"
        )
    return Names(**getattr(rig, "names", {}), units=getattr(rig, "units", None))


@dataclass(frozen=True)
class Course:
    """The drive at the beginning, and which of its two settings is varied over which range."""

    parameter: str  # "frequency" or "amplitude"
    low: float
    high: float
    frequency: float
    amplitude: float
    rising: bool

    def setting(self, value: float) -> tuple[float, float]:
        """Frequency and amplitude of the drive at a value of the parameter."""
        return (value, self.amplitude) if self.parameter == "frequency" else (self.frequency, value)

    def of(self, held: Held) -> float:
        """The parameter that was really set."""
        return float(getattr(held, self.parameter))

    def inside(self, value: float) -> bool:
        """Return whether a value lies in the range."""
        return self.low <= value <= self.high


def course_of(
    names: Names, parameter: str, range: tuple[float, float], frequency: float, amplitude: float, direction: str
) -> Course:
    """The course that was asked for, checked.

    Raises
    ------
    ValueError, TypeError
        Settings that do not fit the drive or each other.
    """
    own = {"frequency": "frequency", "amplitude": "amplitude"}
    known = own | {names.frequency: "frequency", names.amplitude: "amplitude"}
    if parameter not in known:
        raise ValueError(unknown(parameter, "a parameter", "the drive", known))
    (low, high), varied = range, known[parameter]
    begin = {"frequency": frequency, "amplitude": amplitude}
    if not low <= begin[varied] <= high:
        raise ValueError(f"{varied} = {begin[varied]!r} lies outside the range {low:g} ... {high:g}: begin within it")
    return Course(varied, low, high, rising=direction == "up", **begin)
