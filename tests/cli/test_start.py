"""The command line before it has work to do (what it loads: ``tests/test_import.py``), and when it is interrupted."""

from __future__ import annotations

import subprocess
import sys


def test_plot_loads_no_library_before_it_draws() -> None:
    code = "import sys, nonsmooth.plot; print(bool({'numba', 'matplotlib', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


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
