"""Registers and memory that NVIDIA's assembler gives a kernel."""

from __future__ import annotations

import re
import shutil
import subprocess
import sysconfig
import tempfile
from pathlib import Path
from typing import Any


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
        "registers": int(used[1]),
        "stack_bytes": int(stack[1]),
        "spill_store_bytes": int(stack[2]),
        "spill_load_bytes": int(stack[3]),
        "object_bytes": size,
    }
