"""A chart with ``device="cuda"`` in a store, through study files; Numba's simulator stands for the GPU."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("numba_cuda") is None, reason="numba-cuda is not installed (extra `test`, Linux only)"
)
HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    environment = os.environ | {
        "NUMBA_ENABLE_CUDASIM": "1",
        "PYTHONPATH": os.pathsep.join([str(HERE), *filter(None, sys.path)]),
    }
    done = subprocess.run(
        [sys.executable, str(HERE / "gpu_store_script.py")],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path_factory.mktemp("gpu"),
    )
    assert done.returncode == 0, done.stderr[-3000:]
    facts: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return facts


def test_what_is_in_the_store_is_not_computed_again(found: dict[str, Any]) -> None:
    assert found["first"]["code"] == 0
    assert found["first"]["launches"] > 0
    assert found["again"] | {"out": ""} == {"code": 0, "out": "", "err": "", "launches": 0}
    assert 0 < found["one lost"]["launches"] < found["first"]["launches"]
    assert found["same files"]


def test_the_stores_facts_are_those_of_the_gpu(found: dict[str, Any]) -> None:
    assert found["mark"]["cpu"].startswith("Numba's CUDA simulator")
    assert found["mark"]["seconds"] > 0
    assert "s of a GPU, on a processor of type Numba's CUDA simulator" in found["show"]["out"]
    assert "2 of 2 chunks are there" in found["show"]["out"]


def test_a_plan_measures_a_sample_on_the_gpu(found: dict[str, Any]) -> None:
    assert found["plan"]["launches"] > 0
    lines = {line.split()[0]: line for line in found["plan"]["out"].splitlines()}
    assert "of one core" in lines["work"]
    assert lines["gpu"].endswith("s on Numba's CUDA simulator (all 4 points were run)")


def test_results_are_the_processors(found: dict[str, Any]) -> None:
    assert found["processor"]["code"] == 0
    assert found["processor"]["launches"] == 0
    for name, (cpu, cuda) in found["results"].items():
        np.testing.assert_allclose(cuda, cpu, rtol=0, atol=1e-9 if name == "maximum" else 0, err_msg=name)


def test_chunks_of_a_gpu_and_of_a_processor_never_share_a_store(found: dict[str, Any]) -> None:
    """Not even with any_cpu."""
    for which in ("gpu's store, processor", "processor's store, gpu"):
        assert found[which]["code"] != 0
        assert "is the store of another work: its options differ in device" in found[which]["err"]
        assert found[which]["launches"] == 0


def test_another_type_of_gpu_is_refused_unless_asked(found: dict[str, Any]) -> None:
    assert found["another gpu"]["code"] != 0
    assert "was begun on a processor of type \"Numba's CUDA simulator" in found["another gpu"]["err"]
    assert "any_cpu=True" in found["another gpu"]["err"]
    assert found["any"]["code"] == 0
