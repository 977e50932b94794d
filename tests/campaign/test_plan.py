"""The plan of a chart against the truth: processor time, bytes of the store, memory, each within 30 %."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from simple_work import Squares

from nonsmooth.campaign.plan import plan

STUDY = """
[system]
model = "discontinuous_support"
parameters = {{ {parameters} }}

[chart]
grid = {{ {x} = {{ from = {x0}, to = {x1}, n = {n} }}, {y} = {{ from = {y0}, to = {y1}, n = {n} }} }}
extremes = false
threads = 2

[output]
store = "chart.zarr"
"""
PLANES = {
    "omega, rho": {"parameters": "g = 0.02", "x": "omega", "x0": 3.0, "x1": 7.0, "y": "rho", "y0": 0.1, "y1": 0.3},
    "g, rho": {
        "parameters": "omega = 11.15",
        "x": "g",
        "x0": -0.0015,
        "x1": 0.002,
        "y": "rho",
        "y0": 0.2,
        "y1": 0.5,
    },
}
PLAN = """
import json, sys, h5netcdf, xarray
from pathlib import Path
from nonsmooth.diagrams.chart import plan_chart
from nonsmooth.campaign.work import STORED
from nonsmooth.campaign.plan import plan
from nonsmooth.cli.study import read_study
study = read_study(Path(sys.argv[1]))
given = {name: value for name, value in study.options.items() if name != "threads"}
found = plan(plan_chart(study.system, **given).work, kept=STORED)
print(json.dumps([found.core_seconds, found.stored_bytes, found.memory_bytes, found.error]))
"""
RUN = """
import json, resource, sys
from nonsmooth.cli.main import main
assert main(["run", sys.argv[1], "--quiet"]) == 0
used = resource.getrusage(resource.RUSAGE_SELF)
print(json.dumps([used.ru_utime + used.ru_stime, 0, used.ru_maxrss * 1024]))
"""


def numbers(program: str, study: Path) -> list[float]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", program, str(study)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: list[float] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("n", [512, 1000])
@pytest.mark.parametrize("plane", PLANES)
def test_the_plan_of_a_chart(plane: str, n: int, tmp_path: Path) -> None:
    study = tmp_path / "chart.toml"
    study.write_text(STUDY.format(**PLANES[plane], n=n), encoding="utf-8")
    planned, true = numbers(PLAN, study), numbers(RUN, study)
    true[1] = sum(file.stat().st_size for file in (tmp_path / "chart.zarr").rglob("*") if file.is_file())
    for what, unit, a, b in zip(("processor", "store", "memory"), (1, 1e6, 1e6), planned, true, strict=False):
        print(f"{plane:<11} {n:>4}^2  {what:<10} plan {a / unit:9.4g}  truth {b / unit:9.4g}  ratio {a / b:.3f}")
    for a, b in zip(planned[:3], true, strict=True):
        assert abs(a / b - 1) <= 0.3


def test_the_error_of_a_plan_is_that_of_a_sample_without_replacement(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard error of a total from k of n chunks of equal size: N s sqrt((1 - k/n) / k)."""
    clock, took = [0.0], []

    class Counted(Squares):
        def compute(self, chunk: int) -> dict[str, Any]:
            took.append(1.0 + chunk % 5)
            clock[0] += took[-1] * self.step
            return super().compute(chunk)

    monkeypatch.setattr(time, "thread_time", lambda: clock[0])
    work = Counted(size=280)
    found = plan(work, seconds=150.0)
    times = took[1:]  # the first runs before the clock
    assert 3 <= found.sampled == len(times) < work.n_chunks() == 40
    assert found.core_seconds == pytest.approx(280 * statistics.mean(times))
    expected = 280 * statistics.stdev(times) * ((1 - len(times) / 40) / len(times)) ** 0.5
    assert found.error == pytest.approx(expected)
