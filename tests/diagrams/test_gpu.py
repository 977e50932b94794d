"""``device="cuda"`` without a GPU: Numba's simulator against the processor, and every kernel through the compiler.

The simulator accepts what the compiler refuses, and the compiler does not run anything: both are asked. The argument
types that are compiled are those with which the simulated run launched the kernels.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gpu_compiler import compiled, run

import nonsmooth as ns

COMPILER = [importlib.util.find_spec(name) is not None for name in ("numba_cuda", "nvidia")]
pytestmark = pytest.mark.skipif(not COMPILER[0], reason="numba-cuda is not installed (extra `test`, Linux only)")
SCRIPT = Path(__file__).with_name("gpu_script.py")
SIMULATED = os.environ.get("NUMBA_ENABLE_CUDASIM", "1")  # 0: a real GPU (CONTRIBUTING)

ENTRIES = {"tabulate", "beside", "measure", "decide", "frames", "advance", "neighbours"}
LONG = {"frames", "neighbours"}  # the loop of ``advance`` again, with other observers: 34 s of a processor


@pytest.fixture(scope="module")
def simulated() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(run([str(SCRIPT)], NUMBA_ENABLE_CUDASIM=SIMULATED).splitlines()[-1])
    return found


def pair(simulated: dict[str, Any], verb: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    both = simulated["results"][verb]
    return np.array(both["cpu"][name]), np.array(both["cuda"][name])


@pytest.mark.parametrize("verb", ["chart", "every_period", "stop", "sliding", "carried"])
def test_a_chart_has_the_labels_and_extremes_of_the_processor(simulated: dict[str, Any], verb: str) -> None:
    for name in ("period_number", "status", "crossings_per_period", "contacts_per_period"):
        np.testing.assert_array_equal(*pair(simulated, verb, name), err_msg=name)
    if verb != "every_period":
        cpu, gpu = pair(simulated, verb, "maximum")
        periodic = pair(simulated, verb, "period_number")[0] > 0
        assert periodic.any()
        np.testing.assert_allclose(gpu[periodic], cpu[periodic], rtol=0, atol=1e-9)


def test_starts_beyond_a_stop_fail_as_they_do_on_the_processor(simulated: dict[str, Any]) -> None:
    status, other = pair(simulated, "stop", "status")
    assert len(set(status.ravel().tolist())) > 1
    np.testing.assert_array_equal(status, other)


def test_a_chart_has_the_exponents_of_the_processor(simulated: dict[str, Any]) -> None:
    cpu, gpu = pair(simulated, "chart", "lyapunov")
    assert np.isfinite(cpu).all()
    np.testing.assert_allclose(gpu, cpu, atol=1e-6)


def test_basins_have_the_labels_and_attractors_of_the_processor(simulated: dict[str, Any]) -> None:
    np.testing.assert_array_equal(*pair(simulated, "basins", "label"))
    assert pair(simulated, "basins", "label")[0].max() > 0
    np.testing.assert_allclose(*pair(simulated, "basins", "section_points"), rtol=0, atol=1e-9)


def test_basin_fractions_are_those_of_the_processor(simulated: dict[str, Any]) -> None:
    for name in ("fraction", "fraction_error", "period_number", "not_converged", "diverged", "n_starts_99"):
        np.testing.assert_array_equal(*pair(simulated, "basin_fractions", name), err_msg=name)
    assert (pair(simulated, "basin_fractions", "fraction")[0] > 0).sum() == 3  # one attractor, then two
    for name in ("section", "maximum", "minimum"):
        np.testing.assert_allclose(*pair(simulated, "basin_fractions", name), rtol=0, atol=1e-9, err_msg=name)


def test_a_sweep_has_the_periodic_points_of_the_processor(simulated: dict[str, Any]) -> None:
    np.testing.assert_array_equal(*pair(simulated, "sweep", "period_number"))
    np.testing.assert_array_equal(*pair(simulated, "sweep", "status"))
    cpu, gpu = pair(simulated, "sweep", "section")
    periodic = pair(simulated, "sweep", "period_number")[0] > 0
    assert periodic.any()
    np.testing.assert_allclose(gpu[periodic], cpu[periodic], rtol=0, atol=1e-9)
    for name in ("maximum", "minimum", "clearance", "contact_force_maximum"):
        a, b = pair(simulated, "sweep", name)
        np.testing.assert_allclose(b[periodic], a[periodic], rtol=1e-9, atol=1e-9, err_msg=name)


def test_spectra_are_those_of_the_processor(simulated: dict[str, Any]) -> None:
    for name in ("exponents", "standard_error", "kaplan_yorke", "trace_defect"):
        np.testing.assert_allclose(*pair(simulated, "lyapunov", name), rtol=1e-9, atol=1e-11, err_msg=name)


@pytest.mark.skipif(not COMPILER[1], reason="nvidia-nvvm is not installed (extra `test`, Linux only)")
@pytest.mark.parametrize(
    ("entries", "optimised"),
    [(ENTRIES - LONG, False), pytest.param(ENTRIES, True, marks=pytest.mark.slow)],
    ids=["most", "all optimised"],
)
def test_every_kernel_compiles_for_the_types_it_is_launched_with(
    simulated: dict[str, Any], entries: set[str], optimised: bool
) -> None:
    compiled("linear", {name: simulated["launched"][name] for name in sorted(entries)}, optimised)


@pytest.mark.slow
def test_the_benchmark_compares_both_devices() -> None:
    code = "import gpu, gpu_valve as v; v.TRANSIENT, v.KEEP = 6, 4; print(*gpu.compared('Fig. 9', 3), *v.compared(2))"
    paths = os.pathsep.join([*sys.path, str(SCRIPT.parents[2] / "benchmarks")])
    chart, valve, _ = run(["-c", code], NUMBA_ENABLE_CUDASIM="1", PYTHONPATH=paths).split("- ")[1:]
    assert "0.000% of the labels differ" in chart
    assert "9 periodic points" in chart
    assert "0.000% of the labels differ" in valve


def test_tables_are_built_once_for_each_point(simulated: dict[str, Any]) -> None:
    """Four points of a chart and of its exponents, three of a sweep, two of spectra; whatever launches and starts."""
    built = {verb: simulated["results"][verb]["built"] for verb in ("chart", "every_period", "sweep", "lyapunov")}
    assert built == {"chart": 8, "every_period": 2, "sweep": 3, "lyapunov": 2}


def test_no_kernel_is_left_out(simulated: dict[str, Any]) -> None:
    assert set(simulated["launched"]) == ENTRIES


PLANE = {"omega": [3.2, 3.69], "rho": [0.15, 0.3]}


def test_what_a_gpu_does_not_take_is_said_at_the_door() -> None:
    oscillator = ns.models.discontinuous_support()
    with pytest.raises(ValueError, match="device = 'gpu'; allowed: 'cpu', 'cuda'"):
        ns.chart(oscillator, PLANE, device="gpu")
    with pytest.raises(ValueError, match="direction=None"):
        ns.sweep(oscillator, "rho", [0.1, 0.2], device="cuda")
    with pytest.raises(ValueError, match='asks for method="rkf45"'):
        ns.chart(oscillator, PLANE, method="rkf45", device="cuda")
    with pytest.raises(ValueError, match='basin_fractions with device="cuda".*method="rkf45"'):
        ns.basin_fractions(oscillator, "rho", [0.1, 0.2], box={"x": (0.0, 0.1)}, method="rkf45", device="cuda")


def test_without_the_package_the_door_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r'pip install "\.\[cuda\]"'):
        ns.sweep(ns.models.discontinuous_support(), "rho", [0.1, 0.2], direction=None, device="cuda")


def test_threads_and_clusters_are_those_of_the_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_ENABLE_CUDASIM", "1")
    with pytest.raises(ValueError, match="leave threads out"):
        ns.chart(ns.models.discontinuous_support(), PLANE, device="cuda", threads=2)
    with pytest.raises(ValueError, match="leave client out"):
        ns.chart(ns.models.discontinuous_support(), PLANE, device="cuda", client=object())
    with pytest.raises(ValueError, match="leave threads out"):
        ns.basin_fractions(
            ns.models.discontinuous_support(), "rho", [0.1], box={"x": (0.0, 0.1)}, device="cuda", threads=2
        )
    with pytest.raises(ValueError, match="a single trajectory is one thread"):
        ns.lyapunov(ns.models.discontinuous_support(), device="cuda")


def test_a_machine_without_a_gpu_says_so() -> None:
    """In a process that is shown none, so that it holds where there is one too."""
    code = (
        "import nonsmooth as ns\n"
        "ns.chart(ns.models.discontinuous_support(), {'omega': [3.0, 4.0], 'rho': [0.1, 0.2]}, device='cuda')"
    )
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_ENABLE_CUDASIM"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment | {"CUDA_VISIBLE_DEVICES": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert re.search('RuntimeError: .*found no GPU on this machine.*use device="cpu"', done.stderr), done.stderr
