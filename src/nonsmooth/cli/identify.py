"""``nonsmooth identify SESSION``: the parameters behind a session's recordings, with their uncertainty."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

__all__ = ["add"]


def add(commands: Any) -> None:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "identify",
        help="identify parameters from a session folder",
        description="Identify the parameters of the oscillator from a folder with recordings and session.toml.",
    )
    parser.add_argument("session", type=Path, metavar="SESSION", help="folder with session.toml, or that file")
    parser.add_argument("--out", type=Path, help="write the parameters with their covariance (.nc or .zarr)")
    parser.add_argument("--crank", type=float, help="crank length (m) to whose mean position the gap is referred")
    parser.add_argument("--quiet", action="store_true", help="parameters only, no findings")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from nonsmooth.identification.chain import identify

    folder = options.session.parent if options.session.suffix == ".toml" else options.session
    found = identify(folder, crank_length=options.crank)
    print(found)
    if not options.quiet:
        for finding in found.findings:
            print(f"\n{finding}")
        print()
        for name, sentence in found.identifiability.items():
            print(f"{name}: {sentence}")
    if options.out is not None:
        from nonsmooth.results.store import save

        print(f"written to {save(found.to_dataset(), options.out)}")
    return 0
