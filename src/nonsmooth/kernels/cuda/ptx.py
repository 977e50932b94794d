"""The kernels for CUDA as PTX, on a machine with or without a GPU: what the compiler makes of them.

Compiling a kernel asks the present GPU for its type where there is one; here it is told. That leans on a private part
of numba-cuda (``dispatcher.get_current_device``), checked with 0.30.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sysconfig
import tempfile
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

CAPABILITY = (9, 0)


def ptx_of(entry: str, signature: str, shape: tuple[int, ...], capability: tuple[int, int] = CAPABILITY) -> str:
    """One entry of the module for a shape of system, compiled for a compute capability.

    Parameters
    ----------
    signature : str
        Types of its arguments, as Numba writes them.
    shape : tuple of int
        Arguments of :func:`nonsmooth.kernels.cuda.module.cuda_linear_module`.
    """
    from nonsmooth.kernels.cuda.module import cuda_linear_module

    observer = "growth" if entry == "frames" else "sections"
    return ptx_of_module(cuda_linear_module(*shape, observer), entry, signature, capability)


def ptx_of_module(module: ModuleType, entry: str, signature: str, capability: tuple[int, int] = CAPABILITY) -> str:
    """The same for an entry of any module with the GPU's header."""
    from numba.cuda import compile, dispatcher

    from nonsmooth.kernels.cuda.target import THREADS

    before = dispatcher.get_current_device
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=capability)
    try:
        function = getattr(module, entry).py_func
        text, _ = compile(function, signature, device=False, abi="numba", cc=capability, launch_bounds=THREADS)
    finally:
        dispatcher.get_current_device = before
    return str(text)


def resources_of(ptx: str, registers: int | None = None) -> dict[str, Any]:
    """Figures of ``ptxas`` for a kernel: registers, bytes of stack, of spills, of machine code; empty without it."""
    program = shutil.which("ptxas", path=f"{Path(sysconfig.get_path('purelib')) / 'nvidia' / 'cu13' / 'bin'}")
    program = program or shutil.which("ptxas")
    found = re.search(r"\.target (sm_\w+)", ptx)
    if program is None or found is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "kernel.ptx", Path(folder) / "kernel.cubin"
        source.write_text(ptx)
        limit = [] if registers is None else [f"-maxrregcount={registers}"]
        done = subprocess.run(
            [program, "-v", f"-arch={found[1]}", *limit, str(source), "-o", str(target)], capture_output=True, text=True
        )
        if done.returncode:
            raise RuntimeError(f"ptxas refuses the kernel: {done.stderr[-1000:]}")
        size = target.stat().st_size
    stack = re.search(r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads", done.stderr)
    used = re.search(r"Used (\d+) registers", done.stderr)
    assert stack is not None and used is not None, done.stderr
    return {
        "registers": int(used[1]), "stack_bytes": int(stack[1]), "spill_store_bytes": int(stack[2]),
        "spill_load_bytes": int(stack[3]), "object_bytes": size,
    }  # fmt: skip
