"""Code made ahead is found in an empty cache; what does not fit is not, and is compiled as if none had come."""

import ast
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import nonsmooth
from nonsmooth.kernels.compile import cache, sources, target

KERNEL = """
from nonsmooth.kernels.compile.cache import kernel


@kernel("float64(float64)")
def twice(a):
    return 2.0 * a
"""
LOADED, COMPILED = (42.0, 1, 0), (42.0, 0, 1)


@pytest.fixture
def forgetting(monkeypatch):
    """The level of the architecture is asked for anew, here and afterwards."""
    target.level.cache_clear()
    yield
    monkeypatch.undo()
    target.level.cache_clear()


class Package:
    """A file with one kernel, and a folder for code made ahead; each import of it is as a new process would see it."""

    def __init__(self, folder, monkeypatch):
        self.folder, self._patch = folder, monkeypatch
        (folder / "one.py").write_text(KERNEL)
        monkeypatch.setattr(target, "AHEAD", folder / "ahead")

    def imported(self, cache_name):
        self._patch.setenv("NONSMOOTH_CACHE_DIR", str(self.folder / cache_name))
        sources.file_stamp.cache_clear()
        target.level.cache_clear()
        spec = importlib.util.spec_from_file_location("one", self.folder / "one.py")
        module = importlib.util.module_from_spec(spec)
        self._patch.setitem(sys.modules, "one", module)
        spec.loader.exec_module(module)
        return module

    def call(self, cache_name="empty"):
        """The kernel's result, and how often it was loaded and compiled."""
        module = self.imported(cache_name)
        value = module.twice(21.0)
        [(_, loaded, compiled)] = cache.cache_statistics(module)
        return value, loaded, compiled


@pytest.fixture
def package(tmp_path, monkeypatch, forgetting):
    """The entry stands where code made ahead belongs."""
    package = Package(tmp_path, monkeypatch)
    name = cache.compiled(package.imported("elsewhere").twice).entry()
    if not target.level():
        pytest.skip("this processor has none of the levels")
    package.entry = tmp_path / "ahead" / target.level() / name
    package.entry.parent.mkdir(parents=True)
    (tmp_path / "elsewhere" / "compiled" / name).rename(package.entry)
    return package


def test_an_entry_made_ahead_is_found_in_an_empty_cache(package):
    assert package.call() == LOADED
    assert not (package.folder / "empty" / "compiled").exists()  # nothing was copied either


@pytest.mark.parametrize("damage", [lambda data: data[:200], lambda data: data[:-9] + b"\x10" + data[-8:]])
def test_a_damaged_one_is_not_used(package, damage):
    package.entry.write_bytes(damage(package.entry.read_bytes()))
    assert package.call() == COMPILED
    assert package.call() == LOADED  # from the user's cache, where it has been kept


def test_one_of_an_edited_source_is_not_used(package):
    (package.folder / "one.py").write_text(KERNEL.replace("2.0 * a", "a + a"))
    assert package.call() == COMPILED


@pytest.mark.parametrize(
    ("whose", "version"),
    [("numba.__version__", "0.0"), ("llvmlite.__version__", "0.0"), ("sys.version_info", (3, 99, 0))],
)
def test_one_of_other_versions_is_not_used(package, monkeypatch, whose, version):
    monkeypatch.setattr(whose, version)
    assert package.call() == COMPILED


def test_one_of_another_level_is_not_used(package, monkeypatch):
    """Nor where the processor has no level: then code is made as Numba makes it."""
    with monkeypatch.context() as patch:
        patch.setattr(target, "LEVELS", {})
        assert package.call() == COMPILED
    with monkeypatch.context() as patch:
        patch.setattr(numba.config, "CPU_NAME", "generic")  # NUMBA_CPU_NAME
        assert package.call("other") == COMPILED
    package.entry.parent.rename(package.entry.parent.with_name("of-another-machine"))
    assert package.call("third") == COMPILED


@pytest.mark.parametrize("has", ["", "avx avx512f"])
def test_the_level_is_one_that_the_processor_has(monkeypatch, forgetting, has):
    """Code for a level is asked for only where every feature of it is there."""
    v3 = target.LEVELS["x86_64"]["x86-64-v3"]
    monkeypatch.setattr("platform.machine", lambda: "x86_64")

    def level(features):
        monkeypatch.setattr(target, "get_host_cpu_features", lambda: ",".join(f"+{name}" for name in features))
        target.level.cache_clear()
        return target.level()

    assert level(has.split()) == ""
    assert level([*v3.split(), *has.split()]) == "x86-64-v3"
    assert level([name for name in v3.split() if name != "fma"] + has.split()) == ""


def test_a_level_that_the_processor_lacks_is_refused(monkeypatch, forgetting):
    monkeypatch.setenv("NONSMOOTH_LEVEL", "x86-64-v9")
    with pytest.raises(ValueError, match=r"NONSMOOTH_LEVEL=x86-64-v9: this processor has"):
        target.level()


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
    assert [arguments for _, name, arguments in ahead.tasks() if name == "linear_module"] == [(False,), (True,)]


def test_a_list_for_some_steppers():
    """Leave out what other steppers need."""
    from nonsmooth.kernels.compile import ahead

    chosen, every = ahead.tasks(["series", "planar"]), ahead.tasks()
    left_out = [task[1:] for task in every if task not in chosen]
    assert left_out == [("linear_module", (False,))]


#: A later process; the package's own folder of code made ahead is moved.
LATER = """
import json, sys
from pathlib import Path
from nonsmooth.kernels import histogram
from nonsmooth.kernels.compile import cache, target
target.AHEAD = Path(sys.argv[1])
histogram.count.compile_now()
print(json.dumps([list(found) for found in cache.cache_statistics(histogram)]))
"""


def test_what_is_compiled_ahead_is_what_a_later_process_looks_for(tmp_path):
    from nonsmooth.kernels.compile.ahead import compile_ahead

    if not target.level():
        pytest.skip("this processor has none of the levels")
    folder = tmp_path / "ahead"
    stale = folder / target.level() / "gone-0123.nbc"
    stale.parent.mkdir(parents=True)
    stale.write_bytes(b"of an older source")
    work = [("nonsmooth.kernels.histogram", "", ())]
    assert compile_ahead(folder, target.level(), work, whole=False) == 1
    assert stale.exists()  # it may belong to what was not asked for
    assert compile_ahead(folder, target.level(), work) == 1
    assert not stale.exists()
    done = subprocess.run(
        [sys.executable, "-c", LATER, str(folder)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "NONSMOOTH_CACHE_DIR": str(tmp_path / "empty")},
    )
    assert json.loads(done.stdout) == [["count", 1, 0]]
