"""The kernels for CUDA, of both steppers: the text of the CPU's files under another header; PTX without a GPU.

One module for each shape of a linear system (modes, indicators, outputs, transitions, rows, harmonics), because a
thread's arrays have constant shapes; for the series one for each system, method and order, because the model is part of
it too. Tolerances, sections and parameters are arguments.

Compiling a kernel asks the present GPU for its type where there is one; for its PTX it is told. That leans on a private
part of numba-cuda (``dispatcher.get_current_device``), checked with 0.30.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

from nonsmooth.kernels.compile import assembly
from nonsmooth.kernels.compile.assembly import LINEAR_STEPPER, with_numbers
from nonsmooth.kernels.compile.cache import load_module

OBSERVERS = {
    "sections": (
        "linear.extremes",
        "hybrid.sections",
        "hybrid.observers",
        "judging.judge",
        "judging.settle",
        "cuda.arrays",
        "cuda.tables",
        "cuda.advance",
        "cuda.settle",
    ),
    "growth": (
        "tangent.frame",
        "linear.growth",
        "hybrid.growth",
        "hybrid.observers",
        "cuda.arrays",
        "cuda.tables",
        "cuda.growth",
    ),
}
ELSEWHERE = ("hybrid.growth", "hybrid.record", "hybrid.sections", "linear.sums", "series.generated")  # not for a GPU


@cache
def cuda_linear_module(
    harmonics: int,
    modes: int,
    indicators: int,
    outputs: int,
    transitions: int,
    rows: int,
    observer: str = "sections",
) -> ModuleType:
    """The module with the entries of the ``cuda`` texts of one observer; ``rows`` counts those of the section too."""
    sizes = {
        "HARMONICS": harmonics,
        "N_MODES": modes,
        "N_INDICATORS": indicators,
        "N_OUTPUTS": outputs,
        "N_TRANSITIONS": transitions,
        "N_ROWS": rows,
        "LOGS": 0,
        "GROWS": 2 if observer == "growth" else 0,
        "MAY_WAIT": 0,
    }
    text = with_numbers(joined((*LINEAR_STEPPER, *OBSERVERS[observer])), sizes)
    name = "_".join(map(str, (harmonics, modes, indicators, outputs, transitions, rows)))
    return load_module(text + stamp(), f"cuda_{observer}_{name}")


def joined(parts: Iterable[str], model: str = "") -> str:
    """The text of a model and of some kernel files in one, with the GPU's markers; its functions are there by name."""
    text = f"{model}\n{assembly.joined(parts, absent=ELSEWHERE)}"
    text = re.sub(r"^ +(field|jet|values|jump) = \1_of\(form\)$", "", text, flags=re.MULTILINE)
    return re.sub(r"\bnonsmooth\.kernels\.compile\.(cache|direct) import", "nonsmooth.kernels.cuda.target import", text)


def stamp() -> str:
    """A line that stands for the header: Numba's disk cache goes by the module's text alone, and the header decides how
    it is compiled."""
    header = Path(__file__).with_name("target.py").read_text(encoding="utf-8")
    return f"\nHEADER = {hashlib.sha256(header.encode()).hexdigest()!r}\n"


CAPABILITY = (9, 0)


def ptx_of(entry: str, signature: str, shape: tuple[int, ...]) -> str:
    """One entry of the module for a shape of system, compiled for ``CAPABILITY``.

    Parameters
    ----------
    signature : str
        Types of its arguments, as Numba writes them.
    shape : tuple of int
        Arguments of :func:`nonsmooth.kernels.cuda.module.cuda_linear_module`.
    """

    observer = "growth" if entry == "frames" else "sections"
    return ptx_of_module(cuda_linear_module(*shape, observer), entry, signature)


def ptx_of_module(module: ModuleType, entry: str, signature: str) -> str:
    """The same for an entry of any module with the GPU's header."""
    from numba.cuda import compile, dispatcher

    from nonsmooth.kernels.cuda.target import THREADS

    before = dispatcher.get_current_device
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=CAPABILITY)
    try:
        function = getattr(module, entry).py_func
        text, _ = compile(function, signature, device=False, abi="numba", cc=CAPABILITY, launch_bounds=THREADS)
    finally:
        dispatcher.get_current_device = before
    return str(text)


SERIES = (
    "circular",
    "series.polynomial",
    "series.crossing",
    "series.rkf45",
    "series.taylor",
    "series.step",
    "series.watch",
    "series.instant",
    "series.stepper",
    "hybrid.loop",
    "hybrid.sections",
    "hybrid.observers",
    "judging.judge",
    "judging.settle",
    "cuda.settle",
    "cuda.series",
)


def cuda_series_source(model: str, sizes: Mapping[str, int], tables: Mapping[str, Any]) -> str:
    """Text of the module.

    Parameters
    ----------
    model : str
        Text of the model's module (``system.codegen.generate.model_source``).
    sizes : mapping
        The numbers at the top of ``cuda.series``.
    tables : mapping
        The arrays there.
    """
    text = joined(SERIES, model)
    for names in (
        ("METHOD", "ORDER", "CHECKED", "CORNERS", "N_GUARDS"),
        ("N_PARAMETERS", "N_MEMORY", "N_INDICATORS", "N_OUTPUTS", "N_SCRATCH_ROWS"),
    ):
        line = f"{', '.join(names)} = {', '.join(str(int(sizes[name])) for name in names)}"
        text, found = re.subn(rf"^{', '.join(names)} = [\d, ]+$", line, text, flags=re.MULTILINE)
        assert found == 1, names
    text = with_numbers(text, {"N_STATES": tables["LACKING"].shape[1], "LOGS": 0, "GROWS": 0, "MAY_WAIT": 0})
    for name, table in tables.items():
        line = f"{name} = np.array({table.tolist()!r}, dtype=np.{table.dtype}).reshape({table.shape})"
        text, found = re.subn(rf"^{name} = np\.array.*$", line, text, flags=re.MULTILINE)
        assert found == 1, name
    return text + stamp()


@cache
def cuda_series_module(source: str) -> ModuleType:
    """The module of a text made by :func:`cuda_series_source`."""
    return load_module(source, "cuda_series")
