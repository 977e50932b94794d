"""``nonsmooth run STUDY.toml``: one verb on one system, as a study file describes it."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

__all__ = ["add"]


def add(commands: Any) -> None:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "run",
        help="run a study file",
        description="Run a study file: a system, one analysis of it, and where the result goes. "
        "Paths in the file are relative to the file.",
    )
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="the study file")
    parser.add_argument("--quiet", action="store_true", help="no progress bars, no summary")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from nonsmooth.cli.show import summary
    from nonsmooth.cli.study import read_study

    study = read_study(options.study)
    began = time.perf_counter()
    result = study.compute(progress=not options.quiet)
    seconds = time.perf_counter() - began
    written = study.write(result)
    if not options.quiet:
        print(summary(result))
        print(f"computed in {seconds:.2f} s")
        for path in written:
            print(f"written to {path}")
        if not written:
            print("nothing was kept: the file has no [output] with `data` or `figure`")
    return 0
