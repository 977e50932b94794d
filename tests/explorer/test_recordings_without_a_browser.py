"""Recordings laid over a motion in closed form: their phase by turns of the drive, distance, section and history."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

import nonsmooth as ns
from nonsmooth.explorer.recorded import RecordedStates
from nonsmooth.explorer.work import compute

SYSTEM = ns.models.discontinuous_support(g=1.0)
P = SYSTEM.values
T = 2 * np.pi / P["omega"]
H = P["rho"] / (2 * P["k"] - P["m"] * P["omega"] ** 2 + 1j * P["c"] * P["omega"])  # x = Re(H exp(i phase))


def laid(off: float = 0.0, late: float = 0.0, turns: bool = True, **more: Any) -> dict[str, Any]:
    """A record of twelve periods that begins ``late`` (in periods), its x shifted by ``off``."""
    t = np.arange(0.0, 12 * T, T / 50)
    x = (H * np.exp(2j * np.pi * (t / T + late))).real + off
    marks = (np.arange(1, 13) - late) * T if turns else np.zeros(0)
    asked = {"view": "recording", "text": SYSTEM.to_text(), "values": dict(P), "method": "auto"}
    asked |= {"samples": RecordedStates(t, {"x": x}, marks[(marks >= 0) & (marks <= t[-1])])}
    asked |= {"start": {"x": 0.0, "v": 0.0}, "transient": 300, "period": 1, "periods": 2, "phase": 0.0, "shown": "x"}
    return compute(asked | more, lambda done: True)["laid"]


def test_what_is_laid_over_a_motion_is_not_taken_for_its_own_section_points() -> None:
    """Results of all views go by name: the readout failed where the motion's own were not there."""
    recorded = {"view": "recording", "text": SYSTEM.to_text(), "values": dict(P), "method": "auto"}
    recorded |= {"samples": RecordedStates(np.arange(9.0), {"x": np.zeros(9)}, np.zeros(0))}
    recorded |= {"start": {"x": 0.0, "v": 0.0}, "transient": 0, "period": 1, "periods": 1, "phase": 0.0, "shown": "x"}
    motion = {**recorded, "view": "section", "transient": 10}
    names = [set(compute(asked, lambda done: True)) for asked in (recorded, motion)]
    assert names[1] == {"section", "apart"} and not names[0] & names[1]


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_turns_of_the_drive_give_the_phase(late: float) -> None:
    found = laid(late=late)
    assert found["drive"] == pytest.approx(T)
    told = found["distance"]
    assert (told["of"], told["periods"] >= 10) == ("x", True)
    assert told["shift"] == pytest.approx(0.0, abs=2e-3) and told["part"] < 1e-2
    assert found["section"]["x"] == pytest.approx(np.full(len(found["section"]["x"]), H.real), abs=2e-3 * abs(H))
    time, x = found["history"]["time"], found["history"]["x"]
    assert len(time) > 80 and x == pytest.approx((H * np.exp(2j * np.pi * time / T)).real, abs=2e-2 * abs(H))
    assert np.ptp(time) <= 2 * T


def test_without_turns_a_late_record_is_shifted() -> None:
    """Its own phase is counted from its first sample: 0.3 of a period less than that of the drive."""
    found = laid(late=0.3, turns=False)
    assert "drive" not in found
    assert found["distance"]["shift"] % 1.0 == pytest.approx((1.0 - 0.3) % 1.0, abs=5e-3)
    assert found["distance"]["part"] < 1e-2
    other = laid(late=0.3, phase=0.25)
    assert other["section"]["x"] == pytest.approx(np.full(len(other["section"]["x"]), -H.imag), abs=4e-3 * abs(H))


def test_a_record_that_is_off_has_that_distance() -> None:
    for off in (0.5 * abs(H), 1.5 * abs(H)):
        told = laid(off=off)["distance"]
        assert told["rms"] == pytest.approx(off, rel=1e-2)
        assert told["part"] == pytest.approx(off / (abs(H) / np.sqrt(2)), rel=1e-2)
