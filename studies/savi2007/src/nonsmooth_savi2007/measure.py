r"""Numbers read off the datasets: regimes, the intervals in which they change, jumps, rates of separation.

Closed forms of the motion without contact, and of its grazing: below the gap the oscillator is linear,
:math:`m \ddot x + c \dot x + 2 k x = \rho \cos \omega t`. Its steady motion has the amplitude
:math:`a = (\rho / m) / \sqrt{(2k/m - \omega^2)^2 + (c \omega / m)^2}` and just touches the support where
:math:`a = g`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate

APERIODIC = 0  # no period found up to the longest looked for
UNSETTLED = -1  # the transient did not decide it


def period_word(number: int) -> str:
    """``period 3``, ``no period``, ``unsettled``."""
    return {APERIODIC: "no period", UNSETTLED: "unsettled"}.get(number, f"period {number}")


def period_words(numbers: Iterable[int]) -> str:
    """``no period and period 3``."""
    return " and ".join(map(period_word, numbers))


def motion_word(number: int) -> str:
    """``period 3``; ``chaos`` for a motion without a period, as the paper says."""
    return "chaos" if number == APERIODIC else f"period {number}"


class Interval(NamedTuple):
    """Something that lies between two neighbouring points of a sweep; of a jump the ``size`` of its step."""

    low: float
    high: float
    size: float = 0.0

    @property
    def value(self) -> float:
        """The middle, the best single number."""
        return 0.5 * (self.low + self.high)

    @property
    def expanded(self) -> float:
        """Half the width: it lies there for certain."""
        return 0.5 * (self.high - self.low)

    @property
    def uncertainty(self) -> float:
        """The standard uncertainty: of something that lies anywhere in it with the same probability."""
        return self.expanded / np.sqrt(3)

    def __str__(self) -> str:
        return with_uncertainty(self.value, self.uncertainty)


def with_uncertainty(value: float, uncertainty: float) -> str:
    """``a ± u`` with u the standard uncertainty (GUM), two digits of it; an exact number without."""
    return f"{Estimate(value, uncertainty)}" if uncertainty > 0 else f"{value:.6g}"


def parameter_of(swept: xr.Dataset) -> str:
    """The parameter along which a result was swept."""
    return str(swept["maximum"].dims[0])


def regimes(swept: xr.Dataset, direction: str | None = None) -> tuple[FloatArray, NDArray[np.int64]]:
    """Parameter values, rising, and the regime at each: the period number, APERIODIC or UNSETTLED."""
    one = swept if direction is None or "direction" not in swept.dims else swept.sel(direction=direction)
    one = one.sortby(parameter_of(one))
    return one[parameter_of(one)].values, _regime(one)


def status_names(result: xr.Dataset) -> NDArray[np.str_]:
    """The name of the status at each point, by the result's own attributes."""
    attrs = result["status"].attrs
    names = dict(zip(np.atleast_1d(attrs["flag_values"]).tolist(), attrs["flag_meanings"].split(), strict=True))
    return np.array([names[code] for code in result["status"].values.ravel().tolist()]).reshape(result["status"].shape)


def _regime(result: xr.Dataset) -> NDArray[np.int64]:
    """The period number at each point, UNSETTLED where the transient did not decide it."""
    settled = np.isin(status_names(result), ("ok", "not_periodic", "not_guaranteed"))
    return np.where(settled, result["period_number"].values.astype(np.int64), UNSETTLED)


def changes(swept: xr.Dataset, first: int, second: int, direction: str | None = None) -> list[Interval]:
    """Borders between the regimes ``first`` and ``second`` (in either order), with only unsettled points between."""
    values, regime = regimes(swept, direction)
    at = np.flatnonzero(regime != UNSETTLED)
    return [
        Interval(values[i], values[j])
        for i, j in pairwise(at)
        if {regime[i], regime[j]} == {first, second} and first != second
    ]


def range_of(swept: xr.Dataset, regime_wanted: int, direction: str | None = None) -> tuple[float, float] | None:
    """Smallest and largest parameter value with a regime; None where it does not occur."""
    values, regime = regimes(swept, direction)
    at = np.flatnonzero(regime == regime_wanted)
    return (values[at[0]], values[at[-1]]) if len(at) else None


def jumps(response: xr.Dataset, direction: str) -> list[Interval]:
    """The steps in which an amplitude, computed or measured, jumps in one direction, at rising values."""
    here = response["jump_direction"].values.astype(str) == direction
    if "jump_variable" in response:
        here &= response["jump_variable"].values.astype(str) == "x"
    columns = (response[f"jump_{name}"].values[here].tolist() for name in ("value", "step", "before", "after"))
    return sorted(
        Interval(value - 0.5 * step, value + 0.5 * step, abs(after - before))
        for value, step, before, after in zip(*columns, strict=True)
    )


def main_jump(response: xr.Dataset, direction: str) -> Interval | None:
    """The jump above resonance: that with the largest step in amplitude."""
    return max(jumps(response, direction), key=lambda one: one.size, default=None)


def small_jump(response: xr.Dataset, direction: str) -> Interval | None:
    """The smallest of several jumps."""
    found = jumps(response, direction)
    return min(found, key=lambda one: one.size) if len(found) > 1 else None


def measured_periods(runs: xr.Dataset, direction: str | None = None) -> tuple[FloatArray, NDArray[np.int64]]:
    """Frequencies, rising, and the period number measured at each; of one direction or of all runs."""
    mine = runs if direction is None else runs.isel(run=runs["direction"].values.astype(str) == direction)
    mine = mine.sortby("omega")
    return mine["omega"].values, mine["period_number"].values.astype(np.int64)


def periods_reached(survey: xr.Dataset, value: float) -> dict[int, int]:
    """Number of starts of a ``survey`` (a sweep from several starts) that end in each regime at one parameter value."""
    regime = _regime(survey.sel({parameter_of(survey): value}, method="nearest"))
    return {r: (regime == r).sum() for r in np.unique(regime)}


def separation_rate(found: xr.Dataset) -> tuple[float, float]:
    """Growth of ln(distance) of neighbours per period, with its standard error: the largest Lyapunov exponent."""
    largest, period = found.isel(exponent=0), 2 * np.pi / float(found["omega"])
    return float(largest["exponents"]) * period, float(largest["standard_error"]) * period


def grazing_frequencies(parameters: Mapping[str, float]) -> list[float]:
    r"""Frequencies at which the steady motion without contact just touches the support.

    The real positive roots of

    .. math:: (2k/m - \omega^2)^2 + (c \omega / m)^2 = (\rho / (m g))^2,

    a quadratic in :math:`\omega^2`.

    Parameters
    ----------
    parameters : mapping
        ``m``, ``k``, ``c``, ``rho`` and ``g``, such as the ``values`` of the system (g > 0).

    Returns
    -------
    list of float
        None, one or two frequencies in rad/s, rising.

    Raises
    ------
    ValueError
        A gap that is not positive: that support is pressed at rest, and no motion grazes it from below.
    """
    m, k, c, rho, g = (parameters[name] for name in ("m", "k", "c", "rho", "g"))
    if not g > 0:
        raise ValueError(f"grazing from below needs a gap g > 0, not {g}")
    # w2^2 - 2 b w2 + (2k/m)^2 - (rho/(m g))^2 = 0 with w2 = omega^2
    b = 2 * k / m - 0.5 * (c / m) ** 2
    rest = b * b - (2 * k / m) ** 2 + (rho / (m * g)) ** 2
    if rest < 0:
        return []
    return sorted(float(np.sqrt(square)) for square in {b - np.sqrt(rest), b + np.sqrt(rest)} if square > 0)


def free_amplitude(parameters: Mapping[str, float]) -> float:
    """Amplitude (m) of the steady motion without contact."""
    return abs(_response(parameters))


def steady_state(parameters: Mapping[str, float]) -> dict[str, float]:
    """State of the steady motion without contact at phase 0 of the forcing."""
    response = _response(parameters)
    return {"x": response.real, "v": (1j * parameters["omega"] * response).real}


def _response(parameters: Mapping[str, float]) -> complex:
    p = parameters
    return complex(p["rho"] / (2 * p["k"] - p["m"] * p["omega"] ** 2 + 1j * p["c"] * p["omega"]))
