"""Runs that a table numbers: each with its own clock, in the order of the file."""

from __future__ import annotations

from pathlib import Path

import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def test_each_run_has_a_clock_of_its_own_in_the_order_of_the_file(tmp_path: Path) -> None:
    """Runs 2 and 1 at 10 Hz: times 0, 0.1, ... in both; a blank field takes its instant with it."""
    path = tmp_path / "runs.csv"
    path.write_text("run,x (m),y (m)\n2,1.0,5.0\n2,2.0,6.0\n2,3.0,7.0\n1,4.0,\n1,5.0,8.0\n", encoding="utf-8")
    recording = ns.load_recording(path, rate=10.0, columns={"run": "run", "x": "x (m)", "y": "y (m)"})
    assert recording.runs == ("Run #2", "Run #1")
    expected = {"Run #2": {"x": [1, 2, 3], "y": [5, 6, 7]}, "Run #1": {"x": [4, 5], "y": [8]}}
    times = {"Run #2": {"x": [0, 0.1, 0.2], "y": [0, 0.1, 0.2]}, "Run #1": {"x": [0, 0.1], "y": [0.1]}}
    for run, channels in expected.items():
        for name, values in channels.items():
            found = recording.channel(name, run)
            assert found.values.tolist() == values
            assert found["time"].values == pytest.approx(times[run][name], abs=1e-15)


def test_counters_and_clocks_of_runs_whose_rows_alternate(tmp_path: Path) -> None:
    """Two boards write in turn: neighbouring samples are those of one board, and each has its own rate."""
    counts = {1: [100 + 9000 * k for k in range(40)], 2: [60000 - 7000 * k for k in range(40)]}
    ticks = {1: [20 * k for k in range(40)], 2: [250 + 20 * k for k in range(40)]}
    rows = [f"{n},{ticks[n][k] % 256},{counts[n][k] % 65536}" for k in range(40) for n in counts]
    path = tmp_path / "boards.csv"
    path.write_text("board,tick (ms),angle\n" + "\n".join(rows) + "\n", encoding="utf-8")
    columns = {"run": "board", "time": "tick (ms)", "angle": "angle"}
    recording = ns.load_recording(path, columns=columns, wraps={"angle": 65536, "time": 256})
    at_rate = ns.load_recording(path, columns={"run": "board", "angle": "angle"}, rate=50.0, wraps={"angle": 65536})
    for n, values in counts.items():
        for found in (recording.channel("angle", f"Run #{n}"), at_rate.channel("angle", f"Run #{n}")):
            assert found.values.tolist() == values
        assert recording.channel("angle", f"Run #{n}")["time"].values == pytest.approx([t * 1e-3 for t in ticks[n]])
        assert at_rate.channel("angle", f"Run #{n}")["time"].values == pytest.approx([k / 50 for k in range(40)])
