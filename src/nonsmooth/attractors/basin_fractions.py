"""``basin_fractions``: every attractor over a parameter, with its share of random starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Unpack

import numpy as np

from nonsmooth.attractors.basins import failed, settler_of, shown
from nonsmooth.attractors.basins_attractors import Attractor, find_attractors
from nonsmooth.attractors.basins_found import NONE, Patience
from nonsmooth.attractors.basins_matching import numbered
from nonsmooth.attractors.basins_measures import share_errors, starts_needed
from nonsmooth.attractors.basins_work import StartsWork
from nonsmooth.attractors.settled import Settled
from nonsmooth.attractors.settler import Settler
from nonsmooth.campaign.run import run, whole_or_part
from nonsmooth.campaign.work import inputs
from nonsmooth.errors import shortened
from nonsmooth.flow.failure import warn_if_small
from nonsmooth.flow.options import Campaign, Varied, as_called, kept_of
from nonsmooth.flow.starts import random_starts, start_states
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least, swept_values

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.flow.engines.engine import FloatArray, IntArray
    from nonsmooth.system.system import System


@checked
def basin_fractions(
    system: System,
    parameter: Varied,
    values: Any,
    *,
    n_starts: Annotated[int, at_least(1)] = 200,
    box: Mapping[str, tuple[float, float]] | None = None,
    seed: Annotated[int, at_least(0)] = 0,
    **options: Unpack[Campaign],
) -> xr.Dataset:
    """Attractors over a parameter, and the share of random starts that each attracts: the multistability diagram.

    Parameters
    ----------
    system : System
    parameter : str
        The one that is varied.
    values : array (P,)
        Attractors are matched from each value to the next in the order of rising values.
    n_starts : int
        Random starts at each value, the same at all of them.
    box : mapping
        Lowest and highest value of each state at the start; states that are not named start at zero.
    seed : int
        Seed of the starts.

    Returns
    -------
    xarray.Dataset
        Over the parameter and ``attractor``: ``name`` (empty: not there), ``fraction`` with its binomial
        ``fraction_error``, ``period_number`` (0:
        no cycle, -1: not there), ``chaotic``, ``lyapunov`` with its error, ``maximum``, ``minimum``, a point on the
        ``section``. A number stays with an attractor along the parameter: one that a run carried over ends on, and is
        carried back from. A share of 0 beside a period number is an attractor that only a run
        carried from the value before has met. Over the parameter: ``not_converged`` and ``diverged`` (shares; of the
        first, ``failed`` are runs that could not be followed, as from a start beyond a stop) and ``n_starts_99``, the
        number of starts that meet every attractor met there by random starts with 99 %.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    Interrupted
        Ctrl-C; its ``result`` has the values at which all runs were made, with the cycles among them (with ``store``
        they are there).
    ImportError, RuntimeError
        ``device="cuda"`` without the package numba-cuda, or without a GPU.
    """
    asked = as_called(locals())
    numbers = swept_values(system, parameter, values)
    starts = start_states(system, _starts(system, box, n_starts, seed))
    settler, chunk = settler_of(system, "basin_fractions", options)
    asked["values"], points = numbers, system.parameter_points({parameter: numbers})
    work = StartsWork(settler, points, starts, chunk, inputs(system, "basin_fractions", asked))
    fill = partial(run, work, **kept_of(options))

    def result(columns: dict[str, Any], whole: bool) -> xr.Dataset | None:
        runs = work.settled(columns)
        if whole:
            warn_if_small(system, starts, runs.maximum, runs.minimum)
        done = (runs.status.reshape(len(numbers), n_starts) != codes.INTERRUPTED).all(axis=1)
        known = {**asked, "values": numbers[done]}
        return _followed(settler, points[done], known, runs[np.repeat(done, n_starts)], whole) if done.any() else None

    found: xr.Dataset = whole_or_part(fill, f"basins over {parameter}", result)
    return found


def _followed(settler: Settler, points: FloatArray, asked: Mapping[str, Any], runs: Settled, whole: bool) -> xr.Dataset:
    """The attractors at each value, matched from one to the next."""
    numbers, n_starts, patience = asked["values"], asked["n_starts"], Patience() if whole else NONE
    rising = [int(i) for i in np.argsort(numbers, kind="stable")]
    per_value: list[dict[int, Attractor]] = [{} for _ in numbers]
    labels = np.full((len(numbers), n_starts), -1, dtype=np.int64)
    seen: dict[int, Attractor] = {}
    last: dict[int, Attractor] = {}
    single = replace(settler, device="cpu")  # a few runs from one value to the next
    status, before = np.zeros_like(labels), points[rising[:1]]
    for i in rising:
        point = points[i : i + 1]
        found, label, status[i] = find_attractors(settler, point, runs[i * n_starts : (i + 1) * n_starts], patience)
        ids = numbered(single, point, found, before, last, seen)
        before = point
        last = dict(zip(ids, found, strict=True))
        seen |= {k: replace(item, tree=None) for k, item in last.items()}
        per_value[i] = dict(zip(ids, shown(settler, found), strict=True))
        labels[i] = np.append(ids, [-2, -1])[label] if len(ids) else label
    return _dataset(settler.system, settler.engine.name, asked, per_value, labels, status, len(seen))


def _starts(system: System, box: Mapping[str, tuple[float, float]] | None, n_starts: int, seed: int) -> Any:
    form = ", ".join(f'"{name}": (low, high)' for name in system.states)
    if not box:
        raise ValueError(f"box = {shortened(box)}: give the box from which starts are drawn, box={{{form}}}")
    low, high = ({name: ends[k] for name, ends in box.items()} for k in (0, 1))
    return random_starts(n_starts, low, high, seed)


def _dataset(
    system: System,
    method: str,
    asked: Mapping[str, Any],
    per_value: list[dict[int, Attractor]],
    labels: IntArray,
    status: IntArray,
    n_attractors: int,
) -> xr.Dataset:
    from nonsmooth.results.global_schema import basin_fractions as build
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    numbers, n_starts, n = asked["values"], labels.shape[1], len(system.states)
    count = (labels[:, None] == np.arange(n_attractors)[:, None]).sum(axis=2)
    fraction, error = share_errors(count, n_starts)
    period = np.full(count.shape, -1, dtype=np.int64)
    exponent, spread = np.full(count.shape, np.nan), np.full(count.shape, np.nan)
    chaotic, kind = np.zeros(count.shape, dtype=np.int8), np.zeros(count.shape, dtype=object)
    kind[:] = ""
    maximum, minimum, section = (np.full((*count.shape, n), np.nan) for _ in range(3))
    for i, found in enumerate(per_value):
        for k, item in found.items():
            period[i, k], chaotic[i, k], kind[i, k] = item.period_number, item.chaotic, item.name
            exponent[i, k], spread[i, k] = item.exponent, item.exponent_error
            maximum[i, k], minimum[i, k], section[i, k] = item.maximum, item.minimum, item.points[0]
    arrays = {
        "fraction": fraction,
        "fraction_error": error,
        "period_number": period,
        "lyapunov": exponent,
        "lyapunov_error": spread,
        "chaotic": chaotic,
        "name": kind.astype(str),
        "maximum": maximum,
        "minimum": minimum,
        "section": section,
        "not_converged": (labels == -1).mean(axis=1),
        "diverged": (labels == -2).mean(axis=1),
        "failed": (failed(status) & (labels == -1)).mean(axis=1),
        "n_starts_99": np.array([starts_needed(row) for row in fraction], dtype=np.int64),
    }
    named = labels_of(system)
    record = provenance(named, "basin_fractions", asked, method=method, seed=asked["seed"])
    return build(named, record, asked["parameter"], numbers, arrays)
