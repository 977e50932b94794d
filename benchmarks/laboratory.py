"""Processor time of ``identify`` and ``compare`` of a session of a virtual rig: ``python -m benchmarks.laboratory``.

``--session FOLDER`` takes a session at hand in place of a fresh one. Each command runs in a process of its own, whose
user and system time is printed: it depends less on other work on the machine than the time by the clock. The first run
of an empty cache also compiles: run it twice.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

PROCEDURES = (
    "springs",
    "support",
    "impulse",
    "drop",
    "response",
    "voltage",
    "crank",
    "grazing",
    "contact",
    "rise",
    "section",
)


def spent(*arguments: str) -> float:
    """User and system time (s) of the command with these arguments."""
    before = os.times()
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "nonsmooth.cli.main", *arguments], stdout=subprocess.DEVNULL, check=False
    )
    after = os.times()
    if done.returncode not in (0, 3):
        raise SystemExit(done.returncode)
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    """Print processor times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--session", type=Path, help="a session folder; a virtual rig's with seed 3 where not given")
    given = parser.parse_args().session
    with tempfile.TemporaryDirectory() as folder:
        session, found = given or Path(folder) / "rig", Path(folder) / "found.nc"
        if given is None:
            time = spent("rig", "--seed", "3", "--out", str(session), "--quiet", "--procedures", *PROCEDURES)
            print(f"rig       {time:6.1f} s")
        print(f"identify  {spent('identify', str(session), '--out', str(found), '--quiet'):6.1f} s")
        both = ("--identified", str(found), "--identified-from", str(session))
        print(f"compare   {spent('compare', str(session), *both, '--quiet'):6.1f} s", flush=True)


if __name__ == "__main__":
    main()
