"""Code of models that nobody uses any more is freed."""

import gc
import subprocess
import sys
import weakref

import numpy as np
import pytest

MODEL = """
from math import sin
from nonsmooth.kernels.compile.direct import callback


@callback("void(int64, float64, float64[::1], float64[::1], float64[::1])")
def field(mode, t, u, q, du):
    du[0] = sin(u[0]) * {0!r}
"""


def test_machine_code_ends_with_the_last_function_of_its_file(tmp_path, monkeypatch):
    """Compiled and loaded from the cache alike; while a function is held it can be called."""
    from nonsmooth.kernels.compile import cache

    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    for misses in (1, 0):
        module = cache.load_module(MODEL.format(2.0), "ending", lasting=False)
        assert [found[2] for found in cache.cache_statistics(module)] == [misses]
        assert module is cache.load_module(MODEL.format(2.0), "ending", lasting=False)
        field, name = module.field, module.__name__
        engine = weakref.ref(field.codegen._engine._ee)
        del module
        gc.collect()
        du = np.empty(1)
        field(0, 0.0, np.array([0.5]), np.empty(0), du)
        assert du[0] == pytest.approx(2.0 * np.sin(0.5), rel=1e-15)
        del field
        gc.collect()
        assert engine() is None and name not in sys.modules


SIXTY = """
import gc, sys
import numpy as np
import nonsmooth as ns

def size():
    gc.collect()
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6

def run(number):
    def swing(t, u, p):
        x, v = u
        return v, p.rho * np.cos(p.omega * t) - p.c * v - np.sin(x) - number * 1e-3 * x**2

    model = ns.System(
        states=["x", "v"], parameters={"rho": 0.4, "omega": 1.2, "c": 0.2, "g": 0.6}, modes={"swing": swing},
        indicators={"stop": lambda t, u, p: p.g - u.x},
        transitions=[ns.Transition("swing", "swing", when="stop < 0", reset=lambda t, u, p: (p.g, -0.7 * u.v))],
    )
    ns.simulate(model, periods=3)

for number in range(40):
    run(number)
before = size()
for number in range(40, 100):
    run(number)
print((size() - before) / 60)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_sixty_models_take_no_more_memory(tmp_path, monkeypatch):
    """Beyond those of which the code is kept: MB for each, compiled, then loaded from the cache (were 4.3, 0.5).

    What is left where they are compiled are llvmlite's pass managers, two for each function, which it never frees."""
    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    for most in (1.0, 0.25):
        done = subprocess.run([sys.executable, "-c", SIXTY], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        print(f"{float(done.stdout):.3f} MB for each model")
        assert float(done.stdout) < most


def test_the_code_of_a_model_ends_with_those_that_are_kept():
    """A model's field is that of no lasting module: none has its name, and with the cache it goes."""
    import nonsmooth as ns
    from nonsmooth.system.codegen.generate import compile_model

    number = 1.2345678  # a model that nobody else has
    modes = {"one": lambda t, u, p: (np.sin(u.x) - number * u.x,)}
    model = compile_model(ns.System(states=["x"], parameters={"k": 1.0}, modes=modes).traced)
    field = weakref.ref(model.field)
    assert model.field.__module__ not in sys.modules
    del model
    compile_model.cache_clear()
    gc.collect()
    assert field() is None
