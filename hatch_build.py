"""Compiles what no model changes when the package is built: into a wheel for this Python and this kind of processor.

Nothing depends on it. Where it fails, or `HATCH_BUILD_NO_HOOKS=true` leaves it out, the wheel has the sources alone and
kernels are compiled when they are first called. `NONSMOOTH_LEVELS` names the levels of the architecture to be made (by
default that of this processor).
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompileAhead(BuildHookInterface):  # type: ignore[misc]
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """An editable install reads its kernels from the checkout, a wheel brings them along."""
        sources = Path(self.root) / "src"
        arguments = os.environ.get("NONSMOOTH_LEVELS", "").split()
        if version != "editable":
            self.folder = tempfile.TemporaryDirectory()
            arguments += ["--into", self.folder.name]
        paths = os.pathsep.join([str(sources), *filter(None, [os.environ.get("PYTHONPATH")])])
        done = subprocess.run(
            [sys.executable, "-m", "nonsmooth.kernels.compile.ahead", *arguments],
            env={**os.environ, "PYTHONPATH": paths}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        if done.returncode:
            self.app.display_warning(f"nothing is compiled ahead; kernels will be when they are called:\n{done.stdout}")
        elif version != "editable" and any(Path(self.folder.name).iterdir()):
            build_data["force_include"][self.folder.name] = "nonsmooth/kernels/ahead"
            build_data["pure_python"] = False
            build_data["infer_tag"] = True
