"""``propagate``: the uncertainty of parameters through any verb, by draws and to first order."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
import xarray as xr

from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.errors import Interrupted, SolveError, shortened, unknown
from nonsmooth.identification.compare.draws import Setting, draw_systems, known_together, nominal, read_settings
from nonsmooth.identification.gathered import Gathered, matched
from nonsmooth.results.labels import labelled
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as watched
from nonsmooth.system.arguments import checked, declared
from nonsmooth.system.kinds import at_least, real_number
from nonsmooth.system.system import System

COARSE = 0.02  # the largest step of draws' branches: values between points lie on a cubic


@checked
def propagate(
    found: Annotated[Mapping[str, Any], "such as ns.fit returns, or values by name"],
    verb: Annotated[Callable[..., Any], "a function such as ns.sweep"],
    start: Annotated[
        System | Orbit,
        "as its first argument the verb takes a System or an Orbit; for anything else give a function of a System: "
        "lambda s: ns.continue_orbit(ns.find_orbit(s), 'omega', (3, 5))",
    ],
    /,
    *args: Any,
    draws: Annotated[int, at_least(0)] = 200,
    seed: Annotated[int, at_least(0)] = 0,
    settings: Mapping[str, Any] | None = None,
    bounds: Mapping[str, Any] | None = None,
    quantiles: Sequence[float] = (0.025, 0.5, 0.975),
    first_order: bool = False,
    progress: Progress = True,
    **options: Any,
) -> xr.Dataset:
    r"""Return the result of a verb with the band that the uncertainty of the parameters gives it.

    Parameters are drawn from their joint normal law (those known to a factor from a log-normal one), and each draw goes
    through ``verb``. To first order a special point of a branch at :math:`\lambda^*(p)` has the variance

    .. math:: \operatorname{var} \lambda^* = g^T C g, \qquad
        g_i = \frac{d \lambda^*}{d p_i} = -\frac{\psi \cdot F_{p_i}}{\psi \cdot F_\lambda} ,

    C the covariance of the parameters, F = 0 the equations of the orbit and of the special point, bordered so that they
    are regular, :math:`\psi` their left null vector (special points of equilibria: by differences).

    Parameters
    ----------
    found : ParameterSet, or mapping with ``draw(n, seed)`` or ``covariance``
        What :func:`nonsmooth.fit` found. A plain mapping is exact: what is uncertain then stands in ``settings``.
    verb : function
        Any verb whose first argument is a System or an Orbit, or a function of a System that returns a Dataset or a
        number: ``lambda s: ns.continue_orbit(ns.find_orbit(s), "omega", (3, 5))``.
    start : System or Orbit
        Its first argument; parameters in ``found`` replace its own. An Orbit is found anew for each draw, from its
        section point.
    *args, **options
        The verb's other arguments.
    draws, seed : int
        The number of draws (0: none, with ``first_order``), and what they begin from.
    settings : mapping, optional
        Parameters known otherwise: ``{"rho": (0.33, 0.002)}``, value and standard uncertainty; independent, normal.
    bounds : mapping, optional
        ``{"c": (0, None)}``: draws outside are drawn again. A positive parameter of ``found`` never becomes negative or
        zero; of ``settings`` only its bounds say so.
    quantiles : sequence of float
        Probabilities below the edges of the bands.
    first_order : bool
        True: the special points of a branch to first order too.
    progress : bool, or function
        A bar over the draws; see :func:`nonsmooth.sweep`.

    Returns
    -------
    xarray.Dataset
        The result at the parameters found, and for each variable ``x`` with numbers (and ``amplitude``, half of
        maximum less minimum) ``x_quantiles`` over ``quantile``, whose band ``nonsmooth.plot`` draws;
        where some draws have no value, ``x_share`` says how many have. Of a run these are values at its own instants:
        give ``duration=`` and ``samples=``, so that every draw has them. For period numbers
        ``period_number_probability`` over ``period_value`` (0: none found; a draw that diverged has no number), for
        ``stable`` ``stable_probability``, shares of all draws, those without a motion here included. Of a branch, at
        each of its points the values of drawn branches at the same parameter, between the same folds (of a diagram of
        several branches only the special points). Crossings of a run are those of draws in which they are the same
        ones, ``crossing_time_share`` says how many. Attractors of a
        draw are those near which they lie (by the extremes of their motions). Jumps and special points are matched by
        kind and nearness:
        ``jump_value_draws`` and ``special_value_draws`` over ``draw``, their ``_quantiles`` and ``_share``. With
        ``first_order``:
        ``special_slope`` over ``special`` and ``source`` (g), and ``special_first_order`` (the standard uncertainty;
        NaN, with a warning, where a branch for changed parameters does not show the point again).
        ``drawn_<name>`` are the draws, ``failed`` says how many the verb refused.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit; a covariance from which almost no draw is allowed.
    SolveError
        The verb failed for the parameters found, or for all draws.
    Interrupted
        Ctrl-C; the bands of the draws until then are its ``result``.

    Notes
    -----
    Drawn branches are followed with steps of at most 0.02, or ``step=`` where that is longer, whatever the step of the
    branch itself: their special points are as exact, and values between their points lie on a cubic. First order
    holds where the special point moves in proportion to the parameters, and not beside a cusp, where draws show it.
    Source: ISO/IEC Guide 98-3 (2008) and its Supplement 1; bordered systems: W. Govaerts, Numerical Methods for
    Bifurcations of Dynamical Equilibria (2000), section 3.

    Examples
    --------
    The amplitude of a linear oscillator is :math:`F / |k - m \omega^2 + i c \omega|`:

    >>> import numpy as np
    >>> import nonsmooth as ns
    >>> s = ns.mechanical(1.0, 0.1, 1.0, parameters={"F": 1.0, "w": 2.0},
    ...                   forcing={"q": lambda t, p: p.F * np.cos(p.w * t)})
    >>> band = ns.propagate({}, ns.sweep, s, "w", [2.0], settings={"F": (1.0, 0.1)}, draws=50, progress=False)
    >>> amplitude = band["maximum_quantiles"].sel(state="q").values[:, 0]
    >>> bool(np.allclose(amplitude, np.quantile(band["drawn_F"], [0.025, 0.5, 0.975]) / np.hypot(3.0, 0.2)))
    True
    """
    system = start.system if isinstance(start, Orbit) else start
    call, edges = _caller(verb, start, args, options), [real_number(q, "quantiles") for q in quantiles]
    if not edges or sorted(set(edges)) != edges or not 0 < edges[0] <= edges[-1] < 1:
        raise ValueError(f"quantiles = {shortened(quantiles)}: probabilities that rise, between 0 and 1")
    if draws < 2 and not first_order:
        raise ValueError(f"draws = {draws}: a band takes two and more, and some 200 to show its edges")
    known = read_settings(settings, system)
    base = nominal(system, found, known)
    centre = call(base, coarse=False)
    systems, drawn = draw_systems(system, found, known, draws, seed, bounds)
    gathered = Gathered(centre)
    linear_part = to_first_order(centre, found, known, base, call) if first_order else {}
    try:
        with watched(draws, "propagate", progress) as advance:
            for one in systems:
                try:
                    gathered.add(call(one, coarse=True))
                except SolveError as error:
                    gathered.fail(str(error))
                advance()
    except KeyboardInterrupt as error:
        said = f"stopped after {len(gathered.rows)} of {draws} draws; what they gave is the exception's result"
        raise Interrupted(said, gathered.banded(edges, linear_part, drawn, base, seed)) from error
    if systems and len(gathered.failures) == len(systems):
        raise SolveError(f"the verb failed for all {draws} draws: {gathered.failures[0]}", status="no_convergence")
    return gathered.banded(edges, linear_part, drawn, base, seed)


def _caller(
    verb: Callable[..., Any], start: Any, args: tuple[Any, ...], options: dict[str, Any]
) -> Callable[..., xr.Dataset]:
    """The verb with its arguments, for one system after another; ``coarse``: as draws are computed."""
    try:
        takes = set(inspect.signature(verb).parameters)
    except (TypeError, ValueError):
        takes = set()
    for name in options.keys() - takes if hasattr(verb, "door") else ():
        known = takes | declared(propagate).keys()
        raise TypeError(unknown(name, "an option", f"propagate, nor of {verb.__name__}", known))
    of_draws = {"step": max(COARSE, options.get("step", 0.05))} if {"step", "virtual"} <= takes else {}
    quiet = {"progress": False} if "progress" in takes else {}

    def call(system: System, *, coarse: bool) -> xr.Dataset:
        first: Any = system
        if isinstance(start, Orbit):
            from nonsmooth.continuation.find import find_orbit

            number = start.period_number or None
            first = find_orbit(system, start=start.u, period_number=number, transient=0, progress=False)
        with warnings.catch_warnings():
            if coarse:  # said once, of the parameters found
                warnings.simplefilter("ignore")
            result = verb(first, *args, **quiet | options | (of_draws if coarse else {}))
        if isinstance(result, xr.DataArray):
            result = result.to_dataset(name=result.name or "value")
        elif hasattr(result, "to_dataset"):
            result = result.to_dataset()
        if isinstance(result, int | float | np.number):
            result = {"value": result}
        if isinstance(result, Mapping) and not isinstance(result, xr.Dataset):
            result = xr.Dataset({name: ((), float(value)) for name, value in result.items()})
        if not isinstance(result, xr.Dataset):
            given = type(result).__name__
            raise TypeError(f"the verb returned {given}; propagate takes Datasets, numbers and mappings of numbers")
        return result

    return call


DIFFERENCE = 0.1  # of a standard uncertainty, to either side


def to_first_order(
    branch: xr.Dataset, found: Any, settings: Mapping[str, Setting], system: System, call: Callable[..., Any]
) -> dict[str, Any]:
    """Derivatives of special points in the uncertain parameters, and their standard uncertainties."""
    from scipy.linalg import block_diag

    from nonsmooth.continuation.special import special_points

    if "special_point" not in branch:
        raise ValueError("first_order concerns the special points of a branch: give continue_orbit as the verb")
    if any(one.follows for one in settings.values()):
        raise ValueError("first_order takes settings with values: one that is a function is left to the draws")
    names, joint = known_together(found, system.values.keys() - settings.keys())
    set_ = [(name, one.uncertainty) for name, one in settings.items() if one.uncertainty > 0]
    covariance = block_diag(joint, np.diag([error**2 for _, error in set_]))
    every = [*zip(names, np.sqrt(np.diag(joint)).tolist(), strict=True), *set_]
    some = [i for i, (_, error) in enumerate(every) if error > 0]
    sources, covariance = [every[i] for i in some], covariance[np.ix_(some, some)]
    own = str(branch.attrs["parameter"])
    table = special_points(branch)
    slope = np.array(
        [
            [0.0 if name == own else _slope(table.isel(special=i), name) for name, _ in sources]
            for i in range(table.sizes["special"])
        ]
    ).reshape(table.sizes["special"], len(sources))
    for i, (name, error) in enumerate(sources):
        if (lost := np.isnan(slope[:, i])).any():  # of equilibria: by differences of whole branches
            value, h = system.values[name], DIFFERENCE * error
            ends = [call(system.with_parameters({name: value + sign * h}), coarse=True) for sign in (1, -1)]
            ahead, behind = (matched(branch, one, "special") for one in ends)
            slope[lost, i] = ((ahead - behind) / (2 * h))[lost]
    for i, name in zip(*np.nonzero(np.isnan(slope)), strict=True):
        kind, at = table["kind"].values[i], table[own].values[i]
        warnings.warn(
            f"special_first_order is NaN for the {kind} at {own} = {at:.6g}: it has no curve of its own, and with "
            f"{sources[name][0]} changed by {DIFFERENCE:g} standard uncertainties the branch shows no {kind} beside it",
            RuntimeWarning,
            stacklevel=4,
        )
    variance = np.einsum("si,ij,sj->s", slope, covariance, slope)
    unit = system.parameters[own].unit or "1"
    return {
        "source": ("source", [name for name, _ in sources]),
        "special_slope": labelled(("special", "source"), slope, f"derivative of {own} at a special point"),
        "special_first_order": labelled(
            "special", np.sqrt(variance), f"standard uncertainty of {own} to first order", unit
        ),
    }


def _slope(row: xr.Dataset, name: str) -> float:
    """Derivative of a special point in another parameter: the tangent of its curve in both; NaN where it has none."""
    from nonsmooth.continuation.branches.reading import special_row
    from nonsmooth.continuation.events.codimension_two import KINDS
    from nonsmooth.continuation.problems.locus import Locus

    if "unknowns" not in row or str(row["kind"].values) not in KINDS:
        return np.nan
    system, kind, own, point, period_number, span = special_row(row, "propagate")
    system = system.with_parameters({own: point.value})
    widths = (abs(system.values[name]) or 1.0, abs(span[1] - span[0]))
    first = Locus.through(system, kind, point, period_number, (name, own), widths)
    if first is None or first.tangent[-2] == 0.0:
        return np.nan
    other, along = first.tangent[-2:] * first.curve.scale[-2:]
    return along / other
