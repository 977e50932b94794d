"""Type of the processor that computes chunks, which decides the last digits, and the clock that measures its work."""

from __future__ import annotations

import hashlib
import platform
import time
from collections.abc import Callable
from functools import cache


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
