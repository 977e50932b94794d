"""Values of a system's parameters: given by name, checked, in rows for many points, with the widths of bands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nonsmooth.errors import shortened, unknown
from nonsmooth.system.description import Description
from nonsmooth.system.parameter import finite_number
from nonsmooth.system.variant import ETA_PER_INDICATOR, ONE_ETA, SHARP, Variant, variant_of


def changed_values(
    variant: Variant, values: Mapping[str, float], name: str, given: Any, named: Mapping[str, float]
) -> dict[str, float]:
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
        if key not in new:
            raise ValueError(_unknown_parameter(key, variant, name))
        if type(value) is not float or value - value != 0:
            value = finite_number(value, f"parameter {key!r}")
        new[key] = value
    for key, _ in variant.etas:
        if key in changes:
            _positive(new[key], key)
    variant.domain.check(new, changes)
    return new


def parameter_rows(variant: Variant, values: Mapping[str, float], name: str, columns: Mapping[str, Any]) -> np.ndarray:
    """Rows of values (P, n_parameters) in declared order, for columns of equal length P."""
    lists = {key: np.atleast_1d(np.asarray(column, dtype=np.float64)) for key, column in columns.items()}
    sizes = {column.shape for column in lists.values()}
    if len(sizes) > 1 or any(len(size) != 1 for size in sizes):
        raise ValueError(f"columns of parameters must be one-dimensional and of equal length, not {sizes}")
    now = np.array(list(values.values()), dtype=np.float64)
    points = np.tile(now, (next(iter(sizes))[0] if sizes else 1, 1))
    order = list(values)
    for key, column in lists.items():
        if key not in values:
            raise ValueError(_unknown_parameter(key, variant, name))
        if not np.isfinite(column).all():
            raise ValueError(f"parameter {key!r} must be finite, not {column[~np.isfinite(column)][0]}")
        if key in dict(variant.etas):
            _positive(float(column.min()), key)
        points[:, order.index(key)] = column
    if len(points):
        variant.domain.check_points(points)
    return points


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
    new = plain | {key: _positive(finite_number(width, key), key) for key, width in widths.items()}
    variant.domain.check(new)
    return new, variant


def _unknown_parameter(key: object, variant: Variant, name: str) -> str:
    text = unknown(key, "a parameter", repr(name), variant.units)
    if str(key).startswith("eta") and variant.kind == SHARP:
        text += "; eta is set by smoothed(eta)"
    return text


def _positive(width: float, key: str) -> float:
    if width <= 0:
        raise ValueError(f"{key} is the half width of a band and must be positive, not {width}")
    return width
