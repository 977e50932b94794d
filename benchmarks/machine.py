"""Facts that a reader needs about the machine and the versions; nothing that names the machine."""

from __future__ import annotations

import os
import platform
from importlib.metadata import distributions, version
from pathlib import Path


def processor() -> str:
    """Model and architecture flags that matter for peers compiled at run time."""
    path = Path("/proc/cpuinfo")
    if not path.exists():
        return platform.processor() or platform.machine()
    lines = [line.partition(":") for line in path.read_text().splitlines()]
    facts = {key.strip(): value.strip() for key, _, value in lines}
    wide = "AVX-512" if "avx512f" in facts.get("flags", "") else "AVX2" if "avx2" in facts.get("flags", "") else "SSE"
    clock = facts.get("cpu MHz")
    return f"{facts.get('model name', platform.machine())}, {wide}" + (f", {float(clock):.0f} MHz" if clock else "")


def facts() -> list[str]:
    packages = ("nonsmooth", "numpy", "numba", "numba-cuda", "scipy", "heyoka", "xarray", "sympy")
    there = {found.name.lower() for found in distributions()}
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return [
        f"processor: {processor()}; {cores} cores visible",
        f"system: {platform.system()}, Python {platform.python_version()}",
        "versions: " + ", ".join(f"{name} {version(name)}" for name in packages if name in there),
        f"load of the machine when the run began: {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "",
    ]
