"""Ctrl-C ends what was asked for: no verb and no caller goes on with a part of a result as if it were whole."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import nonsmooth
from nonsmooth.cli import main as cli
from nonsmooth.continuation.problems.curve import Curve

SOURCES = Path(nonsmooth.__file__).parent
#: Who may catch Ctrl-C without raising it at once, and why.
CATCHES = {
    "continuation/march/march.py: march",  # unless_interrupted raises it with what was found
    "campaign/run.py: run",  # a worker hands it to the thread that waits, which raises it
    "cli/main.py: _answer",  # the exit code 130
    "explorer/worker.py: _answer",  # the process that asked is told that the work was cancelled
}


def test_ctrl_c_is_caught_in_four_places_only() -> None:
    found = set()
    for path in SOURCES.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for function in ast.walk(ast.parse(text)) if re.search(NAMED, text) else ():
            if isinstance(function, ast.FunctionDef):
                own = [node for node in ast.walk(function) if isinstance(node, ast.ExceptHandler)]
                if any(_catches(one) and not isinstance(one.body[-1], ast.Raise) for one in own):
                    found.add((function.name, path.relative_to(SOURCES).as_posix()))
    found.discard(("over_items", "campaign/run.py"))  # it holds `run`
    assert {f"{path}: {name}" for name, path in found} == CATCHES


#: What a file has that catches it.
NAMED = r"KeyboardInterrupt|BaseException|Interrupted|except\s*:"


def _catches(handler: ast.ExceptHandler) -> bool:
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in ("KeyboardInterrupt", "BaseException", "Interrupted")
        for node in ast.walk(handler.type)
    )


def test_ctrl_c_while_a_study_follows_a_branch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 130, and neither a figure of a part of the branch nor a report."""
    steps, step = iter(range(11)), Curve.step

    def interrupted(*arguments: Any) -> Any:
        if next(steps, None) == 10:
            raise KeyboardInterrupt
        return step(*arguments)

    monkeypatch.setattr(Curve, "step", interrupted)
    arguments = ["reproduce", "savi2007", "--quick", "--quiet", "--figure", "fig13", "--out", str(tmp_path)]
    assert cli.main(arguments) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "nonsmooth: interrupted"
    assert next(steps, None) is None  # it was a branch that was interrupted
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".nc", ".md", ".html", ".pdf", ".png")]


LONG = """
import faulthandler, os, signal, threading, time, warnings
import nonsmooth as ns

faulthandler.dump_traceback_later(280, exit=True)  # says where it is
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs are begun deaf to Ctrl-C
warnings.simplefilter("ignore")
o = ns.models.discontinuous_support().with_parameters(rho=0.2)  # chaotic: what repeats itself is not run
valve, top = ns.models.relief_valve(), ns.Poincare("lift_velocity", rising=False)
two = {"rho": [0.2, 0.201], "omega": [3.69, 3.691]}
cases = {  # each short, to compile what it needs, then long
    "a step of 1e-9": lambda long: ns.simulate(o, duration=0.9, method="taylor", step=1e-9 if long else 0.01),
    "a period of 1e12": lambda long: ns.simulate(
        o.with_parameters(omega=1e-12 if long else 1.0), periods=1, samples=2, method="exact"
    ),
    "a long transient": lambda long: ns.poincare(o, n=2, transient=10**8 if long else 1),
    "by Runge-Kutta": lambda long: ns.poincare(o, n=2, transient=10**8 if long else 1, method="rkf45"),
    "on a surface": lambda long: ns.poincare(
        valve, n=2, transient=10**8 if long else 1, start=[0.2, 0.0, 10.0], section=top
    ),
    "one value of a sweep": lambda long: ns.sweep(o, "rho", [0.2], transient=2 * 10**7 if long else 1),
    "a chart": lambda long: ns.chart(o, two, transient=2 * 10**7 if long else 1, stop_early=False),
    "exponents": lambda long: ns.lyapunov(o, periods=10**7 if long else 100),
}
for name, call in cases.items():
    call(False)
    began = []
    def interrupt():
        began.append(time.process_time())
        os.kill(os.getpid(), signal.SIGINT)
    try:
        threading.Timer(0.1, interrupt).start()
        call(True)
        print(name, "came to its end", flush=True)
    except KeyboardInterrupt:
        print(name, "took", time.process_time() - began[0], flush=True)
"""


def test_every_verb_ends_soon_after_ctrl_c() -> None:
    """Whatever the length of a transient, a period or a step: kernels pause. 2 s are promised on a quiet machine: of
    processor time, that of two threads."""
    done = subprocess.run([sys.executable, "-c", LONG], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 8
    for line in lines:
        assert " took " in line, line
        assert float(line.rpartition(" ")[2]) < 4.0, line
