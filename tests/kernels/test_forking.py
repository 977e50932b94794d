"""A child that is forked while another thread compiles or loads modules can do so too."""

from __future__ import annotations

import os
import subprocess
import sys
import uuid
from pathlib import Path

import pytest

SCRIPT = '''
import os, sys, threading, time, warnings
import nonsmooth
from nonsmooth.kernels.compile import cache

warnings.simplefilter("ignore")  # later Pythons warn of any fork beside threads
SOURCE = """
from math import sin
from nonsmooth.kernels.compile.direct import callback

@callback("float64(float64)")
def value(x):
    for i in range(10):
        x += sin({0} * x) * sin(x + {0}) / (2.0 + sin(x - {0}) * sin({0} * x) ** 3)
    return x
"""

def compile_one(number):
    return cache.load_module(SOURCE.format(number), "forked")

compile_one(NUMBER)
for attempt in range(100):  # on a busy machine a compile may be over before it is seen
    thread = threading.Thread(target=compile_one, args=(NUMBER + 10.0 + attempt,))
    thread.start()
    while thread.is_alive() and not cache._lock.locked():
        time.sleep(0.001)
    if thread.is_alive():
        break
assert thread.is_alive()
child = os.fork()
if child == 0:
    compile_one(NUMBER + 2.0)
    os._exit(7)
end = time.time() + 300
while time.time() < end:
    done, status = os.waitpid(child, os.WNOHANG)
    if done:
        break
    time.sleep(0.05)
else:
    os.kill(child, 9)
    os.waitpid(child, 0)
    sys.exit("the child waits for a lock that nobody will give back")
thread.join()
compile_one(NUMBER + 3.0)  # the locks are free in the parent too
print(os.waitstatus_to_exitcode(status))
'''


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_fork_beside_a_compile() -> None:
    script = SCRIPT.replace("NUMBER", repr(uuid.uuid4().int % 10**9 / 1e9))  # not in the cache of compiled code
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=600)
    assert (done.stdout.strip(), done.stderr) == ("7", "")


LOADING = """
import importlib, os, sys, threading, time, warnings
import nonsmooth

warnings.simplefilter("ignore")
sys.path.insert(0, FOLDER)
hung = []
for k in range(MANY):  # each while a module is loaded that the child asks for too
    thread = threading.Thread(target=importlib.import_module, args=(f"slow_{k}",))
    thread.start()
    while f"slow_{k}" not in sys.modules:
        time.sleep(0.001)
    child = os.fork()
    if child == 0:
        os._exit(0 if importlib.import_module(f"slow_{k}").whole else 1)
    end = time.monotonic() + 20
    done = 0
    while not done and time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        time.sleep(0.002)
    if not done:
        os.kill(child, 9)
        os.waitpid(child, 0)
        hung.append(k)
        break
    assert os.waitstatus_to_exitcode(status) == 0, k
    thread.join()
print("hung:", hung)
"""

WITHIN = """
import sys
import nonsmooth
sys.path.insert(0, FOLDER)
import forks_itself
print(forks_itself.status)
"""


def run(script: str, folder: Path, many: int = 1) -> str:
    code = script.replace("FOLDER", repr(str(folder))).replace("MANY", str(many))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.parametrize("many", [12, pytest.param(50, marks=pytest.mark.slow)])
def test_forks_beside_a_thread_that_loads_modules(tmp_path: Path, many: int) -> None:
    for k in range(many):
        (tmp_path / f"slow_{k}.py").write_text("import time\ntime.sleep(0.05)\nwhole = True\n")
    assert run(LOADING, tmp_path, many) == "hung: []"


ONCE = """
import functools, os, sys, threading, time, warnings
import nonsmooth

warnings.simplefilter("ignore")
class Thing:
    @functools.cached_property
    def value(self):
        began.set()
        time.sleep(0.3)
        return 7

began = threading.Event()
thread = threading.Thread(target=lambda: Thing().value)
thread.start()
began.wait()
child = os.fork()
if child == 0:
    os._exit(Thing().value)  # of another object: up to Python 3.11 all share one lock
end, done = time.monotonic() + 20, 0
while not done and time.monotonic() < end:
    done, status = os.waitpid(child, os.WNOHANG)
    time.sleep(0.01)
if not done:
    os.kill(child, 9)
print(os.waitstatus_to_exitcode(status) if done else "hung")
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_fork_beside_a_thread_that_computes_a_property(tmp_path: Path) -> None:
    assert run(ONCE, tmp_path) == "7"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_module_that_forks_while_it_is_loaded_is_not_held_up(tmp_path: Path) -> None:
    """Also where another thread waits for that module."""
    (tmp_path / "forks_itself.py").write_text(
        "import os, sys, threading, time\n"
        "threading.Thread(target=lambda: __import__('forks_itself'), daemon=True).start()\n"
        "time.sleep(0.2)\n"
        "child = os.fork()\n"
        "if child == 0:\n"
        "    os._exit(7)\n"
        "status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])\n"
    )
    assert run(WITHIN, tmp_path) == "7"
