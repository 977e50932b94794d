"""``nonsmooth plan``: a line for the GPU that is a number only where one was measured."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from nonsmooth.cli.main import main

STUDY = """
[system]
model = "{model}"

[chart]
grid = {grid}
transient = 10
keep = 8
max_period = 3
{more}
"""
PAPER = ("discontinuous_support", "{ omega = [3.0, 4.0], rho = [0.1, 0.2] }")


@pytest.fixture
def planned(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    def lines(model: str, grid: str, more: str) -> dict[str, str]:
        file = tmp_path / "chart.toml"
        file.write_text(STUDY.format(model=model, grid=grid, more=more), encoding="utf-8")
        assert main(["plan", str(file), "--seconds", "0.01"]) == 0
        return {line.split()[0]: line for line in capsys.readouterr().out.splitlines()}

    return lines


@pytest.mark.parametrize("device", ["cpu", "cuda"])
def test_without_the_package_it_says_so(planned: Any, monkeypatch: pytest.MonkeyPatch, device: str) -> None:
    """Also for a study that is to run on a GPU elsewhere."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    found = planned(*PAPER, f'device = "{device}"')
    assert "of one core" in found["work"]
    assert found["gpu"].startswith("gpu         not measured, so no estimate: ")
    assert 'pip install ".[cuda]"' in found["gpu"]


def test_a_chart_that_no_gpu_takes(planned: Any) -> None:
    found = planned(*PAPER, 'method = "rkf45"')
    assert 'not measured, so no estimate: chart with device="cuda" ' in found["gpu"]
