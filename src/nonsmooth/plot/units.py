"""Units of the axes: SI with the prefix in which the values read easily, millimetres rather than 10^-2 m.

Artists keep the values of the result, in its own units, so that whatever is drawn over a figure by hand stands where it
should. Only the numbers at the ticks are scaled, and only by the prefix that the label names: a label that is written
anew in the plain unit, or a formatter of the caller's own, brings the plain numbers back.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.axis import Axis, Ticker
from matplotlib.ticker import ScalarFormatter

from nonsmooth.plot.labels import with_unit
from nonsmooth.plot.prefixes import FIRST, PREFIXES, power_for


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
    if axis.get_scale() == "linear" and axis.isDefault_majfmt and type(formatter) is ScalarFormatter:
        axis.set_major_formatter(formatter := _AsText())
    ours = type(formatter) in (ScalarFormatter, _AsText, _Prefixed)
    if axis.get_scale() != "linear" or not ours or FIRST.match(unit) is None:
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

    ValueError: an axis whose unit takes no prefix, or a unit that is not its own with one of them."""
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


class _AsText(ScalarFormatter):
    """Numbers at the ticks as plain text, mathematics only the factor at the end of the axis.

    The letters are the same, and a figure parses its formulas again with every measurement of its labels."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The number at a tick."""
        text = super().__call__(x, pos)
        return text if rcParams["text.usetex"] else text.removeprefix(r"$\mathdefault{").removesuffix("}$")


class _Prefixed(_AsText):
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
