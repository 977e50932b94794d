"""Arguments of figures: each is drawn, or refused in a sentence that says what is allowed."""

from __future__ import annotations

import inspect
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from tests.test_doors import WORDS, wrong

import nonsmooth as ns
from nonsmooth.plot import style

ROOMS = (ns.plot, ns.plot.identification)
FIGURES = {name: one for room in ROOMS for name, one in vars(room).items() if hasattr(one, "door")}
QUIET = {"progress": False}


@pytest.fixture(scope="module")
def drawn() -> dict[str, tuple[Any, ...]]:
    """Arguments of figures: results of one oscillator."""
    support = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=4.5)
    orbit = ns.find_orbit(support, progress=False)
    plane = {"x": np.linspace(-0.02, 0.02, 4), "v": np.linspace(-0.2, 0.2, 3)}
    swept = ns.sweep(support, "rho", [0.14, 0.15], keep=17, direction="both", **QUIET)
    run = ns.simulate(support, periods=2)
    return {
        "time_history": (run,),
        "phase_portrait": (run,),
        "section": (ns.poincare(support, n=4),),
        "orbit": (orbit,),
        "amplitude_spectrum": (ns.amplitude_spectrum(support, transient=20, **QUIET),),
        "bifurcation": (swept,),
        "frequency_response": (ns.frequency_response(support, [4.4, 4.5, 4.6], **QUIET),),
        "density": (ns.sweep(support, "rho", [0.14, 0.15], keep=17, density=True, **QUIET),),
        "branch": (ns.continue_orbit(orbit, "omega", (4.4, 4.6)),),
        "multipliers": (orbit,),
        "chart": (ns.chart(support, {"omega": [4.4, 4.5], "rho": [0.14, 0.15]}, keep=17, **QUIET),),
        "basins": (ns.basins(support, plane, transient=20, **QUIET),),
    }


def test_every_figure_of_a_result_has_a_door() -> None:
    """Those without: what is no figure of a result."""
    names = {name for room in ROOMS for name in room.__all__ if inspect.isfunction(getattr(room, name))}
    others = {"annotate", "journal", "name_plane", "one_branch", "prefixed", "save_figure", "shade_zone"}
    assert names - FIGURES.keys() == others | {"shared_legend", "slides"}


@pytest.mark.parametrize("name", FIGURES)
def test_what_a_declaration_does_not_allow_is_refused_before_anything_is_drawn(name: str) -> None:
    door = FIGURES[name].door
    needed = {item.name: (0.0, 1.0) for item in door.named.values() if item.default is item.empty}
    needed |= {"system": ns.models.discontinuous_support()} if "system" in needed else {}
    tried = [(key, value) for key, kind in door.kinds.items() for value in wrong(kind)]
    for key, value in tried:
        with pytest.raises((TypeError, ValueError)) as caught:
            FIGURES[name](**{**needed, key: value})
        said = str(caught.value)
        assert key in said and any(word in said for word in WORDS), (key, value, said)
    assert not plt.get_fignums()


def test_a_property_of_lines_changes_a_line_or_is_refused(drawn) -> None:
    """A chart and a density have none: `color=` did nothing there."""
    for name, given in drawn.items():
        if name in ("chart", "density"):
            with pytest.raises(TypeError, match="color: no property of this picture"):
                FIGURES[name](*given, color="red")
            continue
        ax = FIGURES[name](*given, color="red")
        colors = {plt.matplotlib.colors.to_hex(line.get_color()) for line in ax.lines if len(line.get_xdata())}
        assert "#ff0000" in colors, name
    stems = ns.plot.amplitude_spectrum(*drawn["amplitude_spectrum"], color="red").collections[0]
    assert plt.matplotlib.colors.to_hex(stems.get_color()[0]) == "#ff0000"
    with pytest.raises(TypeError, match="alpha: no property"):
        ns.plot.multipliers(*drawn["branch"], alpha=0.5)  # points in colours of the parameter


SENTENCES = {
    "a parameter that is none": ("phase_portrait", {"zone": "gg"}, "`gg` is not a parameter of this result.*or give"),
    "a start that is not there": ("chart", {"start": 5}, "start = 5: this result has 1; allowed: 0"),
    "a state where none is meant": ("chart", {"y": "v"}, "y = 'v' goes with show='maximum', 'minimum' or 'amplitude'"),
    "no state": ("chart", {"show": "maximum", "y": "z"}, "'z' is not a state; states:"),
    "no quantity": ("chart", {"show": "height"}, "`height` is not a quantity"),
    "no region": ("chart", {"region": 3}, "region = 3: give a condition, or what ns.region found"),
    "levels that are words": ("chart", {"contours": {"x_amplitude": "low"}}, "contours.*'low'"),
    "a quantity of an axis": ("bifurcation", {"y": "height"}, "`height` is not a quantity"),
    "two names": ("section", {"x": ["x", "v"]}, "it is one name"),
    "a map of colours": ("density", {"cmap": "nope"}, "'nope' is not a valid value for cmap"),
    "no element": ("time_history", {"shade": "stop"}, "no element of this name"),
    "no colour": ("time_history", {"color": "reddish"}, "'reddish' is not a valid value for color"),
    "no marker": ("time_history", {"marker": "zz"}, "marker style 'zz'"),
    "two axes' unit": ("time_history", {"unit": {"z": "m"}}, "a unit of the ordinate"),
}


@pytest.mark.parametrize("case", SENTENCES)
def test_a_name_that_a_result_has_not_is_answered_with_those_it_has(drawn, case: str) -> None:
    name, options, words = SENTENCES[case]
    with pytest.raises((TypeError, ValueError), match=words):
        FIGURES[name](*drawn[name], **options)


def test_colours_of_many_modes_attractors_and_branches_do_not_repeat(drawn) -> None:
    for colors in ([style.nth(k) for k in range(60)], [style.attractor_color(k) for k in range(60)]):
        rgb = np.array([plt.matplotlib.colors.to_rgb(one) for one in colors])
        apart = np.abs(rgb[:, None] - rgb[None]).max(axis=2)[~np.eye(60, dtype=bool)]
        assert apart.min() > 0.03
    run = drawn["phase_portrait"][0]
    many = xr.DataArray(
        np.arange(run.sizes["time"]) % 12, dims="time", attrs={"flag_meanings": " ".join("abcdefghijkl")}
    )
    lines = ns.plot.phase_portrait(run.assign(mode=many)).lines
    assert len({line.get_color() for line in lines}) == len(lines) == 12
