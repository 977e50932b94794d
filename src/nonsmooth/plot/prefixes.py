"""SI prefixes: the one in which values read easily."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

PREFIXES = {0: "", -3: "m", -6: "\N{MICRO SIGN}", -9: "n"}
#: Units that take a prefix; the first one of a compound does: ``m``, ``m/s``, ``m s``, ``N/m``.
FIRST = re.compile(r"(m|s|N|V|A|Pa|W|J|rad)(?=$|[/ ])")
#: Below this a prefix is used. Lengths and speeds are read in millimetres up to a metre.
_WHOLE = {"m": 1.0}
_ALMOST_WHOLE = 0.1
_READ = 0.05  # of the other axis' unit: from there on both have it


def power_for(unit: str, largest: float) -> int:
    """Return the power of ten of the prefix for values up to ``largest`` (in the unit itself): 0, -3, -6 or -9."""
    found = FIRST.match(unit)
    if found is None or not (np.isfinite(largest) and largest > 0):
        return 0
    if largest >= _WHOLE.get(found[1], _ALMOST_WHOLE):
        return 0
    # 0.1 mm to 1 m are millimetres
    return max(-3 * int(np.ceil((-np.log10(largest) - 1) / 3 - 1e-9)) or -3, min(PREFIXES))


def together(axes: Sequence[tuple[str, float]]) -> list[float]:
    """Largest values (unit, largest) by which axes choose their prefixes: metres beside metres per second, where the
    smaller one is still read easily."""
    found = [most for _, most in axes]
    firsts = [match[1] for unit, _ in axes if (match := FIRST.match(unit))]
    powers = [power_for(unit, most) for unit, most in axes]
    if len(firsts) == 2 and firsts[0] == firsts[1]:
        low = powers.index(min(powers))
        if found[low] >= _READ * 10.0 ** max(powers):
            found[low] = found[1 - low]
    return found


def prefixed(value: float, unit: str, digits: int = 6) -> tuple[str, str]:
    """A value as an axis would write it, and its unit with the prefix: ``("−1.2", "mm")`` of -0.0012 and ``"m"``."""
    power = power_for(unit, abs(value))
    return f"{value / 10.0**power:.{digits}g}".replace("-", "\N{MINUS SIGN}"), PREFIXES[power] + unit
