"""Random arguments for every verb: each refusal is a sentence of ours, and nothing runs long without progress.

Usage: python tests/fuzz_doors.py [calls for each verb] [seed] [verb ...]; prints a line for each verb, and every call
that ended in an error raised by a library, or took more than 20 s of processor time.
"""

from __future__ import annotations

import inspect
import math
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

import nonsmooth as ns

SOURCE = str(Path(ns.__file__).parent)
LONGEST = 20.0  # seconds
#: Values that people and programs hand over by mistake, and some that are allowed.
ODD: list[Any] = [
    None,
    True,
    False,
    0,
    1,
    2,
    3,
    -1,
    2.5,
    3.0,
    1e-320,
    1e300,
    -0.0,
    math.nan,
    math.inf,
    10**30,
    3j,
    "",
    "a",
    "up",
    "no",
    "x",
    "rho",
    "omega",
    "auto",
    "taylor",
    "cuda",
    [],
    [1.0],
    [0.1, 0.2],
    [[0.0, 0.1]],
    (0.1, 0.3),
    (0.3, 0.1),
    {},
    {"x": 0.01},
    {"x": (0.0, 0.01), "v": (0.0, 0.1)},
    {"rho": "up"},
    {"y": 1},
    np.zeros(2),
    np.array(3.0),
    np.array([]),
    np.array(["a"]),
    np.float64(0.2),
    np.int64(4),
    np.bool_(True),
    object(),
    len,
    ns,
    ns.Stroboscopic(0.5),
    ns.Poincare("penetration"),
    b"x",
    range(3),
    {1, 2},
    1.0 + 0.0j,
    "1e-3",
]


def bases() -> dict[str, tuple[Any, ...]]:
    """A small call of each verb: what it needs, and options that keep it small."""
    s = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.0)
    valve = ns.models.relief_valve(q=9.0)
    run = ns.simulate(s, periods=4, start={"x": 0.01})
    orbit = ns.find_orbit(s, progress=False)
    branch = ns.continue_orbit(orbit, "omega", (4.9, 5.9))
    lost = branch.isel(point=int(branch["special_point"][:2].mean()))  # between its two folds
    saddle = ns.find_orbit(
        s.with_parameters(omega=float(lost["omega"])),
        start=lost["section"].values,
        period_number=1,
        transient=0,
        progress=False,
    )
    points = ns.poincare(s, n=300)["section"].values
    free = ns.mechanical(1.0, 0.2, "k", parameters={"k": 4.0}, coordinates=["q"])
    record = {"q": (np.arange(0, 5, 0.05), np.exp(-0.1 * np.arange(0, 5, 0.05)) * np.cos(2 * np.arange(0, 5, 0.05)))}
    few: dict[str, Any] = {"transient": 10, "keep": 12, "progress": False}
    grid = {"omega": [4.5, 5.0], "rho": [0.14, 0.2]}
    plane, box = {"x": [0.0, 0.01], "v": [0.0, 0.1]}, {"x": (0.0, 0.01)}
    return {
        "simulate": ({"system": s, "periods": 3},),
        "poincare": ({"system": s, "n": 5},),
        "sensitivity": ({"system": s, "periods": 2},),
        "sweep": ({"system": s, "parameter": "rho", "values": [0.14, 0.2], **few},),
        "frequency_response": ({"system": s, "values": [4.5, 5.0], **few},),
        "chart": ({"system": s, "grid": grid, **few},),
        "basins": ({"system": s, "grid": plane, **few},),
        "basin_fractions": ({"system": s, "parameter": "rho", "values": [0.14], "n_starts": 3, "box": box, **few},),
        "lyapunov": ({"system": s, "periods": 40, "transient": 10, "progress": False},),
        "amplitude_spectrum": ({"system": s, "transient": 10, "periods": 8, "samples": 16},),
        "correlation_dimension": ({"section": points},),
        "zero_one_test": ({"section": points},),
        "random_starts": ({"n": 2, "low": [0.0], "high": [1.0], "seed": 1},),
        "find_orbit": ({"system": s, "transient": 10, "max_period": 2, "budget": 5.0, "progress": False},),
        "continue_orbit": ({"start": orbit, "parameter": "omega", "range": (4.9, 5.1), "points": 3},),
        "continue_equilibrium": (
            {"system": valve, "parameter": "q", "range": (8.9, 9.1), "start": {"y1": 2.0, "y3": 12.0}, "points": 3},
        ),
        "bifurcation_diagram": (
            {
                "system": s,
                "parameter": "omega",
                "range": (4.9, 5.0),
                "n": 3,
                "transient": 10,
                "points": 3,
                "depth": 0,
                "budget": 5.0,
                "progress": False,
            },
        ),
        "manifolds": ({"orbit": saddle, "length": 0.5},),
        "special_points": ({"branch": branch},),
        "smoothing_report": ({"system": s, "etas": [1e-3], "transient": 5, "progress": False},),
        "fit": ({"system": free, "recording": record, "parameters": ["k"], "tries": 1, "progress": False},),
        "select_model": (
            {
                "models": {"a": (free, ["k"]), "b": (free, ["k"])},
                "recording": record,
                "folds": 2,
                "tries": 1,
                "progress": False,
            },
        ),
        "plan_experiment": (
            {
                "system": free,
                "runs": {"a": {"duration": 2.0, "samples": 20, "start": {"q": 1.0}}},
                "parameters": ["k"],
                "measured": {"q": ns.Sensor(noise=1e-3)},
            },
        ),
        "propagate": (
            {
                "found": {},
                "verb": ns.sweep,
                "start": s,
                "parameter": "rho",
                "values": [0.14],
                "draws": 2,
                "settings": {"g": (0.02, 1e-4)},
                **few,
            },
        ),
        "compare": (
            {
                "measured": ns.sweep(s, "omega", [5.0], keep=40, progress=False).isel(omega=0),
                "theory": s,
                "noise": [1e-4, 1e-3],
                "transient": 10,
                "draws": 0,
                "splits": 20,
            },
        ),
        "region": ({"result": run, "condition": "x < 0.01"},),
        "table": ({"result": run},),
        "Poincare": ({"indicator": "penetration"},),
        "Stroboscopic": ({},),
        "Holding": ({},),
        "SimulatedRig": ({"system": s},),
    }


class Slow(BaseException):
    """A call that has run too long."""


def too_long(*_: object) -> None:
    """Answer the clock."""
    raise Slow


def judged(error: BaseException) -> str:
    """Empty for an error that is ours; else the library's own, and where it was raised."""
    ours = (ValueError, TypeError, ns.SolveError, MemoryError, ImportError, RuntimeError)
    last = traceback.extract_tb(error.__traceback__)[-1]
    said = str(last.line).startswith("raise") and len(str(error)) > 12  # else Python's own words
    if isinstance(error, ours) and last.filename.startswith(SOURCE) and said:
        return ""
    return f"{type(error).__name__}: {str(error)[:150]} ({Path(last.filename).name}:{last.lineno})"


def main() -> None:
    """Call every verb many times with one to three of its arguments replaced."""
    given = [int(one) for one in sys.argv[1:3]]
    many, seed = (*given, *(500, 1)[len(given) :])
    rng = np.random.default_rng(seed)
    signal.signal(signal.SIGPROF, too_long)
    bad = 0
    wanted = sys.argv[3:]
    for verb, (base,) in bases().items():
        if wanted and verb not in wanted:
            continue
        call, count, slowest = getattr(ns, verb), Counter[str](), 0.0
        items = inspect.signature(call).parameters.values()
        names = [item.name for item in items if item.kind not in (item.VAR_POSITIONAL, item.VAR_KEYWORD)]
        by_place = [item.name for item in items if item.kind is item.POSITIONAL_ONLY]
        for _ in range(many):
            some = rng.choice(names, 1 + int(rng.random() < 0.3))
            changed = {str(name): ODD[rng.integers(len(ODD))] for name in some}
            changed |= {f"{names[rng.integers(len(names))]}s": 1} if rng.random() < 0.05 else {}
            asked, began = {**base, **changed}, time.process_time()
            signal.setitimer(signal.ITIMER_PROF, LONGEST)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    call(*(asked.pop(name) for name in by_place), **asked)
                count["ran"] += 1
            except KeyboardInterrupt:
                count["cancelled by its progress"] += 1
            except Slow:
                count["slow"] += 1
            except Exception as error:
                why = judged(error)
                count["not ours" if why else "refused"] += 1
                if why:
                    bad += 1
                    print(f"  {verb}({', '.join(f'{k}={v!r:.60}' for k, v in changed.items())}): {why}", flush=True)
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            took = time.process_time() - began
            slowest = max(slowest, took)
            if took > 0.9 * LONGEST:
                bad += 1
                print(f"  {verb}({', '.join(f'{k}={v!r:.60}' for k, v in changed.items())}): {took:.0f} s", flush=True)
        told = ", ".join(f"{key} {number}" for key, number in sorted(count.items()))
        print(f"{verb}: {many} calls, {told}; slowest {slowest:.1f} s", flush=True)
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
