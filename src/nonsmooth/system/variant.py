"""One traced form of a description, sharp or smoothed: what is derived from it and kept; values of its parameters.

Jacobians of the vector fields, resets and writes, gradients of indicators and outputs, in u, t, p and
memory; Hessians of indicators; Lie derivatives
:math:`L_f h = h_t + h_u f`, :math:`L_f^k h = L_f (L_f^{k-1} h)` along a mode's field.
All are expanded, so that "is it constant?" is a question about free symbols.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any

import sympy as sp

from nonsmooth.errors import shortened, unknown
from nonsmooth.system.description import Description
from nonsmooth.system.kinds import real_number
from nonsmooth.system.parameter import Parameter
from nonsmooth.system.symbolic.domain import Domain
from nonsmooth.system.symbolic.traced import Traced, along

SHARP, ONE_ETA, ETA_PER_INDICATOR = "sharp", "one eta", "eta per indicator"


class Variant:
    """A traced system, its derivatives, and what its parameters must fulfil; shared by all copies."""

    def __init__(self, description: Description, kind: str, band: str | None) -> None:
        self.kind, self.band = kind, band
        self.etas: tuple[tuple[str, str | None], ...] = ()
        self.memory: dict[str, tuple[float, str]] = dict(description.memory)
        extra: tuple[Any, ...] = ()
        if kind == SHARP:
            declared, surfaces = description.traced, description.surfaces
            self.traced: Traced = declared
            if surfaces:
                from nonsmooth.system.derived.sliding import slide

                self.traced = slide(declared, surfaces, description.scale)
            for surface in surfaces:
                if surface.static is not None and surface.static.free_symbols <= set(declared.p):
                    modes = " | ".join(declared.mode_names[mode] for mode in (surface.below, surface.above))
                    says = (
                        f"`static` of surface {declared.indicator_names[surface.indicator]} ({modes}) must be 1 or more"
                    )
                    extra += ((surface.static - 1, says),)
        else:
            from nonsmooth.system.derived.smoothing import smooth

            smoothed = smooth(description, kind == ONE_ETA, band or "linear")
            self.traced, self.etas, extra = smoothed.traced, smoothed.etas, smoothed.apart
            self.memory |= {name: (0.0, unit) for name, unit in smoothed.memory}
        self.name, self.parameters = description.name, dict(description.parameters)
        for name, of in self.etas:
            self.parameters[name] = Parameter(0.0, "", r"\eta" if of is None else rf"\eta_{{\mathrm{{{of}}}}}")
        self.domain = Domain(self.traced, (*description.ranges, *extra))
        tables = {
            "states": description.states,
            "memory": {name: unit for name, (_, unit) in self.memory.items()},
            "outputs": description.outputs,
            "inputs": {name: states[name] for name, states in description.driven.items()},
            "scale": description.scale,
        }
        #: What a system is, whatever the values of its parameters.
        self.facts: dict[str, Any] = {name: MappingProxyType(dict(one)) for name, one in tables.items()} | {
            "name": self.name,
            "surfaces": description.surfaces if kind == SHARP else (),
            "symmetry": description.symmetry,
            "explicit_time": description.explicit_time,
            "is_smoothed": kind != SHARP,
            "band": band,
        }

    def eta(self, values: Mapping[str, float]) -> float | dict[str, float] | None:
        """Half width of the bands: None, a number, or a number for each indicator."""
        if self.kind == SHARP:
            return None
        if self.kind == ONE_ETA:
            return values["eta"]
        return {str(indicator): values[key] for key, indicator in self.etas}

    def changed(self, values: Mapping[str, float], given: Any, named: Mapping[str, float]) -> dict[str, float]:
        """The values with some changed: ``given`` is a mapping or has a mapping ``values``; ``named`` wins over it."""
        changes = dict(named)
        if given is not None:
            mapping = given if isinstance(given, Mapping) else getattr(given, "values", None)
            if not isinstance(mapping, Mapping):
                raise TypeError(
                    f"with_parameters takes a mapping or an object with a mapping `values`, not {shortened(given)}"
                )
            changes = {**mapping, **changes}
        new = dict(values)
        for key, value in changes.items():
            self.check_known(key)
            if type(value) is not float or value - value != 0:
                value = real_number(value, f"parameter {key!r}")
            new[key] = value
        for key, _ in self.etas:
            if key in changes:
                positive(new[key], key)
        self.domain.check(new, changes)
        return new

    def check_known(self, key: str) -> None:
        """ValueError for what is no parameter."""
        if key not in self.parameters:
            units = {name: parameter.unit for name, parameter in self.parameters.items()}
            hint = "; eta is set by smoothed(eta)" if str(key).startswith("eta") and self.kind == SHARP else ""
            raise ValueError(unknown(key, "a parameter", repr(self.name), units) + hint)

    @cached_property
    def derivatives(self) -> Derivatives:
        """Exact derivatives, built on demand."""
        return Derivatives(self.traced)


def variant_of(description: Description, kind: str = SHARP, band: str | None = None) -> Variant:
    """Return the variant, made once for each description."""
    found = description.variants.get((kind, band))
    if found is None:
        found = description.variants[kind, band] = Variant(description, kind, band)
    return found


Vector = tuple[sp.Expr, ...]
Matrix = tuple[Vector, ...]


class Derivatives:
    """Derivatives of a traced system, by indices, as tuples of SymPy expressions; ``of`` is one of ``"u"``, ``"t"``,
    ``"p"``, ``"m"`` (memory): the columns of a Jacobian."""

    def __init__(self, traced: Traced) -> None:
        self.traced = traced

    def variables(self, of: str) -> tuple[sp.Symbol, ...]:
        """The symbols meant by ``of``."""
        t = self.traced
        try:
            return {"u": t.u, "t": (t.t,), "p": t.p, "m": t.m}[of]
        except KeyError:
            raise ValueError(f"`of` is one of 'u', 't', 'p', 'm', not {of!r}") from None

    def _gradient(self, expression: sp.Expr, of: str) -> Vector:
        free = expression.free_symbols
        return tuple(sp.expand(expression.diff(s)) if s in free else sp.Integer(0) for s in self.variables(of))

    def field(self, mode: int, of: str = "u") -> Matrix:
        """Jacobian of a vector field, (n, n_of)."""
        return tuple(self._gradient(entry, of) for entry in self.traced.fields[mode])

    def indicator(self, indicator: int, of: str = "u") -> Vector:
        """Gradient of an indicator, (n_of,)."""
        return self._gradient(self.traced.indicators[indicator], of)

    def output(self, output: int, mode: int, of: str = "u") -> Vector:
        """Gradient of an output in a mode, (n_of,)."""
        return self._gradient(self.traced.outputs[output][mode], of)

    def reset(self, transition: int, of: str = "u") -> Matrix:
        """Jacobian of the map applied at a transition, (n, n_of); the identity's where there is none."""
        reset = self.traced.transitions[transition].reset
        return tuple(self._gradient(entry, of) for entry in (self.traced.u if reset is None else reset))

    def write(self, transition: int, of: str = "u") -> dict[int, Vector]:
        """Gradients of what a transition writes, by index of memory."""
        return {i: self._gradient(value, of) for i, value in self.traced.transitions[transition].writes}

    def lie(self, indicator: int, mode: int, order: int = 1) -> sp.Expr:
        """Lie derivative of an indicator along the field of a mode, order 0 to 3 and more."""
        if order < 0:
            raise ValueError(f"the order of a Lie derivative is not negative, {order}")
        if order == 0:
            return self.traced.indicators[indicator]
        t = self.traced
        return sp.expand(along(self.lie(indicator, mode, order - 1), t.t, t.u, t.fields[mode]))


def smoothed_values(
    description: Description, values: Mapping[str, float], eta: Any, band: str
) -> tuple[dict[str, float], Variant]:
    """The variant for these half widths and this band, and its values; None takes the smoothing away."""
    from nonsmooth.system.derived.smoothing import BANDS

    if band not in BANDS:
        raise ValueError(f"band is one of {', '.join(BANDS)}, not {shortened(band)}")
    plain = {key: values[key] for key in description.parameters}
    if eta is None:
        return plain, variant_of(description, SHARP)
    if isinstance(eta, Mapping):
        variant = variant_of(description, ETA_PER_INDICATOR, band)
        wanted = [str(indicator) for _, indicator in variant.etas]
        for key in eta:
            if key not in wanted:
                raise ValueError(f"eta: {unknown(key, 'a smoothed indicator', repr(description.name), wanted)}")
        if missing := [key for key in wanted if key not in eta]:
            raise ValueError(f"eta: no width for {', '.join(missing)}; give {{{', '.join(wanted)}}} or one number")
        widths = {key: eta[str(indicator)] for key, indicator in variant.etas}
    else:
        variant = variant_of(description, ONE_ETA, band)
        widths = {"eta": eta}
    new = plain | {key: positive(real_number(width, key), key) for key, width in widths.items()}
    variant.domain.check(new)
    return new, variant


def positive(width: float, key: str) -> float:
    if width <= 0:
        raise ValueError(f"{key} is the half width of a band and must be positive, not {width}")
    return width
