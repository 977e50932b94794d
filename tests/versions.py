"""Run ``every_verb.py`` with the lowest and the newest versions that pyproject.toml allows: ``make versions``.

Each set of versions is installed, with the package, into an environment that is thrown away afterwards. Pythons of
other versions are tried where they are found (``python3.12`` on the path, or by pyenv); where not, that is said.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
EXTRAS = ("zarr", "explorer", "experiment", "cluster")
PYTHONS = ("3.11", "3.12", "3.13")


def lowest(project: dict) -> dict[str, str]:
    """The least version allowed of each library that the package and its extras need."""
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"], *(one for extra in EXTRAS for one in extras[extra])]
    found = [re.fullmatch(r"([\w-]+)(?:\[\w+\])?>=([\d.]+)", one) for one in wanted]
    return {one[1]: one[2] for one in found if one is not None}


def interpreter(version: str) -> str | None:
    """The program of a Python of this version."""
    if sys.version_info[:2] == tuple(map(int, version.split("."))):
        return sys.executable
    folders = sorted(Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions").glob(f"{version}.*/bin"))
    for program in (shutil.which(f"python{version}"), *(str(folder / "python") for folder in folders)):
        if program and subprocess.run([program, "-c", ""], capture_output=True).returncode == 0:
            return program
    return None


def tried(program: str, pins: list[str], what: str) -> bool:
    """Install into an environment of its own and call every verb; return True if all of them work."""
    print(f"--- {what}", flush=True)
    with tempfile.TemporaryDirectory(prefix="nonsmooth-versions-") as place:
        folder = Path(place)
        (folder / "pins.txt").write_text("\n".join(pins))
        # Run from another folder, with nothing of this checkout or of the user's cache in sight.
        environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
        environment |= {"NONSMOOTH_CACHE_DIR": place, "HATCH_BUILD_NO_HOOKS": "true", "OPENBLAS_NUM_THREADS": "1"}
        python = str(folder / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python")
        wanted = [f"{ROOT}[{','.join(EXTRAS)}]", str(ROOT / "studies" / "savi2007")]
        for command in (
            [program, "-m", "venv", str(folder / "venv")],
            [python, "-m", "pip", "install", "-qq", "-c", str(folder / "pins.txt"), *wanted],
            [python, str(ROOT / "tests" / "every_verb.py")],
        ):
            if subprocess.run(command, cwd=folder, env=environment).returncode:
                print(f"--- {what}: failed", flush=True)
                return False
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pythons", nargs="+", default=PYTHONS, metavar="VERSION")
    parser.add_argument("--pin", nargs="+", default=[], metavar="NAME==VERSION", help="instead of the lowest bounds")
    options = parser.parse_args()
    bounds = lowest(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"])
    low = options.pin or [f"{name}=={version}" for name, version in bounds.items()]
    results, missing = {}, []
    for version in options.pythons:
        program = interpreter(version)
        if program is None:
            missing.append(version)
            continue
        for pins, words in ((low, "lowest"), ([], "newest")):
            what = f"Python {version}, {' '.join(options.pin) or words}"
            if not (options.pin and words == "newest"):
                results[what] = tried(program, pins, what)
    for what, works in results.items():
        print(f"{what}: {'every verb works' if works else 'FAILED'}")
    if missing:
        print(f"not tried, since there is no such Python here: {', '.join(missing)}")
    return 0 if results and all(results.values()) else 1


if __name__ == "__main__":
    raise SystemExit(main())
