"""``nonsmooth plan STUDY.toml``: what a chart would take, on processors and on the GPU, before it is started."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "plan",
        help="say what a chart would take",
        description="Run a small sample of a chart's points and print what the whole would take: time, memory, and "
        "the bytes of a store. Where this machine has a GPU, a sample is run on it too.",
        epilog="examples:\n  nonsmooth plan chart.toml\n  nonsmooth plan chart.toml --workers 256 --seconds 20",
    )
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="a study file with a table [chart]")
    parser.add_argument("--workers", type=int, help="cores of a cluster to reckon with")
    parser.add_argument("--seconds", type=float, default=5.0, help="time to spend on the sample (default: 5)")
    return parser


def run(options: argparse.Namespace) -> int:
    for library in ("h5netcdf", "xarray"):  # what the run itself loads counts in its memory
        import_module(library)

    from nonsmooth.campaign.plan import plan
    from nonsmooth.campaign.work import STORED
    from nonsmooth.cli.study import read_study
    from nonsmooth.diagrams.chart import plan_chart
    from nonsmooth.flow.engines.devices import BATCH
    from nonsmooth.system.kinds import real_number, whole_number

    if options.workers is not None:
        whole_number(options.workers, "--workers", 1)
    if not real_number(options.seconds, "--seconds") > 0:
        raise ValueError(f"--seconds {options.seconds:g}: the time to spend on the sample must be positive")
    study = read_study(options.study)
    if study.verb != "chart":
        raise ValueError(f"{options.study}: plan is for charts, this study runs {study.verb}")
    work = plan_chart(study.system, **{**study.options, "device": "cpu"}).work
    kept = BATCH if study.options.get("device") == "cuda" else STORED
    found = plan(work, seconds=options.seconds, kept=kept)
    print(found.text(options.workers))
    print(_on_gpu(study.system, study.options, options.seconds))
    if study.options.get("refine"):
        print("refine      computes a part of these points; the time above is that of all")
    return 0


def _on_gpu(system: Any, given: Mapping[str, Any], seconds: float) -> str:
    """A line about the GPU: measured where there is one, else why there is no number."""
    from nonsmooth.diagrams.chart import plan_chart
    from nonsmooth.diagrams.chart_plan import plan_on_gpu

    try:
        work = plan_chart(system, **{**given, "device": "cuda"}).work
    except (ValueError, ImportError, RuntimeError) as why:  # the processor's plan was made of the same options
        return f"gpu         not measured, so no estimate: {why}"
    return plan_on_gpu(work, seconds=seconds).text()
