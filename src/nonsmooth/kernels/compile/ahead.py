"""Compiles what no model changes, to come with the package: `python -m nonsmooth.kernels.compile.ahead`.

It runs when a wheel is built, when a checkout is installed and whenever it is called (after an upgrade of Numba, say).
An entry is named as in the cache (``cache``), so that one which does not fit the installed versions or an edited source
is never found, and the code is then compiled as if none had come. It needs Numba and NumPy, nothing else.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import shutil
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from nonsmooth.kernels.compile.target import AHEAD, level

JOINED = ("kernels.hybrid.run", "kernels.linear.modes")  # texts of modules that are made for a stepper
_ROOT = Path(__file__).parents[2]
_Task = tuple[str, str, tuple[Any, ...]]  # a module, or a function in it that makes one and its arguments
MARCHES: dict[str, _Task] = {  # the longest first
    "linear": ("nonsmooth.kernels.compile.assembly", "linear_module", (False,)),
    "series": ("nonsmooth.kernels.compile.assembly", "series_module", ()),
    "planar": ("nonsmooth.kernels.compile.assembly", "linear_module", (True,)),
}
STEPPERS = tuple(MARCHES)


def plain_files() -> Iterator[str]:
    """Modules of the package with kernels that are no text of another module, found by their decorators."""
    for path in sorted(_ROOT.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        name = ".".join(path.relative_to(_ROOT).with_suffix("").parts)
        if re.search(r"^@kernel\(", text, flags=re.MULTILINE) and name not in JOINED:
            yield f"nonsmooth.{name}"


def tasks(steppers: Sequence[str] = STEPPERS) -> list[_Task]:
    """The list of modules to compile, each by one process: the marches of these steppers, then the plain files."""
    return [MARCHES[name] for name in STEPPERS if name in steppers] + [(name, "", ()) for name in plain_files()]


def _module(task: _Task) -> ModuleType:
    file, name, arguments = task
    module = importlib.import_module(file)
    return getattr(module, name)(*arguments) if name else module


def kernels_of(module: ModuleType) -> list[Any]:
    """The kernels that stand in a module, not those that it imports."""
    found = [value for value in vars(module).values() if hasattr(value, "compile_now")]
    return [value for value in found if value.py_func.__module__ == module.__name__]


def _begin(chosen: str, cache: str) -> None:
    """Set a process up to compile: for the level, and with nothing of the user's own cache."""
    os.environ.update(NONSMOOTH_LEVEL=chosen, NONSMOOTH_CACHE_DIR=cache)


def _compile(task: _Task) -> list[str]:
    """Compile a module's kernels, where they are not there yet; the names of their entries."""
    from nonsmooth.kernels.compile.cache import compiled

    return [compiled(kernel).entry() for kernel in kernels_of(_module(task))]


def compile_ahead(into: Path, chosen: str, work: Sequence[_Task], *, whole: bool = True) -> int:
    """Fill ``into / chosen`` for a level of this processor, with all processors; returns the number of kernels.

    What stands there and fits is kept; what does not belong to the work is removed where that is the whole of it."""
    folder = into / chosen
    folder.mkdir(parents=True, exist_ok=True)
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with TemporaryDirectory() as cache:
        with ProcessPoolExecutor(
            min(processors, len(work)), mp_context=get_context("spawn"), initializer=_begin, initargs=(chosen, cache)
        ) as pool:
            wanted = [name for names in pool.map(_compile, work) for name in names]
        for name in wanted:
            made = Path(cache) / "compiled" / name
            source = made if made.exists() else AHEAD / chosen / name
            if source != folder / name:
                unfinished = folder / f"{name}.tmp"
                shutil.copyfile(source, unfinished)
                os.replace(unfinished, folder / name)
    for path in folder.iterdir():
        if whole and path.name not in wanted:
            path.unlink()
    return len(wanted)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m nonsmooth.kernels.compile.ahead", description=__doc__)
    parser.add_argument("levels", nargs="*", help="levels of the architecture; without one, this processor's highest")
    parser.add_argument("--steppers", nargs="+", choices=STEPPERS, default=STEPPERS, help="without it, all")
    parser.add_argument("--into", type=Path, default=AHEAD, help="another folder than the package's own")
    options = parser.parse_args()
    for chosen in filter(None, options.levels or [level()]):
        work = tasks(options.steppers)
        number = compile_ahead(options.into, chosen, work, whole=len(options.steppers) == len(STEPPERS))
        print(f"{number} kernels compiled for {chosen} in {options.into / chosen}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
