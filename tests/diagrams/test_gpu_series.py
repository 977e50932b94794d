"""The series methods on a GPU without one: Numba's simulator against the processor, the kernel through the compiler.

A run is the same sequence of steps on both devices, however it is cut into launches; so whatever does not stretch small
differences is equal to rounding.
"""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gpu_compiler import compiled, run
from gpu_series_systems import START, TOP, two_wells

import nonsmooth as ns

COMPILER = [importlib.util.find_spec(name) is not None for name in ("numba_cuda", "nvidia")]
pytestmark = pytest.mark.skipif(not COMPILER[0], reason="numba-cuda is not installed (extra `test`, Linux only)")
FOLDER = Path(__file__).parent

SIMULATED = os.environ.get("NUMBA_ENABLE_CUDASIM", "1")  # 0: a real GPU (CONTRIBUTING)
ENTRIES = {"advance", "beside", "measure", "contract", "decide", "separated"}


@pytest.fixture(scope="module")
def simulated() -> dict[str, Any]:
    printed = run([str(FOLDER / "gpu_series_script.py")], NUMBA_ENABLE_CUDASIM=SIMULATED)
    found: dict[str, Any] = json.loads(printed.splitlines()[-1])
    return found


def pair(simulated: dict[str, Any], verb: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    both = simulated["results"][verb]
    return np.array(both["cpu"][name], dtype=float), np.array(both["cuda"][name], dtype=float)


@pytest.mark.parametrize("verb", ["sweep", "memory", "exact", "planar"])
def test_a_sweep_is_that_of_the_processor(simulated: dict[str, Any], verb: str) -> None:
    """The valve on its maxima of the lift; a forced system with steep layers, memory and corners; four linear
    states; two without forcing.
    """
    assert pair(simulated, verb, "period_number")[0].max() > 0
    for name in simulated["results"][verb]["cpu"]:
        cpu, gpu = pair(simulated, verb, name)
        np.testing.assert_allclose(gpu, cpu, rtol=1e-12, atol=1e-12, err_msg=name)


def test_a_forced_planar_system_on_a_surface(simulated: dict[str, Any]) -> None:
    """The planar kernels of a GPU have no such section; the processor's have."""
    assert pair(simulated, "forced", "period_number")[0].max() > 0
    for name in simulated["results"]["forced"]["cpu"]:
        cpu, gpu = pair(simulated, "forced", name)
        np.testing.assert_allclose(gpu, cpu, rtol=1e-9, atol=1e-9, err_msg=name)


def test_the_valve_hits_its_seat(simulated: dict[str, Any]) -> None:
    """At q = 6.5 the orbit has impacts, at q = 8, above the grazing at 7.56, none."""
    contacts = pair(simulated, "sweep", "contacts_per_period")[1]
    assert contacts[0] > 0
    assert contacts[1] == 0


def test_a_run_that_meets_no_section_ends_with_its_status(simulated: dict[str, Any]) -> None:
    status, other = pair(simulated, "at_rest", "status")
    assert status == other == 7
    assert np.isnan(pair(simulated, "at_rest", "section")[1]).all()


def test_a_chart_has_the_labels_and_exponents_of_the_processor(simulated: dict[str, Any]) -> None:
    for name in ("period_number", "status", "crossings_per_period", "contacts_per_period"):
        np.testing.assert_array_equal(*pair(simulated, "chart", name), err_msg=name)
    assert pair(simulated, "chart", "period_number")[0] > 0
    np.testing.assert_allclose(*pair(simulated, "chart", "maximum"), rtol=0, atol=1e-9)
    cpu, gpu = pair(simulated, "chart", "lyapunov")
    assert cpu < 0
    np.testing.assert_allclose(gpu, cpu, atol=1e-6)


def test_basins_have_the_labels_and_attractors_of_the_processor(simulated: dict[str, Any]) -> None:
    labels, other = pair(simulated, "basins", "label")
    np.testing.assert_array_equal(other, labels)
    assert len(np.unique(labels)) == 2  # one attractor in each well
    np.testing.assert_allclose(*pair(simulated, "basins", "section_points"), rtol=0, atol=1e-9)


@pytest.mark.skipif(not COMPILER[1], reason="nvidia-nvvm is not installed (extra `test`, Linux only)")
@pytest.mark.parametrize(
    ("name", "optimised"),
    [
        ("valve", False),
        *(pytest.param(name, True, marks=pytest.mark.slow) for name in ("valve", "two wells", "filtered")),
    ],
)
def test_the_kernels_compile_for_the_types_they_are_launched_with(
    simulated: dict[str, Any], name: str, optimised: bool
) -> None:
    compiled(name, simulated["launched"], optimised)


def test_no_kernel_is_left_out(simulated: dict[str, Any]) -> None:
    assert set(simulated["launched"]) == ENTRIES


def test_what_a_gpu_does_not_take_is_said_at_the_door() -> None:
    valve = ns.models.relief_valve()
    common: dict[str, Any] = {"start": START, "section": TOP, "device": "cuda"}
    with pytest.raises(ValueError, match='method="exact" or method="taylor" with crossings located.*"rkf45"'):
        ns.sweep(valve, "q", [5.0, 6.0], direction=None, method="rkf45", **common)
    with pytest.raises(ValueError, match="locate=False"):
        ns.sweep(valve, "q", [5.0, 6.0], direction=None, method="taylor", locate=False, **common)
    with pytest.raises(ValueError, match="direction=None"):
        ns.sweep(valve, "q", [5.0, 6.0], method="taylor", **common)
    second = ns.Poincare("lift_velocity", rising=False, every=2)
    with pytest.raises(ValueError, match=r"takes every return of a section.*every = 2"):
        ns.sweep(valve, "q", [5.0, 6.0], direction=None, method="taylor", **(common | {"section": second}))
    with pytest.raises(ValueError, match="lyapunov with device.*or chart with lyapunov"):
        ns.lyapunov(two_wells(), parameter="F", values=[0.1, 0.2], direction=None, periods=50, device="cuda")
