"""The build of a wheel: a killed compile leaves nothing behind; the sdist holds what the checkout does."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
import textwrap
import time
import tomllib
import types
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
posix = pytest.mark.skipif(not hasattr(os, "killpg"), reason="groups of processes are POSIX")

#: Starts a process that never ends by itself, as a pool's worker whose parent was killed, and tells its number.
FAMILY = """
import subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
open({file!r}, "w").write(str(child.pid))
print("begun", flush=True)
{then}
"""


@pytest.fixture
def hook(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module, without hatchling, which only a build installs."""
    name = "hatchling.builders.hooks.plugin.interface"
    monkeypatch.setitem(sys.modules, name, types.SimpleNamespace(BuildHookInterface=object))
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def is_gone(number: int) -> bool:
    """Return whether a process has ended; one that nobody has waited for has."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        try:
            os.kill(number, 0)
            if Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except OSError:
            return True
        time.sleep(0.05)
    return False


@posix
def test_a_killed_compile_ends_with_all_that_it_started(hook: Any, tmp_path: Path) -> None:
    file = tmp_path / "child"
    then = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    began = time.monotonic()
    code, said = hook.run_apart(FAMILY.format(file=str(file), then=then), [], dict(os.environ))
    assert (code, said) == (-signal.SIGKILL, "begun\n")
    assert time.monotonic() - began < 60
    assert is_gone(int(file.read_text()))


@posix
def test_a_compile_ends_with_the_build_that_was_killed(tmp_path: Path) -> None:
    file = tmp_path / "child"
    script = textwrap.dedent(f"""
        import importlib.util, os, sys, types
        sys.modules["hatchling.builders.hooks.plugin.interface"] = types.SimpleNamespace(BuildHookInterface=object)
        spec = importlib.util.spec_from_file_location("hatch_build", {str(ROOT / "hatch_build.py")!r})
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        module.run_apart({FAMILY.format(file=str(file), then="time.sleep(600)")!r}, [], dict(os.environ))
    """)
    build = subprocess.Popen([sys.executable, "-c", script])
    end = time.monotonic() + 60
    while not (file.exists() and file.read_text()):
        assert time.monotonic() < end
        time.sleep(0.05)
    build.kill()
    build.wait()
    assert is_gone(int(file.read_text()))


def test_what_a_compile_prints_and_its_exit_code(hook: Any) -> None:
    code = "import sys; print(sys.argv[1:]); raise SystemExit(5)"
    assert hook.run_apart(code, ["a", "--into", "b"], dict(os.environ)) == (5, "['a', '--into', 'b']\n")


def test_the_sdist_holds_every_file_of_the_checkout() -> None:
    """All that lies at its top, but for what says which files git leaves out."""
    done = subprocess.run(["git", "-C", str(ROOT), "ls-files"], capture_output=True, text=True)
    if done.returncode:
        pytest.skip("this is no checkout")
    top = {line.partition("/")[0] for line in done.stdout.splitlines()}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    named = set(project["tool"]["hatch"]["build"]["targets"]["sdist"]["include"])
    assert top - {".gitignore", "pyproject.toml"} <= named  # these two are always in it
