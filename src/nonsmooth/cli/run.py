"""``nonsmooth run STUDY.toml``: one verb on one system, as a study file describes it."""

from __future__ import annotations

import argparse
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "run",
        help="run a study file",
        description="Run a study file: a system, one analysis of it, and where the result goes. "
        "Paths in the file are relative to the file.",
        epilog="examples:\n"
        "  nonsmooth run fig11.toml\n"
        "  nonsmooth run chart.toml --store chart.zarr          # go on after an interruption\n"
        "  nonsmooth run chart.toml --store chart.zarr --scheduler tcp://10.0.0.1:8786",
    )
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="the study file")
    parser.add_argument(
        "--store",
        type=Path,
        metavar="STORE.zarr",
        help="keep finished chunks of a chart or of basins there, and go on from what is there (or [output] store)",
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="compute the chunks on the workers of this Dask scheduler (tcp://...)"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bars, no summary")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.cli.show import summary
    from nonsmooth.cli.study import read_study

    study = read_study(options.study)
    from nonsmooth.campaign.run import connect

    began = time.perf_counter()
    store = options.store or study.store
    if store and "data" in study.output and store.resolve() == (study.path.parent / study.output["data"]).resolve():
        raise ValueError(f"--store {store} is where the result is to be written (data): give another name")
    with nullcontext() if options.scheduler is None else connect(options.scheduler) as client:
        result = study.compute(progress=not options.quiet, store=store, client=client)
    seconds = time.perf_counter() - began
    written = study.write(result)
    if not options.quiet:
        print(summary(result))
        print(f"computed in {seconds:.2f} s")
        for path in written:
            print(f"written to {path}")
        if store:
            print(f"chunks are kept in {store}")
        if not written and not store:
            print("nothing was kept: the file has no [output] with `data`, `figure` or `store`")
    return 0
