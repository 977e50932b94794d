"""``basins``: which start leads to which attractor; the attractors are found, not given."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Unpack

import numpy as np

from nonsmooth.attractors.basins_attractors import Attractor, find_attractors
from nonsmooth.attractors.basins_found import NONE, Patience
from nonsmooth.attractors.basins_measures import (
    basin_entropy,
    boundary_dimension,
    minimal_shock,
    share_errors,
    starts_needed,
    uncertain_part,
)
from nonsmooth.attractors.basins_work import StartsWork
from nonsmooth.attractors.settled import usable
from nonsmooth.attractors.settler import Settler, settler_for
from nonsmooth.campaign.run import run, whole_or_part
from nonsmooth.campaign.work import CHUNK, STORED, inputs
from nonsmooth.errors import shortened
from nonsmooth.flow.engines.devices import BATCH
from nonsmooth.flow.failure import warn_if_small
from nonsmooth.flow.options import Campaign, as_called, kept_of
from nonsmooth.flow.sections import Poincare
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.memory import room_for
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import float_array

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.flow.engines.engine import FloatArray, IntArray
    from nonsmooth.system.system import System


@checked
def basins(
    system: System,
    grid: Mapping[str, Any],
    *,
    fixed: Annotated[Mapping[str, float], "of the states not in the grid: fixed={name: value}"] | None = None,
    **options: Unpack[Campaign],
) -> xr.Dataset:
    """Attractors and their basins on a plane of starts.

    Parameters
    ----------
    system : System
    grid : mapping
        Two states and the values from which runs start: ``{"x": (A,), "v": (B,)}``.
    fixed : mapping, optional
        Values of the other states at the start; zero where not given.
    section : Stroboscopic or Poincare, optional
        ``Stroboscopic(0)`` where the system has a period. With another phase the runs start at that phase,
        in the mode to which transitions at earlier phases (``at=``) have led.
    transient, keep : int
        Section returns passed over, then judged; a run ends earlier where its cycle is certain, and is followed for
        20 000 returns and more where it has no period.
    device : {"cpu", "cuda"}
        ``"cuda"`` runs the starts on an NVIDIA GPU, one per thread, by the exact flow or by
        ``method="taylor"``: see the guide "A chart on a GPU". What a few single runs decide stays on the processor.

    Returns
    -------
    xarray.Dataset
        ``label`` over the two states: the attractor's number, in the order of falling share; -1 not converged, -2
        diverged; ``status`` says why a start has no label (one beyond a stop, say). Over ``attractor``:
        ``name`` (``period 3``, ``chaos``, ``equilibria in f_stick``; of a set of equilibria the extremes are its
        extent), ``period_number`` (0: no cycle; 1 of an equilibrium), ``confirmed`` (1 where Newton's method has found
        the cycle), ``fraction`` of the starts with its binomial ``fraction_error``, ``lyapunov`` with its error,
        ``chaotic`` (1 where that is above zero beyond doubt), ``multiplier``, ``maximum``, ``minimum``, a point
        on the ``section``, and ``minimal_shock``: the least jump of the state, in units of the states' scales, that
        leads from the section to a start of this plane in another basin or one that diverges.
        ``section_points`` holds the attractors' points one after the other, with ``point_attractor``.
        Of the picture: ``entropy``, ``boundary_entropy``, ``boundary_dimension``, ``uncertain`` over ``distance``,
        and ``n_starts_99``, the number of random starts that meet every one of these attractors with 99 %.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit. A run that fails keeps the label -1 or -2.
    Interrupted
        Ctrl-C; its ``result`` has the runs that came to their end until then and the cycles among them, and no shares
        or measures of the picture (with ``store`` the runs are there).
    ImportError, RuntimeError
        ``device="cuda"`` without the package numba-cuda, or without a GPU.

    Notes
    -----
    A cycle counts with a certificate only (``kernels.judging.judge``), and Newton's method on the section's map then
    gives its points and multipliers to rounding. Motion without a period counts only where a run of 20 000 returns
    neither settles nor leaves the places it has visited, and where runs that begin beside it come back
    (:mod:`nonsmooth.attractors.basins_candidate`); so motion without damping, and a slow transient, keep the label -1.
    A start exactly on a boundary, as at a saddle, is pushed off it to one side. Cycles whose multipliers are nearer
    than 0.002 to the unit circle are not certified; their starts keep -1 with the status ``slow``. What friction holds,
    at rest or on a moving belt, so that it repeats beside it too, is no multiplier. A run that has stopped, or creeps
    towards the end of a set of equilibria and is nearer than 1e-5 of the scales, belongs to it
    (:mod:`nonsmooth.attractors.standing`).

    ``lyapunov`` of a cycle is minus infinity where its multipliers are zero, NaN where they are not zero but lost in
    rounding (below 1e-8). Where a Poincare section is used, ``lyapunov`` and ``multiplier`` are those of its map: the
    exponent 0 along the flow is not among them.
    """
    asked = as_called(locals())
    values = _plane(system, grid)
    rest = _fixed(system, values, fixed)
    settler, chunk = settler_of(system, "basins", options)
    names = list(system.states)
    (x_name, x), (y_name, y) = values.items()
    room_for(16.0 * len(names) * len(x) * len(y), f"a plane of {len(x)} x {len(y)} starts", "take fewer")
    starts = np.tile(rest, (len(x) * len(y), 1))
    starts[:, names.index(x_name)] = np.repeat(x, len(y))
    starts[:, names.index(y_name)] = np.tile(y, len(x))
    asked["grid"], point = values, system.parameter_vector()[None, :]
    work = StartsWork(settler, point, starts, chunk, inputs(system, "basins", asked))
    fill = partial(run, work, **kept_of(options))

    def result(columns: dict[str, Any], whole: bool) -> xr.Dataset:
        runs = work.settled(columns)
        if whole:
            warn_if_small(system, starts, runs.maximum, runs.minimum)
        attractors = find_attractors(settler, point, runs, Patience() if whole else NONE)
        return _dataset(settler, asked, values, rest, *attractors)

    found: xr.Dataset = whole_or_part(fill, f"basins over {x_name} and {y_name}", result)
    return found


def _dataset(
    settler: Settler,
    asked: Mapping[str, Any],
    values: Mapping[str, FloatArray],
    rest: FloatArray,
    attractors: list[Attractor],
    labels: IntArray,
    status: IntArray,
) -> xr.Dataset:
    """The plane with its attractors in the order of falling share, and measures of the picture."""
    from nonsmooth.results.global_schema import basins as build
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    system = settler.system
    names, (x, y) = list(system.states), values.values()
    found, labels = by_share(attractors, labels)
    label = labels.reshape(len(x), len(y))
    told = 1.0 if (status != codes.INTERRUPTED).all() else np.nan  # a picture with holes has no shares and no measures
    fraction, error = share_errors([told * np.sum(labels == k) for k in range(len(found))], labels.size)
    scale, at = system.scale_vector(), [names.index(name) for name in values]
    others = [k for k in range(len(names)) if k not in at]
    shocks = [
        minimal_shock(
            label,
            x / scale[at[0]],
            y / scale[at[1]],
            item.points[:, at] / scale[at],
            k,
            np.linalg.norm((item.points - rest)[:, others] / scale[others], axis=1),
        )
        for k, item in enumerate(found)
    ]
    entropy, boundary = basin_entropy(label)
    steps, parts = uncertain_part(label)
    named = labels_of(system)
    return build(
        named,
        provenance(named, "basins", asked, method=settler.engine.name),
        values,
        label,
        shown(settler, found),
        status=status.reshape(label.shape),
        fixed={name: rest[names.index(name)] for name in names if name not in values},
        per_attractor={"fraction": fraction, "fraction_error": error, "minimal_shock": told * np.array(shocks)},
        measures={
            "entropy": told * entropy,
            "boundary_entropy": told * boundary,
            "boundary_dimension": told * boundary_dimension(label),
            "n_starts_99": starts_needed(fraction),
        },
        uncertain=(steps, told * parts),
    )


def settler_of(system: System, verb: str, options: Campaign) -> tuple[Settler, int]:
    """The attractor mapper that the options of basins describe, and the runs of one of its chunks."""
    section = options["section"]
    if isinstance(section, Poincare) and system.period() is not None:
        raise ValueError(
            f"{system.name!r} is forced: its fate depends on the phase at which a run starts, so its section must be "
            "one too: section=ns.Stroboscopic(phase)"
        )
    if isinstance(section, Poincare) and section.every > 1:
        raise ValueError(
            f"section with every = {section.every}: the returns that are passed over make several attractors of one "
            "cycle, by the one at which a run begins; leave `every` out"
        )
    settler, stored = settler_for(system, verb, options), options["store"] is not None or options["client"] is not None
    return settler, BATCH if settler.device == "cuda" else STORED if stored else CHUNK


def shown(settler: Settler, found: Iterable[Attractor]) -> list[Attractor]:
    """Attractors for a result: a state that the mode of a section point lacks is NaN there."""
    copies = [replace(item, points=item.points.copy()) for item in found]
    for item in copies:
        settler.engine.hide(item.points, item.modes)
    return copies


def failed(status: Any) -> Any:
    """Marks of runs that could not be followed to an end, other than by diverging."""
    return ~usable(status) & (np.asarray(status) != codes.DIVERGED)


def by_share(found: list[Attractor], labels: IntArray) -> tuple[list[Attractor], IntArray]:
    """The same with the most common attractor first; those that no run ended on are left out."""
    count = np.array([np.sum(labels == k) for k in range(len(found))], dtype=np.int64)
    order = [int(k) for k in np.argsort(-count, kind="stable") if count[k]]
    new = np.full(len(found) + 2, -1, dtype=np.int64)
    new[order] = np.arange(len(order))
    new[-1], new[-2] = -1, -2
    return [found[k] for k in order], new[labels]


def _plane(system: System, grid: Any) -> dict[str, FloatArray]:
    from nonsmooth.errors import unknown

    names = dict(system.states)
    if not isinstance(grid, Mapping) or len(grid) != 2:
        given = list(grid) if isinstance(grid, Mapping) else grid
        raise ValueError(f"grid must name two of the states {list(names)} with their values; given: {shortened(given)}")
    values = {}
    for name, numbers in grid.items():
        if name not in names:
            raise ValueError(unknown(name, "a state", repr(system.name), names))
        axis = float_array(numbers, f"values of {name!r}")
        if axis.ndim != 1 or not len(axis) or not np.isfinite(axis).all() or (np.diff(axis) <= 0).any():
            raise ValueError(f"values of {name!r} must be a rising list of finite numbers")
        values[str(name)] = axis
    return values


def _fixed(system: System, values: Mapping[str, Any], fixed: Any) -> FloatArray:
    from nonsmooth.errors import unknown

    names = list(system.states)
    rest = np.zeros(len(names))
    for name, value in (fixed or {}).items():
        if name not in names:
            raise ValueError(unknown(name, "a state", repr(system.name), dict(system.states)))
        if name in values:
            raise ValueError(f"state {name!r} is in the grid and in fixed; give it once")
        rest[names.index(name)] = value
    return rest
