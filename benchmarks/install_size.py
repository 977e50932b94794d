"""Megabytes of a base install: the files of the package and of all that it needs, extras left out.

Run it in the environment to be measured; what else is installed there does not count. Byte code is told apart: pip
writes it, other installers do not. With ``--limit MB`` it fails where the files take more.
"""

from __future__ import annotations

import argparse
import re
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement

LARGEST = 12  # packages shown


def needed(name: str) -> dict[str, Distribution]:
    """The distributions that ``name`` needs, itself included."""
    found: dict[str, Distribution] = {}
    queue = [name]
    while queue:
        one = re.sub(r"[-_.]+", "-", queue.pop()).lower()
        if one in found:
            continue
        try:
            found[one] = distribution(one)
        except PackageNotFoundError:
            raise SystemExit(f"{one} is not installed here: install the package first") from None
        requirements = map(Requirement, found[one].requires or ())
        queue += [r.name for r in requirements if r.marker is None or r.marker.evaluate({"extra": ""})]
    return found


def size(package: Distribution) -> tuple[int, int, int]:
    """Bytes of a distribution's files, of its byte code, and of the disk that the former take."""
    files = {Path(str(package.locate_file(file))) for file in package.files or ()}
    if package.name == "nonsmooth":  # an editable install lists none of them
        import nonsmooth

        files |= set(Path(nonsmooth.__file__).parent.rglob("*"))
    there = {file: file.stat() for file in files if file.is_file()}
    code = sum(found.st_size for file, found in there.items() if file.suffix == ".pyc")
    plain = [found for file, found in there.items() if file.suffix != ".pyc"]
    return sum(found.st_size for found in plain), code, sum(512 * found.st_blocks for found in plain)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--limit", type=float, metavar="MB", help="fail where the files take more")
    options = parser.parse_args()
    sizes = {name: size(package) for name, package in needed("nonsmooth").items()}
    for name, (files, *_) in sorted(sizes.items(), key=lambda item: -item[1][0])[:LARGEST]:
        print(f"  {name:20}{files / 1e6:7.1f} MB")
    total, code, disk = (sum(column) for column in zip(*sizes.values(), strict=True))
    print(f"{len(sizes)} packages: {total / 1e6:.0f} MB of files, for which the disk needs {disk / 2**20:.0f} MiB;")
    print(f"besides, {code / 1e6:.0f} MB of byte code")
    return int(options.limit is not None and total / 1e6 > options.limit)


if __name__ == "__main__":
    raise SystemExit(main())
