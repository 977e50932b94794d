"""First states of runs: reading them, and drawing them at random."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engine import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["is_one_start", "random_starts", "start_states"]


def random_starts(n: int, low: Any, high: Any, seed: int) -> list[Any]:
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
    >>> random_starts(2, {"x": 0.0}, {"x": 0.01}, seed=1)  # doctest: +ELLIPSIS
    [{'x': 0.005...}, {'x': 0.009...}]
    """
    if n < 1:
        raise ValueError(f"n = {n}: ask for at least one start")
    rng = np.random.default_rng(seed)
    if isinstance(low, Mapping) or isinstance(high, Mapping):
        if not (isinstance(low, Mapping) and isinstance(high, Mapping)) or set(low) != set(high):
            raise ValueError(f"low and high must name the same states, not {low!r} and {high!r}")
        names = list(low)
        table = rng.uniform([low[k] for k in names], [high[k] for k in names], size=(n, len(names)))
        return [dict(zip(names, map(float, row), strict=True)) for row in table]
    a, b = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    if a.ndim != 1 or a.shape != b.shape:
        raise ValueError(f"low and high must be states of equal length, not of shapes {a.shape} and {b.shape}")
    return [list(map(float, row)) for row in rng.uniform(a, b, size=(n, len(a)))]


def is_one_start(start: Any) -> bool:
    """Whether ``start`` is one state (None, a mapping, a flat sequence of numbers) rather than several."""
    if start is None or isinstance(start, Mapping) or hasattr(start, "data_vars"):
        return True
    return isinstance(start, np.ndarray | Sequence) and np.ndim(_first(start)) == 0 and not isinstance(
        _first(start), Mapping
    )


def _first(start: Any) -> Any:
    return start[0] if len(start) else 0.0


def start_states(system: System, start: Any) -> FloatArray:
    """``start`` as an array (S, n): None is all zeros, a result of ``simulate`` its last state.

    Raises
    ------
    ValueError, TypeError
        A state that does not exist, a wrong number of them, a value that is not finite.
    """
    if is_one_start(start):
        return _state(system, start)[None, :]
    if not isinstance(start, np.ndarray | Sequence) or len(start) == 0:
        raise TypeError(f"start must be a state or a list of states, not {start!r}")
    return np.stack([_state(system, one) for one in start])


def _state(system: System, start: Any) -> FloatArray:
    names = list(system.states)
    if start is None:
        return np.zeros(len(names))
    if hasattr(start, "data_vars"):
        if "u" in start and start["u"].dims == ("time", "state"):
            return _finite(np.array(start["u"].values[-1], dtype=float), names)
        raise ValueError("a Dataset given as start must be a result of simulate (with u over time and state)")
    if isinstance(start, Mapping):
        for name in start:
            if name not in names:
                from nonsmooth.system.names import unknown

                raise ValueError(unknown(name, "a state", repr(system.name), dict(system.states)))
        return _finite(np.array([float(start.get(name, 0.0)) for name in names]), names)
    values = np.asarray(start, dtype=float)
    if values.shape != (len(names),):
        raise ValueError(
            f"a start of {system.name!r} has {len(names)} numbers ({', '.join(names)}), not shape {values.shape}; "
            f"or name them: {{{', '.join(f'{name!r}: 0.0' for name in names)}}}"
        )
    return _finite(values, names)


def _finite(values: FloatArray, names: Sequence[str]) -> FloatArray:
    if not np.isfinite(values).all():
        bad = names[int(np.flatnonzero(~np.isfinite(values))[0])]
        raise ValueError(f"the start of state {bad!r} is not finite: {values.tolist()}")
    return values
