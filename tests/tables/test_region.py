"""Regions: against closed forms, and against a chart evaluated by hand."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.results.labels import in_words


@pytest.fixture(scope="module")
def forced():
    return ns.mechanical(
        1.0,
        0.5,
        1.0,
        coordinates={"q": "m"},
        parameters={"F": (2.0, "N"), "w": (1.0, "rad/s")},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
    )


@pytest.fixture(scope="module")
def struck():
    """A chart of an oscillator between two stops with loads, 5 x 4 points."""
    rig = ns.mechanical(
        1.0,
        0.2,
        1.0,
        coordinates={"q": "m"},
        parameters={"F": (1.0, "N"), "w": (1.0, "rad/s")},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
        elements={
            "left": ns.elements.Stop(at="q", position=-1.5, side=-1, restitution=0.6),
            "right": ns.elements.Stop(at="q", position=1.0, restitution=0.6),
        },
    )
    plane = {"w": np.linspace(0.7, 1.5, 5), "F": np.linspace(0.2, 1.1, 4)}
    return ns.chart(rig, plane, loads=True, progress=False)


def test_a_state_stands_for_all_its_values(forced) -> None:
    w = np.linspace(0.3, 2.0, 18)
    response = ns.frequency_response(forced, w, parameter="w", direction="up", progress=False)
    exact = 2.0 / np.hypot(1 - w**2, 0.5 * w)
    for bound in (1.0, 2.0, 3.0):
        for text in ("abs(q) < {}", "q < {}", "q > -{}", "-{0} < q < {0}", "2*q + 1 < 2*{} + 1"):
            assert (ns.region(response, text.format(bound)).values == (exact < bound)).all()
        assert (ns.region(response, f"abs(v_q)/w < {bound}").values == (exact < bound)).all()
    assert not ns.region(response, "abs(q) > 0.001").any()  # it passes zero
    assert not ns.region(response, "q > 0 or q < 0").any()
    assert not ns.region(response, "q != 0").any() and not ns.region(response, "abs(q) != 0.1").any()
    assert (ns.region(response, "q != 2").values == (exact < 2.0)).all()


def test_against_a_chart_evaluated_by_hand(struck) -> None:
    found = ns.region(struck, "abs(q) < 1.2 and impact_speed < 0.5 or period_number == 2")
    assert found.dims == ("w", "F")
    assert found.dtype == bool
    hand = np.zeros((5, 4), dtype=bool)
    for i in range(5):
        for j in range(4):
            one = struck.isel(w=i, F=j)
            largest = max(abs(float(one.maximum[0])), abs(float(one.minimum[0])))
            speed = max(float(one.left_impact_speed_maximum), float(one.right_impact_speed_maximum))
            hand[i, j] = (largest < 1.2 and speed < 0.5) or int(one.period_number) == 2
    assert (found.values == hand).all()
    assert 0 < hand.sum() < 20
    right = ns.region(struck, "right_impact_speed < 0.5").values
    assert (right == (struck.right_impact_speed_maximum < 0.5).values).all()
    assert found.attrs["long_name"].startswith("abs(q) < 1.2")


def test_the_parameters_and_points_that_are_not_known(struck) -> None:
    plane = ns.region(struck, "F < 0.6*w").values
    assert (plane == (struck.F.values[None, :] < 0.6 * struck.w.values[:, None])).all()
    gone = struck.assign(maximum=struck.maximum.where(struck.w > 0.8))
    found = ns.region(gone, "abs(q) < 100")
    assert not found.isel(w=0).any()
    assert found.isel(w=slice(1, None)).all()
    assert found.attrs["unknown"] == 4


def test_a_period_number_is_known_where_a_run_tells_it() -> None:
    """Of a linear oscillator: with c < 0 it grows without bound, with c = 0 it has two frequencies and never a period
    (one of the two is 0.618 of the other, or 0.7: back to 4e-3 after ten periods), with c > 0 period 1."""
    rig = ns.mechanical(1.0, "c", 1.0, forcing={"q": lambda t, p: np.cos(p.w * t)}, parameters={"c": 0.1, "w": 1.0})
    chart = ns.chart(rig, {"c": [-0.5, 0.0, 0.5], "w": [0.61803398875, 0.7]}, transient=100, progress=False)
    told = in_words(chart["status"])
    assert told[0].tolist() == ["diverged"] * 2 and told[1, 0] == "not_periodic" and told[1, 1] == "slow"
    none = ns.region(chart, "period_number == 0")
    assert none.values.tolist() == [[False, False], [True, False], [False, False]] and none.attrs["unknown"] == 3
    assert ns.region(chart, "period_number < 2").values.tolist() == [[False, False], [True, False], [True, True]]
    attractors = xr.Dataset({"period_number": (("g", "attractor"), [[1, -1], [0, 2]])}, {"g": [0.0, 1.0]})
    found = ns.region(attractors, "period_number < 2")
    assert found.values.tolist() == [[True, False], [True, False]] and found.attrs["unknown"] == 1


def test_a_run_by_its_values(forced) -> None:
    run = ns.simulate(forced, periods=1, start={"q": 1.0})
    assert (ns.region(run, "q > 0.5 and time < 2").values == ((run.u[:, 0] > 0.5) & (run.time < 2)).values).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("q < v_q", "q and v_q stands for all values"),
        ("q*q < 1", "stands for all values"),
        ("abs(q) + q < 1", "stands for all values"),
        ("q", "is no condition"),
        ("q + 1", "is no condition"),
        ("not q < 1", "write the opposite comparison"),
        ("foo < 1", "`foo` is not a quantity of this result"),
        ("q <", "cannot read the condition"),
        ("__import__('os').system('true') < 1", "is not allowed"),
        ("q.real < 1", "is not allowed"),
        ("(lambda: 1)() < 2", "is not allowed"),
        ("q" + " " * 3000 + "< 1", "too long"),
    ],
)
def test_what_cannot_be_read_is_said(struck, text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ns.region(struck, text)


def test_every_value_of_a_force_lies_between_both_of_its_ends(struck) -> None:
    """A belt that runs ahead pulls: the friction force is -0.3 while the mass slips."""
    rig = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"F": 0.5, "w": 0.9},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
        elements={"rub": ns.elements.Coulomb(at="q", friction=0.3, belt=-5.0)},
    )
    chart = ns.chart(rig, {"F": [0.4, 0.5], "w": [0.8, 0.9]}, loads=True, progress=False)
    for end in ("maximum", "minimum"):
        assert chart[f"rub_force_{end}"].values == pytest.approx(np.full((2, 2), -0.3), rel=1e-9)
    assert ns.region(chart, "rub_force < -0.2 and -2*force > 0.5").all()
    assert ns.region(chart, "abs(rub_force) > 0.2 and abs(rub_force) < 0.4 and force > -0.31").all()
    assert not ns.region(chart, "rub_force < -0.4").any() and not ns.region(chart, "abs(rub_force) < 0.2").any()


def test_speeds_of_impacts_lie_between_zero_and_the_largest(struck) -> None:
    largest = np.maximum(struck.left_impact_speed_maximum, struck.right_impact_speed_maximum)
    assert ns.region(struck, "impact_speed != 7 and impact_speed >= 0").all()
    assert (ns.region(struck, "abs(impact_speed) < 0.5") == (largest < 0.5)).all()
    found = ns.region(struck, "impact_speed*(w - 0.7) < 0.1")
    assert found.sel(w=0.7).all() and (found == (largest * (struck.w - 0.7) < 0.1)).all()
    for text in ("impact_speed > 0.1", "impact_speed != 0.1", "0.1 < right_impact_speed"):
        with pytest.raises(ValueError, match="holds the largest value alone"):
            ns.region(struck, text)


def test_what_has_no_value_is_not_known(struck) -> None:
    """The impulse of one impact where there is none; a root of less than zero."""
    none = (struck.right_impacts == 0).values
    assert 0 < none.sum() < none.size
    for text in (
        "right_impulse/right_impacts > 0",
        "right_impulse/right_impacts <= 0",
        "0*F != right_energy/right_impacts",
    ):
        assert ns.region(struck, text).attrs["unknown"] == none.sum()
        assert not ns.region(struck, text).values[none].any()
    found = ns.region(struck, "sqrt(F - 0.6) < 100 or q < 100")
    assert (found == (struck.F >= 0.6)).all() and found.attrs["unknown"] == 10
    orbit = ns.find_orbit(ns.models.impact_oscillator(), progress=False)
    with pytest.raises(ValueError, match="mode is text"):
        ns.region(orbit, "mode == 0")


def test_no_result_no_text(struck) -> None:
    with pytest.raises(TypeError, match="a result is wanted"):
        ns.region(3, "q < 1")
    with pytest.raises(TypeError, match="condition must be text, not 3; a condition such as"):
        ns.region(struck, 3)
    without = struck[[name for name in struck if not str(name).startswith(("left", "right"))]]
    with pytest.raises(ValueError, match="loads=True"):
        ns.region(without, "impact_speed < 1")


def test_it_is_drawn(struck) -> None:
    import matplotlib.pyplot as plt

    inside = ns.region(struck, "impact_speed < 0.5")
    assert isinstance(inside, xr.DataArray)
    ax = ns.plot.chart(struck, show="right_impact_speed_maximum", contours={"q_amplitude": [0.5, 1.0]}, region=inside)
    assert ax.get_title(loc="left") == "dashed: q_amplitude\noutlined: impact_speed < 0.5"
    (outline,) = [one for one in ax.collections if type(one).__name__ == "LineCollection"]
    cells = np.pad(inside.values, 1)
    edges = int((cells[1:] != cells[:-1]).sum() + (cells[:, 1:] != cells[:, :-1]).sum())
    assert len(outline.get_segments()) == edges
    assert (
        ns.plot.chart(struck, show="amplitude", y="v_q").collections[0].get_array().ravel()
        == 0.5 * (struck.maximum - struck.minimum).sel(state="v_q").values.T.ravel()
    ).all()
    plt.close("all")
