"""The linear kernels for CUDA: the text of the CPU's files under another header.

One module for each shape of a system (modes, indicators, outputs, transitions, rows, harmonics), because a thread's
arrays have constant shapes.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from types import ModuleType

from nonsmooth.kernels.compile import assembly
from nonsmooth.kernels.compile.assembly import with_numbers
from nonsmooth.kernels.compile.cache import load_module
from nonsmooth.kernels.linear.module import STEPPER

__all__ = ["cuda_linear_module", "joined", "stamp"]

OBSERVERS = {
    "sections": (
        "linear.extremes", "hybrid.sections", "judging.judge", "judging.settle", "judging.exponent", "linear.many",
        "cuda.arrays", "cuda.tables", "cuda.advance", "cuda.settle", "cuda.neighbours",
    ),
    "growth": (
        "tangent.frame", "hybrid.every_step", "hybrid.growth", "cuda.arrays", "cuda.tables", "cuda.growth",
    ),
}  # fmt: skip


@cache
def cuda_linear_module(
    harmonics: int, modes: int, indicators: int, outputs: int, transitions: int, rows: int,
    observer: str = "sections",
) -> ModuleType:  # fmt: skip
    """The module with the entries of the ``cuda`` texts of one observer; ``rows`` counts those of the section too."""
    sizes = {
        "HARMONICS": harmonics, "N_MODES": modes, "N_INDICATORS": indicators, "N_OUTPUTS": outputs,
        "N_TRANSITIONS": transitions, "N_ROWS": rows,
    }  # fmt: skip
    text = with_numbers(joined((*STEPPER, *OBSERVERS[observer])), sizes)
    return load_module(text + stamp(), f"cuda_{observer}_" + "_".join(str(size) for size in sizes.values()))


def joined(parts: Iterable[str]) -> str:
    """The text of some kernel files in one, with the GPU's markers; a model's functions are there by name."""
    text = assembly.joined(parts, absent=("series.generated",))
    text = re.sub(r"^ +(field|jet|values|jump) = \1_of\(form\)$", "", text, flags=re.MULTILINE)
    header = r"from nonsmooth\.kernels\.compile\.(?:cache|lanes|long_sums) import"
    return re.sub(header, "from nonsmooth.kernels.cuda.target import", text)


def stamp() -> str:
    """A line that stands for the header: Numba's disk cache goes by the module's text alone, and the header decides how
    it is compiled."""
    room = Path(__file__).parents[1]
    files = ("cuda/target.py", "compile/lanes.py", "compile/long_sums.py")
    header = "".join((room / name).read_text(encoding="utf-8") for name in files)
    return f"\nHEADER = {hashlib.sha256(header.encode()).hexdigest()!r}\n"
