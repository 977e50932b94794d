"""The threads of the linear algebra while something is fitted, as the library itself tells them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

CODE = """
import numpy
from nonsmooth.identification import blas
libraries = blas._libraries()
if not libraries:
    raise SystemExit(77)
for library in libraries:
    library.put(2)
seen = []
with blas.one_blas_thread():
    seen.append([library.get() for library in libraries])
    with blas.one_blas_thread():
        pass
    seen.append([library.get() for library in libraries])
assert seen == [[1] * len(libraries)] * 2, seen
assert [library.get() for library in libraries] == [2] * len(libraries)
try:
    with blas.one_blas_thread():
        raise KeyError
except KeyError:
    pass
assert [library.get() for library in libraries] == [2] * len(libraries)
from nonsmooth.studies.savi2007.identification import identify
blas._functions, told = None, []
import nonsmooth.studies.savi2007.identification.chain as chain
chain.gather = lambda *a, **k: told.extend(library.get() for library in libraries) or (_ for _ in ()).throw(KeyError)
try:
    identify("nowhere")
except KeyError:
    pass
assert told == [1] * len(libraries), told
"""


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core has one thread anyway")
def test_fits_run_on_one_thread_and_leave_the_setting_as_it_was() -> None:
    plain = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", CODE], env=plain, capture_output=True, text=True, timeout=600)
    if done.returncode == 77:
        pytest.skip("NumPy and SciPy bring no OpenBLAS of their own here")
    assert done.returncode == 0, done.stderr
