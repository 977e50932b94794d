"""``propagate``: the uncertainty of parameters through any verb, by draws and to first order."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.errors import Interrupted, SolveError, shortened
from nonsmooth.flow.arguments import real_number, whole_number, yes_or_no
from nonsmooth.identification.compare.draws import (
    Setting,
    draw_systems,
    drawn_variables,
    nominal,
    read_settings,
)
from nonsmooth.results.progress import Progress, progress
from nonsmooth.system.system import System

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["propagate"]

#: Dims over which results list what they found, however much it was: the value of each and what its rows share.
LISTS = {"jump": ("jump_value", ("jump_variable", "jump_direction")), "special": (None, ("special_kind", "kind"))}
COARSE = 0.02  # the largest step of draws' branches: values between points lie on a cubic
FINER = 8  # points to a step of a drawn branch, on that cubic
FAILURES = 3  # reasons that are repeated
DIFFERENCE = 0.1  # of a standard uncertainty, to either side
MOST = 10**8  # numbers kept over all draws


def propagate(
    found: Any,
    verb: Callable[..., Any],
    start: Any,
    /,
    *args: Any,
    draws: int = 200,
    seed: int = 0,
    settings: Mapping[str, Any] | None = None,
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
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
        ``{"c": (0, None)}``: draws outside are drawn again. A positive parameter never becomes negative or zero.
    quantiles : sequence of float
        Probabilities below the edges of the bands.
    first_order : bool
        True: the special points of a branch to first order too.
    progress : bool, or function
        A bar over the draws; see :func:`nonsmooth.sweep`.

    Returns
    -------
    xarray.Dataset
        The result at the parameters found, and for each variable ``x`` with numbers ``x_quantiles`` over ``quantile``;
        where some draws have no value, ``x_share`` says how many have. For period numbers ``period_number_probability``
        over ``period_value`` (0: none found), for ``stable`` ``stable_probability``. Of a branch, at each of its points
        the values of drawn branches at the same parameter, between the same folds (of a diagram of several branches
        only the special points). Jumps and special points are matched by kind and nearness: ``jump_value_draws`` and
        ``special_value_draws`` over ``draw``, their ``_quantiles`` and ``_share``. With ``first_order``:
        ``special_slope`` over ``special`` and ``source`` (g), and ``special_first_order`` (the standard uncertainty).
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
    >>> import nonsmooth as ns
    >>> s = ns.models.discontinuous_support(g=0.0018, rho=0.33, omega=11.15)
    >>> found = ns.ParameterSet({"k": Estimate(8.47, 0.05, "N/m")}, [[0.0025]])           # doctest: +SKIP
    >>> band = ns.propagate(found, ns.frequency_response, s, omega_values, draws=200)     # doctest: +SKIP
    >>> band["jump_value_quantiles"]                                                      # doctest: +SKIP
    """
    count, many = whole_number(draws, "draws", 0), whole_number(seed, "seed", 0)
    linear = yes_or_no(first_order, "first_order")
    system = start.system if isinstance(start, Orbit) else start
    if not isinstance(system, System):
        raise TypeError(
            f"propagate takes a System or an Orbit as the verb's first argument, not {type(start).__name__}; for "
            "anything else give a function of a System: lambda s: ns.continue_orbit(ns.find_orbit(s), 'omega', (3, 5))"
        )
    if not callable(verb):
        raise TypeError(f"verb = {shortened(verb)}: a function such as ns.sweep")
    edges = [real_number(q, "quantiles") for q in quantiles]
    if not edges or sorted(set(edges)) != edges or not 0 < edges[0] <= edges[-1] < 1:
        raise ValueError(f"quantiles = {shortened(quantiles)}: probabilities that rise, between 0 and 1")
    if count < 2 and not linear:
        raise ValueError(f"draws = {count}: a band takes two and more, and some 200 to show its edges")
    known = read_settings(settings, system)
    call = _Call(verb, start, args, options)
    base = nominal(system, found, known)
    centre = call(base, coarse=False)
    systems, drawn = draw_systems(system, found, known, count, many, bounds)
    gathered = _Gathered(centre)
    failures: list[str] = []
    linear_part = _to_first_order(centre, found, known, base, call) if linear else {}

    def banded() -> xr.Dataset:
        n = len(gathered.rows)
        variables = gathered.variables(edges) | linear_part
        variables |= drawn_variables({name: values[:n] for name, values in drawn.items()}, base)
        reasons = "; ".join(dict.fromkeys(failures[:FAILURES]))
        variables["failed"] = ((), len(failures), {"long_name": "draws for which the verb failed", "comment": reasons})
        result = centre.assign(variables).assign_coords(quantile=("quantile", edges))
        result.attrs = {**centre.attrs, "propagated": f"{n} draws from seed {many}"}
        return result

    try:
        with _progress(count, progress) as advance:
            for one in systems:
                try:
                    with warnings.catch_warnings():  # said once, of the parameters found
                        warnings.simplefilter("ignore")
                        gathered.add(call(one, coarse=True))
                except SolveError as error:
                    failures.append(str(error))
                    gathered.add(None)
                advance()
    except KeyboardInterrupt as error:
        said = f"stopped after {len(gathered.rows)} of {count} draws; what they gave is the exception's result"
        raise Interrupted(said, banded()) from error
    if systems and len(failures) == len(systems):
        raise SolveError(f"the verb failed for all {count} draws: {failures[0]}", status="no_convergence")
    return banded()


def _progress(total: int, watched: Progress) -> Any:
    return progress(total, "propagate", watched)


class _Call:
    """The verb with its arguments, for one system after another."""

    def __init__(self, verb: Callable[..., Any], start: Any, args: tuple[Any, ...], options: dict[str, Any]) -> None:
        self.verb, self.start, self.args, self.options = verb, start, args, dict(options)
        try:
            takes = set(inspect.signature(verb).parameters)
        except (TypeError, ValueError):
            takes = set()
        self.coarse = {"step": max(COARSE, self.options.get("step", 0.05))} if {"step", "virtual"} <= takes else {}
        if "progress" in takes:
            self.options.setdefault("progress", False)

    def __call__(self, system: System, *, coarse: bool) -> xr.Dataset:
        import xarray as xr

        first: Any = system
        if isinstance(self.start, Orbit):
            from nonsmooth.continuation.find import find_orbit

            o = self.start
            first = find_orbit(system, start=o.u, period_number=o.period_number or None, transient=0, progress=False)
        options = {**self.options, **(self.coarse if coarse else {})}
        result = self.verb(first, *self.args, **options)
        if hasattr(result, "to_dataset"):
            result = result.to_dataset()
        if isinstance(result, int | float | np.number):
            result = xr.Dataset({"value": ((), float(result))})
        if isinstance(result, Mapping) and not isinstance(result, xr.Dataset):
            result = xr.Dataset({name: ((), float(value)) for name, value in result.items()})
        if isinstance(result, xr.DataArray):
            result = result.to_dataset(name=result.name or "value")
        if not isinstance(result, xr.Dataset):
            given = type(result).__name__
            raise TypeError(f"the verb returned {given}; propagate takes Datasets, numbers and mappings of numbers")
        return result


class _Gathered:
    """The results of draws, brought to the dims of the one at the parameters found."""

    def __init__(self, centre: xr.Dataset) -> None:
        self.centre = centre
        self.branch = str(centre.attrs.get("parameter", "")) if "point" in centre.dims else ""
        names = [*centre.data_vars, *([self.branch] if self.branch else [])]
        numbers = [str(name) for name in names if centre[name].dtype.kind in "fiub" and name != "status"]
        listed = {str(name) for name in numbers if set(centre[name].dims) & set(LISTS)}
        along = {name for name in numbers if "point" in centre[name].dims}
        self.plain = [name for name in numbers if name not in listed | along]
        left = {self.branch, "unknowns", "tangent", "layout", "mode"}
        self.along = [] if "branch" in centre else [name for name in along if name not in left]  # one branch alone
        self.lists = [dim for dim in LISTS if dim in centre.dims and (dim != "special" or self.branch)]
        self.rows: list[dict[str, Any]] = []
        self.sheets = _Sheets(centre, self.branch, self.along) if self.along else None

    def add(self, result: xr.Dataset | None) -> None:
        """Keep what a draw gave; None where it failed."""
        row: dict[str, Any] = {}
        if result is not None:
            for name in self.plain:
                if name in result and result[name].shape == self.centre[name].shape:
                    row[name] = result[name].values
            if self.sheets is not None:
                row |= self.sheets.brought(result)
            for dim in self.lists:
                row[dim] = _matched(self.centre, result, dim)
            if len(self.rows) * sum(np.size(values) for values in row.values()) > MOST:
                raise ValueError("the draws hold more than 1e8 numbers: take fewer draws, or a smaller result")
        self.rows.append(row)

    def variables(self, edges: list[float]) -> dict[str, Any]:
        """Quantiles, shares and probabilities."""
        found: dict[str, Any] = {}
        for name in (*self.plain, *self.along):
            if kept := [row[name] for row in self.rows if name in row]:
                found |= self._of(name, np.stack(kept), edges)
        for dim in self.lists:
            value = LISTS[dim][0] or "special_value"
            dims, size = self.centre[value].dims, self.centre[value].shape
            kept = [row.get(dim, np.full(size, np.nan)) for row in self.rows]
            if kept:
                attrs = {**self.centre[value].attrs, "long_name": f"{dim} for drawn parameters"}
                found[f"{value}_draws"] = (("draw", *dims), np.stack(kept), attrs)
                found |= self._numbers(value, np.stack(kept), edges)
        return found

    def _of(self, name: str, stack: FloatArray, edges: list[float]) -> dict[str, Any]:
        array = self.centre[name]
        if name.rpartition("_")[2] == "stable" or array.dtype.kind == "b":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)  # no draw has this point
                mean = np.nanmean(np.asarray(stack, float), axis=0)
            return {f"{name}_probability": (array.dims, mean, {"long_name": f"share of draws: {name}"})}
        if name == "period_number":
            numbers = np.unique(np.append(stack, array.values))
            shares = np.stack([np.mean(stack == number, axis=0) for number in numbers])
            return {
                "period_number_probability": (("period_value", *array.dims), shares, {
                    "long_name": "share of draws with this period number (0: none found)"}),
                "period_value": ("period_value", numbers, {"long_name": "period number"}),
            }  # fmt: skip
        if array.dtype.kind != "f":
            return {}
        return self._numbers(name, stack, edges)

    def _numbers(self, name: str, stack: FloatArray, edges: list[float]) -> dict[str, Any]:
        array = self.centre[name]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # no draw has a value here
            bands = np.nanquantile(stack, edges, axis=0)
        attrs = {key: value for key, value in array.attrs.items() if isinstance(value, str)}
        found: dict[str, Any] = {f"{name}_quantiles": (("quantile", *array.dims), bands, attrs)}
        share = np.isfinite(stack).sum(axis=0) / len(self.rows)
        if (share < 1).any():
            found[f"{name}_share"] = (array.dims, share, {"long_name": f"share of draws that have {name} here"})
        return found


class _Sheets:
    """A branch between its turning points: values of another one at the same parameter, on the same sheet."""

    def __init__(self, centre: xr.Dataset, name: str, along: list[str]) -> None:
        self.name, self.along, self.centre = name, along, centre
        self.value = centre[name].values
        self.sheet = _sheet_numbers(self.value)

    def brought(self, result: xr.Dataset) -> dict[str, Any]:
        """Values of a drawn branch at the points of the branch itself; NaN where its sheet does not reach."""
        value = result[self.name].values
        sheet, finer = _sheet_numbers(value), _finer(_length(result, self.name))
        first = self._first(sheet, result)
        found = {}
        dense = finer(value)
        of = np.repeat(sheet, FINER)[: len(dense)] if len(sheet) > 1 else sheet
        for name in self.along:
            if name not in result:
                continue
            values = np.asarray(result[name].values, float)
            rows = np.full((len(self.value), *values.shape[1:]), np.nan)
            flag = result[name].dtype.kind in "iub"
            other = np.repeat(values, FINER, axis=0)[: len(dense)] if flag else finer(values)
            for k in np.unique(self.sheet):
                here, there = self.sheet == k, of == k - first
                if np.count_nonzero(there) > 1:
                    rows[here] = _at(self.value[here], dense[there], other[there], flag)
            found[name] = rows
        return found

    def _first(self, sheet: FloatArray, result: xr.Dataset) -> int:
        """Number by which sheets are counted differently, where a draw has fewer turning points before the same one."""
        begins = self.centre[self.name].values[:2], result[self.name].values[:2]
        same = np.sign(np.diff(begins[0])) == np.sign(np.diff(begins[1]))
        return 0 if same.all() else 1


def _sheet_numbers(value: FloatArray) -> FloatArray:
    """The number of turning points before each point."""
    up = np.sign(np.diff(value))
    turns = np.concatenate([[0], np.cumsum(up[1:] * up[:-1] < 0)]) if len(up) else np.zeros(0)
    return np.append(turns, turns[-1:]).astype(int) if len(turns) else np.zeros(len(value), int)


def _length(branch: xr.Dataset, name: str) -> FloatArray:
    """Length along a branch, its parameter and the amplitudes of the states scaled to one."""
    columns = [branch[name].values[:, None]]
    columns += [branch[key].values for key in ("maximum", "minimum", "u") if key in branch]
    whole = np.concatenate(columns, axis=1)
    sizes = np.ptp(whole, axis=0)
    steps = np.linalg.norm(np.diff(whole / np.where(sizes > 0, sizes, 1.0), axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-12))])


def _finer(length: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Values at FINER points to a step, by cubics that do not overshoot."""
    from scipy.interpolate import PchipInterpolator

    fine = np.interp(np.arange((len(length) - 1) * FINER + 1) / FINER, np.arange(len(length)), length)

    def finer(values: FloatArray) -> FloatArray:
        if len(length) < 2:
            return values
        if not np.isfinite(values).all():
            flat = values.reshape(len(values), -1)
            dense = np.stack([np.interp(fine, length, column) for column in flat.T], axis=-1)
            return dense.reshape(-1, *values.shape[1:])
        return np.asarray(PchipInterpolator(length, values, axis=0)(fine))

    return finer


def _at(wanted: FloatArray, value: FloatArray, other: FloatArray, flag: bool) -> FloatArray:
    """``other`` where ``value``, which rises or falls, has the wanted values; NaN beyond its ends."""
    order = np.argsort(value, kind="stable")
    value, flat = value[order], other[order].reshape(len(value), -1)
    if flag:
        rows = flat[np.clip(np.searchsorted(value, wanted), 0, len(value) - 1)]
    else:
        rows = np.stack([np.interp(wanted, value, column) for column in flat.T], axis=-1)
    near = 1e-9 * (abs(value[0]) + abs(value[-1]))  # an edge of the range, to rounding
    rows[(wanted < value[0] - near) | (wanted > value[-1] + near)] = np.nan
    return rows.reshape(len(wanted), *other.shape[1:])


def _matched(centre: xr.Dataset, result: xr.Dataset, dim: str) -> FloatArray:
    """The value of each listed row in a draw: the nearest of the same kind; NaN where it has none."""
    from scipy.optimize import linear_sum_assignment

    value, shared = LISTS[dim]
    value = value or "special_value"
    found = np.full(centre[value].shape, np.nan)
    if value not in result or not result[value].size or not found.size:
        return found
    keys = [key for key in shared if key in centre]
    ours = list(zip(*(centre[key].values.astype(str) for key in keys), strict=True))
    theirs = list(zip(*(result[key].values.astype(str) for key in keys), strict=True))
    far = np.abs(centre[value].values[:, None] - result[value].values[None, :])
    other = np.array([[a != b for b in theirs] for a in ours])
    beyond = 1e3 * (far.max() + 1.0)
    for i, j in zip(*linear_sum_assignment(far + beyond * other), strict=True):
        if not other[i, j]:
            found[i] = result[value].values[j]
    return found


def _sources(found: Any, settings: Mapping[str, Setting], system: System) -> tuple[list[tuple[str, float]], FloatArray]:
    """Uncertain parameters with their standard uncertainties, and their covariance."""
    covariance = getattr(found, "covariance", None)
    names = [] if covariance is None else [str(n) for n in covariance[covariance.dims[0]].values]
    held = [i for i, n in enumerate(names) if n in found and n in system.values and n not in settings]
    joint = np.zeros((0, 0)) if covariance is None else np.asarray(covariance.values, float)[np.ix_(held, held)]
    own = [(n, one.uncertainty) for n, one in settings.items() if one.uncertainty > 0 and not one.follows]
    matrix = np.zeros((len(held) + len(own), len(held) + len(own)))
    matrix[: len(held), : len(held)] = joint
    matrix[range(len(held), len(matrix)), range(len(held), len(matrix))] = [error**2 for _, error in own]
    return [(names[i], float(np.sqrt(joint[k, k]))) for k, i in enumerate(held)] + own, matrix


def _to_first_order(
    branch: xr.Dataset, found: Any, settings: Mapping[str, Setting], system: System, call: _Call
) -> dict[str, Any]:
    """Derivatives of special points in the uncertain parameters, and their standard uncertainties."""
    from nonsmooth.continuation.special import special_points

    if "special_point" not in branch:
        raise ValueError("first_order concerns the special points of a branch: give continue_orbit as the verb")
    if any(one.follows for one in settings.values()):
        raise ValueError("first_order takes settings with values: one that is a function is left to the draws")
    sources, covariance = _sources(found, settings, system)
    own = str(branch.attrs["parameter"])
    table = special_points(branch)
    slope = np.array([
        [0.0 if name == own else _slope(table.isel(special=i), name) for name, _ in sources]
        for i in range(table.sizes["special"])
    ]).reshape(table.sizes["special"], len(sources))  # fmt: skip
    for i, (name, error) in enumerate(sources):
        if (lost := np.isnan(slope[:, i])).any() and error > 0:  # of equilibria: by differences of whole branches
            value, h = system.values[name], DIFFERENCE * error
            ends = [call(system.with_parameters({name: value + sign * h}), coarse=True) for sign in (1, -1)]
            ahead, behind = (_matched(branch, one, "special") for one in ends)
            slope[lost, i] = ((ahead - behind) / (2 * h))[lost]
    variance = np.einsum("si,ij,sj->s", slope, covariance, slope)
    unit = system.parameters[own].unit or "1"
    return {
        "source": ("source", [name for name, _ in sources]),
        "special_slope": (("special", "source"), slope, {"long_name": f"derivative of {own} at a special point"}),
        "special_first_order": (("special",), np.sqrt(variance), {
            "long_name": f"standard uncertainty of {own} to first order", "units": unit}),
    }  # fmt: skip


def _slope(row: xr.Dataset, name: str) -> float:
    """Derivative of a special point in another parameter: the tangent of its curve in both; NaN where it has none."""
    from nonsmooth.continuation.branches.reading import special_row
    from nonsmooth.continuation.events.codimension_two import KINDS
    from nonsmooth.continuation.problems.locus import Locus
    from nonsmooth.continuation.problems.orbits import size_of
    from nonsmooth.continuation.problems.shooting import Shooting

    if "unknowns" not in row or str(row["kind"].values) not in KINDS:
        return np.nan
    system, kind, own, point, period_number, span = special_row(row, "propagate")
    system = system.with_parameters({own: point.value})
    shooting = Shooting(system, point.signature, period_number, (name, own))
    size = size_of(point.maximum, point.minimum, system)
    X = np.concatenate([point.X[: shooting.size], [system.values[name], point.value]])
    shooting.prepare(X, size)
    widths = (abs(system.values[name]) or 1.0, abs(span[1] - span[0]))
    locus = Locus(shooting, kind, size, point.period, widths)
    first = locus.first(X)
    if first is None or first.tangent[-2] == 0.0:
        return np.nan
    return float(first.tangent[-1] * locus.scale[-1] / (first.tangent[-2] * locus.scale[-2]))
