"""Identity of a work: model, parameters, options, source of kernels and rules, type of processor; and its clock."""

from __future__ import annotations

import hashlib
import platform
import time
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from nonsmooth.campaign.work import ChunkedWork

ROOMS = ("kernels", "system", "flow", "attractors", "diagrams")  # whose text decides what a chunk holds


@cache
def _kernel_version() -> str:
    """Hash of all that decides a number: a store of older kernels, or of older rules of judgement, is another work."""
    import numba

    import nonsmooth

    digest = hashlib.sha256(numba.__version__.encode())
    package = Path(str(nonsmooth.__file__)).parent
    for room in ROOMS:
        for file in sorted((package / room).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def described(work: ChunkedWork) -> dict[str, Any]:
    """Everything that the content of a work's chunks depends on, but for the processor."""
    columns = {name: [item.dtype, list(item.shape)] for name, item in work.columns().items()}
    return {
        **work.describe(),
        "columns": columns,
        "chunks": work.n_chunks(),
        "places": work.bounds(work.n_chunks() - 1)[1],
        "kernels": _kernel_version(),
    }


def difference(record: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """In what a recorded work differs from the wanted one, in words."""
    keys = [name for name in wanted if record.get(name) != wanted[name]]
    if keys == ["kernels"]:
        return "it was computed by another version of the package"
    for name in keys:
        a, b = record.get(name), wanted[name]
        if isinstance(a, dict) and isinstance(b, dict):
            inner = [one for one in {**a, **b} if a.get(one) != b.get(one)]
            return f"its {name} differ in {', '.join(map(str, inner[:4]))}"
    return f"it differs in {', '.join(keys)}"


def processor_type(device: str) -> str:
    """The type of this machine's processor, or that of its GPU with ``device="cuda"``."""
    return gpu_type() if device == "cuda" else cpu_type()


def clock(device: str) -> Callable[[], float]:
    """Seconds of a processor's thread, which other users of the machine do not lengthen; of a GPU those on the wall."""
    return time.perf_counter if device == "cuda" else time.thread_time


@cache
def cpu_type() -> str:
    """The processor as the linear algebra sees it, and the level that kernels are made for: both decide last digits."""
    from llvmlite import binding

    from nonsmooth.kernels.compile.target import level

    features = binding.get_host_cpu_features().flatten()
    stamp = hashlib.sha256(features.encode()).hexdigest()[:8]
    return " ".join(filter(None, [platform.machine(), binding.get_host_cpu_name(), stamp, level()]))


@cache
def gpu_type() -> str:
    """The GPU's compute capability, for which its code is made, and the versions of what makes it."""
    from importlib import metadata

    from numba import config, cuda

    if config.ENABLE_CUDASIM:
        return f"Numba's CUDA simulator on {cpu_type()}"
    capability = "".join(map(str, cuda.get_current_device().compute_capability))
    runtime = ".".join(map(str, cuda.runtime.get_version()))
    return f"CUDA sm_{capability}, numba-cuda {metadata.version('numba-cuda')}, runtime {runtime}"
