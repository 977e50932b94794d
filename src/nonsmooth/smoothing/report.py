"""``smoothing_report``: how an orbit, its multipliers and exponents, and attractors change with the bands' width."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.attractors.basin_fractions import basin_fractions
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.continuation.find import find_orbit
from nonsmooth.diagrams.lyapunov import lyapunov
from nonsmooth.errors import SolveError
from nonsmooth.flow.options import Length, as_called
from nonsmooth.flow.sections import Poincare, Stroboscopic
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.system.arguments import checked
from nonsmooth.system.derived.smoothing import BANDS
from nonsmooth.system.kinds import at_least, real_number

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.flow.sections import Poincare, Stroboscopic
    from nonsmooth.system.system import System


ALIKE = 0.1  # of the largest attractor: what extremes of counterparts may differ


@dataclass(frozen=True)
class Box:
    """Random starts."""

    n_starts: int
    box: dict[str, tuple[float, float]]
    section: Stroboscopic | Poincare | None
    seed: int


@dataclass(frozen=True)
class FoundAttractor:
    """An attractor: its period number (0 without a period), and its extremes."""

    period_number: int
    extremes: Any  # (2, n) maxima, minima


def attractors_of(system: System, search: Box, parameter: str, value: float) -> list[FoundAttractor]:
    """Attractors that the starts reach at one value of a parameter."""
    found = basin_fractions(
        system,
        parameter,
        [value],
        n_starts=search.n_starts,
        box=search.box,
        section=search.section,
        seed=search.seed,
        progress=False,
    ).isel({parameter: 0})
    return [
        FoundAttractor(int(one.period_number), np.array([one.maximum.values, one.minimum.values]))
        for k in range(found.sizes["attractor"])
        if (one := found.isel(attractor=k)).period_number >= 0
    ]


def matched(own: Sequence[FoundAttractor], others: Sequence[FoundAttractor], scale: Any) -> tuple[int, int]:
    """Numbers of attractors without a counterpart: of the first, of the others.

    Pairs are taken in the order of their distances; ``scale``: sizes of states in which none of them moves."""
    if not own or not others:
        return len(own), len(others)
    size = np.max([one.extremes[0] - one.extremes[1] for one in (*own, *others)], axis=0)
    size = np.where(size > 0, size, scale)
    pairs = sorted(
        (float(np.abs((a.extremes - b.extremes) / size).max()), i, j)
        for i, a in enumerate(own)
        for j, b in enumerate(others)
        if a.period_number == b.period_number
    )
    left, free = set(range(len(own))), set(range(len(others)))
    for distance, i, j in pairs:
        if distance < ALIKE and i in left and j in free:
            left.remove(i)
            free.remove(j)
    return len(left), len(free)


@checked
def smoothing_report(
    system: System,
    etas: Any,
    *,
    band: str | Sequence[str] = "linear",
    orbit: Orbit | None = None,
    start: Any = None,
    transient: Annotated[int, at_least(0)] = 20,
    periods: Annotated[int, at_least(1)] | None = None,
    duration: Length | None = None,
    n_starts: Annotated[int, at_least(0)] = 0,
    box: Mapping[str, tuple[float, float]] | None = None,
    section: Stroboscopic | Poincare | None = None,
    seed: Annotated[int, at_least(0)] = 0,
    progress: Progress = True,
) -> xr.Dataset:
    r"""Differences between smoothed systems and the event-driven one, over the half width of the bands.

    At each width the periodic orbit near the event-driven one is found by Newton's method, from that of the width
    before. With the scales s of the states,

    .. math:: d_u = \max_i |\Delta u_i| / s_i, \qquad d_\mu = \max_k |\Delta \mu_k|, \qquad
        \text{order} = \frac{\ln d(\eta_j) - \ln d(\eta_{j-1})}{\ln \eta_j - \ln \eta_{j-1}}

    Parameters
    ----------
    system : System
        Not smoothed. Dry friction and relays are smoothed without their sliding modes; rigid impacts have no band
        (see :meth:`nonsmooth.System.smoothed`).
    etas : array (E,)
        Half widths, in the unit of the indicators.
    band : {"linear", "tanh", "arctan"}, or several
        Shapes of the bands.
    orbit : Orbit, optional
        The event-driven orbit, of ``find_orbit``, stable or not; found from ``start`` where not given. Where the motion
        from there is not periodic only exponents and attractors are compared.
    start : state, optional
        As in :func:`nonsmooth.simulate`.
    transient : int
        Periods (autonomous systems: rounds) that a smoothed system runs before Newton's method; none from an unstable
        orbit.
    periods, duration : int, float, optional
        Length of the runs that give Lyapunov exponents, as in :func:`nonsmooth.lyapunov`. Not given, those of the
        orbit, ln\|mu\| / T; 1000 periods where there is none.
    n_starts : int
        Random starts for the search of attractors at each width; 0 for no search. An autonomous system needs a
        ``section`` for it.
    box, section, seed : optional
        Of these starts, as in :func:`nonsmooth.basin_fractions`; by default the orbit's extremes, twice as far apart.
    progress : bool, or function
        A bar over the widths.

    Returns
    -------
    xarray.Dataset
        Over ``band`` and ``eta`` (rising): ``state_difference`` d_u, of the states at phase 0 of the forcing (of an
        autonomous system of the largest and least values); ``multiplier_difference`` d_mu; ``exponent_difference``, of
        the exponents that are finite without a band; ``period_difference``, relative; with the order of each
        (``state_order``, ...) against the next smaller width. The orbits themselves: ``section``, ``maximum``,
        ``minimum``, ``period``, ``floquet_multipliers``, ``stable``, ``exponents``; those without a band are called
        ``reference_section`` and so on. ``status``, and in ``note`` the reason where there is no such orbit.
        With ``n_starts``: ``n_attractors``, ``missing`` (attractors of the event-driven system without a counterpart),
        ``spurious`` (the other way round) and ``reference_n_attractors``. Counterparts have the same period number and
        extremes that differ by less than a tenth of the largest attractor's.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit; an eta at which the bands overlap.
    SystemDefinitionError
        A system that has no smoothed counterpart, with the reason.
    SolveError
        The search of the event-driven orbit failed, other than because the motion is not periodic.

    See Also
    --------
    nonsmooth.System.smoothed : the smoothed system itself.
    nonsmooth.plot.smoothing_report : its figure.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> friction = ns.models.dry_friction_oscillator(omega=0.4, zeta=0.05)
    >>> report = ns.smoothing_report(friction, [1e-4, 1e-3], progress=False)
    >>> float(report.multiplier_order.sel(band="linear", eta=1e-3).round(2))
    1.0
    """
    asked = as_called(locals())
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.progress import progress as bar
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.variations import report

    if system.is_smoothed:
        raise ValueError("smoothing_report compares with the event-driven system: give it without smoothed(...)")
    widths, bands = _widths(etas), _bands(band)
    if orbit is not None and orbit.system != system:
        raise ValueError("the orbit belongs to another system, or to other values of its parameters")
    for shape in bands:  # overlapping bands are refused before anything is computed
        system.smoothed(widths[-1], shape)
    sharp = _sharp(system, orbit or _reference(system, start), start, transient, periods, duration)
    reference = ({} if sharp.orbit is None else sharp.of(sharp.orbit)) | {"exponents": sharp.exponents()}
    if n_starts:
        sharp.search = Box(n_starts, dict(box) if box else _box(system, sharp.orbit), section, seed)
        sharp.own = attractors_of(system, sharp.search, *_any_parameter(system))
        reference["n_attractors"] = len(sharp.own)
    rows: dict[tuple[int, int], dict[str, Any]] = {}
    with bar(len(bands) * len(widths), "smoothing report", progress) as advance:
        for i, shape in enumerate(bands):
            near = sharp.begin
            for j, eta in enumerate(widths.tolist()):
                rows[i, j], near = sharp.row(system.smoothed(eta, shape), eta, near)
                advance()
    asked |= {"etas": widths, "band": bands, "orbit": None if sharp.orbit is None else sharp.orbit.u, **sharp.length}
    labels = labels_of(system)
    return report(
        labels,
        provenance(labels, "smoothing_report", asked, method="events", seed=seed),
        bands,
        widths,
        reference,
        rows,
        scale=system.scale_vector(),
        forced=system.period() is not None,
    )


@dataclass
class _Sharp:
    """The event-driven system, and by what its smoothed counterparts are compared with it."""

    system: System
    orbit: Orbit | None
    begin: Any  # of runs, and of the search of smoothed orbits
    transient: int
    length: Mapping[str, Any]  # of the runs that give exponents
    search: Box | None = None
    own: list[FoundAttractor] = field(default_factory=list)

    def exponents(self) -> FloatArray:
        """Its Lyapunov exponents."""
        return _exponents(self.system, self.orbit, self.begin, self.length)

    def of(self, orbit: Orbit) -> dict[str, Any]:
        """The compared parts of an orbit; multipliers of memory, which only a band has, are the least and left out."""
        return {
            "section": orbit.u,
            "maximum": orbit.maximum,
            "minimum": orbit.minimum,
            "period": orbit.period,
            "floquet_multipliers": orbit.floquet_multipliers[: len(self.system.states)],
            "stable": orbit.stable,
        }

    def row(self, smooth: System, eta: float, near: Any) -> tuple[dict[str, Any], Any]:
        """The smoothed system's orbit near a state, exponents and attractors; with the state to look near next."""
        row: dict[str, Any] = {"status": codes.OK, "note": ""}
        found = None
        if self.orbit is not None:
            found, row = _near(smooth, self.orbit, near, self.transient)
            near = near if found is None else found.u
        try:
            row["exponents"] = _exponents(smooth, found, near, self.length)[: len(self.system.states)]
        except SolveError as error:
            row |= {"status": _code(error), "note": str(error)}
        if self.search is not None:
            others = attractors_of(smooth, self.search, "eta", eta)
            apart = matched(self.own, others, self.system.scale_vector())
            row["n_attractors"], row["missing"], row["spurious"] = len(others), *apart
        return row | ({} if found is None else self.of(found)), near


def _sharp(
    system: System, orbit: Orbit | None, start: Any, transient: int, periods: int | None, duration: float | None
) -> _Sharp:
    length = {"periods": periods, "duration": duration}
    if orbit is None and periods is None and duration is None:
        length["periods"] = 1000
    return _Sharp(system, orbit, start if orbit is None else orbit.u, transient, length)


def _widths(etas: Any) -> FloatArray:
    """The half widths, rising."""
    given = [real_number(eta, "etas") for eta in np.atleast_1d(np.asarray(etas, dtype=object)).tolist()]
    if not given or min(given) <= 0 or len(set(given)) != len(given):
        raise ValueError(f"etas are half widths of bands: positive numbers, each there once; not {given}")
    return np.sort(np.array(given))


def _bands(band: str | Sequence[str]) -> list[str]:
    wanted = [band] if isinstance(band, str) else list(band)
    if not wanted or len(set(wanted)) != len(wanted) or not set(wanted) <= set(BANDS):
        raise ValueError(f"band is one or several of {', '.join(BANDS)}, not {band!r}")
    return wanted


def _reference(system: System, start: Any) -> Orbit | None:
    """The event-driven orbit, or None where the motion is not periodic."""
    try:
        return find_orbit(system, start=start, progress=False)
    except SolveError as error:
        if error.status == "not_periodic":
            return None
        raise


def _near(smooth: System, orbit: Orbit, near: Any, transient: int) -> tuple[Orbit | None, dict[str, Any]]:
    """The smoothed system's orbit near a state, with the status of the search."""
    number = orbit.period_number or None
    try:
        with np.errstate(all="ignore"):  # a guess that diverges is none
            found = find_orbit(
                smooth, start=near, period_number=number, transient=transient if orbit.stable else 0, progress=False
            )
    except SolveError as error:
        return None, {"status": _code(error), "note": str(error)}
    return found, {"status": codes.OK, "note": ""}


def _code(error: SolveError) -> int:
    """The code of an error's status; of those that only a search has, that of a search without a result."""
    from nonsmooth.results.labels import STATUSES

    return next((status.code for status in STATUSES if status.name == error.status), codes.NO_CONVERGENCE)


def _exponents(system: System, orbit: Orbit | None, start: Any, length: Mapping[str, Any]) -> FloatArray:
    """Exponents of long runs where a length was asked for, else of the orbit; NaN where there is none."""
    n = len(system.states)
    if length["periods"] is not None or length["duration"] is not None:
        return lyapunov(system, start=start, progress=False, **length).exponents.values[:n]
    if orbit is None:
        return np.full(n, np.nan)
    with np.errstate(divide="ignore"):
        return np.log(np.abs(orbit.floquet_multipliers[:n])) / orbit.period


def _box(system: System, orbit: Orbit | None) -> dict[str, tuple[float, float]]:
    """Extremes of the orbit, twice as far apart."""
    if orbit is None:
        raise ValueError("n_starts without an orbit: give box=, the lowest and highest value of each state at a start")
    middle, half = (orbit.maximum + orbit.minimum) / 2, orbit.maximum - orbit.minimum
    both = zip(system.states, (middle - half).tolist(), (middle + half).tolist(), strict=True)
    return {name: (low, high) for name, low, high in both if low < high}


def _any_parameter(system: System) -> tuple[str, float]:
    """A parameter to call sweeps with that vary nothing."""
    if not system.values:
        raise ValueError(f"{system.name!r} has no parameter: n_starts needs one, which stays as it is")
    return next(iter(system.values.items()))
