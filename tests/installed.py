"""Build sdist and wheel, install the wheel in an empty environment and run the README's ten lines: ``make installed``.

``make wheels`` (``--wheels FOLDER``) leaves two wheels there, one with kernels for any Linux of this Python and a plain
one, each tried likewise. A wheel takes the kernels that were compiled ahead in this checkout. Where the lines run,
neither a compiler nor make is on the path, the checkout is not in sight and the cache is empty: nothing is compiled but
the sweep's own model.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
MOST = 20.0  # seconds of processor time for the ten lines, with nothing in any cache; a compiled march adds as much
IN_SIGHT = ("PYTHONPATH", "VIRTUAL_ENV", "NONSMOOTH_CACHE_DIR", "HATCH_BUILD_NO_HOOKS", "PYTHONDONTWRITEBYTECODE")


def run(words: list[str], folder: Path, **environment: str) -> float:
    """Run a command in a folder; the seconds of processor time that it took."""
    begun = os.times()
    known = {name: value for name, value in os.environ.items() if name not in IN_SIGHT}
    subprocess.run(words, cwd=folder, env=known | environment, check=True, stdin=subprocess.DEVNULL)
    ended = os.times()
    return ended.children_user - begun.children_user + ended.children_system - begun.children_system


def tracked() -> set[str]:
    """Files of the checkout."""
    done = subprocess.run(["git", "-C", str(ROOT), "ls-files"], capture_output=True, text=True, check=True)
    return {name for name in done.stdout.splitlines() if Path(name).name != ".gitignore"}


def check_contents(sdist: Path, wheel: Path) -> None:
    """Raise where a file of the checkout is missing in one of both."""
    with tarfile.open(sdist) as held:
        names = {name.partition("/")[2] for name in held.getnames()}
    missing = tracked() - names
    assert not missing, f"{sdist.name} lacks {sorted(missing)}"
    packed = set(zipfile.ZipFile(wheel).namelist())
    missing = {name.removeprefix("src/") for name in tracked() if name.startswith("src/")} - packed
    assert not missing, f"{wheel.name} lacks {sorted(missing)}"
    assert any("/kernels/ahead/" in name for name in packed), f"{wheel.name} brings no compiled kernels"


def build(dist: Path, *what: str, **environment: str) -> None:
    """Build what is wanted in a folder."""
    kept = {"PYTHONPATH": os.environ["PYTHONPATH"]} if "PYTHONPATH" in os.environ else {}
    took = run([sys.executable, "-m", "hatchling", "build", "-d", str(dist), *what], ROOT, **kept, **environment)
    print(f"built: {took:.0f} s of processor time", flush=True)


def try_out(wheel: Path) -> float:
    """Install a wheel in an empty environment and run the README's ten lines there: seconds of processor time."""
    with tempfile.TemporaryDirectory(prefix="nonsmooth-installed-") as place:
        folder, begun = Path(place), time.monotonic()
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
        run([sys.executable, "-m", "venv", str(folder / "venv")], folder)
        programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
        took = run([str(programs / "python"), "-m", "pip", "install", "-qq", "--no-compile", str(wheel)], folder)
        print(f"installed with what it needs: {took:.0f} s", flush=True)
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        lines = re.search(r"^## Ten lines\n.*?^```python\n(.*?)^```", readme, re.MULTILINE | re.DOTALL)
        assert lines is not None
        (folder / "ten_lines.py").write_text(lines[1], encoding="utf-8")
        alone = {"PATH": str(programs), "MPLBACKEND": "Agg", "NONSMOOTH_CACHE_DIR": str(folder / "cache")}
        took = run([str(programs / "python"), "ten_lines.py"], folder, **alone)
        whole = time.monotonic() - begun
        print(f"the README's ten lines: {took:.1f} s; by the clock, all in all: {whole:.0f} s", flush=True)
        assert (folder / "fig11.nc").is_file() and (folder / "fig11.pdf").stat().st_size > 1000
    return took


def main() -> int:
    if sys.argv[1:2] == ["--wheels"]:
        dist = Path(sys.argv[2])
        machine = platform.machine()
        build(dist, "-t", "wheel", NONSMOOTH_PLATFORM=f"manylinux_2_17_{machine}")
        build(dist, "-t", "wheel", HATCH_BUILD_NO_HOOKS="true")
        for wheel in sorted(dist.glob("*.whl")):
            try_out(wheel)
        return 0
    with tempfile.TemporaryDirectory(prefix="nonsmooth-built-") as place:
        build(Path(place))
        [sdist], [wheel] = (list(Path(place).glob(one)) for one in ("*.tar.gz", "*.whl"))
        check_contents(sdist, wheel)
        took = try_out(wheel)
    assert took < MOST, f"the ten lines took {took:.1f} s; something was compiled that the wheel should bring"
    return 0


if __name__ == "__main__":
    sys.exit(main())
