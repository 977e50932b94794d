"""Draws of the parameters from what is known of them, so that their uncertainty reaches the prediction."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.identification.finding import normal_draws
from nonsmooth.results.labels import labelled
from nonsmooth.system.kinds import ends, real_number
from nonsmooth.system.system import System

Rule = Callable[[Mapping[str, float]], float]


class Setting(NamedTuple):
    """Setting of a run: a value, or a rule by which it follows from the other parameters; standard uncertainty."""

    value: float | Rule
    uncertainty: float = 0.0

    @property
    def follows(self) -> bool:
        """Return whether it is a rule."""
        return callable(self.value)

    def at(self, values: Mapping[str, float]) -> float:
        """The value, the other parameters being these."""
        return float(self.value(values) if callable(self.value) else self.value)


Settings = Mapping[str, Setting]

MOST_REFUSED = 100  # draws per accepted one before the covariance is called unfit


def read_settings(settings: Mapping[str, Any] | None, system: System) -> dict[str, Setting]:
    """Settings of the run as ``{name: Setting}``.

    Each is a number, a pair, or ``{"value": ..., "uncertainty": ...}``; the value may be a function of the other
    parameters (the force of a crank is ``lambda p: p["k"] * a``, and uncertain as k is).
    """
    read: dict[str, Setting] = {}
    for name, given in (settings or {}).items():
        check_parameter(name, system)
        pair: Any = (given, 0.0)
        if isinstance(given, Mapping):
            extra = set(given) - {"value", "uncertainty"}
            if extra or "value" not in given:
                raise ValueError(f"setting {name!r} is {dict(given)!r}; write {{value = ..., uncertainty = ...}}")
            pair = (given["value"], given.get("uncertainty", 0.0))
        elif isinstance(given, tuple | list) and len(given) == 2:
            pair = given
        value = pair[0] if callable(pair[0]) else real_number(pair[0], f"setting {name!r}")
        error = real_number(pair[1], f"uncertainty of {name!r}")
        if error < 0:
            raise ValueError(f"the uncertainty of setting {name!r} is {error:g}; it must be zero or more")
        read[name] = Setting(value, error)
    return read


def nominal(system: System, parameters: Mapping[str, float] | None, settings: Settings) -> System:
    """The system at the identified parameters and at the run's settings; settings win."""
    given = dict(parameters or {})
    for name, value in given.items():
        if isinstance(value, tuple | list):
            raise TypeError(f"{name!r} is given as {value!r}: with an uncertainty it stands in settings=")
    for key in getattr(parameters, "extra", {}):
        name, comma, run = key.partition(", ")
        if comma and name in system.values and name not in settings:
            raise ValueError(
                f"{key!r} was found of run {run} alone: say which value holds here, settings={{{name!r}: ...}}"
            )
    system = system.with_parameters(given)
    return system.with_parameters(settled(settings, system.values))


def settled(settings: Settings, values: Mapping[str, float]) -> dict[str, float]:
    """The nominal value of each setting; those that follow from other parameters are worked out last."""
    plain = {name: setting.at({}) for name, setting in settings.items() if not setting.follows}
    known = {**values, **plain}
    return plain | {name: setting.at(known) for name, setting in settings.items() if setting.follows}


def draw_systems(
    system: System,
    parameters: Any,
    settings: Settings,
    draws: int,
    seed: int,
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
) -> tuple[list[System], dict[str, np.ndarray]]:
    """Systems whose parameters are drawn from their joint law, and the draws by name.

    ``parameters`` with ``draw(n, seed)`` draw by it, with ``covariance`` by a normal law; a mapping without either is
    exact. ``settings`` are independent and normal, and replace parameters. A draw outside of ``bounds``, one that the
    equations refuse (a mass below zero), or in which a positive parameter has become negative, is drawn again: a
    damping known only to a factor has a law that ends at zero.
    """
    rng = np.random.default_rng(seed)
    base = nominal(system, parameters, settings)
    for name in bounds or {}:
        check_parameter(name, system)
    allowed = {name: ends(pair, name) for name, pair in (bounds or {}).items()}
    systems: list[System] = []
    kept: list[dict[str, float]] = []
    refused = 0
    while len(systems) < draws:
        missing = draws - len(systems)
        table = _identified(parameters, missing, int(rng.integers(2**31)))
        beside = {}  # what is added to the value of each setting
        for name, setting in settings.items():
            table.pop(name, None)
            beside[name] = setting.uncertainty * rng.standard_normal(missing)
            if not setting.follows:
                table[name] = setting.at({}) + beside[name]
        for i in range(missing):
            row = {name: float(column[i]) for name, column in table.items()}
            known = {**base.values, **row}
            row |= {name: one.at(known) + float(beside[name][i]) for name, one in settings.items() if one.follows}
            try:
                drawn = base.with_parameters(row)
            except (SystemDefinitionError, ValueError):
                refused += 1
                continue
            negative = any(base.values[name] > 0 >= value and name not in settings for name, value in row.items())
            if negative or any(not low <= drawn.values[name] <= high for name, (low, high) in allowed.items()):
                refused += 1
                continue
            systems.append(drawn)
            kept.append(row)
        if refused > MOST_REFUSED * draws:
            raise ValueError(
                f"of {refused + len(systems)} draws only {len(systems)} are allowed by {system.name!r} and bounds=: a "
                "parameter's uncertainty is many times its value (identify it better, or leave it out of the "
                "covariance), or its value lies outside the bounds"
            )
    return systems, {name: np.array([row[name] for row in kept]) for name in (kept[0] if kept else ())}


def check_parameter(name: str, system: System) -> None:
    """Refuse a name that is no parameter of the system."""
    if name not in system.parameters:
        system.with_parameters({name: 0.0})  # raises with the names there are


def quantiles(draws: Any, edges: Any) -> np.ndarray:
    """Quantiles over draws; NaN, which tells nothing, is passed over."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # no draw has a value here
        return np.nanquantile(np.asarray(draws, float), edges, axis=0)


def intervals(name: str, over: str, drawn: Any, unit: str, level: float) -> dict[str, Any]:
    """Ends of the intervals of drawn values (draws, n), NaN where fewer than half of the draws have one."""
    if not len(drawn):
        return {}
    table = np.array(drawn, float)
    table[:, np.isfinite(table).sum(axis=0) * 2 < len(table)] = np.nan
    both = quantiles(table, [(1 - level) / 2, (1 + level) / 2]).reshape(2, -1)
    rows, said = dict(zip(("low", "high"), both, strict=True)), "end of the interval for drawn parameters"
    return {f"{name}_{end}": labelled(over, row, f"{end} {said}", unit) for end, row in rows.items()}


def drawn_variables(drawn: Mapping[str, np.ndarray], system: System) -> dict[str, Any]:
    """The draws as variables ``drawn_<name>`` over ``draw``, to be kept with a comparison."""
    return {
        f"drawn_{name}": labelled("draw", column, f"drawn {name}", system.parameters[name].unit or "1")
        for name, column in drawn.items()
    }


def _identified(parameters: Any, count: int, seed: int) -> dict[str, np.ndarray]:
    if parameters is None:
        return {}
    own = getattr(parameters, "draw", None)
    if callable(own):
        drawn = own(count, seed)
        names = list(getattr(drawn, "data_vars", drawn))
        return {str(name): np.asarray(drawn[name], float) for name in names if name in parameters}
    if not hasattr(parameters, "covariance"):
        return {name: np.full(count, float(parameters[name])) for name in parameters}
    names, matrix = known_together(parameters, parameters)
    table = normal_draws([float(parameters[name]) for name in names], matrix, count, seed)
    return dict(zip(names, table.T, strict=True))


def known_together(parameters: Any, allowed: Container[str]) -> tuple[list[str], np.ndarray]:
    """Names of the allowed parameters that have a covariance, and this."""
    covariance = getattr(parameters, "covariance", None)
    names = [] if covariance is None else [str(name) for name in covariance[covariance.dims[0]].values]
    held = [i for i, name in enumerate(names) if name in parameters and name in allowed]
    matrix = np.zeros((0, 0)) if covariance is None else covariance.values
    return [names[i] for i in held], matrix[np.ix_(held, held)]


@dataclass(frozen=True)
class Model:
    """A System with identified parameters and a run's settings, or a result at hand, and how it is compared.

    ``states``: those that were measured, in their order, in which the comparison is made; ``noise``: of a section
    point in each; ``solver``: options of trajectories; all others are options of :func:`compare`.
    """

    theory: Any
    states: list[str]
    parameters: Any
    settings: Settings
    noise: FloatArray
    solver: Mapping[str, Any]
    grid: int
    transient: int
    max_period: int
    draws: int
    level: float
    splits: int
    seed: int

    @cached_property
    def system(self) -> System | None:
        """The system at parameters and settings; None where the theory is a result."""
        if hasattr(self.theory, "data_vars"):
            return None
        return nominal(self.theory, self.parameters, self.settings)

    def drawn(self) -> tuple[list[System], dict[str, Any]]:
        """Systems whose parameters are drawn, and the draws as variables."""
        systems, drawn = draw_systems(self.theory, self.parameters, self.settings, self.draws, self.seed)
        return systems, drawn_variables(drawn, self.theory)

    @property
    def places(self) -> list[int]:
        """Places of the compared states among those of the theory."""
        return [list(self.theory.states).index(name) for name in self.states]

    def band(self, stack: Any) -> dict[str, np.ndarray]:
        """Low, median and high of the band of draws; NaN, which tells nothing, is passed over."""
        edges = (1 - self.level) / 2, 0.5, (1 + self.level) / 2
        return dict(zip(("low", "median", "high"), quantiles(stack, edges), strict=True))
