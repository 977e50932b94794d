"""A piece of work: its interface (chunks that depend on their own index only), its identity, the clock of its time."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nonsmooth.results.memory import room_for

if TYPE_CHECKING:
    from nonsmooth.system.system import System


CHUNK = 256  # runs of one chunk, at least: a tenth of a second
STORED = 4096  # and of one that is kept in a store or sent to a cluster: a second
LISTED = 40  # bytes of a chunk's number in a list


Columns = Mapping[str, NDArray[Any]]  # arrays over places, by name


@dataclass(frozen=True)
class ColumnType:
    """One result per place: its type, the shape of one entry, and what stands where nothing was computed (NaN of real
    numbers)."""

    dtype: str
    shape: tuple[int, ...] = ()
    unknown: int = 0


class ChunkedWork(Protocol):
    """Places, cut into chunks; chunk k holds the places from ``bounds(k)[0]`` up to ``bounds(k)[1]``, from k alone.

    ``describe`` is everything that the outcome depends on, as plain data (JSON): two works with equal descriptions
    give equal results. A work can be pickled and sent to another process. ``device`` is ``"cpu"`` or ``"cuda"``.
    ``load`` compiles what ``compute`` calls: Ctrl-C cannot stop a compile in a thread.
    """

    @property
    def device(self) -> str: ...

    def columns(self) -> Mapping[str, ColumnType]: ...

    def n_chunks(self) -> int: ...

    def bounds(self, chunk: int) -> tuple[int, int]: ...

    def load(self) -> None: ...

    def compute(self, chunk: int) -> Columns: ...

    def describe(self) -> Mapping[str, Any]: ...


def places_of(work: ChunkedWork) -> int:
    """The number of places of a work."""
    return work.bounds(work.n_chunks() - 1)[1]


def width_of(work: ChunkedWork) -> int:
    """The bytes of a work's columns at one place."""
    return sum(np.dtype(item.dtype).itemsize * int(np.prod(item.shape)) for item in work.columns().values())


def check_room(work: ChunkedWork, label: str) -> None:
    """MemoryError where a work's columns over all places would not fit into memory."""
    needed = width_of(work) * places_of(work) + LISTED * work.n_chunks()
    room_for(needed, label or "the result", "ask for fewer points")


def empty_columns(work: ChunkedWork) -> dict[str, NDArray[Any]]:
    """Arrays for all places of a work."""
    size = places_of(work)
    return {
        name: np.full((size, *one.shape), np.nan if one.dtype.startswith("f") else one.unknown, one.dtype)
        for name, one in work.columns().items()
    }


def inputs(system: System, verb: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that a work's outcome depends on, as plain data."""
    from nonsmooth.results.provenance import options_as_data

    return {
        "verb": verb,
        "system": system.to_text(),
        "parameters": {k: float(v) for k, v in system.values.items()},
        "options": options_as_data(options),
    }


ROOMS = ("kernels", "system", "flow", "attractors", "diagrams")  # whose text decides what a chunk holds


@cache
def _kernel_version() -> str:
    """Hash of all that decides a number: a store of older kernels, or of older rules of judgement, is another work."""
    import numba

    import nonsmooth

    digest = hashlib.sha256(numba.__version__.encode())
    package = Path(str(nonsmooth.__file__)).parent
    for room in ROOMS:
        for file in sorted((package / room).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def described(work: ChunkedWork) -> dict[str, Any]:
    """Everything that the content of a work's chunks depends on, but for the processor."""
    columns = {name: [item.dtype, list(item.shape)] for name, item in work.columns().items()}
    return {
        **work.describe(),
        "columns": columns,
        "chunks": work.n_chunks(),
        "places": places_of(work),
        "kernels": _kernel_version(),
    }


def difference(record: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """In what a recorded work differs from the wanted one, in words; mappings by the order of their names too."""

    def unlike(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[str]:
        return [name for name in {**b, **a} if json.dumps(a.get(name)) != json.dumps(b.get(name))]

    keys = unlike({name: record.get(name) for name in wanted}, wanted)
    if keys == ["kernels"]:
        return "it was computed by another version of the package"
    for name in keys:
        a, b = record.get(name), wanted[name]
        if isinstance(a, dict) and isinstance(b, dict):
            return f"its {name} differ in {', '.join(unlike(b, a)[:4]) or 'their order'}"
    return f"it differs in {', '.join(keys)}"


def processor_type(device: str) -> str:
    """The type of this machine's processor, or that of its GPU with ``device="cuda"``."""
    return gpu_type() if device == "cuda" else cpu_type()


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
