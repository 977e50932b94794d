"""Jumps in measured steps, found without a glance at the prediction; and which predicted jump belongs to which."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.results.labels import labelled

STEEPER = 2.5  # a jump exceeds the steps on both sides by this factor
LEAST = 0.02  # and this part of the amplitude
CERTAIN = 6.0  # and its standard error by this factor


class AmplitudeJump(NamedTuple):
    """A jump: it lies within ``half`` of ``value``; the amplitude before and after it, in the order of the sweep."""

    value: float
    half: float = 0.0
    before: float = float("nan")
    after: float = float("nan")


Jumps = Mapping[str, Sequence[AmplitudeJump]]


def jumps_in_steps(x: FloatArray, heights: FloatArray, error: FloatArray) -> list[AmplitudeJump]:
    """The jumps in an amplitude measured step by step, in the order in which the steps were taken.

    On the way to a fold the steps grow, so a jump need not be many times its neighbours. It is one where the step is
    larger than both by 2.5 times, and where the steps before and the steps after, each carried on evenly, both leave
    more than half of it over.

    Parameters
    ----------
    x, heights, error : array (n,)
        Value of the parameter, amplitude and its standard error (0 where it is not known).
    """
    step = np.diff(heights)
    found = []
    for i in range(len(step)):
        beside = [abs(step[j]) for j in (i - 1, i + 1) if 0 <= j < len(step)]
        if not beside or abs(step[i]) <= STEEPER * max(beside):
            continue
        carried = []
        if i >= 1:
            carried.append(2 * step[i - 1] - step[i - 2] if i >= 2 else step[i - 1])
        if i + 1 < len(step):
            carried.append(2 * step[i + 1] - step[i + 2] if i + 2 < len(step) else step[i + 1])
        least = max(LEAST * max(abs(heights[i : i + 2])), CERTAIN * np.hypot(*error[i : i + 2]))
        if abs(step[i]) <= least or any(abs(step[i] - one) < 0.5 * abs(step[i]) for one in carried):
            continue
        middle, half = 0.5 * float(x[i] + x[i + 1]), 0.5 * float(abs(x[i + 1] - x[i]))
        found.append(AmplitudeJump(middle, half, float(heights[i]), float(heights[i + 1])))
    return found


def jumps_of_runs(value: FloatArray, amplitude: FloatArray, error: FloatArray, direction: NDArray[Any]) -> Jumps:
    """The jumps in each direction in which runs were reached, in the order of the steps."""
    found = {}
    for word in ("up", "down"):
        mine = np.flatnonzero(direction == word)
        order = mine[np.argsort(value[mine])][:: -1 if word == "down" else 1]
        if len(order):
            found[word] = jumps_in_steps(*(np.nan_to_num(column[order]) for column in (value, amplitude, error)))
    return found


def match_jumps(measured: Jumps, theory: Jumps, drawn: Sequence[Jumps], unit: str, level: float) -> dict[str, Any]:
    """Pair the jumps of each direction in the order in which they are met, rises with rises and falls with falls.

    Where one side has more of a kind, those stay without a partner that leave the sum of the distances least, the
    order being kept.

    Parameters
    ----------
    measured, theory : mapping of direction to sequence of AmplitudeJump
        In the order of the sweep.
    drawn : sequence of such mappings
        The predicted jumps for drawn parameters.
    unit : str
    level : float
        Of the interval in which the drawn jumps lie.

    Returns
    -------
    dict
        Variables over ``jump``: ``jump_direction``, ``measured_jump``, ``theory_jump`` (NaN: no partner),
        ``jump_difference`` (theory minus measurement), ``jump_tolerance`` (both half steps together: the difference is
        not known better), and with draws ``theory_jump_low``, ``theory_jump_high``.
    """
    rows: list[tuple[str, AmplitudeJump, AmplitudeJump]] = []
    nothing = AmplitudeJump(np.nan)
    for word in dict.fromkeys([*measured, *theory]):
        seen, expected = list(measured.get(word, ())), list(theory.get(word, ()))
        pairs = _pairs(seen, expected)
        rows += [(word, jump, expected[pairs[i]] if i in pairs else nothing) for i, jump in enumerate(seen)]
        rows += [(word, nothing, jump) for j, jump in enumerate(expected) if j not in pairs.values()]
    (m, half), (t, step) = (np.array([row[k][:2] for row in rows], dtype=float).reshape(-1, 2).T for k in (1, 2))
    over = "jump"
    variables: dict[str, Any] = {
        "jump_direction": labelled(
            over, np.array([row[0] for row in rows], dtype=str), "direction in which the jump is met"
        ),
        "measured_jump": labelled(over, m, "measured jump (NaN: none was seen)", unit),
        "theory_jump": labelled(over, t, "predicted jump (NaN: none is predicted)", unit),
        "jump_difference": labelled(over, t - m, "predicted minus measured jump", unit),
        "jump_tolerance": labelled(over, half + step, "half steps of both", unit),
    }
    if drawn:
        ends = [_interval(jump.value, word, drawn, level) for word, _, jump in rows]
        for end, column in zip(("low", "high"), np.array(ends, dtype=float).reshape(-1, 2).T, strict=True):
            said = f"{end} end of the interval for drawn parameters"
            variables[f"theory_jump_{end}"] = labelled(over, column, said, unit)
    return variables


def _pairs(seen: list[AmplitudeJump], expected: list[AmplitudeJump]) -> dict[int, int]:
    """Pairs of predicted and measured jumps."""
    # Jumps as an experimenter read them off do not say whether the amplitude rose.
    alike = any(np.isnan(jump.after) for jump in seen)
    kinds = ([alike or jump.after > jump.before for jump in jumps] for jumps in (seen, expected))
    return nearest_alike(*([jump.value for jump in jumps] for jumps in (seen, expected)), *kinds)


def nearest_alike(ours: Any, theirs: Any, our_kinds: Sequence[Any], their_kinds: Sequence[Any]) -> dict[int, int]:
    """Pairs of values of one kind, by their places, so that the sum of their distances is least; the order is kept."""
    from scipy.optimize import linear_sum_assignment

    pairs: dict[int, int] = {}
    for kind in dict.fromkeys(our_kinds):
        mine, other = (
            sorted((i for i, one in enumerate(kinds) if one == kind), key=values.__getitem__)
            for values, kinds in ((ours, our_kinds), (theirs, their_kinds))
        )
        away = np.abs(np.subtract.outer([ours[i] for i in mine], [theirs[j] for j in other]))
        # Of numbers along a line those in order leave the least sum too.
        rows, columns = map(sorted, linear_sum_assignment(away))
        pairs |= {mine[i]: other[j] for i, j in zip(rows, columns, strict=True)}
    return pairs


def _interval(value: float, word: str, drawn: Sequence[Jumps], level: float) -> tuple[float, float]:
    """Quantiles of the drawn jump nearest to this one; NaN where fewer than half of the draws have one."""
    if not drawn or not np.isfinite(value):
        return np.nan, np.nan
    near = [
        min((jump.value for jump in one.get(word, ())), key=lambda v: abs(v - value), default=np.nan) for one in drawn
    ]
    held = np.array(near)[np.isfinite(near)]
    if 2 * len(held) < len(drawn):
        return np.nan, np.nan
    low, high = np.quantile(held, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)
