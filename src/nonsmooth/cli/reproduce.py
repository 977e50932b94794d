"""``nonsmooth reproduce STUDY``: the figures, data and report of a published paper."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from nonsmooth.cli.files import without_screen


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "reproduce",
        help="reproduce a published study",
        description="Compute the figures, the data and the report of a published study. What its authors measured is "
        "measured on a virtual rig: synthetic, and labelled so.",
        epilog="examples:\n"
        "  nonsmooth reproduce savi2007\n"
        "  nonsmooth reproduce savi2007 --quick --figure 11 --figure 13",
    )
    parser.add_argument("study", metavar="STUDY", help="the study, for example savi2007")
    parser.add_argument(
        "--figure",
        action="append",
        metavar="N",
        help="only this figure of the paper, by model and rig, or one by its name (fig11_rig, table1, eta, ...); "
        "may be repeated",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where to write (default: out/STUDY, with --quick out/STUDY_quick); what an earlier or an interrupted run "
        "finished there is used again",
    )
    parser.add_argument("--quick", action="store_true", help="coarser grids and shorter runs: a first look")
    parser.add_argument(
        "--full", action="store_true", help="large charts over two parameters too; an interrupted run goes on"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bars")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.studies import installed, study

    out = options.out or Path("out") / (options.study + "_quick" * options.quick)
    # what follows loads the numerics: that takes a second or more
    if options.study in installed() and not options.quiet and sys.stderr.isatty():
        print(f"reproducing {options.study} into {out}", file=sys.stderr, flush=True)
    without_screen()
    study(options.study).reproduce(
        out=out, figures=options.figure, quick=options.quick, full=options.full, progress=not options.quiet
    )
    print(f"written to {out}", file=sys.stderr)
    return 0
