"""A child that is forked while another thread compiles can compile too."""

from __future__ import annotations

import os
import subprocess
import sys
import uuid

import pytest

SCRIPT = '''
import os, sys, threading, time, warnings
import nonsmooth
from nonsmooth.kernels.compile import cache

warnings.simplefilter("ignore")  # later Pythons warn of any fork beside threads
SOURCE = """
from math import sin
from nonsmooth.kernels.compile.cache import callback

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
