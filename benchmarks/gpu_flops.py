"""Floating-point operations of the exact flow, counted: the kernels' own text, run as plain Python on counting numbers.

Every +, -, * and / of a float counts as one; comparisons, signs and the library's functions do not. Run with
NUMBA_DISABLE_JIT=1; prints one JSON object.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

import nonsmooth as ns
from nonsmooth.flow.engines.methods import engine_for
from work import TABLE_1

PLANES = {
    "Fig. 9": ({"g": 0.02}, {"omega": (3.0, 7.0), "rho": (0.1, 0.3)}),
    "Fig. 13": ({"omega": 11.15}, {"g": (-0.0015, 0.002), "rho": (0.2, 0.5)}),
}


class Counted(float):
    """A float that counts what is done with it."""

    done = 0


def _operation(name: str) -> Any:
    plain = getattr(float, name)

    def operation(a: float, b: float) -> Counted:
        Counted.done += 1
        return Counted(plain(a, float(b)))

    return operation


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul", "truediv", "rtruediv"):
    setattr(Counted, f"__{_name}__", _operation(f"__{_name}__"))
Counted.__neg__ = lambda self: Counted(-float(self))


def counted(array: Any) -> Any:
    """The same array of counting numbers (or of plain integers)."""
    kind = Counted if np.asarray(array).dtype.kind == "f" else int
    found = np.empty(np.shape(array), dtype=object)
    for place in np.ndindex(found.shape):
        found[place] = kind(array[place])
    return found


def operations(system: ns.System, returns: int) -> int:
    """Operations of one run from rest, its tables included."""
    engine: Any = engine_for(system)
    tables = engine.prepare(system.parameter_vector()[None, :])
    module = tables.module
    for plain in (math.cos, math.sin, math.fabs, math.sqrt):
        setattr(module, plain.__name__, lambda x, f=plain: Counted(f(x)))
    out = engine.kept(1, 1)
    rows = engine.net[1].copy()
    Counted.done = 0
    module.chain(
        0, 1, 0, counted(np.zeros((1, 2))), *(counted(np.zeros(n)) for n in (2, 3)), [0, -1, 0, 0],
        *map(counted, tables.linear), *(counted(part) for part in (engine.net[0], rows, *engine.net[2:])),
        0.0, [-1, 1, -1, 1, 1, 0], 1e300, returns - 1, 1, counted(1e9 * engine.scale),
        *(counted(part) if part.ndim else part for part in out),
        *(counted(part) for part in module.scratch(*tables.sizes)),
    )  # fmt: skip
    return Counted.done


def main() -> None:
    rng = np.random.default_rng(1)
    found = {}
    for name, (parameters, ranges) in PLANES.items():
        model = ns.models.discontinuous_support(**TABLE_1, **parameters)
        table, period = [], []
        for _ in range(20):
            system = model.with_parameters({key: float(rng.uniform(*ends)) for key, ends in ranges.items()})
            few, many = operations(system, 2), operations(system, 42)
            period.append((many - few) / 40)
            table.append(few - 2 * period[-1])
        found[name] = {"per_period": float(np.mean(period)), "tables": float(np.mean(table))}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
