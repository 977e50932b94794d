"""Unknowns of a fit: parameters of the system, of its sensors, and the phase of each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import shortened
from nonsmooth.flow.arguments import real_number
from nonsmooth.identification.fit.sensors import OF_A_SENSOR, Sensor
from nonsmooth.system.names import unknown

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Unknowns", "read_unknowns"]


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Names, first guesses, bounds and what is known before.

    The parameters of the system come first, then those of sensors, then one phase for each run (where it is unknown).

    Attributes
    ----------
    names : tuple of str
    active : tuple of str
        The parameters of the system among them.
    sensors : tuple of (str, str)
        Quantity and which of gain, offset and delay, for each unknown of a sensor.
    phases : int
        How many phases are unknown: none, or one for each run.
    units : tuple of str
    guess, low, high : array (p,)
    precision : array (p, p)
        Inverse covariance of what is known before, about ``centre``.
    """

    names: tuple[str, ...]
    active: tuple[str, ...]
    sensors: tuple[tuple[str, str], ...]
    phases: int
    units: tuple[str, ...]
    guess: FloatArray
    low: FloatArray
    high: FloatArray
    centre: FloatArray
    precision: FloatArray

    def of_run(self, run: int) -> NDArray[np.intp]:
        """Places of the unknowns that act on a run."""
        shared = len(self.active) + len(self.sensors)
        return np.array([*range(shared), *([shared + run] if self.phases else [])], dtype=np.intp)


def read_unknowns(
    system: System, sensors: Mapping[str, Sensor], parameters: Any, priors: Any, runs: Sequence[str],
    settings: Sequence[Mapping[str, float]],
) -> Unknowns:  # fmt: skip
    """Read the unknowns of a fit from names, bounds and priors.

    Raises
    ------
    ValueError, TypeError
        A name that is no parameter, of no sensor, or twice there; bounds that the first guess is not within.
    """
    given = [parameters] if isinstance(parameters, str) else list(parameters)
    bounds = dict(parameters) if isinstance(parameters, Mapping) else {}
    if not given:
        raise ValueError(f"parameters names nothing to be found; allowed: {', '.join(_allowed(system, sensors))}")
    if twice := [name for name in given if given.count(name) > 1]:
        raise ValueError(f"parameters names {twice[0]!r} twice; name each once")
    units = {key: parameter.unit for key, parameter in system.parameters.items()}
    allowed = _allowed(system, sensors)
    for name in given:
        if name not in allowed:
            raise ValueError(unknown(name, "an unknown of this fit", repr(system.name), allowed))
        if any(name in own for own in settings):
            raise ValueError(f"{name!r} stands in parameters, to be found, and in settings, as known: leave one out")
    if "phase" in given and system.period() is None:
        raise ValueError(f"the phase of {system.name!r} cannot be found: it has no forcing period; leave 'phase' out")
    active = tuple(name for name in given if name in system.values)
    of_sensors = tuple((q, what) for name in given if "." in name for q, what in [name.split(".", 1)])
    phases = len(runs) if "phase" in given else 0
    labels = [f"phase, {run}" for run in runs] if phases > 1 else ["phase"] * phases
    names = (*active, *(f"{q}.{what}" for q, what in of_sensors), *labels)
    quantity = {**system.states, **system.outputs}
    found_units = [units[name] for name in active] + [
        "" if what == "delay" else "" if what == "gain" and not quantity[q] else
        f"1/({quantity[q]})" if what == "gain" and sensors[q].gain != 1 else "" if what == "gain" else quantity[q]
        for q, what in of_sensors
    ]  # fmt: skip
    guess = [system.values[name] for name in active] + [getattr(sensors[q], what) for q, what in of_sensors]
    low, high = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    whole = np.array(guess + [0.0] * phases)
    for i, name in enumerate(names):
        pair = bounds.get(name.split(",")[0])
        if pair is not None:
            low[i], high[i] = _bounds(name, pair, whole[i])
    centre, precision = _known(names, priors, whole)
    return Unknowns(
        names, active, of_sensors, phases, (*found_units, *["periods"] * phases), whole, low, high, centre, precision
    )


def _allowed(system: System, sensors: Mapping[str, Sensor]) -> dict[str, str]:
    units = {key: parameter.unit for key, parameter in system.parameters.items()}
    return {**units, **{f"{q}.{what}": "" for q in sensors for what in OF_A_SENSOR}, "phase": "periods"}


def _bounds(name: str, pair: Any, guess: float) -> tuple[float, float]:
    if not isinstance(pair, list | tuple) or len(pair) != 2:
        raise TypeError(f"bounds of {name!r}: allowed are None and (low, high), not {shortened(pair)}")
    low, high = (float(end) if end is not None else sign * np.inf for end, sign in zip(pair, (-1, 1), strict=True))
    if not low < high:
        raise ValueError(f"bounds of {name!r}: {low:g} must be below {high:g}")
    if not low <= guess <= high:
        raise ValueError(
            f"the first guess {name} = {guess:g} lies outside its bounds {low:g} ... {high:g}; set another with "
            f"system.with_parameters({name}=...)"
        )
    return low, high


def _known(names: tuple[str, ...], priors: Any, guess: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre and precision of what is known before: ``{name: (value, standard uncertainty)}``, or a ParameterSet."""
    p = len(names)
    centre, precision = guess.copy(), np.zeros((p, p))
    if priors is None:
        return centre, precision
    if hasattr(priors, "full_covariance"):
        covariance = priors.full_covariance
        held = [name for name in names if name in covariance["parameter"].values]
        places = [names.index(name) for name in held]
        part = covariance.sel(parameter=held, other=held).values
        centre[places] = [priors.estimate(name).value for name in held]
        precision[np.ix_(places, places)] = np.linalg.inv(part)
        return centre, precision
    if not isinstance(priors, Mapping):
        raise TypeError(
            f"priors = {shortened(priors)}: allowed are {{name: (value, standard uncertainty)}} and a ParameterSet"
        )
    for name, pair in priors.items():
        if name not in names:
            raise ValueError(f"priors: {unknown(name, 'an unknown', 'this fit', list(names))}")
        if not isinstance(pair, list | tuple) or len(pair) != 2:
            raise TypeError(f"priors[{name!r}] = {shortened(pair)}: allowed is (value, standard uncertainty)")
        value, error = (real_number(number, f"priors[{name!r}]") for number in pair)
        if not error > 0:
            raise ValueError(f"priors[{name!r}]: the standard uncertainty {error:g} must be positive")
        i = names.index(name)
        centre[i], precision[i, i] = value, error**-2.0
    return centre, precision
