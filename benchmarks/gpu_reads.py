"""Reads and writes of a thread's arrays per forcing period of the exact flow, counted: what its local memory carries.

The kernels' own text, run as plain Python (NUMBA_DISABLE_JIT=1) on arrays that count. Every element that is read or
written counts; a compiler keeps some of the small arrays' elements in registers. Prints one JSON object: numbers of
8 bytes, of the tables and of the rest.
"""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

import numpy as np

import nonsmooth as ns
from gpu_flops import PLANES
from nonsmooth.flow.engines.methods import engine_for
from work import TABLE_1

TABLES = 6  # of the scratch arrays, the first ones
COUNT: Counter[str] = Counter()


class Counting(np.ndarray):
    """An array that counts what is taken out of it and put into it, by its name; so do its parts."""

    name = ""

    def __array_finalize__(self, other: Any) -> None:
        self.name = getattr(other, "name", "")

    def __getitem__(self, place: Any) -> Any:
        found = super().__getitem__(place)
        if not isinstance(found, np.ndarray):
            COUNT[f"{self.name} read"] += 1
        return found

    def __setitem__(self, place: Any, value: Any) -> None:
        COUNT[f"{self.name} written"] += 1
        super().__setitem__(place, value)


def counting(array: Any, name: str) -> Counting:
    found: Counting = array.view(Counting)
    found.name = name
    return found


def counts(system: ns.System, returns: int) -> Counter[str]:
    """Of one run from rest, its tables included."""
    engine: Any = engine_for(system)
    tables = engine.prepare(system.parameter_vector()[None, :])
    out = engine.kept(1, 1)
    work = tables.module.scratch(*tables.sizes)
    scratch = [counting(part, "tables" if k < TABLES else "rest") for k, part in enumerate(work)]
    COUNT.clear()
    tables.module.chain(
        0, 1, 0, np.zeros((1, 2)), np.zeros(2), np.zeros(3), np.array([0, -1, 0, 0]), *tables.linear, *engine.net,
        0.0, np.array([-1, 1, -1, 1, 1, 0]), 1e300, returns - 1, 1, 1e9 * engine.scale, *out, *scratch,
    )  # fmt: skip
    return Counter(COUNT)


def main() -> None:
    rng = np.random.default_rng(1)
    found = {}
    for name, (parameters, ranges) in PLANES.items():
        model = ns.models.discontinuous_support(**TABLE_1, **parameters)
        total: Counter[str] = Counter()
        for _ in range(20):
            system = model.with_parameters({key: float(rng.uniform(*ends)) for key, ends in ranges.items()})
            few, many = counts(system, 2), counts(system, 42)
            total.update({key: many[key] - few[key] for key in many})
        found[name] = {key: total[key] / (20 * 40) for key in sorted(total)}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
