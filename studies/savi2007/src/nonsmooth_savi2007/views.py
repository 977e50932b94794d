"""Views that the explorer offers of the paper's oscillator: parameters of the figures, and fields of its state."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from nonsmooth_savi2007 import printed


def _over(parameters: Mapping[str, float], low: float, high: float, shown: str, **at: float) -> Mapping[str, Any]:
    """Parameters of a figure, ``at`` a value of what it varies between two ends, and the state that it shows."""
    (name,) = at
    return {**parameters, **at, "over": name, "low": low, "high": high, "shown": shown}


_GAP = partial(_over, printed.FIGURE_13, -0.0015, 0.002, "v")
_AMPLITUDE = partial(_over, printed.FIGURE_11, 0.2, 0.5, "v")
_FREQUENCY = partial(_over, printed.FIGURE_17, 8.4, 10.4, "v")
_FIGURES = {
    "Fig. 9": _over(printed.FIGURE_9, 3.0, 7.0, "x", omega=4.8),
    "Fig. 10": _over(printed.FIGURE_10, 3.0, 7.0, "x", omega=4.5),
    "Fig. 11": _AMPLITUDE(rho=0.45),
    **{f"Fig. 12 {'abcd'[i]}": _AMPLITUDE(rho=rho) for i, rho in enumerate(printed.FIGURE_12)},
    "Fig. 13": _GAP(g=0.0009),
    **{f"Fig. 14 {'abcd'[i]}": _GAP(g=g) for i, g in enumerate(printed.FIGURE_14)},
    "Fig. 15": _GAP(g=0.0018),
    "Fig. 17": _FREQUENCY(omega=9.55),
    **{f"Fig. 18 {'abc'[i]}": _FREQUENCY(omega=omega) for i, omega in enumerate(printed.FIGURE_18)},
}
#: By model.
VIEWS = {"discontinuous_support": _FIGURES}
