"""Compiles what no model changes when the package is built: into a wheel for this Python and this kind of processor.

Nothing depends on it. Where it fails, or `HATCH_BUILD_NO_HOOKS=true` leaves it out, the wheel has the sources alone and
kernels are compiled when they are first called. `NONSMOOTH_LEVELS` names the levels of the architecture to be made (by
default that of this processor), `NONSMOOTH_PLATFORM` the platform in the wheel's name (by default that of this machine:
the kernels are no libraries, and know nothing of the system that they were made on).
"""

import os
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Its pipe from the process that builds closes when that one ends, in whatever way.
_WATCH = """
import os, signal, threading
def end():
    os.read(0, 1)
    os.killpg(0, signal.SIGKILL)
if hasattr(os, "killpg"):
    threading.Thread(target=end, daemon=True).start()
"""
_COMPILE = "from nonsmooth.kernels.compile.ahead import main\nraise SystemExit(main())"


class CompileAhead(BuildHookInterface):  # type: ignore[misc]
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """An editable install reads its kernels from the checkout, a wheel brings them along."""
        sources = Path(self.root) / "src"
        arguments = os.environ.get("NONSMOOTH_LEVELS", "").split()
        if version != "editable":
            self.folder = tempfile.TemporaryDirectory()
            arguments += ["--into", self.folder.name]
        paths = os.pathsep.join([str(sources), *filter(None, [os.environ.get("PYTHONPATH")])])
        code, said = run_apart(_COMPILE, arguments, {**os.environ, "PYTHONPATH": paths})
        if code:
            self.app.display_warning(f"nothing is compiled ahead; kernels will be when they are called:\n{said}")
        elif version != "editable" and any(Path(self.folder.name).iterdir()):
            build_data["force_include"][self.folder.name] = "nonsmooth/kernels/ahead"
            build_data["pure_python"] = False
            if platform := os.environ.get("NONSMOOTH_PLATFORM"):
                python = f"cp{sys.version_info.major}{sys.version_info.minor}"
                build_data["tag"] = f"{python}-{python}-{platform}"
            else:
                build_data["infer_tag"] = True


def run_apart(code: str, arguments: list[str], environment: dict[str, str]) -> tuple[int, str]:
    """Run Python in a process; its exit code and what it printed.

    It and the processes that it starts are a group, which ends when that process ends and when this one does, killed
    or not: none of them is left for the installer to wait for."""
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said:  # a pipe waits for all who have it
        process = subprocess.Popen(
            [sys.executable, "-c", _WATCH + code, *arguments],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=said,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            process.wait()
        finally:
            with suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
            process.wait()
        said.seek(0)
        return process.returncode, said.read()
