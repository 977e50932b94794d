"""Seconds until something is seen, on whatever is installed; a process of its own for each scenario.

The newcomer is the README's first ten lines, on a terminal: seconds until the first byte that it shows, and until its
figure is saved. Import and help are given in seconds of a processor, the least of five processes. The cache of compiled
code is an empty temporary folder, or one that an earlier process has filled; the user's own is left alone. Run it on a
quiet machine: other times are those of a clock on the wall. With a number it runs all that many times and prints
medians.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

Steps = dict[str, float]

# What a process does: a beginning, then steps with a name. The steps of `ALL` are what a first hour brings.
IMPORT = """
import numpy as np
import nonsmooth as ns
"""
SUPPORT = "support = ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045, rho=0.3)"
VALVE = """
valve = ns.models.relief_valve()
ns.simulate(valve, duration=20.0, start={"y1": 0.2, "y2": 0.0, "y3": 10.0})
"""
SIMULATE = {"simulate": f"{SUPPORT}\nns.simulate(support, periods=20, transient=100)"}
ALL = {
    **SIMULATE,
    "sweep": "ns.sweep(support, 'rho', np.linspace(0.25, 0.35, 11), transient=100, keep=20, progress=False)",
    "find_orbit": "orbit = ns.find_orbit(support, progress=False)",
    "continue_orbit": "ns.continue_orbit(orbit, 'rho', (0.25, 0.35))",
    "lyapunov": "ns.lyapunov(support, periods=200, progress=False)",
    "basins": "ns.basins(support, {'x': np.linspace(-0.02, 0.02, 8), 'v': np.linspace(-0.1, 0.1, 8)}, progress=False)",
    "plot": "ns.plot.bifurcation(ns.sweep(support, 'rho', np.linspace(0.25, 0.35, 11), transient=100, progress=False))",
    "relief valve": VALVE,
}
# Two models of one kind, so that the second finds all but its own code compiled.
NONLINEAR = """
def swing(t, u, p):
    x, v = u
    return v, p.rho * np.cos(p.omega * t) - p.c * v - {force}

model = ns.System(
    states={{"x": "", "v": ""}}, parameters={{"rho": 0.4, "omega": 1.2, "c": 0.2, "g": 0.6, "r": 0.7}},
    modes={{"swing": swing}}, indicators={{"stop": lambda t, u, p: p.g - u.x}},
    transitions=[ns.Transition("swing", "swing", when="stop < 0", reset=lambda t, u, p: (p.g, -p.r * u.v))],
)
ns.simulate(model, periods=20, transient=100)
"""
# Masses in a row with stops: numbers of states that nothing was compiled for by itself.
ROW = """
n = {masses}
K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
names = [f"q{{i + 1}}" for i in range(n)]
row = ns.mechanical(
    np.eye(n).tolist(), (0.05 * K).tolist(), K.tolist(), parameters={{}}, coordinates=names,
    forcing={{"q1": lambda t, p: 0.5 * np.cos(0.7 * t)}},
    elements={{f"s_{{q}}": ns.elements.Stop(at=q, position=0.4, restitution=0.7) for q in names[n - {stops} :]}},
)
ns.simulate(row, periods=10)
"""
ORBIT = "ns.find_orbit(model, progress=False).floquet_multipliers"
PENDULUM = {"first result": NONLINEAR.format(force="np.sin(x)"), "orbit with multipliers": ORBIT}
DUFFING = {"first result": NONLINEAR.format(force="x - 0.4 * x**3"), "orbit with multipliers": ORBIT}


def seconds(steps: dict[str, str], folder: str) -> Steps:
    """Return the seconds of each step in a new process, with imports first and the whole process last."""
    parts = {"import": IMPORT, **steps}
    text = [
        "import json, os, warnings",
        "from time import perf_counter",
        "os.environ['MPLBACKEND'] = 'Agg'",
        "warnings.simplefilter('ignore')",
        "seconds = {}",
    ]
    for name, code in parts.items():
        text += ["begin = perf_counter()", code, f"seconds[{name!r}] = perf_counter() - begin"]
    text.append("print(json.dumps(seconds))")
    begin = perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(text)],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        env={**os.environ, "NONSMOOTH_CACHE_DIR": folder},
    )
    found: Steps = json.loads(done.stdout.splitlines()[-1])
    return {**found, "whole process": perf_counter() - begin}


def newcomer(folder: str) -> Steps:
    """Return the seconds of the README's first lines on a terminal, to the first byte shown and to the figure."""
    import pty

    readme = (HERE.parent / "README.md").read_text(encoding="utf-8")
    code = re.findall(r"^```python\n(.*?)^```", readme, re.MULTILINE | re.DOTALL)[0]
    environment = {**os.environ, "NONSMOOTH_CACHE_DIR": folder, "MPLBACKEND": "Agg", "TERM": "xterm"}
    ours, theirs = pty.openpty()
    found: Steps = {}
    with tempfile.TemporaryDirectory() as place:
        begin = perf_counter()
        program = subprocess.Popen(
            [sys.executable, "-c", code],
            cwd=place,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=theirs,
            stderr=theirs,
        )
        os.close(theirs)
        try:
            while os.read(ours, 4096):
                found.setdefault("first byte", perf_counter() - begin)
        except OSError:  # Linux says so where nobody writes any more
            pass
        assert program.wait() == 0 and (Path(place) / "fig11.pdf").is_file()
        found["figure"] = perf_counter() - begin
    os.close(ours)
    return found


def processor(*words: str) -> float:
    """The seconds of a processor that a command takes, the least of five."""
    taken = []
    for _ in range(5):
        begin = os.times()
        subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
        end = os.times()
        taken.append(end.children_user - begin.children_user + end.children_system - begin.children_system)
    return min(taken)


def measured() -> dict[str, Steps]:
    """Every scenario once."""
    found = {}
    found["seconds of a processor"] = {
        "import nonsmooth": processor("-c", "import nonsmooth"),
        "nonsmooth --help": processor("-m", "nonsmooth", "--help"),
    }
    with tempfile.TemporaryDirectory() as folder:
        found["empty cache: the README's ten lines"] = newcomer(folder)
        found["warm cache: the README's ten lines"] = newcomer(folder)
    with tempfile.TemporaryDirectory() as folder:
        found["empty cache: the first simulate"] = seconds(SIMULATE, folder)
        found["warm cache: the first simulate"] = seconds(SIMULATE, folder)
    for name, masses, stops in (("ten degrees of freedom with a stop", 10, 1), ("100 states with ten stops", 50, 10)):
        with tempfile.TemporaryDirectory() as folder:
            found[f"empty cache: {name}"] = seconds({"simulate": ROW.format(masses=masses, stops=stops)}, folder)
    with tempfile.TemporaryDirectory() as folder:
        found["empty cache: a first hour"] = seconds(ALL, folder)
        found["warm cache: a first hour"] = seconds(ALL, folder)
    with tempfile.TemporaryDirectory() as folder:
        found["empty cache: a nonlinear model"] = seconds(PENDULUM, folder)
        found["warm kernels: a new nonlinear model"] = seconds(DUFFING, folder)
        found["warm cache: the same nonlinear model"] = seconds(DUFFING, folder)
    return found


def main() -> int:
    import machine

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repeats", nargs="?", type=int, default=1)
    options = parser.parse_args()
    print("\n".join(f"- {fact}" for fact in machine.facts() if fact))
    runs = [measured() for _ in range(options.repeats)]
    for scenario, steps in runs[0].items():
        print(f"\n{scenario}")
        for step in steps:
            print(f"  {step:24}{median(run[scenario][step] for run in runs):7.2f} s")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
