"""First states of runs: reading them, and drawing them at random."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.errors import shortened, unknown
from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.results.memory import room_for
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least, float_array, real_number

if TYPE_CHECKING:
    from nonsmooth.system.system import System


@checked
def random_starts(
    n: Annotated[int, at_least(1), "the number of starts"], low: Any, high: Any, seed: Annotated[int, at_least(0)]
) -> list[Any]:
    """``n`` states drawn uniformly from a box, the same for the same seed.

    Parameters
    ----------
    n : int
        How many.
    low, high : mapping of state to float, or sequence of floats
        Corners of the box; with mappings, states not named are zero in every start.
    seed : int
        Seed of ``numpy.random.default_rng``.

    Returns
    -------
    list
        States in the form of the corners: mappings or lists.

    Raises
    ------
    ValueError
        A count below 1, or corners that do not match.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> ns.random_starts(2, {"x": 0.0}, {"x": 0.01}, seed=1)  # doctest: +ELLIPSIS
    [{'x': 0.005...}, {'x': 0.009...}]
    """
    room_for(300.0 * n, f"a list of {n:.6g} starts", "draw fewer")
    rng = np.random.default_rng(seed)
    if isinstance(low, Mapping) or isinstance(high, Mapping):
        if not (isinstance(low, Mapping) and isinstance(high, Mapping)) or set(low) != set(high):
            raise ValueError(f"low and high must name the same states, not {shortened(low)} and {shortened(high)}")
        names = list(low)
        a, b = (np.array([real_number(corner[k], k) for k in names]) for corner in (low, high))
        _check_box(a, b, low, high)
        table = rng.uniform(a, b, size=(n, len(names)))
        return [dict(zip(names, map(float, row), strict=True)) for row in table]
    a, b = float_array(low, "low"), float_array(high, "high")
    if a.ndim != 1 or a.shape != b.shape:
        raise ValueError(f"low and high must be states of equal length, not of shapes {a.shape} and {b.shape}")
    _check_box(a, b, low, high)
    return [list(map(float, row)) for row in rng.uniform(a, b, size=(n, len(a)))]


def _check_box(a: FloatArray, b: FloatArray, low: Any, high: Any) -> None:
    if not (np.isfinite(a).all() and np.isfinite(b).all() and (a <= b).all()):
        raise ValueError(
            f"low must be finite and not above high, got low = {shortened(low)} and high = {shortened(high)}"
        )


def is_one_start(start: Any) -> bool:
    """Return whether ``start`` is one state (None, a mapping, a flat sequence of numbers) rather than several."""
    if not _is_list(start):
        return True  # None, a mapping, a result; or no start at all: start_states says so
    first = start[0] if len(start) else 0.0
    return not (isinstance(first, Mapping) or hasattr(first, "data_vars") or np.ndim(first) > 0)


def _is_list(start: Any) -> bool:
    """Return whether ``start`` has entries: a sequence or an array (NumPy's, xarray's, a row of a table)."""
    if isinstance(start, str) or hasattr(start, "data_vars") or getattr(start, "ndim", 1) == 0:
        return False
    return isinstance(start, Sequence) or hasattr(start, "__array__")


def plain_start(system: System, start: Any) -> Any:
    """``start`` as data that a result can record: arrays and results as lists of numbers."""
    if isinstance(start, Mapping) and not hasattr(start, "data_vars"):
        return start  # as it was named
    own, usual, found = list(system.states)[: system._description.n_own], system.memory_vector(), list[Any]()
    for state in first_states(system, start):
        found.append(state.u[: len(own)].tolist())
        if state.counters[0] or (state.memory != usual).any():
            named = zip((*own, *system.memory), (*found[-1], *state.memory.tolist()), strict=True)
            found[-1] = dict(named) | {"mode": system.modes[int(state.counters[0])]}
    return found[0] if is_one_start(start) else found


def start_states(system: System, start: Any) -> FloatArray:
    """``start`` as an array (S, n): None is all zeros, a result of ``simulate`` its last state.

    Raises
    ------
    ValueError, TypeError
        A state that does not exist, a wrong number of them, a value that is not finite, or a start on a surface from
        which both vector fields lead away.
    """
    alone = is_one_start(start)
    states = _state(system, start)[None, :] if alone else np.stack([_state(system, one) for one in start])
    if system.surfaces:
        from nonsmooth.system.derived.sliding import repelled

        if found := repelled(system, states):
            surface, which = found
            raise ValueError(
                f"the start {dict(zip(system.states, map(float, states[which]), strict=True))} lies on the surface "
                f"{surface!r} where both vector fields lead away from it, so that motion from there is not unique: "
                "move it to one side"
            )
    return states


def first_state(system: System, start: Any, mode: str | None = None) -> State:
    """The one start of a single run.

    Parameters
    ----------
    mode : str, optional
        Mode at the start; that which ``start`` has, else the first, where not given.

    Raises
    ------
    ValueError
        A mode that does not exist, and what :func:`start_states` raises.
    """
    state = first_states(system, start)[0]
    if mode is not None:
        state.counters[0] = _known_mode(system, mode)
    return state


def first_states(system: System, start: Any) -> list[State]:
    """The starts of runs, each with its mode and memory: those with which a result of ``simulate`` ended, or which a
    mapping names beside the states; else the first mode, and the memory's initial values.

    Raises
    ------
    ValueError, TypeError
        A mode that does not exist, and what :func:`start_states` raises.
    """
    states = [State(u.copy(), system.memory_vector()) for u in start_states(system, start)]
    for state, one in zip(states, [start] if is_one_start(start) else start, strict=True):
        known: Mapping[str, Any] = {}
        if hasattr(one, "data_vars"):
            if "mode" not in one:
                raise ValueError(
                    "the result given as start has no `mode`: give it whole, or a state of it, run['u'].isel(time=-1)"
                )
            ended = one["mode"].attrs["flag_meanings"].split()[int(one["mode"].values[-1])]
            state.counters[0] = mode_number(system, ended) or 0
            known = {name: one[name].values[-1] for name in system.memory if name in one}
        elif isinstance(one, Mapping):
            known = one
            if "mode" in one:
                state.counters[0] = _known_mode(system, one["mode"])
        for i, name in enumerate(system.memory):
            if name in known:
                state.memory[i] = _finite(np.array([_number(known[name], name)]), [name])[0]
    return states


def _known_mode(system: System, name: Any) -> int:
    """The number of a mode; ValueError where there is none."""
    if (number := mode_number(system, name)) is None:
        raise ValueError(unknown(str(name), "a mode", repr(system.name), system.written_out().modes))
    return number


def mode_number(system: System, name: Any) -> int | None:
    """The number of a mode by its name, one that no run has visited yet too; None where there is none."""
    patterns, modes = system.traced.patterns, system.modes
    if patterns is not None and isinstance(name, str):
        found: int | None = patterns.named(name)
        return found
    return modes.index(name) if name in modes else None


def _state(system: System, start: Any) -> FloatArray:
    """One start as numbers; those of inputs, which a run sets, are zero."""
    names, n_own = list(system.states), system._description.n_own
    own, rest = names[:n_own], np.zeros(len(names) - n_own)
    if start is None:
        return np.zeros(len(names))
    if hasattr(start, "data_vars"):
        if "u" in start and start["u"].dims == ("time", "state") and list(start["state"].values) == names:
            # NaN where the last mode lacks a state; a run that went wrong has no result.
            return np.nan_to_num(np.array(start["u"].values[-1], dtype=float), nan=0.0)
        raise ValueError(
            f"a Dataset given as start must be a result of simulate with the states {', '.join(names)} of "
            f"{system.name!r}; a state within it is run['u'].isel(time=k)"
        )
    if isinstance(start, Mapping):
        for name in start:
            if name == "mode" or name in system.memory:
                continue
            if name not in names:
                raise ValueError(unknown(name, "a state", repr(system.name), {key: system.states[key] for key in own}))
            if name not in own:
                raise ValueError(f"start: {name!r} is that of an input, which begins as its samples say: leave it out")
        return _finite(np.array([*(_number(start.get(name, 0.0), name) for name in own), *rest]), names)
    if not _is_list(start):
        raise TypeError(
            f"start must be a state ({_form(own)}), a result of simulate (orbit.trajectory() is one), or a list of "
            f"states, not {shortened(start)}"
        )
    values = float_array(start, "the numbers of a start")
    if values.shape != (len(own),):
        raise ValueError(
            f"a start of {system.name!r} has {len(own)} numbers ({', '.join(own)}), not shape {values.shape}; "
            f"or name them: {_form(own)}"
        )
    return _finite(np.concatenate([values, rest]), names)


def _form(names: Sequence[str]) -> str:
    return f"{{{', '.join(f'{name!r}: 0.0' for name in names)}}}"


def _number(value: Any, name: str) -> float:
    """NaN and infinity are told apart later, with the whole state."""
    if isinstance(value, float):
        return value
    return real_number(value, f"the start of state {name!r}")


def _finite(values: FloatArray, names: Sequence[str]) -> FloatArray:
    if not np.isfinite(values).all():
        bad = names[int(np.flatnonzero(~np.isfinite(values))[0])]
        raise ValueError(f"the start of state {bad!r} must be a finite number: {shortened(values.tolist())}")
    return values
