"""Functions passed as addresses: the same legs with and without a compiler, and nothing compiled twice."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

from nonsmooth.kernels.compile.cache import compiled
from nonsmooth.kernels.compile.folder import cache_folder
from nonsmooth.kernels.tangent.legs import cross, march_legs

SCRIPT = """
import json
import numpy as np
import pytest
import nonsmooth as ns
from nonsmooth import kernels
from nonsmooth.flow.variational import VariationalFlow

compiled = []
kernels.before_compiling.append(compiled.append)
def field(stiffness):
    return lambda t, u, p: (u.v, p.rho * np.cos(t) - u.x**3 - stiffness * (u.x + 0.0045))

system = ns.System(  # not linear: of these the equations are compiled
    states=["x", "v"], parameters={"rho": 0.3}, modes={"free": field(0.0), "contact": field(50.0)},
    indicators={"depth": lambda t, u, p: u.x + 0.0045},
    transitions=[
        ns.Transition("free", "contact", when="depth > 0"), ns.Transition("contact", "free", when="depth < 0"),
    ],
)
flow = VariationalFlow.of(system, ("rho",))
values = system.parameter_vector()
legs = flow.segments(values, [0, 1], [0.1, 0.4], [0.3, 0.02], [[-0.006, 0.03], [-0.0045, 0.04]])
jump = flow.jump(values, 0, 0.3, [-0.0045, 0.04])
numbers = [*legs.z.ravel(), *legs.Phi.ravel(), *legs.P.ravel(), *jump.saltation.ravel(), *jump.fields[1]]
print(json.dumps([numbers, len(compiled)]))
"""


def run(folder, **environment):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "NONSMOOTH_CACHE_DIR": str(folder), **environment},
    )
    numbers, compiles = json.loads(done.stdout.splitlines()[-1])
    return np.array(numbers), compiles


@pytest.mark.slow
def test_addresses(tmp_path) -> None:
    for kernel in (march_legs, cross):  # what is new in this cache are the model's functions
        entry = cache_folder() / "compiled" / compiled(kernel).entry()
        if entry.exists():  # else it has come with the package
            (tmp_path / "compiled").mkdir(mode=0o700, exist_ok=True)
            shutil.copy(entry, tmp_path / "compiled")
    first, compiles = run(tmp_path)
    second, compiles_again = run(tmp_path)
    plain, nothing = run(tmp_path, NUMBA_DISABLE_JIT="1")
    assert compiles > 0 and compiles_again == nothing == 0
    assert np.array_equal(first, second)
    assert np.abs(plain - first).max() < 1e-12 * np.abs(first).max()
