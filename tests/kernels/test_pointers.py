"""Functions passed as addresses: the same legs with and without a compiler, and nothing compiled twice."""

import json
import os
import subprocess
import sys

import numpy as np

SCRIPT = """
import json
import numpy as np
import nonsmooth as ns
from nonsmooth import kernels
from nonsmooth.flow.variational import VariationalFlow

compiled = []
kernels.before_compiling.append(compiled.append)
system = ns.models.discontinuous_support()
flow = VariationalFlow.of(system, ("rho",))
values = system.parameter_vector()
legs = flow.segments(values, [0, 1], [0.1, 0.4], [0.3, 0.02], [[-0.006, 0.03], [-0.0045, 0.04]])
jump = flow.jump(values, 0, 0.3, [-0.0045, 0.04])
numbers = [*legs.z.ravel(), *legs.Phi.ravel(), *legs.P.ravel(), *jump.saltation.ravel(), *jump.f_after]
print(json.dumps([numbers, len(compiled)]))
"""


def run(folder, **environment):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True,
        env={**os.environ, "NONSMOOTH_CACHE_DIR": str(folder), **environment},
    )  # fmt: skip
    numbers, compiled = json.loads(done.stdout.splitlines()[-1])
    return np.array(numbers), compiled


def test_addresses(tmp_path) -> None:
    first, compiled = run(tmp_path)
    second, compiled_again = run(tmp_path)
    plain, nothing = run(tmp_path, NUMBA_DISABLE_JIT="1")
    assert compiled > 0 and compiled_again == nothing == 0
    assert np.array_equal(first, second)
    assert np.abs(plain - first).max() < 1e-12 * np.abs(first).max()
