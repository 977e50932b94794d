"""Fig. 2 of Savi et al. (2007): the regions and surfaces by Eqs. (4)-(5), the bands by Eqs. (9)-(10)."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes

from nonsmooth import models, plot
from nonsmooth.system.system import System

G, K_S, C_S, ETA = 0.0018, 1210.0, 0.60, 1e-5
WINDOW = {"xlim": (G - 6 * ETA, G + 6 * ETA), "ylim": (-0.15, 0.15)}


@pytest.fixture
def support() -> System:
    return models.discontinuous_support(g=G)


def colour_at(ax: Axes, x: float, v: float) -> str:
    """The name of the region whose filled contour covers a point (the last one drawn, as on paper)."""
    names = [text.get_text() for text in ax.texts if "S" in text.get_text() or "G" in text.get_text()]
    filled = [item for item in ax.collections if item.get_facecolor().size]
    covering = [i for i, item in enumerate(filled) if any(path.contains_point((x, v)) for path in item.get_paths())]
    return names[covering[-1]] if covering else ""


def sampled() -> np.ndarray:
    rng = np.random.default_rng(2)
    return rng.uniform((G - 6 * ETA, -0.15), (G + 6 * ETA, 0.15), (300, 2))


def clear_of_borders(x: float, v: float) -> bool:
    h_a, h_b = x - G, -(x - G) - C_S / K_S * v
    close = [abs(abs(h) - ETA) for h in (h_a, h_b)] + [abs(h_a), abs(h_b), abs(h_a + h_b)]
    return min(close) > 0.1 * ETA


def test_the_sharp_regions_are_those_of_the_paper(support: System) -> None:
    ax = plot.regions(support, **WINDOW)
    for x, v in sampled():
        if clear_of_borders(x, v):
            contact = x - G > 0 and -(x - G) - C_S / K_S * v < 0
            assert colour_at(ax, x, v) == (r"$\tilde G_+$" if contact else r"$\tilde G_-$"), (x, v)
    assert {r"$\tilde S_a$", r"$\tilde S_b$"} <= {text.get_text() for text in ax.texts}


def test_the_bands_are_those_of_the_paper(support: System) -> None:
    ax = plot.regions(support.smoothed(ETA), **WINDOW)
    for x, v in sampled():
        if not clear_of_borders(x, v):
            continue
        h_a, h_b = x - G, -(x - G) - C_S / K_S * v
        if h_a <= -ETA or h_b >= ETA:
            name = "$G_-$"
        elif h_a >= ETA and h_b <= -ETA:
            name = "$G_+$"
        else:
            name = "$S_a$" if h_b <= -h_a else "$S_b$"
        assert colour_at(ax, x, v) == name, (x, v)


def test_over_a_longer_motion_the_part_that_was_asked_for_is_shown(support: System) -> None:
    ax = plot.regions(support, **WINDOW)
    ax.clear()
    (motion,) = ax.plot([-1.0, 1.0], [-1.0, 1.0])
    plot.regions(support, ax, **WINDOW)
    assert (ax.get_xlim(), ax.get_ylim()) == (WINDOW["xlim"], WINDOW["ylim"])
    motion.remove()


def test_what_cannot_be_drawn_is_explained(support: System) -> None:
    with pytest.raises(ValueError, match="'w' is not a state; states:"):
        plot.regions(support, y="w", **WINDOW)


def test_what_a_figure_needs_is_said_with_its_name(support: System) -> None:
    with pytest.raises(TypeError, match="regions needs xlim and ylim: regions\\(system, ax, xlim="):
        plot.regions(support)
