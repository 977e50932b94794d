"""What a command loads before it has work to do: neither compilers nor symbols nor figures."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("sympy", "numba", "xarray", "matplotlib", "scipy", "tqdm", "numpy", "pandas")


@pytest.mark.parametrize("module", ["nonsmooth.cli.main", "nonsmooth.plot"])
def test_nothing_heavy_is_loaded(module: str) -> None:
    heavy = HEAVY if module == "nonsmooth.cli.main" else ("numba", "matplotlib", "scipy")
    code = f"import sys, {module}; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_ctrl_c_in_a_process_gives_130_and_one_line() -> None:
    code = (
        "import sys, signal, os\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a job in the background inherits "ignore"
        "from nonsmooth import models\n"
        "models.names = lambda: os.kill(os.getpid(), signal.SIGINT)\n"
        "from nonsmooth.cli.main import main\n"
        "sys.exit(main(['models']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr == "nonsmooth: interrupted\n"
