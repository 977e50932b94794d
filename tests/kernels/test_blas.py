"""The threads of the linear algebra while something is fitted or followed, as the library itself tells them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

CODE = """
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits
from nonsmooth import blas

def told():
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]

if not told():
    raise SystemExit(77)
outer = threadpool_limits(2, user_api="blas")
two, one = [2] * len(told()), [1] * len(told())
assert told() == two
with blas.one_blas_thread():
    assert told() == one
    with blas.one_blas_thread():
        pass
    assert told() == one
assert told() == two
try:
    with blas.one_blas_thread():
        raise KeyError
except KeyError:
    pass
assert told() == two
from nonsmooth_savi2007.identification import identify
seen = []
import nonsmooth_savi2007.identification.chain as chain
chain.gather = lambda *a, **k: seen.extend(told()) or (_ for _ in ()).throw(KeyError)
try:
    identify("nowhere")
except KeyError:
    pass
assert seen == one, seen
from nonsmooth.continuation.march import march
march._Marching.__init__ = lambda *a: None
march._Marching.follow = lambda *a: seen.extend(told() + [0])
march.march(None, None, None)
assert seen == 2 * one + [0], seen
assert told() == two
"""


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core has one thread anyway")
def test_fits_and_branches_run_on_one_thread_and_leave_the_setting_as_it_was() -> None:
    plain = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", CODE], env=plain, capture_output=True, text=True, timeout=600)
    if done.returncode == 77:
        pytest.skip("the linear algebra here has no threads that can be set")
    assert done.returncode == 0, done.stderr
