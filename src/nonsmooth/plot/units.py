"""Units of the axes: SI with the prefix in which the values read easily, millimetres rather than 10^-2 m.

Artists keep the values of the result, in its own units, so that whatever is drawn over a figure by hand stands where it
should. Only the numbers at the ticks are scaled, and only by the prefix that the label names: a label that is written
anew in the plain unit, or a formatter of the caller's own, brings the plain numbers back.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.axis import Axis, Ticker
from matplotlib.ticker import ScalarFormatter

from nonsmooth.plot.labels import with_unit

PREFIXES = {0: "", -3: "m", -6: "\N{MICRO SIGN}", -9: "n"}
#: Units that take a prefix; the first one of a compound does: ``m``, ``m/s``, ``m s``, ``N/m``.
_FIRST = re.compile(r"(m|s|N|V|A|Pa|W|J|rad)(?=$|[/ ])")
#: Below this a prefix is used. Lengths and speeds are read in millimetres up to a metre.
_WHOLE = {"m": 1.0}
_ALMOST_WHOLE = 0.1
_READ = 0.05  # of the other axis' unit: from there on both have it


def power_for(unit: str, largest: float) -> int:
    """Return the power of ten of the prefix for values up to ``largest`` (in the unit itself): 0, -3, -6 or -9."""
    found = _FIRST.match(unit)
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
    firsts = {match[1] for unit, _ in axes if (match := _FIRST.match(unit))}
    powers = [power_for(unit, most) for unit, most in axes]
    if len(axes) == 2 and len(firsts) == 1 and powers[0] != powers[1] and all(_FIRST.match(unit) for unit, _ in axes):
        low = powers.index(min(powers))
        if found[low] >= _READ * 10.0 ** max(powers):
            found[low] = found[1 - low]
    return found


def prefixed(value: float, unit: str) -> tuple[str, str]:
    """Return a value as an axis would write it, and its unit with the prefix: ``("−1.2", "mm")``."""
    power = power_for(unit, abs(value))
    return f"{value / 10.0**power:g}".replace("-", "\N{MINUS SIGN}"), PREFIXES[power] + unit


def name_axis(axis: Axis, name: str, unit: str, largest: float | None = None) -> None:
    """Label an axis with its quantity, in the unit whose prefix suits what the axis shows now.

    Call it when everything is drawn. The prefix is that of all axes which share this one's scale.

    Parameters
    ----------
    axis
        ``ax.xaxis`` or ``ax.yaxis``.
    name
        The quantity, as it stands in the label.
    unit
        The unit of the values drawn.
    largest
        The greatest magnitude among them; by default that of the axis' ends.
    """
    ticks, formatter = axis.major, axis.get_major_formatter()
    ours = type(formatter) in (ScalarFormatter, _Prefixed)
    if axis.get_scale() != "linear" or not ours or _FIRST.match(unit) is None:
        axis.set_label_text(with_unit(name, unit))
        return
    if not isinstance(ticks, _Ticks):
        ticks = _Ticks(ticks)
        for one in _sharing(axis):
            one.major = ticks
    axis.set_label_text(with_unit(name, unit))
    ticks.units[axis] = unit
    power = power_for(unit, float(np.abs(axis.get_view_interval()).max()) if largest is None else largest)
    axis.set_major_formatter(_Prefixed(unit))
    ticks.write(power)


def in_unit(axis: Axis, unit: str) -> None:
    """Write an axis that :func:`name_axis` has named in a unit with another prefix, or with none.

    Raises
    ------
    ValueError
        An axis whose unit takes no prefix, or a unit that is not its own with one of them.
    """
    ticks = axis.major
    if not isinstance(ticks, _Ticks) or (plain := ticks.units.get(axis)) is None:
        raise ValueError(f"unit = {unit!r}: this axis ({axis.get_label_text()!r}) has no unit that takes a prefix")
    allowed = {prefix + plain: power for power, prefix in PREFIXES.items()}
    wanted = {f"u{plain}": PREFIXES[-6] + plain}.get(unit, unit)
    if wanted not in allowed:
        raise ValueError(f"unit = {unit!r} is not one of {', '.join(allowed)}, the units of this axis")
    ticks.write(allowed[wanted])


class _Ticks(Ticker):
    """The ticks of axes that :func:`name_axis` named. Another formatter brings back the labels' plain units."""

    units: dict[Axis, str]

    def __init__(self, before: Ticker) -> None:
        super().__init__()
        self.__dict__.update(before.__dict__)
        self.units = {}

    def __setattr__(self, key: str, value: Any) -> None:
        super().__setattr__(key, value)
        if key == "formatter" and not isinstance(value, _Prefixed):
            self.write(0)

    def write(self, power: int) -> None:
        """Write the prefix into the labels that name the unit; what else stands there stays."""
        for axis, unit in self.__dict__.get("units", {}).items():
            text = axis.get_label_text()
            old = _power_of(text, unit)
            if old is not None and old != power:
                axis.set_label_text(text.replace(f"({PREFIXES[old]}{unit})", f"({PREFIXES[power]}{unit})"))


class _Prefixed(ScalarFormatter):
    """Numbers in the unit that the axis' label names; without one the numbers themselves."""

    def __init__(self, unit: str) -> None:
        super().__init__()
        self.unit = unit
        self.limits = tuple(rcParams["axes.formatter.limits"])  # of the numbers themselves

    def _power(self) -> int:
        """The power of the prefix in the label, on this axis or on one that shares its scale."""
        if not isinstance(self.axis, Axis):
            return 0
        found = [_power_of(axis.get_label_text(), self.unit) for axis in (self.axis, *_sharing(self.axis))]
        return next((power for power in found if power is not None), 0)

    def set_locs(self, locs: Any) -> None:
        """Fix the power of ten before the numbers are formatted."""
        power = self._power()
        if power:
            self.set_scientific(True)
        self.set_powerlimits((power, power) if power else self.limits)
        super().set_locs(locs)

    def get_offset(self) -> str:
        """No factor at the end of the axis: it stands in the label, as the prefix."""
        return "" if self._power() else super().get_offset()

    def format_data_short(self, value: Any) -> str:
        """The value under the cursor, in the unit of the label."""
        power = self._power()
        if not power:
            return super().format_data_short(value)
        return f"{value / 10.0**power:.5g} {PREFIXES[power]}{self.unit}"


def _sharing(axis: Axis) -> list[Axis]:
    """The axes that share an axis' scale, itself among them."""
    ax = axis.axes
    if axis is ax.xaxis:
        return [one.xaxis for one in ax.get_shared_x_axes().get_siblings(ax)]
    return [one.yaxis for one in ax.get_shared_y_axes().get_siblings(ax)]


def _power_of(text: str, unit: str) -> int | None:
    """The power of the prefix with which a label names the unit; None where it does not name it."""
    return next((power for power, prefix in PREFIXES.items() if f"({prefix}{unit})" in text), None)
