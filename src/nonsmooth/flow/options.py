"""Options that verbs share, each declared, documented and checked once: a verb takes them as ``Unpack`` of a group."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypedDict, cast

from nonsmooth.flow.sections import Poincare, Stroboscopic, section_plan
from nonsmooth.flow.starts import plain_start
from nonsmooth.results.progress import Progress
from nonsmooth.system.kinds import Default, above, at_least

LONGEST_RUN = 1e12  # periods, or units of time: what is longer does not end
#: Of a run, in periods or in time.
Length = Annotated[float, above(0, LONGEST_RUN), "it is the length of a run"]
#: The parameter that a verb varies.
Varied = Annotated[str, 'the parameter is given by its name in quotes, as "rho", before its values']


class Solver(TypedDict, total=False):
    """The way a trajectory is computed.

    Parameters
    ----------
    method : {"auto", "exact", "taylor", "rkf45"}
        ``"auto"``: ``"exact"`` where every mode is linear with harmonic forcing, else ``"taylor"``.
    rtol, atol : float; float, mapping of state to float, or array (n,)
        Tolerances per step; rtol 1e-9 and atol = rtol * scale where not given.
    order : int, optional
        That of the Taylor series; from the tolerance where not given.
    locate : bool
        False: judge transitions at the ends of steps only.
    """

    method: Annotated[Literal["auto", "exact", "taylor", "rkf45"], Default("auto")]
    rtol: Annotated[float, at_least(1e-15, 1e-2)] | None
    atol: Any
    order: Annotated[int, at_least(2, 30)] | None
    locate: Annotated[bool, Default(True)]


class Execution(Solver, total=False):
    """Independent work of a verb, and where it is done.

    Parameters
    ----------
    threads : int, optional
        Threads for independent work; the result does not depend on it. Default: one per core.
    device : {"cpu", "cuda"}
        ``"cuda"`` runs the work on an NVIDIA GPU, one start or point per thread, by the exact flow or by
        ``method="taylor"``: see the guide "A chart on a GPU".
    progress : bool, or function
        A bar, on a terminal and in a notebook; nothing elsewhere. A function hears the fraction done, and cancels the
        work by returning False (:func:`nonsmooth.results.progress.progress`).
    """

    threads: Annotated[int, at_least(1)] | None
    device: Annotated[Literal["cpu", "cuda"], Default("cpu")]
    progress: Annotated[Progress, Default(True)]


class Settling(Execution, total=False):
    """Section returns in which a motion settles, and by which it is judged.

    Parameters
    ----------
    section : Stroboscopic or Poincare, optional
        ``Stroboscopic(0)`` where the system has a period.
    transient : int
        Section returns passed over, so that the motion settles. A point that is still settling gets up to eight times
        as many; what is not settled then has the status ``slow``.
    keep : int
        Section returns after them, from which the period number follows.
    max_period : int, optional
        Longest period number searched, less than ``keep``; the smaller of 16 and ``keep`` - 1 where not given.
    """

    section: Stroboscopic | Poincare | None
    transient: Annotated[int, at_least(0), Default(500)]
    keep: Annotated[int, at_least(2), Default(60)]
    max_period: Annotated[int, at_least(1)] | None


class Campaign(Settling, total=False):
    """Work in chunks, which may be kept, go on after an interruption, and be spread over machines.

    Parameters
    ----------
    store : path, optional
        A Zarr store for finished chunks; what is there already is not computed again.
    client : dask.distributed.Client, optional
        Computes the chunks on its workers.
    any_cpu : bool
        Go on with a store that was begun on another type of processor, or of GPU with ``device="cuda"``.
    """

    store: Any
    client: Any
    any_cpu: Annotated[bool, Default(False)]


LONGEST = 16  # period number looked for where none is given and as many points are kept
#: Options that say who computes, not what: results do not depend on them.
_UNRECORDED = ("threads", "progress", "budget", "store", "client", "any_cpu")


def workers_of(options: Execution) -> int | None:
    """Threads for the work that options describe: one where a GPU runs it.

    Raises
    ------
    ValueError
        Threads or a cluster together with a GPU.
    """
    if options["device"] == "cpu":
        return options["threads"]
    if options.get("client") is not None:
        raise ValueError('device="cuda" uses the GPU of this machine: leave client out, or use device="cpu"')
    if options["threads"] is not None:
        raise ValueError('threads are those of device="cpu": leave threads out with device="cuda"')
    return 1


def solver_of(options: Solver) -> Solver:
    """The part that says how a trajectory is computed."""
    return cast(Solver, {name: value for name, value in options.items() if name in Solver.__annotations__})


def longest_period(keep: int, max_period: int | None) -> int:
    """``max_period``; where None, up to 16. ValueError for more than ``keep`` section points can show."""
    if max_period is None:
        return min(LONGEST, keep - 1)
    if max_period >= keep:
        raise ValueError(
            f"max_period = {max_period}: {keep} kept section points show periods up to {keep - 1} only; raise keep "
            "above max_period, or lower max_period"
        )
    return max_period


def kept_of(options: Campaign) -> dict[str, Any]:
    """The part that says where chunks are computed and kept: what :func:`nonsmooth.campaign.run.run` takes."""
    own = ("progress", "store", "client", "any_cpu")
    return {"threads": workers_of(options)} | {name: value for name, value in options.items() if name in own}


def as_called(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a verb for the record of its result, from ``locals()`` where the verb begins: all but its system
    and what the result does not depend on."""
    own = {name: value for name, value in arguments.items() if name not in ("system", "options")}
    record = {**own, **arguments.get("options", {})}
    if record.get("start") is not None:
        record["start"] = plain_start(arguments["system"], record["start"])
    if "section" in record and (record["section"] is not None or arguments["system"].period() is not None):
        record["section"] = section_plan(arguments["system"], record["section"])[0]
    if "keep" in record and "max_period" in record:
        record["max_period"] = longest_period(record["keep"], record["max_period"])
    return {name: value for name, value in record.items() if name not in _UNRECORDED}
