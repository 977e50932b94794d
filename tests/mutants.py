"""Apply small mistakes to the sources one by one and see that a test fails: ``python tests/mutants.py [part of name]``.

``--tests FILE`` takes those that tests of that file are to catch.

``mutants.toml`` lists them: the file, the text and what it becomes, and the tests that state the fact. A mutant that
all of them survive is a hole in the tests, and one whose text has moved says nothing: exit code 1. The sources
themselves are not touched; a copy is.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent
SOURCES = ("src", "studies/savi2007/src")


LONGEST = 600  # seconds of one test, kernels compiled anew included: a mutant that hangs is caught


def passes(tests: list[str], copy: Path) -> bool:
    """Return True where the tests pass with the packages of a copy."""
    paths = os.pathsep.join(str(copy / one) for one in SOURCES)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            "-n",
            "0",
            "-p",
            "no:cacheprovider",
            "-o",
            f"faulthandler_timeout={LONGEST}",
            *tests,
        ],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    if done.returncode not in (0, 1):
        raise SystemExit(f"pytest could not run {' '.join(tests)}:\n{done.stdout}{done.stderr}")
    return done.returncode == 0


def main(wanted: str, file: str) -> int:
    listed = tomllib.loads((HERE / "mutants.toml").read_text())["mutant"]
    mutants = [one for one in listed if wanted in one["name"] and any(file in test for test in one["tests"])]
    survivors, moved = [], 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for one in SOURCES:
            shutil.copytree(ROOT / one, copy / one, ignore=shutil.ignore_patterns("__pycache__"))
        every = sorted({test for one in mutants for test in one["tests"]})
        if every and not passes(every, copy):
            raise SystemExit(f"these tests do not pass as it is: {' '.join(every)}")
        for one in mutants:
            path = copy / one["file"]
            text = path.read_text(encoding="utf-8") if path.is_file() else ""
            if text.count(one["old"]) != 1:
                print(f"MOVED     {one['name']}: stands {text.count(one['old'])} times in {one['file']}: {one['old']}")
                moved += 1
                continue
            path.write_text(text.replace(one["old"], one["new"]), encoding="utf-8")
            survives = passes(one["tests"], copy)
            path.write_text(text, encoding="utf-8")
            print(f"{'SURVIVES' if survives else 'caught  '}  {one['name']}", flush=True)
            survivors += [one["name"]] * survives
    print(f"{len(mutants)} mutants, {len(survivors)} survive, {moved} have moved")
    return int(bool(survivors) or moved > 0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="apply small mistakes one by one and see that a test fails")
    parser.add_argument("wanted", nargs="?", default="", help="a part of their names")
    parser.add_argument("--tests", default="", metavar="FILE", help="those that tests of this file are to catch")
    given = parser.parse_args()
    sys.exit(main(given.wanted, given.tests))
