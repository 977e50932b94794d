"""Synthetic results, built through the schema, whose every number is known in closed form."""

from __future__ import annotations

import gc
import os

os.environ.setdefault("MPLBACKEND", "Agg")

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from nonsmooth.results import schema
from nonsmooth.results.labels import Labels, QuantityLabel, by_name
from nonsmooth.results.provenance import provenance

# What is one worker's in one piece (`ByFile`) and takes long comes first, so that no worker waits for it in the end.
FIRST = ("../studies/savi2007/tests/test_savi2007_global.py", "explorer/test_page.py")
GAP = 0.5
JUMP_UP, JUMP_DOWN = 5.9, 5.2


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    folder = Path(__file__).parent
    rank = {(folder / name).resolve(): i for i, name in enumerate(FIRST)}
    assert all(path.is_file() for path in rank), "a file of FIRST has been moved"
    items.sort(key=lambda item: rank.get(item.path, len(FIRST)))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Any:
    """Collect without looking for garbage (a quarter of the time): all of it stays, and is not looked through later;
    and rarely then (2 % of what is left)."""
    gc.disable()
    found = yield
    gc.enable()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
    return found


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """A file is one worker's, and so are all that share the quick reproduction (20 s), and a server and a browser."""
    from xdist.scheduler import LoadFileScheduling

    class ByFile(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            shared = (name for name in ("tests/test_savi2007", "tests/explorer/") if name in file)
            return next(shared, file)

    return ByFile(config, log) if config.getvalue("dist") == "loadfile" else None


@pytest.fixture(scope="session")
def labels() -> Labels:
    return Labels(
        name="oscillator",
        states={"x": QuantityLabel("m"), "v": QuantityLabel("m/s", r"\dot x")},
        parameters={
            "rho": QuantityLabel("N", r"\rho", 0.3),
            "omega": QuantityLabel("rad/s", r"\omega", 1.0),
            "g": QuantityLabel("m", "g", GAP),
        },
        modes=("free", "contact"),
        transitions=((0, 1), (1, 0)),
        indicators=("penetration", "separation"),
        outputs={"contact_force": QuantityLabel("N")},
        text="the system as text",
    )


@pytest.fixture
def trajectory(labels: Labels) -> xr.Dataset:
    """x = cos t, v = -sin t over two turns, "contact" where x > GAP; each crossing stands twice."""
    first = np.arccos(GAP)
    turns = 2 * np.pi * np.arange(3)
    crossing = np.sort(np.concatenate([turns + first, turns - first]))
    crossing = crossing[(crossing > 0) & (crossing < 4 * np.pi)]
    time = np.sort(np.concatenate([np.linspace(0, 4 * np.pi, 401), crossing, crossing]))
    segment = np.searchsorted(crossing, time, side="left")
    for k, instant in enumerate(crossing):
        segment[np.flatnonzero(time == instant)[-1]] = k + 1
    mode = 1 - segment % 2  # the run begins inside contact
    state = np.stack([np.cos(time), -np.sin(time)], axis=1)
    at = np.stack([np.cos(crossing), -np.sin(crossing)], axis=1)
    return schema.trajectory(
        labels,
        provenance(labels, "simulate", {"periods": 2}, method="exact"),
        time=time,
        u=state,
        mode=mode,
        segment=segment,
        crossing_time=crossing,
        crossing_transition=1 - np.arange(len(crossing)) % 2,
        u_before=at,
        u_after=at,
        touch_time=np.empty(0),
        touch_indicator=np.empty(0),
        touch_u=np.empty((0, 2)),
        touch_clearance=np.empty(0),
        outputs=np.maximum(state[:, :1] - GAP, 0),
    )


def sweep_arrays(directions: int, starts: int, points: int, keep: int = 4) -> dict[str, np.ndarray]:
    """Every entry holds its own indices, so that a transposed dim shows: 1000 d + 100 s + point + iterate / 10."""
    lead = (directions, starts, points)
    d, s, p = np.meshgrid(*(np.arange(k) for k in lead), indexing="ij")
    base = 1000.0 * d + 100.0 * s + p
    iterate = np.arange(keep) / 10
    section = np.stack([base[..., None] + iterate, -(base[..., None] + iterate)], axis=-1)
    status = np.full(lead, by_name("ok").code)
    status[..., -1] = by_name("diverged").code
    section[..., -1, :, :] = np.nan
    return {
        "section": section,
        "maximum": section.max(axis=-2),
        "minimum": section.min(axis=-2),
        "period_number": np.ones(lead, dtype=int),
        "residual": np.zeros(lead),
        "crossings_per_period": 2 * np.ones(lead),
        "contacts_per_period": np.ones(lead),
        "clearance": np.stack([base, -base], axis=-1),
        "status": status,
        "output_maximum": base[..., None] + 0.5,
        "output_minimum": base[..., None] - 0.5,
    }


@pytest.fixture
def swept(labels: Labels) -> xr.Dataset:
    """A sweep of rho both ways over five values, from one start; the last point diverged."""
    return schema.sweep(
        labels,
        provenance(labels, "sweep", {"parameter": "rho", "direction": "both"}, method="exact"),
        "rho",
        np.linspace(0.2, 0.4, 5),
        sweep_arrays(2, 1, 5),
        directions=("up", "down"),
        starts=np.zeros((1, 2)),
        squeeze=("start",),
    )


@pytest.fixture
def responded(labels: Labels) -> xr.Dataset:
    """A triangular resonance that drops at JUMP_UP going up and at JUMP_DOWN coming down."""
    omega = np.linspace(3, 7, 81)
    low, high = np.full_like(omega, 0.01), 0.01 * omega
    amplitude = np.stack([np.where(omega <= JUMP_UP, high, low), np.where(omega < JUMP_DOWN, high, low)])
    arrays = sweep_arrays(2, 1, 81)
    x = amplitude[:, None, :, None] * np.array([1.0, 2.0])
    base = schema.sweep(
        labels,
        provenance(labels, "frequency_response", {}, method="exact"),
        "omega",
        omega,
        arrays | {"maximum": x, "minimum": -x},
        directions=("up", "down"),
        starts=np.zeros((1, 2)),
        squeeze=("start",),
    )
    sides = {"variable": "x", "start": 0, "step": 0.05, "before": 0.05, "after": 0.01}
    jumps = [{"value": JUMP_UP, "direction": "up", **sides}, {"value": JUMP_DOWN, "direction": "down", **sides}]
    return schema.response(base, jumps)


@pytest.fixture
def points(labels: Labels) -> xr.Dataset:
    """Ten points of a section on the unit circle, from two starts."""
    angle = np.linspace(0, 1, 20).reshape(2, 10)
    return schema.section_points(
        labels,
        provenance(labels, "poincare", {"n": 10}, method="exact"),
        section=np.stack([np.cos(angle), np.sin(angle)], axis=-1),
        time=angle,
        mode=np.zeros((2, 10)),
        status=np.zeros(2),
        starts=np.zeros((2, 2)),
    )
