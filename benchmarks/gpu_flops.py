"""Floating-point operations, counted: the kernels' own text, run as plain Python on counting numbers.

Every +, -, * and / of a float counts as one; comparisons, signs and the library's functions do not. Run with
NUMBA_DISABLE_JIT=1; prints one JSON object for the exact flow of the paper's oscillator.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

import nonsmooth as ns
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.sections import section_plan
from nonsmooth.kernels.compile.pointers import Block
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


def counted(record: Any) -> Any:
    """The same record with arrays of counting numbers in place of arrays of floats."""
    if isinstance(record, tuple):
        parts = [counted(part) for part in record]
        return type(record)(*parts) if hasattr(record, "_fields") else tuple(parts)
    if not isinstance(record, np.ndarray) or record.dtype.kind != "f":
        return record
    found = np.empty(record.shape, dtype=object)
    for place in np.ndindex(found.shape):
        found[place] = Counted(record[place])
    return found


def _put(block: Block, record: Any) -> Any:
    block.address[:] = [counted(record)]
    return block.address


def operations(
    engine: Any, section: Any, start: list[float], returns: int, spaces: tuple[dict[str, Any], ...] = ()
) -> int:
    """Operations of one run to so many section returns, tables included; ``spaces``: names of more text it calls."""
    functions = {name: getattr(math, name) for name in ("fabs", "sqrt", "exp", "log", "cos", "sin")} | {"ln": math.log}
    for space in (vars(engine.module()), *spaces):
        for name, plain in functions.items():
            if name in space:
                space[name] = lambda x, f=plain: Counted(f(x))
    Block.put = _put  # type: ignore[method-assign]
    tables = engine.prepare(engine.point)
    state = State(np.array(start), np.zeros(len(engine.traced.m)))
    Counted.done = 0
    engine.chain(tables, 0, 1, state, None, section, returns - 1, 1, engine.kept(1, 1))
    return Counted.done


def main() -> None:
    rng = np.random.default_rng(1)
    found = {}
    for name, (parameters, ranges) in PLANES.items():
        model = ns.models.discontinuous_support(**TABLE_1, **parameters)
        table, period = [], []
        for _ in range(20):
            system = model.with_parameters({key: float(rng.uniform(*ends)) for key, ends in ranges.items()})
            engine: Any = engine_for(system)
            engine.point = system.parameter_vector()[None, :]
            few, many = (operations(engine, section_plan(system, None)[1], [0.0, 0.0], n) for n in (2, 42))
            period.append((many - few) / 40)
            table.append(few - 2 * period[-1])
        found[name] = {"per_period": float(np.mean(period)), "tables": float(np.mean(table))}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
