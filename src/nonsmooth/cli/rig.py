"""``nonsmooth rig``: recordings of a virtual rig, as a lab would have them; all of them labelled synthetic."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "rig",
        help="record on a virtual rig",
        description="Write the recordings of a virtual rig (Savi et al. 2007, Fig. 3) into a session folder, with the "
        "notebook session.toml. What the rig really is goes to a file beside the folder. Everything is labelled "
        "synthetic.",
        epilog="examples:\n"
        "  nonsmooth rig --seed 3 --out session\n"
        "  nonsmooth rig --figure 9 --out figure9\n"
        "  nonsmooth rig --out decays --procedures springs impulse",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="draws the rig and its noise (default 0)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the session folder, made if needed")
    parser.add_argument(
        "--figure",
        type=int,
        metavar="N",
        help="what stands behind one of the paper's Figs. 4 to 18, on a rig with the published parameters",
    )
    parser.add_argument(
        "--procedures",
        nargs="+",
        metavar="NAME",
        help="which to record: springs, support, impulse, drop, response, voltage, crank, grazing, contact (all of "
        "these where not given), rise, section",
    )
    parser.add_argument("--truth", type=Path, metavar="FILE", help="where the truth goes (default: DIR.truth.toml)")
    parser.add_argument("--quiet", action="store_true", help="no summary")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.studies import study

    rig = study("savi2007", "rig")
    if options.figure is not None and options.procedures:
        raise ValueError("give --figure or --procedures, not both: a figure says itself what is to be recorded")
    if options.figure is None:
        folder = rig.VirtualRig(options.seed).write_session(options.out, options.procedures, truth=options.truth)
    else:
        folder = rig.VirtualRig.published(options.seed).write_figure(options.figure, options.out, truth=options.truth)
    if not options.quiet:
        for file in sorted(path.name for path in folder.iterdir() if path.is_file()):
            print(f"written to {folder / file}")
        print(f"the truth, not to be shown to who identifies: {rig.truth_path(folder, options.truth)}")
    return 0
