"""Charts, basins and shares reject wrong input before memory or time is spent."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.results import memory

QUIET = {"progress": False}
SUPPORT = ns.models.discontinuous_support()
PLANE = {"omega": [9.0, 10.0], "rho": [0.2, 0.3]}
MANY = np.linspace(9.0, 10.0, 10**5)


@pytest.mark.parametrize(
    "call",
    [
        lambda: ns.chart(SUPPORT, {"omega": MANY, "rho": MANY}, **QUIET),
        lambda: ns.basins(SUPPORT, {"x": MANY, "v": MANY}, **QUIET),
        lambda: ns.basin_fractions(SUPPORT, "omega", MANY, n_starts=10**5, box={"x": (0.0, 1.0)}, **QUIET),
        lambda: ns.sweep(SUPPORT, "omega", MANY, keep=10**4, **QUIET),
        lambda: ns.sweep(SUPPORT, "omega", MANY, density={"x": (0, 1), "v": (0, 1)}, bins=10**4, **QUIET),
    ],
)
def test_memory_is_asked_for_before_it_is_taken(call: Callable[[], Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "free_memory", lambda: 10**9)
    with pytest.raises(MemoryError, match="GiB are free"):
        call()


def test_free_memory_is_that_of_the_machine_or_the_container(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    facts = tmp_path / "meminfo"
    facts.write_text("MemTotal: 4000 kB\nMemAvailable: 3000 kB\n")
    monkeypatch.setattr(memory, "FACTS", facts)
    monkeypatch.setattr(memory, "LIMITS", tmp_path)
    assert memory.free_memory() == 3000 * 1024
    (tmp_path / "memory.max").write_text("2000000\n")
    (tmp_path / "memory.current").write_text("500000\n")
    assert memory.free_memory() == 1500000
    (tmp_path / "memory.stat").write_text("file 600000\nactive_file 100000\ninactive_file 400000\n")
    assert memory.free_memory() == 1900000  # files that were read are dropped when memory is needed
    (tmp_path / "memory.max").write_text("max\n")
    assert memory.free_memory() == 3000 * 1024
    memory.room_for(3000 * 1024, "this", "take less")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stop_early": "no"}, "allowed: True, False"),
        ({"extremes": "no"}, "allowed: True, False"),
        ({"refine": "yes"}, "refine must be True, False or a real number, not 'yes'"),
        ({"store": 3}, "store = 3"),
    ],
)
def test_words_are_no_switches(options: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        ns.chart(SUPPORT, PLANE, transient=20, keep=20, **options, **QUIET)


def test_numpy_switches_are_taken() -> None:
    plane = ns.chart(
        SUPPORT,
        PLANE,
        transient=20,
        keep=20,
        stop_early=np.False_,
        extremes=np.True_,
        lyapunov=np.False_,
        refine=np.False_,
        **QUIET,
    )
    assert "lyapunov" not in plane and "computed" not in plane


def test_ends_of_a_box_are_numbers() -> None:
    with pytest.raises(TypeError, match="real number"):
        ns.basin_fractions(SUPPORT, "omega", [9.0], box={"x": ("0", "1")}, n_starts=3, **QUIET)
