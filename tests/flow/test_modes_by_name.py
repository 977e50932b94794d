"""A run begins in the mode that is named, also where that is a combination of contact states no run has met."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.results.labels import in_words

E = ns.elements


FAR = {f"far{k}": E.ElasticStop(at="x", position=10.0, stiffness=5.0) for k in range(7)}  # too many to write all out


def stops(more: dict[str, Any]) -> ns.System:
    """Two springs behind gaps, whose names begin alike, and a support that is rubbed."""
    return ns.mechanical(
        [[1.0]],
        [[0.1]],
        [[1.0]],
        coordinates=["x"],
        parameters={"f": 0.2},
        elements={
            "a": E.ElasticStop(at="x", position=0.1, stiffness=5.0),
            "a_b": E.ElasticStop(at="x", position=0.2, stiffness=5.0),
            "dry": E.Coulomb(at="x", friction=0.3),
            **more,
        },
    )


@pytest.mark.parametrize(
    ("x", "v", "mode"),
    [
        (0.0, 1.0, "a_open_a_b_open_dry_forward"),
        (0.15, -1.0, "a_contact_a_b_open_dry_back"),
        (0.25, 1.0, "a_contact_a_b_contact_dry_forward"),
        (0.05, 0.0, "a_open_a_b_open_dry_stick"),
    ],
)
@pytest.mark.parametrize("more", [{}, FAR], ids=["written out", "as rows"])
def test_a_mode_of_elements_is_the_one_that_is_named(x: float, v: float, mode: str, more: dict[str, Any]) -> None:
    name, system = "_".join([mode, *(f"{key}_open" for key in more)]), stops(more)
    run = ns.simulate(system, duration=1e-3, start={"x": x, "v_x": v}, mode=name)
    assert in_words(run["mode"])[0] == name
    again = ns.simulate(system, duration=1e-3, start=run)
    assert in_words(again["mode"])[0] == in_words(run["mode"])[-1]


@pytest.mark.parametrize("more", [{}, FAR], ids=["written out", "as rows"])
@pytest.mark.parametrize(
    "mode", ["a_open_a_b_open", "a_open_a_b_open_dry", "open_open_stick", "a_open_b_open_dry_stick"]
)
def test_another_name_is_no_mode(mode: str, more: dict[str, Any]) -> None:
    system, start = stops(more), {"x": 0.0, "v_x": 1.0}
    for ending in ("", *([] if not more else ["_" + "_".join(f"{key}_open" for key in more)])):
        with pytest.raises(ValueError, match="is not a mode of"):
            ns.simulate(system, duration=1e-3, start=start, mode=mode + ending)
    assert np.isfinite(ns.simulate(system, duration=1e-3, start=start)["u"].values).all()
