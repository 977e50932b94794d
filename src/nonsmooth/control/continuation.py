"""``control_based_continuation``: the branch of a rig's periodic motions, stable or not, without a model."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from nonsmooth.control.held import Held, Holder
from nonsmooth.control.march import March, Point
from nonsmooth.control.outcome import Names, branch_dataset
from nonsmooth.control.release import UNKNOWN
from nonsmooth.control.release import release as let_go
from nonsmooth.control.rig import Rig
from nonsmooth.errors import Interrupted, SolveError, shortened
from nonsmooth.flow.arguments import real_number, whole_number
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as bar
from nonsmooth.results.provenance import options_as_data, package_version
from nonsmooth.system.names import by_name, unknown

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["control_based_continuation"]

REPEATS = 0.01  # scatter of the first harmonic over its size: beyond it the first motion is not of the drive's period
PER_HARMONIC = 2.5  # samples
MOST_HARMONICS = 20


@by_name
def control_based_continuation(
    rig: Rig,
    parameter: str,
    range: tuple[float, float],
    *,
    frequency: float,
    amplitude: float,
    direction: str = "up",
    mass: float | None = None,
    gains: tuple[float, float] | None = None,
    harmonics: int | None = None,
    transient: int = 50,
    settle: int = 5,
    record: int = 10,
    release: int = 12,
    step: float = 0.1,
    tolerance: float = 1e-3,
    points: int = 100,
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
    mass : float, optional
        The moving mass, from which the gains follow; where not given, the rig's attribute ``mass``.
    gains : (K_p, K_d), optional
        In place of the rule :math:`K_p = 0`, :math:`K_d = m \omega`.
    harmonics : int, optional
        H; 20 where not given, fewer where the rig is read fewer than 50 times per turn.
    transient : int
        Turns of the drive before the first measurement.
    settle, record : int
        Turns of the drive to wait and to record in each measurement.
    release : int
        Turns of the drive for which each motion found is let go, to see whether it is stable; 0: that is not done.
    step : float
        The largest step along the branch, in units of the range and of the first motion.
    tolerance : float
        Largest control force at convergence, over that which would move the reference by the size of the motion; the
        force may be larger where its noise is.
    points : int
        The largest number of points.
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
        The first motion does not repeat with each turn of the drive, or no reference was found that it follows.
    Interrupted
        Ctrl-C; its ``result`` is the branch that was measured until then. The control force is then off.

    Notes
    -----
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
    follow = _which(parameter, names)
    low, high = _limits(range)
    begin = {"frequency": real_number(frequency, "frequency"), "amplitude": real_number(amplitude, "amplitude")}
    if begin["frequency"] <= 0:
        raise ValueError(f"frequency = {frequency!r}: the angular frequency of the drive is positive")
    if not low <= begin[follow] <= high:
        raise ValueError(f"{follow} = {begin[follow]!r} lies outside the range {low:g} ... {high:g}: begin within it")
    if direction not in ("up", "down"):
        raise ValueError(f"direction = {direction!r}; allowed: 'up', 'down'")
    if real_number(step, "step") <= 0 or real_number(tolerance, "tolerance") <= 0:
        raise ValueError(f"step = {step!r} and tolerance = {tolerance!r} must be positive")
    turns = {"settle": whole_number(settle, "settle", 1), "record": whole_number(record, "record", 3)}
    most = whole_number(points, "points", 1)
    watched = whole_number(release, "release", 0)
    holder = Holder(rig, _gains(gains), _mass(rig, mass, gains), 3, **turns)
    options = {
        "parameter": parameter, "range": [low, high], **begin, "direction": direction, "mass": mass, "gains": gains,
        "harmonics": harmonics, "transient": transient, **turns, "release": release, "step": step,
        "tolerance": tolerance, "points": points,
    }  # fmt: skip
    record_of = {
        "version": package_version(), "verb": "control_based_continuation", "rig": type(rig).__name__,
        "options": options_as_data(options),
    }  # fmt: skip
    found: list[Point] = []
    seen: list[tuple[int, float]] = []
    march: March | None = None
    ending = "points"
    try:
        free = _first(holder, begin, harmonics, whole_number(transient, "transient", 0))
        march = _march(holder, follow, begin, high - low, free, tolerance)
        way = march.points(march.start(free), step, lambda value: low <= value <= high, direction == "up")
        with bar(most, "control-based continuation", progress) as advance:
            while len(found) < most:
                try:
                    point = next(way)
                except StopIteration as last:
                    ending = last.value
                    break
                found.append(point)
                seen.append((UNKNOWN, float("nan")))
                if watched:
                    seen[-1] = let_go(holder, point.held, watched)
                advance()
    except KeyboardInterrupt as error:
        if march is None or not found:
            raise
        part = branch_dataset(march, found, seen, names, getattr(names, follow), "interrupted", record_of)
        raise Interrupted(f"interrupted: {len(found)} points were measured", part) from error
    finally:
        with suppress(Exception):  # what went wrong before is what is said
            rig.apply_force(0.0)
    return branch_dataset(march, found, seen, names, getattr(names, follow), ending, record_of)


def _first(holder: Holder, begin: dict[str, float], harmonics: int | None, transient: int) -> Held:
    """The motion at the beginning, measured without control; the number of harmonics follows from the samples."""
    frequency, amplitude = holder.rig.set_drive(begin["frequency"], begin["amplitude"])
    if transient:
        holder.run(frequency, None, transient)
    per_turn = len(holder.run(frequency, None, 4).phase) / 4
    allowed = int(per_turn / PER_HARMONIC)
    if allowed < 1:
        raise ValueError(f"the rig is read {per_turn:.3g} times per turn of the drive: at least 3 are needed")
    asked = min(MOST_HARMONICS, allowed) if harmonics is None else whole_number(harmonics, "harmonics", 1)
    if asked > allowed:
        raise ValueError(
            f"harmonics = {asked} cannot be told apart by {per_turn:.3g} samples per turn of the drive: at most "
            f"{allowed}"
        )
    holder.harmonics = asked
    free = holder.hold(frequency, amplitude, None)
    size, scatter = abs(free.position.c[1]), free.position.u[1]
    if not scatter < REPEATS * size:
        raise SolveError(
            f"the motion at frequency = {frequency:g}, amplitude = {amplitude:g} does not repeat with each turn of the "
            f"drive (first harmonic {size:.3g}, scatter {scatter:.2g}): begin where a motion of the drive's period is "
            "stable, or give a longer transient",
            status="not_periodic",
        )
    return free


def _march(
    holder: Holder, follow: str, begin: dict[str, float], width: float, free: Held, tolerance: float
) -> March:
    if follow == "frequency":
        return March(
            holder, lambda value: (value, begin["amplitude"]), lambda held: held.frequency, width,
            abs(free.position.c[1]), tolerance,
        )  # fmt: skip
    return March(
        holder, lambda value: (begin["frequency"], value), lambda held: held.amplitude, width,
        abs(free.position.c[1]), tolerance,
    )  # fmt: skip


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


def _which(parameter: Any, names: Names) -> str:
    own = {"frequency": "frequency", "amplitude": "amplitude"}
    known = own | {names.frequency: "frequency", names.amplitude: "amplitude"}
    if parameter not in known:
        raise ValueError(unknown(parameter, "a parameter", "the drive", known))
    return known[parameter]


def _limits(given: Any) -> tuple[float, float]:
    try:
        low, high = given
    except (TypeError, ValueError):
        raise ValueError(f"range = {shortened(given)}: give (low, high)") from None
    low, high = real_number(low, "the lower end of the range"), real_number(high, "the upper end of the range")
    if not low < high:
        raise ValueError(f"range = ({low:g}, {high:g}): the lower end comes first")
    return low, high


def _gains(given: Any) -> tuple[float, float] | None:
    if given is None:
        return None
    try:
        proportional, derivative = (real_number(one, "gains") for one in given)
    except (TypeError, ValueError):
        raise ValueError(f"gains = {shortened(given)}: give (K_p, K_d), two numbers") from None
    if derivative <= 0:
        raise ValueError(f"K_d = {derivative:g}: without damping the controller holds nothing; give more than 0")
    return proportional, derivative


def _mass(rig: Any, given: Any, gains: Any) -> float:
    if gains is not None:
        return 1.0
    mass = getattr(rig, "mass", None) if given is None else given
    if mass is None:
        raise ValueError("the gains follow from the moving mass: give mass=..., roughly, or gains=(K_p, K_d)")
    if real_number(mass, "mass") <= 0:
        raise ValueError(f"mass = {mass!r} must be positive")
    return float(mass)
