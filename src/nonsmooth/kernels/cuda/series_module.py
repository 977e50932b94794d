"""The series kernels for CUDA: a model's generated functions, the text of the CPU's files, and ``cuda.series``.

One module for each system, method and order, because the model is part of it and a thread's arrays have constant
shapes; tolerances, sections and parameters are arguments.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from types import ModuleType
from typing import Any

from nonsmooth.kernels.compile.assembly import with_numbers
from nonsmooth.kernels.compile.cache import load_module
from nonsmooth.kernels.cuda.module import joined, stamp

PARTS = (
    "circular",
    "series.polynomial",
    "series.crossing",
    "series.rkf45",
    "series.taylor",
    "series.trust",
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
    text = joined(PARTS, model)
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
