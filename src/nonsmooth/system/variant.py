"""One traced form of a description, sharp or smoothed, with what is derived from it and kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.description import Description
from nonsmooth.system.symbolic.derivatives import Derivatives
from nonsmooth.system.symbolic.domain import Domain
from nonsmooth.system.symbolic.traced import Traced

SHARP, ONE_ETA, ETA_PER_INDICATOR = "sharp", "one eta", "eta per indicator"


class Variant:
    """A traced system, its derivatives, and what its parameters must fulfil; shared by all copies."""

    def __init__(self, description: Description, kind: str, band: str | None) -> None:
        self.kind, self.band = kind, band
        self.etas: tuple[tuple[str, str | None], ...] = ()
        self.memory: dict[str, tuple[float, str]] = dict(description.memory)
        extra: tuple[Any, ...] = ()
        if kind == SHARP:
            self.traced: Traced = description.with_sliding(description.traced)
            extra = tuple(_static_ratios(description))
        else:
            from nonsmooth.system.derived.smoothing import smooth

            smoothed = smooth(description, kind == ONE_ETA, band or "linear")
            self.traced, self.etas, extra = smoothed.traced, smoothed.etas, smoothed.apart
            self.memory |= {name: (0.0, unit) for name, unit in smoothed.memory}
        self.units: Mapping[str, str] = {
            **{name: parameter.unit for name, parameter in description.parameters.items()},
            **{name: "" for name, _ in self.etas},
        }
        self.symbols: Mapping[str, str] = {
            **{name: parameter.symbol for name, parameter in description.parameters.items()},
            **{name: r"\eta" if of is None else rf"\eta_{{\mathrm{{{of}}}}}" for name, of in self.etas},
        }
        self.domain = Domain(self.traced, (*description.ranges, *extra))

    @property
    def visited(self) -> Traced:
        """The equations; where modes are made when they are first visited, the names of those visited so far."""
        if self.traced.decider is not None:
            return self.traced.decider.known()
        return self.traced if self.traced.patterns is None else self.traced.patterns.seen()

    @cached_property
    def period(self) -> Callable[..., float] | None:
        """The forcing period as a function of all parameters in order."""
        if self.traced.period is None:
            return None
        import sympy as sp

        return sp.lambdify(self.traced.p, self.traced.period, modules="math")

    def period_at(
        self, now: Mapping[str, float], values: Mapping[str, float] | Sequence[float] | np.ndarray
    ) -> float | None:
        """The forcing period at other values than those of ``now``: a mapping (others stay), or all in order."""
        if self.period is None:
            return None
        if isinstance(values, Mapping):
            values = [values.get(key, value) for key, value in now.items()]
        return float(self.period(*map(float, values)))

    def eta(self, values: Mapping[str, float]) -> float | dict[str, float] | None:
        """Half width of the bands: None, a number, or a number for each indicator."""
        if self.kind == SHARP:
            return None
        if self.kind == ONE_ETA:
            return values["eta"]
        return {str(indicator): values[key] for key, indicator in self.etas}

    def refuse_patterns(self, name: str, verb: str) -> None:
        """Raise SystemDefinitionError where the modes are made when they are first visited."""
        if self.traced.patterns is not None:
            raise SystemDefinitionError(
                f"{name!r}: its elements {self.traced.patterns.why}; a mode is made when a run first visits it. Not so "
                f"for {verb}: take fewer elements for it"
            )

    @cached_property
    def derivatives(self) -> Derivatives:
        """Exact derivatives, built on demand."""
        return Derivatives(self.traced)


def _static_ratios(description: Description) -> Iterator[tuple[Any, str]]:
    """Excess of the static value over the kinetic one, not negative, where it depends on parameters alone."""
    declared = description.traced
    for surface in description.surfaces:
        if surface.static is not None and surface.static.free_symbols <= set(declared.p):
            names = (
                declared.indicator_names[surface.indicator],
                *(declared.mode_names[mode] for mode in (surface.below, surface.above)),
            )
            yield surface.static - 1, "`static` of surface {} ({} | {}) must be 1 or more".format(*names)


def variant_of(description: Description, kind: str = SHARP, band: str | None = None) -> Variant:
    """Return the variant, made once for each description."""
    found = description.variants.get((kind, band))
    if found is None:
        found = description.variants[kind, band] = Variant(description, kind, band)
    return found
