"""Identity of a work: model, parameters, options, the source of kernels and rules."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from nonsmooth.campaign.work import ChunkedWork

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
        "places": work.bounds(work.n_chunks() - 1)[1],
        "kernels": _kernel_version(),
    }


def difference(record: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """In what a recorded work differs from the wanted one, in words."""
    keys = [name for name in wanted if record.get(name) != wanted[name]]
    if keys == ["kernels"]:
        return "it was computed by another version of the package"
    for name in keys:
        a, b = record.get(name), wanted[name]
        if isinstance(a, dict) and isinstance(b, dict):
            inner = [one for one in {**a, **b} if a.get(one) != b.get(one)]
            return f"its {name} differ in {', '.join(map(str, inner[:4]))}"
    return f"it differs in {', '.join(keys)}"
