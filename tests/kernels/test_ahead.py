"""Code made ahead is found in an empty cache; what does not fit is not, and is compiled as if none had come."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import nonsmooth

KERNEL = """
from nonsmooth.kernels.compile.cache import kernel


@kernel("float64(float64)")
def twice(a):
    return 2.0 * a
"""

#: What a process does before it calls the kernel; the package's own folder of code made ahead is moved.
BEGIN = """
import json, sys
from pathlib import Path
from nonsmooth.kernels.compile import cache, target
target.AHEAD = Path(sys.argv[1])
{}
import one
"""
CALL = (
    BEGIN
    + """
print(json.dumps([one.twice(21.0), *list(cache.cache_statistics(one))[0][1:]]))
"""
)
NAMED = (
    BEGIN
    + """
print(json.dumps([cache.compiled(one.twice).entry(), target.level()]))
"""
)
LOADED, COMPILED = [42.0, 1, 0], [42.0, 0, 1]


def run(folder, script, before="", cache="empty", **environment):
    path = os.pathsep.join([str(folder), *[p for p in sys.path if p]])
    done = subprocess.run(
        [sys.executable, "-c", script.format(before), str(folder / "ahead")], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": path, "NONSMOOTH_CACHE_DIR": str(folder / cache), **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture
def made(tmp_path):
    """A folder with a kernel, and its entry where code made ahead belongs."""
    (tmp_path / "one.py").write_text(KERNEL)
    name, level = run(tmp_path, NAMED, cache="elsewhere")
    if not level:
        pytest.skip("this processor has none of the levels")
    entry = tmp_path / "ahead" / level / name
    entry.parent.mkdir(parents=True)
    (tmp_path / "elsewhere" / "compiled" / name).rename(entry)
    return entry


def test_an_entry_made_ahead_is_found_in_an_empty_cache(tmp_path, made):
    assert run(tmp_path, CALL) == LOADED
    assert not (tmp_path / "empty" / "compiled").exists()  # nothing was copied either


@pytest.mark.parametrize("damage", [lambda data: data[:200], lambda data: data[:-9] + b"\x10" + data[-8:]])
def test_a_damaged_one_is_not_used(tmp_path, made, damage):
    made.write_bytes(damage(made.read_bytes()))
    assert run(tmp_path, CALL) == COMPILED
    assert run(tmp_path, CALL) == LOADED  # from the user's cache, where it has been kept


def test_one_of_an_edited_source_is_not_used(tmp_path, made):
    (tmp_path / "one.py").write_text(KERNEL.replace("2.0 * a", "a + a"))
    assert run(tmp_path, CALL) == COMPILED


@pytest.mark.parametrize(
    "other",
    ["import numba; numba.__version__ = '0.0'", "import llvmlite; llvmlite.__version__ = '0.0'",
     "sys.version_info = (3, 99, 0)"],
)  # fmt: skip
def test_one_of_other_versions_is_not_used(tmp_path, made, other):
    assert run(tmp_path, CALL, before=other) == COMPILED


def test_one_of_another_level_is_not_used(tmp_path, made):
    """Nor where the processor has no level: then code is made as Numba makes it."""
    assert run(tmp_path, CALL, before="target.LEVELS = {}") == COMPILED
    assert run(tmp_path, CALL, cache="other", NUMBA_CPU_NAME="generic") == COMPILED
    made.parent.rename(made.parent.with_name("of-another-machine"))
    assert run(tmp_path, CALL, cache="third") == COMPILED


@pytest.mark.parametrize("has", ["", "avx avx512f"])
def test_the_level_is_one_that_the_processor_has(tmp_path, has):
    """Code for a level is asked for only where every feature of it is there."""
    from nonsmooth.kernels.compile.target import LEVELS

    v3 = LEVELS["x86_64"]["x86-64-v3"]
    script = """
import json, platform, sys
from nonsmooth.kernels.compile import target
platform.machine = lambda: "x86_64"
target.get_host_cpu_features = lambda: sys.argv[1]
print(json.dumps(target.level()))
"""

    def level(features):
        done = subprocess.run(
            [sys.executable, "-c", script, ",".join(f"+{name}" for name in features)], capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )  # fmt: skip
        return json.loads(done.stdout)

    assert level(has.split()) == ""
    assert level([*v3.split(), *has.split()]) == "x86-64-v3"
    assert level([name for name in v3.split() if name != "fma"] + has.split()) == ""


def test_a_level_that_the_processor_lacks_is_refused(tmp_path):
    (tmp_path / "one.py").write_text(KERNEL)
    with pytest.raises(AssertionError, match=r"NONSMOOTH_LEVEL=x86-64-v9: this processor has"):
        run(tmp_path, CALL, NONSMOOTH_LEVEL="x86-64-v9")


def decorated(path):
    """Names of the functions in a file that are decorated with ``@kernel(...)``."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            makers = [made.func for made in node.decorator_list if isinstance(made, ast.Call)]
            if any(isinstance(maker, ast.Name) and maker.id == "kernel" for maker in makers):
                yield node.name


def test_every_kernel_of_the_package_is_compiled_ahead():
    from nonsmooth.kernels.compile import ahead

    written = {name for path in Path(nonsmooth.__file__).parent.rglob("*.py") for name in decorated(path)}
    modules = {ahead._module(task) for task in ahead.tasks()}
    found = [kernel.__name__ for module in modules for kernel in ahead.kernels_of(module)]
    assert len(written) > 10 and set(found) == written
    of_shapes = [arguments[:2] for _, name, arguments in ahead.tasks() if name == "linear_module"]
    assert set(of_shapes) == {(2, 0), (2, 1)}


def test_what_is_compiled_ahead_is_what_a_later_process_looks_for(tmp_path):
    from nonsmooth.kernels.compile.ahead import compile_ahead
    from nonsmooth.kernels.compile.target import level

    if not level():
        pytest.skip("this processor has none of the levels")
    stale = tmp_path / "ahead" / level() / "gone-0123.nbc"
    stale.parent.mkdir(parents=True)
    stale.write_bytes(b"of an older source")
    assert compile_ahead(tmp_path / "ahead", level(), [("nonsmooth.kernels.histogram", "", ())]) == 1
    assert not stale.exists()
    script = (
        BEGIN.replace("import one", "from nonsmooth.kernels import histogram")
        + """
histogram.count.compile_now()
print(json.dumps([list(found) for found in cache.cache_statistics(histogram)]))
"""
    )
    assert run(tmp_path, script) == [["count", 1, 0]]
