"""Functions passed as addresses: the same legs with and without a compiler, and nothing compiled twice."""

import json
import os
import subprocess
import sys

import numpy as np

SCRIPT = """
import json, sys
import numpy as np
import nonsmooth as ns
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.compile.cache import cache_statistics

system = ns.models.discontinuous_support()
flow = VariationalFlow.of(system, ("rho",))
values = system.parameter_vector()
legs = flow.legs(values, [0, 1], [0.1, 0.4], [0.3, 0.02], [[-0.006, 0.03], [-0.0045, 0.04]])
jump = flow.jump(values, 0, 0.3, [-0.0045, 0.04])
compiled = sum(
    misses for name, module in list(sys.modules.items()) if name.startswith("nonsmooth") and module is not None
    for _, _, misses in cache_statistics(module)
)
numbers = [*legs.z.ravel(), *legs.Phi.ravel(), *legs.P.ravel(), *jump.saltation.ravel(), *jump.f_after]
print(json.dumps([numbers, compiled]))
"""


def run(folder, **environment):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True,
        # for a processor for which nothing has been compiled ahead
        env={**os.environ, "NONSMOOTH_CACHE_DIR": str(folder), "NUMBA_CPU_NAME": "generic", **environment},
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
