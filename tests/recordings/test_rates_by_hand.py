"""Rates, gaps, missing values and steps of a sensor, of time axes and signals that are written down."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.recordings.recording import examine, missing_said
from nonsmooth.recordings.signals.displacement import found_resolution, resolution


def test_a_gap_is_counted_and_leaves_the_rate_as_it_is() -> None:
    """A hundred samples at 50 Hz without the numbers 30, 31 and 70."""
    time = np.delete(np.arange(100) / 50.0, [30, 31, 70])
    found = examine(time)
    assert found.rate == pytest.approx(50.0, rel=1e-12)
    assert found.gaps == ((29, 2), (67, 1))
    assert (found.regular, found.repeated, found.change) == (False, 0, None)
    assert examine(np.arange(100) / 50.0).regular


def test_a_step_below_one_and_a_half_is_no_gap() -> None:
    time = np.arange(100) / 50.0
    for late, gaps in ((0.4, 0), (0.6, 1)):
        moved = time.copy()
        moved[60:] += late / 50.0
        assert len(examine(moved).gaps) == gaps


def test_a_change_of_rate_has_its_place_and_both_rates() -> None:
    time = np.concatenate([np.arange(80) / 50.0, 80 / 50.0 + np.arange(80) / 20.0])
    at, before, after = examine(time).change
    assert (at, before, after) == (80, pytest.approx(50.0), pytest.approx(20.0))
    assert not examine(time).regular


def test_times_that_stand_twice_are_counted() -> None:
    time = np.arange(100) / 50.0
    time[41], time[77] = time[40], time[76]
    assert examine(time).repeated == 2
    assert np.isnan(examine(np.zeros(3)).rate) and np.isnan(examine(np.zeros(1)).rate)


def test_runs_of_missing_values() -> None:
    """All of them, and where the longest run begins; of equal ones the first."""
    values = np.ones(20)
    values[[2, 3, 7, 8, 9, 19]] = np.nan
    said = "of 20 values are not finite numbers, the longest run of them 3 from t = 0.7 s on"
    assert missing_said(values, 0.1 * np.arange(20)) == f"6 {said}"
    values[12:15] = np.inf
    assert missing_said(values, 0.1 * np.arange(20)) == f"9 {said}"
    assert missing_said(np.ones(4), np.arange(4.0)) == ""
    assert missing_said(np.full(3, np.nan), np.arange(3.0), "f", "").endswith("the longest run of them 3 from f = 0 on")


def test_the_step_of_a_sensor_is_read_off_whole_multiples() -> None:
    """Spacings of 1, 2 and 3 steps, rounded by the file to 1e-6 m: over all of them better than by the least one."""
    step = 3.0744e-4
    values = np.round(np.cumsum([0, 1, 2, 1, 3, 2, 1, 2, 3, 1]) * step + 0.01, 6)
    assert found_resolution(values) == pytest.approx(step, rel=3e-4)
    assert np.diff(values).min() != pytest.approx(step, rel=1e-3)
    assert resolution(distance_per_turn=-0.072, counts_per_turn=360) == pytest.approx(2e-4)
    with pytest.raises(ValueError, match="not multiples of one step"):
        found_resolution(np.array([0.0, 1.0, 2.4, 3.9]))
