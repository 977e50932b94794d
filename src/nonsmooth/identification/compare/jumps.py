"""Measured jumps beside predicted ones: which belongs to which, and how far apart they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

__all__ = ["Jump", "Jumps", "match_jumps"]


class Jump(NamedTuple):
    """A jump: it lies within ``half`` of ``value``; the amplitude before and after it, in the order of the sweep."""

    value: float
    half: float = 0.0
    before: float = float("nan")
    after: float = float("nan")


Jumps = Mapping[str, Sequence[Jump]]


def match_jumps(measured: Jumps, theory: Jumps, drawn: Sequence[Jumps], unit: str, level: float) -> dict[str, Any]:
    """Pair the jumps of each direction so that the sum of the distances is least, and say what has no partner.

    Parameters
    ----------
    measured, theory : mapping of direction to sequence of Jump
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
    from scipy.optimize import linear_sum_assignment

    rows: list[tuple[str, float, float, float, float, float]] = []
    for word in dict.fromkeys([*measured, *theory]):
        seen, expected = list(measured.get(word, ())), list(theory.get(word, ()))
        cost = np.abs(np.subtract.outer([jump.value for jump in seen], [jump.value for jump in expected]))
        pairs = dict(zip(*linear_sum_assignment(cost), strict=True)) if seen and expected else {}
        for i, jump in enumerate(seen):
            other, step, *_ = expected[pairs[i]] if i in pairs else Jump(np.nan, np.nan)
            rows.append((word, jump.value, other, jump.half + step, *_interval(other, word, drawn, level)))
        for j in sorted(set(range(len(expected))) - {int(k) for k in pairs.values()}):
            other, step, *_ = expected[j]
            rows.append((word, np.nan, other, step, *_interval(other, word, drawn, level)))
    words, values, others, steps, lows, highs = zip(*rows, strict=True) if rows else ((),) * 6
    m, t = np.array(values, dtype=float), np.array(others, dtype=float)
    over = ("jump",)
    variables: dict[str, Any] = {
        "jump_direction": (over, np.array(words, dtype=str), {"long_name": "direction in which the jump is met"}),
        "measured_jump": (over, m, {"long_name": "measured jump (NaN: none was seen)", "units": unit}),
        "theory_jump": (over, t, {"long_name": "predicted jump (NaN: none is predicted)", "units": unit}),
        "jump_difference": (over, t - m, {"long_name": "predicted minus measured jump", "units": unit}),
        "jump_tolerance": (over, np.array(steps, dtype=float), {"long_name": "half steps of both", "units": unit}),
    }  # fmt: skip
    if drawn:
        for word, column in (("low", lows), ("high", highs)):
            variables[f"theory_jump_{word}"] = (over, np.array(column, dtype=float), {
                "long_name": f"{word} end of the interval for drawn parameters", "units": unit})  # fmt: skip
    return variables


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
