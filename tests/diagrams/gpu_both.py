"""Parts that the scripts for Numba's simulator share: a verb on both devices, and the types of launched kernels."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np


def type_of(value: Any) -> str:
    """An argument's type as the text of a Numba signature."""
    if isinstance(value, tuple):
        return f"Tuple(({', '.join(map(type_of, value))},))"
    if isinstance(value, bool | np.bool_):
        return "boolean"
    if isinstance(value, int | np.integer):
        return "int64"
    if isinstance(value, float | np.floating):
        return "float64"
    assert value.flags["C_CONTIGUOUS"], "a kernel takes arrays in C order only"
    return f"{value.dtype}[{', '.join([':'] * (value.ndim - 1) + ['::1'])}]"


JOBS: Counter[str] = Counter()  # of all launches, by kernel


def launches_of(engine_on_gpu: Any) -> dict[str, str]:
    """Signatures of the kernels that a class launches from now on, by name: one set of types for each."""
    launched: dict[str, str] = {}
    plain_launch = engine_on_gpu.launch

    def launch(self: Any, entry: Any, jobs: Any, *arguments: Any) -> None:
        signature = f"void({', '.join(map(type_of, (jobs, *arguments)))})"
        name = entry.py_func.__name__
        assert launched.setdefault(name, signature) == signature, "one set of types for each kernel"
        JOBS[name] += len(jobs)
        self.threads = 4  # so that there are several blocks, and few threads without work
        plain_launch(self, entry, jobs, *arguments)

    engine_on_gpu.launch = launch
    return launched


def both(verb: Any, *arguments: Any, **options: Any) -> dict[str, Any]:
    """The numbers of a verb's result on both devices."""
    found = {}
    for device in ("cpu", "cuda"):
        result = verb(*arguments, device=device, progress=False, **options)
        found[device] = {
            name: np.asarray(result[name].values, dtype=float).tolist()
            for name in result.data_vars
            if result[name].dtype.kind in "fiu"
        }
    return found
