"""Output of a program in a process of its own, with this one's paths: counts without compilation, runs simulated."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
SCRIPTS = HERE.parent / "tests" / "diagrams"  # those that run under Numba's simulator


def printed(*arguments: str, given: str = "", **environment: str) -> str:
    """Return what ``python *arguments`` prints, with further environment variables; an error where it fails."""
    paths = os.pathsep.join([*sys.path, str(HERE), str(SCRIPTS)])
    return subprocess.run(
        [sys.executable, *arguments],
        input=given,
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": paths, **environment},
    ).stdout
