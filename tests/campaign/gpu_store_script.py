"""Run in a process with NUMBA_ENABLE_CUDASIM=1, in an empty folder: a study with ``device = "cuda"`` and a store.

Prints one JSON object with what happened.
"""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path
from typing import Any
from unittest import mock

from simple_work import hashes

import nonsmooth as ns
from nonsmooth.campaign import work
from nonsmooth.cli.main import main
from nonsmooth.diagrams import chart as chart_module
from nonsmooth.flow.engines import gpu as planar_cuda

STUDY = """
[system]
model = "discontinuous_support"
parameters = {{ g = -0.0045 }}

[chart]
grid = {{ omega = [3.2, 3.69], rho = [0.15, 0.3] }}
transient = 8
keep = 8
max_period = 2
device = "{device}"
any_cpu = {any_cpu}

[output]
store = "{store}.zarr"
data = "{device}.nc"
"""
launches = 0
plain_launch = planar_cuda.PlanarOnGpu.launch


def launch(*arguments: Any) -> None:
    global launches
    launches += 1
    plain_launch(*arguments)


mock.patch.object(planar_cuda.PlanarOnGpu, "launch", launch).start()  # counts what is really computed
chart_module.BATCH = 2  # so that the four points make two chunks
PATH = Path("cuda.zarr")


def command(*words: str) -> dict[str, Any]:
    before = launches
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        code = main(list(words))
    return {"code": code, "out": out.getvalue(), "err": err.getvalue(), "launches": launches - before}


def study(device: str, store: str, any_cpu: bool = False) -> dict[str, Any]:
    file = Path("study.toml")
    file.write_text(STUDY.format(device=device, store=store, any_cpu=str(any_cpu).lower()), encoding="utf-8")
    return command("run", str(file), "--quiet")


found: dict[str, Any] = {"first": study("cuda", "cuda")}
before = hashes(PATH)
found["again"] = study("cuda", "cuda")
mark = PATH / "run" / "000001.json"
found["mark"] = json.loads(mark.read_text())
mark.unlink()
found["one lost"] = study("cuda", "cuda")
found["same files"] = hashes(PATH) == before
found["show"] = command("show", "cuda.zarr")
found["plan"] = command("plan", "study.toml", "--seconds", "0.01")
found["processor"] = study("cpu", "cpu")
found["gpu's store, processor"] = study("cpu", "cuda", any_cpu=True)
found["processor's store, gpu"] = study("cuda", "cpu", any_cpu=True)
mock.patch.object(work, "gpu_type", return_value="another").start()  # as on a machine with another GPU
found["another gpu"] = study("cuda", "cuda")
found["any"] = study("cuda", "cuda", any_cpu=True)
cpu, cuda = ns.load("cpu.nc"), ns.load("cuda.nc")
names = ("period_number", "status", "contacts_per_period", "maximum")
found["results"] = {name: [cpu[name].values.tolist(), cuda[name].values.tolist()] for name in names}
print(json.dumps(found))
