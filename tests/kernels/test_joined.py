"""Kernel files that are joined into one module share one space of names."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from nonsmooth.kernels.compile import assembly
from nonsmooth.kernels.compile.assembly import PLACES
from nonsmooth.kernels.cuda import module as cuda_module

ROOM = "nonsmooth.kernels."
FOLDER = Path(cuda_module.__file__).parents[1]
TEXTS = {
    "linear": (*assembly.LINEAR_STEPPER, *assembly.LINEAR_OBSERVERS),
    **{f"cuda {name}": (*assembly.LINEAR_STEPPER, *parts) for name, parts in cuda_module.OBSERVERS.items()},
    "series": (*assembly.SERIES_STEPPER, *assembly.SERIES_OBSERVERS),
    "cuda series": cuda_module.SERIES,
}
MARKERS = {"device", "inline", "kernel", "callback", "local", "once"}  # another compiler's on a GPU
ON_PURPOSE = MARKERS | {"build", "may_pause"}  # replaced on a GPU
SWAPPED = {*PLACES, "series.generated"}  # for the stepper that is joined
PLAIN = """
import json
import numpy as np
import nonsmooth as ns

found = []
for n, method in ((1, "auto"), (2, "auto"), (1, "taylor"), (1, "rkf45")):
    wall = {"wall": ns.elements.Stop(at="q", position=0.0, restitution=0.5)}
    system = ns.mechanical(np.eye(n), np.zeros((n, n)), np.eye(n), coordinates=["q", "r"][:n], elements=wall)
    run = ns.simulate(system, start={"q": -1.0}, duration=4.0, samples=9, method=method)
    found.append([run["time"].values.tolist(), run["u"].values[:, 0].tolist()])
curved = ns.System(states=["x"], parameters={"k": 1.0}, modes={"one": lambda t, u, p: (-p.k * u.x**2,)})
seen = ns.sensitivity(curved, duration=0.5, start={"x": 2.0}, parameters=["k"])
print(json.dumps([found, [seen["Phi"].values.item(), seen["P"].values.item()]]))
"""


@cache
def names(file: str) -> dict[str, str]:
    """Return the origin of each name of a kernel file."""
    found: dict[str, str] = {}
    for node in ast.parse((FOLDER / f"{file.replace('.', '/')}.py").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found[node.name] = file
        elif isinstance(node, ast.Assign):
            targets = [one for target in node.targets for one in ast.walk(target) if isinstance(one, ast.Name)]
            found |= {one.id: file for one in targets}
        elif isinstance(node, ast.ImportFrom) and str(node.module).startswith(ROOM):
            origin = str(node.module).removeprefix(ROOM)
            if (FOLDER / origin.replace(".", "/")).is_dir():
                found |= {one.asname or one.name: f"{origin}.{one.name}" for one in node.names}
            else:
                found |= {one.asname or one.name: names(origin).get(one.name, origin) for one in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {one.asname or one.name: str(node.module) for one in node.names}
    return found


@pytest.mark.parametrize("text", TEXTS)
def test_a_name_means_one_thing_in_a_joined_text(text: str) -> None:
    origins: dict[str, set[str]] = {}
    for file in TEXTS[text]:
        for name, origin in names(file).items():
            foreign = origin in SWAPPED and origin not in TEXTS[text]
            if name not in ON_PURPOSE and not foreign and not re.fullmatch(r"_[if]\d?", name):
                origins.setdefault(name, set()).add(origin)
    assert {name: sorted(files) for name, files in origins.items() if len(files) > 1} == {}


def test_the_texts_run_as_plain_python() -> None:
    """As a debugger wants them: from q = -1 a mass comes to its stop at pi / 2, and leaves it with half the speed.

    x' = -k x^2 has x = 2 / (1 + 2 k t) from 2, with the derivatives (1 + 2 k t)^-2 and -4 t (1 + 2 k t)^-2."""
    plain = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", PLAIN], capture_output=True, text=True, check=True, env=plain)
    runs, derivatives = json.loads(done.stdout)
    np.testing.assert_allclose(derivatives, [0.25, -0.5], rtol=1e-12)
    for time, q in map(np.array, runs):
        fallen = np.where(time < np.pi / 2, -np.cos(time), 0.5 * np.cos(time))
        np.testing.assert_allclose(q, fallen, atol=1e-8)
