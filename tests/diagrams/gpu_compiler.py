"""Kernels of a simulated run through the compiler of numba-cuda, which needs no GPU, in a process of its own."""

from __future__ import annotations

import gc
import hashlib
import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import nonsmooth as ns
from nonsmooth.kernels.compile.folder import cache_folder

SOURCES = Path(ns.__file__).parent
TEXTS = ("kernels", "system/codegen", "flow/engines", "models")  # of which kernels are made
SHAPE = (1, 2, 2, 1, 2, 5)  # of the linear system


def run(code: list[str], given: str = "", **environment: str) -> str:
    paths = {"PYTHONPATH": os.pathsep.join([*sys.path, str(Path(__file__).parent)])}
    done = subprocess.run(
        [sys.executable, *code], input=given, capture_output=True, text=True, env={**os.environ, **paths, **environment}
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def compiled(system: str, launched: dict[str, str], optimised: bool) -> None:
    """Compile kernels for the types they are launched with; not again for the same texts, types and compiler.

    Those that are not to be optimised end at the compiler's verifier: code is generated in the slow tests.
    """
    given = json.dumps([system, launched, optimised])
    if not done_before("sources", given, TEXTS, []):
        run([__file__], given)
        done_before("sources", given, TEXTS, [], now=True)


def done_before(what: str, given: str, folders: tuple[str, ...], modules: list[str], now: bool = False) -> bool:
    """Return whether these kernels were compiled from the texts of folders, and from modules whose names are hashes of
    their texts; ``now``: they were.
    """
    versions = [version(name) for name in ("numba-cuda", "nvidia-nvvm", "llvmlite")]
    files = [Path(__file__), *(path for folder in folders for path in sorted((SOURCES / folder).rglob("*.py")))]
    texts = [given, versions, modules, [path.read_text("utf-8") for path in files]]
    key = hashlib.sha256(repr(texts).encode()).hexdigest()
    system, _, optimised = json.loads(given)
    seen = cache_folder() / f"gpu_{system.replace(' ', '_')}_{'optimised' if optimised else 'verified'}_{what}"
    if now:
        seen.write_text(key)
    return seen.exists() and seen.read_text() == key


def main() -> None:
    from numba.cuda.cudadrv.nvvm import CompilationUnit

    from nonsmooth.kernels.cuda.module import OBSERVERS, cuda_linear_module, ptx_of, ptx_of_module

    gc.disable()  # a compile makes millions of objects and hardly a cycle
    given = sys.stdin.read()
    system, launched, optimised = json.loads(given)
    if not optimised:
        CompilationUnit.compile = lambda unit: b""  # called behind its verifier
    module = None if system == "linear" else series_module(system)
    joined = [module] if module else [cuda_linear_module(*SHAPE, observer) for observer in OBSERVERS]
    names = [one.__name__ for one in joined]
    if done_before("modules", given, ("kernels",), names):  # another file of which kernels are made has changed
        return
    for name, signature in launched.items():
        text = ptx_of_module(module, name, signature) if module else ptx_of(name, signature, SHAPE)
        assert not optimised or (text.count(".visible .entry") == 1 and ".target sm_90" in text), name
    done_before("modules", given, ("kernels",), names, now=True)


def series_module(name: str) -> Any:
    from gpu_series_systems import filtered, two_wells

    from nonsmooth.flow.engines.devices import engine_on_gpu
    from nonsmooth.flow.engines.gpu import module_of
    from nonsmooth.flow.engines.methods import engine_for

    system = {"valve": ns.models.relief_valve, "two wells": two_wells, "filtered": filtered}[name]()
    engine = engine_on_gpu(engine_for(system, "auto" if name == "filtered" else "taylor", None, None), None)
    return module_of(engine, engine.prepare(system.parameter_vector()[None, :]))


if __name__ == "__main__":
    main()
