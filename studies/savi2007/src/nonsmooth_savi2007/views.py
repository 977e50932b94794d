"""Views that the explorer offers of the paper's oscillator: parameters of the figures, and fields of its state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nonsmooth_savi2007 import printed

_GAP = {**printed.FIGURE_13, "over": "g", "low": -0.0015, "high": 0.002, "shown": "v"}
_AMPLITUDE = {**printed.FIGURE_11, "over": "rho", "low": 0.2, "high": 0.5, "shown": "v"}
_FREQUENCY = {**printed.FIGURE_17, "over": "omega", "low": 8.4, "high": 10.4, "shown": "v"}
_FIGURES: Mapping[str, Mapping[str, Any]] = {
    "Fig. 9": {
        **printed.FIGURE_9,
        "omega": 4.8,
        "over": "omega",
        "low": 3.0,
        "high": 7.0,
        "shown": "x",
    },
    "Fig. 10": {
        **printed.FIGURE_10,
        "omega": 4.5,
        "over": "omega",
        "low": 2.4,
        "high": 7.4,
        "shown": "x",
    },
    "Fig. 11": {**_AMPLITUDE, "rho": 0.45},
    **{f"Fig. 12 {'abcd'[i]}": {**_AMPLITUDE, "rho": rho} for i, rho in enumerate(printed.FIGURE_12)},
    "Fig. 13": {**_GAP, "g": 0.0009},
    **{f"Fig. 14 {'abcd'[i]}": {**_GAP, "g": g} for i, g in enumerate(printed.FIGURE_14)},
    "Fig. 15": {**_GAP, "g": 0.0018},
    "Fig. 17": {**_FREQUENCY, "omega": 9.55},
    **{f"Fig. 18 {'abc'[i]}": {**_FREQUENCY, "omega": omega} for i, omega in enumerate(printed.FIGURE_18)},
}

#: By model.
VIEWS = {"discontinuous_support": _FIGURES}
