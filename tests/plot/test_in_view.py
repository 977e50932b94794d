"""Pictures lie within their axes, and fill them."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from tests.plot.test_identification import PICTURES

import nonsmooth as ns
from nonsmooth.plot import identification
from nonsmooth.plot.mechanism import Sketch
from nonsmooth.plot.scheme import scheme_of

CUT = {"profile"}  # a cost far beyond its bound is not shown


def filled(ax: Any, axis: str) -> tuple[float, float]:
    """Begin and end of all lines over the data along an axis, as parts of its length."""
    found = [np.inf, -np.inf]
    k, scale = ("x", "y").index(axis), getattr(ax, f"{axis}axis").get_transform()
    low, high = scale.transform(np.array(getattr(ax, f"get_{axis}lim")()))
    for line in ax.lines:
        values = np.asarray(line.get_data()[k], float)
        if line.get_transform() != ax.transData or not len(values):
            continue
        with np.errstate(all="ignore"):
            part = (scale.transform(values) - low) / (high - low)
        part = part[np.isfinite(part) & (values > 0 if getattr(ax, f"get_{axis}scale")() == "log" else True)]
        if len(part):
            found = [min(found[0], part.min()), max(found[1], part.max())]
    return found[0], found[1]


@pytest.mark.parametrize("name", sorted({*PICTURES} - CUT))
def test_all_of_a_picture_is_in_view(name: str) -> None:
    ax = getattr(identification, name)(PICTURES[name]())
    for one in ax.figure.axes:
        for axis in "xy":
            begin, end = filled(one, axis)
            if begin <= end:
                assert -1e-9 <= begin and end <= 1 + 1e-9 and end - begin > 0.05
    ax.figure.draw_without_rendering()
    for one in filter(None, (one.get_legend() for one in ax.figure.axes)):
        box, whole = one.get_window_extent(), ax.figure.bbox
        assert whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1
    plt.close(ax.figure)


def test_the_heights_of_a_decay_have_room_on_both_sides() -> None:
    """Half the smallest to 1.6 times the largest."""
    data = PICTURES["free_decay"]()
    heights = 1e3 * data["peak_height"].values
    low, high = identification.free_decay(data).get_ylim()
    assert (low, high) == pytest.approx((0.5 * heights.min(), 1.6 * heights.max()))
    plt.close("all")


@pytest.mark.parametrize("gap", [0.2, 0.9, 2.5, 10.0])
def test_a_moved_mass_and_its_gap_stay_within_their_zone(gap: float) -> None:
    """A gap that the motion does not come near to (ten times as far) does not shrink the picture."""
    sketch = Sketch(scheme_of(ns.models.impact_oscillator(d=gap)))
    zone = sketch.faces[0] - sketch.left if sketch.left else sketch.faces[0]
    scale = sketch.scale_for(np.array([[-1.0], [0.5]]))
    assert 0.2 * zone < scale <= 0.5 * zone * (1 + 1e-12)
    assert gap == 10.0 or scale * gap <= 0.7 * zone * (1 + 1e-12)
    assert scale == pytest.approx(zone * (0.7 / gap if 1.4 < gap < 10 else 0.5))
