"""First use: what an import loads, and how long the first result of a new system takes."""

from __future__ import annotations

import os
import subprocess
import sys
import uuid

import pytest

import nonsmooth as ns

NEW_SYSTEM = """
import numpy as np
import nonsmooth as ns

def field(t, u, p):
    x, v = u
    return v, p.F * np.cos(p.w * t) - p.k * np.sin(x) - p.c * v + {number!r} * x**3

system = ns.System(
    states=["x", "v"],
    parameters={{"F": 0.4, "w": 1.1, "k": 1.0, "c": 0.2, "d": 0.3, "e": 0.8}},
    modes={{"swing": field}},
    indicators={{"wall": lambda t, u, p: u.x - p.d}},
    transitions=[ns.Transition("swing", "swing", when="wall > 0", reset=lambda t, u, p: (u.x, -p.e * u.v))],
)
run = ns.simulate(system, periods=50, samples=501)
assert run["crossing_time"].size > 10
"""

COUNT = """
import sys
from nonsmooth.kernels.compile.cache import _passing, cache_statistics
joined = ("nonsmooth_generated_linear", "nonsmooth_generated_series")
modules = [m for name, m in sys.modules.items() if name.startswith(("nonsmooth.kernels.", *joined))]
counts = [one for module in modules for one in cache_statistics(module)]
generated = [one for m in _passing.values() for one in cache_statistics(m)]
print(sum(loads for _, loads, _ in counts), sum(compiles for *_, compiles in counts), len(generated))
"""


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def time_of(code: str) -> tuple[float, str]:
    """Processor time of a fresh process that runs ``code``, and what it prints.

    One thread works, so on an idle machine it is the wall time; other jobs lengthen it little.
    """
    began = os.times()
    printed = run(code)
    ended = os.times()
    return ended.children_user - began.children_user + ended.children_system - began.children_system, printed


def new_system() -> str:
    """The lines of a system that no process has seen yet."""
    return NEW_SYSTEM.format(number=uuid.uuid4().int % 10**9 / 1e12)


@pytest.mark.parametrize("first", ["import nonsmooth", "from nonsmooth.cli.main import main; main([])"])
def test_an_import_and_the_help_load_nothing_but_python_itself(first: str) -> None:
    """Their times, 0.03 and 0.06 s of a processor, are measured by ``benchmarks/latency.py``."""
    code = (
        "import sys, contextlib, io; before = set(sys.modules)\n"
        f"with contextlib.redirect_stdout(io.StringIO()): exec({first!r})\n"
        "print(*{name.partition('.')[0] for name in set(sys.modules) - before} - sys.stdlib_module_names)"
    )
    assert run(code) == "nonsmooth"


def test_every_name_of_the_front_door_is_there() -> None:
    assert len([getattr(ns, name) for name in dir(ns)]) == len(ns.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'simulte'; nearest: ns.simulate"):
        ns.simulte  # noqa: B018


LIBRARIES = """
import numba, numpy, sympy

@numba.njit
def convolution(x, n):
    s = 0.0
    for i in range(n):
        s += x[i] * x[n - i - 1]
    return s

convolution(numpy.ones(8), 8)
"""


def test_a_new_system_in_a_cold_process_compiles_no_kernel() -> None:
    compiles_nothing(run(new_system() + COUNT))


def compiles_nothing(counts: str) -> None:
    """A kernel is compiled once for all."""
    loads, compiles, generated = map(int, counts.split())
    assert compiles == 0
    assert loads >= 1
    assert generated >= 1


@pytest.mark.slow
def test_a_new_nonlinear_system_in_a_cold_process_costs_little_more_than_its_libraries() -> None:
    """Against the same machine at the same time: seconds differ by half between one hour and another.

    Loading the libraries and compiling ten lines takes 1.1 to 1.5 s, so three times that is what 3 to 4 s were. Where
    another job came in between, it is measured again: the first time it may be compiling the package's own kernels."""
    for _ in range(3):
        took, counts = time_of(new_system() + COUNT)
        if took < 3.0 * time_of(LIBRARIES)[0]:
            break
    else:
        pytest.fail(f"a new system took {took:.2f} s")
    compiles_nothing(counts)
