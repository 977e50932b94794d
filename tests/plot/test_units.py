"""The number at a tick times the unit in the label is where the tick stands, whatever is done to either."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

from nonsmooth import plot
from nonsmooth.plot.labels import name_axes
from nonsmooth.plot.prefixes import power_for, prefixed
from nonsmooth.plot.units import name_axis

PREFIXES = {"": 1.0, "m": 1e-3, "µ": 1e-6, "n": 1e-9}


def drawn(high: float, **options: Any) -> Any:
    ax = plt.subplots(**options)[1]
    for one in np.atleast_1d(ax).ravel():
        one.plot([0, 1], [-high, high])
    return ax


def numbers(ax: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the labels at the ordinate's ticks, with the power of ten at the end of the axis, and their places."""
    ax.figure.canvas.draw()
    ticks = [tick for tick in ax.yaxis.get_major_ticks() if tick.label1.get_text()]
    words = [tick.label1.get_text().replace("\N{MINUS SIGN}", "-") for tick in ticks]
    plain = [word.removeprefix(r"$\mathdefault{").removesuffix("}$") for word in words]
    power = ax.yaxis.get_offset_text().get_text().replace("\N{MINUS SIGN}", "-")
    factor = float(power) if power else 1.0  # "1e-2"
    return np.array([float(word) for word in plain]) * factor, np.array([tick.get_loc() for tick in ticks])


def unit_of(ax: Any, base: str) -> float:
    """The factor of the unit that the label names."""
    (text,) = [one for one in ax.get_ylabel().replace("(", " ").replace(")", " ").split() if one.endswith(base)]
    return PREFIXES[text[: -len(base)]]


@pytest.mark.parametrize(
    ("unit", "largest", "power"),
    [
        ("m", 1.2, 0),
        ("m", 0.5, -3),
        ("m", 0.025, -3),
        ("m", 1e-4, -3),
        ("m", 5e-5, -6),
        ("m", 3e-8, -9),
        ("m/s", 0.12, -3),
        ("m/s", 3.0, 0),
        ("m s", 0.11, -3),
        ("N", 0.5, 0),
        ("N", 0.005, -3),
        ("rad/s", 9.0, 0),
        ("rad/s", 2e-5, -6),
        ("kg", 0.01, 0),
        ("1", 0.01, 0),
        ("m^2", 0.01, 0),
        ("m", 0.0, 0),
        ("m", np.nan, 0),
        ("m", 1e-15, -9),
    ],
)
def test_prefixes_by_the_size_of_the_values(unit: str, largest: float, power: int) -> None:
    assert power_for(unit, largest) == power


def test_a_value_in_words() -> None:
    assert prefixed(-0.0012, "m") == ("\N{MINUS SIGN}1.2", "mm") and prefixed(0.45, "N") == ("0.45", "N")


@pytest.mark.parametrize("high", [3.0, 0.02, 4e-6])
def test_ticks_times_unit_are_where_they_stand(high: float) -> None:
    ax = drawn(high)
    name_axis(ax.yaxis, "$x$", "m")
    said, at = numbers(ax)
    assert len(said) > 3
    np.testing.assert_allclose(said * unit_of(ax, "m"), at, atol=1e-6 * high)
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), [-high, high])  # the artist keeps the result's values


@pytest.mark.parametrize(("unit", "high"), [("m", 2e-3), ("1", 2e-6)])
def test_numbers_are_plain_text_and_their_factor_is_mathematics(unit: str, high: float) -> None:
    """Unless TeX sets all text."""
    with plot.journal():
        ax = drawn(high)
        name_axis(ax.yaxis, "$x$", unit)
    ax.figure.canvas.draw()
    said = [tick.get_text() for tick in ax.get_yticklabels()]
    assert {"2", "\N{MINUS SIGN}2"} <= set(said) and not any("$" in word for word in said)
    assert ("10^{" in ax.yaxis.get_offset_text().get_text()) == (unit == "1")
    with mpl.rc_context({"text.usetex": True}):
        assert ax.yaxis.get_major_formatter()(high) == r"$\mathdefault{2}$"


@pytest.mark.usefixtures("window")
def test_whatever_the_caller_does_the_numbers_stay_true() -> None:
    ax = drawn(0.02)
    name_axis(ax.yaxis, "$x$", "m")
    ax.ticklabel_format(axis="y", style="plain")
    said, at = numbers(ax)
    np.testing.assert_allclose(1e-3 * said, at, atol=1e-9)
    for label, unit in (("gap (m)", 1.0), ("", 1.0), ("row\ngap (mm)", 1e-3)):
        ax.set_ylabel(label)
        said, at = numbers(ax)
        np.testing.assert_allclose(unit * said, at, atol=1e-9)
    ax.yaxis.set_major_formatter("{x:.4f}")  # numbers of the caller's own: the label gives up its prefix
    assert ax.get_ylabel() == "row\ngap (m)"
    log = drawn(0.02)
    name_axis(log.yaxis, "$x$", "m")
    log.set_yscale("log")
    assert log.get_ylabel() == "$x$ (m)"


@pytest.mark.usefixtures("window")
def test_a_callers_formatter_and_scale_are_left_alone() -> None:
    mine, log = drawn(0.02), drawn(0.02)
    mine.yaxis.set_major_formatter("{x:.3f}")
    log.set_yscale("log")
    for ax in (mine, log):
        before = ax.yaxis.get_major_formatter()
        name_axis(ax.yaxis, "$x$", "m")
        assert ax.get_ylabel() == "$x$ (m)" and ax.yaxis.get_major_formatter() is before


def test_axes_that_share_a_scale_share_the_prefix() -> None:
    left, right = drawn(0.02, ncols=2, sharey=True)
    name_axis(left.yaxis, "$x$", "m")
    left.set_ylabel(f"exact\n{left.get_ylabel()}")
    right.plot([0, 1], [0, 4.0])
    name_axis(right.yaxis, "$x$", "m")
    assert (left.get_ylabel(), right.get_ylabel()) == ("exact\n$x$ (m)", "$x$ (m)")
    said, at = numbers(left)
    np.testing.assert_allclose(said, at, atol=1e-9)


def test_colour_bars_and_cursors_say_the_unit() -> None:
    ax = drawn(0.02)
    mesh = ax.pcolormesh([0, 1], [0, 1], [[0.0, 0.004], [0.002, 0.003]], shading="nearest")
    bar = ax.figure.colorbar(mesh, ax=ax)
    name_axes(bar.ax, y=("maximum", "m"))
    said, at = numbers(bar.ax)
    assert bar.ax.get_ylabel() == "maximum (mm)"
    np.testing.assert_allclose(1e-3 * said, at, atol=1e-9)
    name_axis(ax.yaxis, "$x$", "m", largest=0.02)
    assert ax.format_coord(0.5, 0.0123).endswith("12.3 mm)")


def test_small_letters_are_seven_points_in_print() -> None:
    with plot.journal():
        assert plot.style.small(plt.figure().add_subplot()) == pytest.approx(7.0)


@pytest.mark.parametrize(
    ("axes", "labels"),
    [
        ((("m", 1.04), ("m/s", 0.54)), ("m", "m/s")),  # not metres beside millimetres per second
        ((("m", 0.02), ("m/s", 0.3)), ("mm", "mm/s")),
        ((("m", 0.02), ("m/s", 5.0)), ("mm", "m/s")),  # 0.02 m reads badly
        ((("m", 2.0), ("N", 0.05)), ("m", "mN")),  # of different kinds
    ],
)
def test_positions_and_speeds_have_one_unit_of_length(axes, labels) -> None:
    from nonsmooth.plot.labels import name_axes

    _, ax = plt.subplots()
    (x, right), (y, top) = axes
    ax.plot([-right, right], [-top, top])
    ax.margins(0)
    name_axes(ax, ("a", x), ("b", y))
    assert (ax.get_xlabel(), ax.get_ylabel()) == tuple(f"{n} ({unit})" for n, unit in zip("ab", labels, strict=True))
