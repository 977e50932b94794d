"""The planar kernels for CUDA: the text of the CPU's files under another header.

One module for each shape of a system (modes, indicators, outputs, transitions, rows, harmonics), because a thread's
arrays have constant shapes.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import ModuleType

from nonsmooth.kernels.cache import load_module

__all__ = ["cuda_linear_module", "joined", "stamp"]

STEPPER = ("linear_tables", "linear_polynomial", "linear_search", "linear_stepper", "linear_layout", "hybrid")
OBSERVERS = {
    "sections": (
        "linear_extremes", "sections", "judge", "settle", "exponent", "planar_settle", "cuda_planar", "cuda_tables",
        "cuda_advance", "cuda_settle", "cuda_neighbours",
    ),
    "growth": ("frame", "every_step", "growth", "cuda_planar", "cuda_tables", "cuda_growth"),
}  # fmt: skip


@cache
def cuda_linear_module(
    harmonics: int, modes: int, indicators: int, outputs: int, transitions: int, rows: int,
    observer: str = "sections",
) -> ModuleType:  # fmt: skip
    """The module with the entries of the ``cuda_*`` texts of one observer; ``rows`` counts those of the section too."""
    text = joined((*STEPPER, *OBSERVERS[observer]))
    sizes = {
        "HARMONICS": harmonics, "N_MODES": modes, "N_INDICATORS": indicators, "N_OUTPUTS": outputs,
        "N_TRANSITIONS": transitions, "N_ROWS": rows,
    }  # fmt: skip
    for name, size in sizes.items():
        text, found = re.subn(rf"^{name} = \d+$", f"{name} = {size}", text, flags=re.MULTILINE)
        assert found == 1, name
    return load_module(text + stamp(), f"cuda_{observer}_" + "_".join(str(size) for size in sizes.values()))


def joined(parts: Sequence[str], before: str = "") -> str:
    """The text of some kernel files in one, behind ``before``: what they import of each other is there already, and
    the markers are those of the GPU."""
    folder = Path(__file__).parent
    text = "\n".join([before, *((folder / f"{part}.py").read_text(encoding="utf-8") for part in parts)])
    own = "|".join({*parts, "linear_stepper", "linear_extremes", "linear_touches", "generated"})
    text = re.sub(
        rf"^from (?:\.|nonsmooth\.kernels\.)(?:{own}) import (\([^)]*\).*|[^(\n]*)$", "", text, flags=re.MULTILINE
    )
    # a model's functions are there by name
    text = re.sub(r"^ +(field|jet|values|jump) = \1_of\(form\)$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^from \. import", "from nonsmooth.kernels import", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    return re.sub(r"from nonsmooth\.kernels\.(?:cache|lanes) import", "from nonsmooth.kernels.cuda_target import", text)


def stamp() -> str:
    """A line that stands for the header: Numba's disk cache goes by the module's text alone, and the header decides how
    it is compiled."""
    folder = Path(__file__).parent
    header = "".join((folder / f"{name}.py").read_text(encoding="utf-8") for name in ("cuda_target", "lanes"))
    return f"\nHEADER = {hashlib.sha256(header.encode()).hexdigest()!r}\n"
