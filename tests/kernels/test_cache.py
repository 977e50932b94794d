"""The compile cache: a second process compiles nothing, an edit anywhere it matters compiles again."""

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

KERNELS = """
from numba import types
from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.compile.pointers import function_at

step_at = function_at(types.FunctionType(types.void(types.int64, types.float64, types.float64[::1])))


@device
def add(a, b):
    return a + b


@kernel(types.float64(types.float64))
def twice(a):
    return add(a, a)


@kernel(types.float64(types.int64[::1], types.float64[::1], types.int64))
def drive(functions, u, n):
    f, g = step_at(functions[0]), step_at(functions[1])
    for i in range(n):
        f(i, 0.5, u)
        g(i, 0.5, u)
    return twice(u[0])
"""

MODEL = """
from nonsmooth.kernels.compile.direct import callback


@callback("void(int64, float64, float64[::1])")
def f(mode, t, u):
    u[0] += {0!r} + mode * t


@callback("void(int64, float64, float64[::1])")
def g(mode, t, u):
    u[0] *= {0!r}
"""

SCRIPT = """
import json, sys
import numpy as np
from nonsmooth import kernels
from nonsmooth.kernels.compile import cache
from nonsmooth.kernels.compile.pointers import addresses
import driver

told = []
kernels.before_compiling.append(told.append)
model = cache.load_module(sys.stdin.read(), "model")
value = driver.drive(addresses(model.f, model.g), np.ones(1), 2)
drive = driver.drive
print(json.dumps({
    "value": value,
    "driver": list(cache.cache_statistics(driver)),
    "model": list(cache.cache_statistics(model)),
    "overloads": len(getattr(drive, "signatures", [])),
    "told": told,
    "file": model.__file__,
}))
"""


def expected(factor):
    u = 1.0
    for mode in range(2):
        u = (u + factor + mode * 0.5) * factor
    return 2 * u


def run(folder, factor, script=SCRIPT, **environment):
    (folder / "driver.py").exists() or (folder / "driver.py").write_text(KERNELS)
    path = os.pathsep.join([str(folder), *[p for p in sys.path if p]])
    environment = {**os.environ, "NONSMOOTH_CACHE_DIR": str(folder / "cache"), "PYTHONPATH": path, **environment}
    done = subprocess.run(
        [sys.executable, "-c", script], input=MODEL.format(factor), env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """The folder of a first process, and what that process said."""
    folder = tmp_path_factory.mktemp("first")
    return folder, run(folder, 2.0)


@pytest.fixture
def filled(tmp_path, first):
    """The folder that a first process left."""
    shutil.copytree(first[0], tmp_path, dirs_exist_ok=True)


def test_second_process_compiles_nothing_and_a_new_model_only_itself(tmp_path, first, filled):
    said = first[1]
    assert said["value"] == expected(2.0)
    assert ["drive", 0, 1] in said["driver"]
    assert sorted(said["told"]) == ["drive", "f", "g", "twice"]

    again = run(tmp_path, 2.0)
    assert again["value"] == expected(2.0)
    assert all(misses == 0 for _, _, misses in again["driver"] + again["model"])
    assert again["told"] == []

    other = run(tmp_path, 3.0)
    assert other["value"] == expected(3.0)
    assert all(misses == 0 for _, _, misses in other["driver"])
    assert all((hits, misses) == (0, 1) for _, hits, misses in other["model"])
    assert sorted(other["told"]) == ["f", "g"]
    # The functions came in by their addresses: no second version of the driver was made for them.
    assert other["overloads"] == 1


LAZY = """
import json, threading
from nonsmooth.kernels.compile import cache
import driver

def statistics():
    return {name: [loads, compiles] for name, loads, compiles in cache.cache_statistics(driver)}

before = statistics()
refused = ""
try:
    driver.twice("text")
except TypeError as error:
    refused = str(error)
values = []
threads = [threading.Thread(target=lambda: values.append(driver.twice(1.5))) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(json.dumps([before, refused, values, len(driver.twice.signatures), statistics()]))
"""


def test_a_kernel_is_compiled_when_it_is_first_called(tmp_path):
    """Not at import, once for all threads, alone, and for its own signature even where the first call is wrong."""
    before, refused, values, versions, after = run(tmp_path, 2.0, script=LAZY)
    assert before == {"twice": [0, 0], "drive": [0, 0]}
    assert "No matching definition" in refused
    assert values == [3.0] * 4 and versions == 1
    assert after == {"twice": [0, 1], "drive": [0, 0]}


def cut(data):
    return data[:100]


def three_bits_flipped(data):
    """In the machine code, where unpickling sees nothing."""
    changed = bytearray(data)
    for part in (0.5, 0.6, 0.7):
        changed[int(part * len(data))] ^= 0x10
    return bytes(changed)


def test_damaged_entries_are_compiled_anew(tmp_path, filled):
    """Cut ones and such with wrong bits; the text of a model that does not match its name is written again."""
    for entry in (tmp_path / "cache" / "compiled").iterdir():
        damage = cut if entry.name[0] in "fd" else three_bits_flipped
        entry.write_bytes(damage(entry.read_bytes()))
    for source in (tmp_path / "cache" / "generated").glob("*.py"):
        source.write_text("damaged")
    damaged = run(tmp_path, 2.0)
    assert damaged["value"] == expected(2.0)
    assert sorted(damaged["told"]) == ["drive", "f", "g", "twice"]
    assert run(tmp_path, 2.0)["told"] == []


def test_without_jit(tmp_path):
    plain = run(tmp_path, 2.0, NUMBA_DISABLE_JIT="1")
    assert plain["value"] == expected(2.0)
    assert plain["model"] == [] and plain["driver"] == []
    assert not (tmp_path / "cache" / "compiled").exists()


def test_stamp_follows_imports_through_kernel_files(monkeypatch):
    from nonsmooth.kernels.compile import sources as stamps

    sources = {
        "low": "x = 1",
        "mid": "from .low import x",
        "top": "from . import mid",
        "other": "import nonsmooth.kernels.mid",
        "apart": "y = 2  # a word: low, mid, top",
    }

    def stamp(text):
        monkeypatch.setattr(stamps, "_kernel_sources", lambda: dict(sources))
        stamps._source_stamp.cache_clear()
        return stamps._source_stamp(text)

    before = {name: stamp(text) for name, text in sources.items()}
    sources["low"] = "x = 3"
    after = {name: stamp(text) for name, text in sources.items()}
    assert before["apart"] == after["apart"]
    assert all(before[name] != after[name] for name in ("low", "mid", "top", "other"))
    stamps._source_stamp.cache_clear()


def test_a_kernel_file_reaches_the_files_that_its_imports_name():
    """Those that Python's own parser finds, with their texts."""
    from nonsmooth.kernels.compile import sources as stamps

    room = Path(stamps.__file__).parents[1]
    texts = {
        ".".join(path.relative_to(room).with_suffix("").parts): path.read_text("utf-8") for path in room.rglob("*.py")
    }
    for text in texts.values():
        imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
        names = {f"{getattr(node, 'module', '')}.{one.name}" for node in imports for one in node.names}
        names |= {one.rpartition(".")[0] for one in names}
        ours = {one.strip(".").removeprefix("nonsmooth.kernels.") for one in names} & texts.keys() - stamps._MACHINERY
        assert {name: texts[name] for name in ours}.items() <= stamps.reached(text).items()
    assert "series.polynomial" in stamps.reached(texts["series.step"])


def grow_old(path, days=200):
    stat = path.lstat()
    os.utime(path, (stat.st_atime, stat.st_mtime - 86400 * days), follow_symlinks=False)


def test_what_was_not_used_for_long_is_removed_where_it_is_ours(tmp_path, filled):
    """Entries as a real process wrote them, and unfinished ones; of the user's files none, whatever its name."""
    from nonsmooth.kernels.compile.folder import prune

    compiled, generated = tmp_path / "cache" / "compiled", tmp_path / "cache" / "generated"
    code, module = next(compiled.iterdir()), next(generated.glob("*.py"))
    new = [path for path in compiled.iterdir() if path != code]
    users = {
        compiled: ["thesis.tex", "old", code.stem, f"copy_of_{code.name}", f"{code.name}.bak", f"a-{32 * '0'}.nbc"],
        generated: ["notes.py", f"{module.stem}.txt", f"model_{20 * '0'}.py", f"solver_{module.stem[-20:]}.py"],
    }
    for folder, names in users.items():
        for name in names:
            (folder / name).write_text("a user's own")
            grow_old(folder / name)
    (compiled / f"link-{code.name[-36:]}").symlink_to(code)
    unfinished = compiled / f"{code.name}.0123456789ab.tmp"
    unfinished.write_bytes(b"half")
    for path in (code, module, unfinished, compiled / f"link-{code.name[-36:]}"):
        grow_old(path)
    for folder in (compiled, generated):
        prune(folder)
    assert not code.exists() and not module.exists() and not unfinished.exists()
    assert all(path.exists() for path in new)
    assert all((folder / name).exists() for folder, names in users.items() for name in names)
    assert (compiled / f"link-{code.name[-36:]}").is_symlink()


FULL = """
import resource
from pathlib import Path
from nonsmooth.kernels.compile.folder import cache_folder, make_private, write_atomically
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
path = cache_folder() / "generated" / "model.py"
write_atomically(path, bytes(100))
try:
    write_atomically(path.with_name("other.py"), bytes(101))
except OSError as error:
    print(error)
print(*(one.name for one in path.parent.iterdir()))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_disk_that_takes_no_more_is_a_sentence(tmp_path):
    """By a limit on the size of files, which no administrator has to set; nothing unfinished is left."""
    environment = {**os.environ, "NONSMOOTH_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", FULL], env=environment, capture_output=True, text=True)
    said, names = done.stdout.splitlines()
    assert f"cannot be written to {tmp_path / 'generated'} (File too large)" in said
    assert "set the environment variable NONSMOOTH_CACHE_DIR to a folder on another disk" in said
    assert names == "model.py"


def test_cache_folder(tmp_path, monkeypatch):
    from nonsmooth.kernels.compile.folder import cache_folder

    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path / "a" / "b"))
    assert cache_folder() == tmp_path / "a" / "b"
    assert cache_folder().is_dir()
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path / "file"))
    with pytest.raises(PermissionError, match="choose another folder"):
        cache_folder()


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="XDG folders")
def test_unwritable_user_folder_falls_back_to_a_private_one(tmp_path, monkeypatch):
    from nonsmooth.kernels.compile.folder import cache_folder, usable_folder

    (tmp_path / "file").write_text("")
    monkeypatch.delenv("NONSMOOTH_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    usable_folder.cache_clear()
    folder = cache_folder()
    assert folder.parent == tmp_path
    assert Path(folder).stat().st_mode & 0o077 == 0
    usable_folder.cache_clear()


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
@pytest.mark.parametrize("part", ["", "compiled"])
def test_a_folder_that_others_may_write_is_refused(tmp_path, monkeypatch, part):
    """Its files are executed. A folder that was chosen: an error; the user's own: a private one in its place."""
    from nonsmooth.kernels.compile.folder import cache_folder, usable_folder

    open_to_all = tmp_path / "nonsmooth"
    (open_to_all / part).mkdir(parents=True)
    (open_to_all / part).chmod(0o777)
    usable_folder.cache_clear()
    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(open_to_all))
    with pytest.raises(PermissionError, match="others may write it"):
        cache_folder()
    monkeypatch.delenv("NONSMOOTH_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.warns(UserWarning, match="others may write it"):
        assert cache_folder() == tmp_path / f"nonsmooth-{os.getuid()}"
    usable_folder.cache_clear()


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
def test_new_entries_are_the_users_alone_and_others_are_not_executed(tmp_path, filled):
    entries = [*(tmp_path / "cache").rglob("*")]
    assert entries and all(path.stat().st_mode & 0o022 == 0 for path in entries)
    for entry in (tmp_path / "cache" / "compiled").iterdir():
        entry.chmod(0o666)
    assert ["drive", 0, 1] in run(tmp_path, 2.0)["driver"]


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="a user without a name or home, as in a container")
def test_an_unknown_user_without_a_home(tmp_path):
    """Path.home() raises for such a user, and no name is known; compiled code is kept among the temporary files."""
    script = """
import os, sys
from pathlib import Path
def none():
    raise RuntimeError("Could not determine home directory.")
Path.home = none
from nonsmooth.kernels.compile.folder import cache_folder
print(cache_folder())
"""
    unset = ("HOME", "USER", "LOGNAME", "XDG_CACHE_HOME", "NONSMOOTH_CACHE_DIR")
    environment = {name: value for name, value in os.environ.items() if name not in unset}
    done = subprocess.run(
        [sys.executable, "-c", script], env={**environment, "TMPDIR": str(tmp_path)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(tmp_path / f"nonsmooth-{os.getuid()}")


def test_one_signature_only(tmp_path, monkeypatch):
    from nonsmooth.kernels.compile import cache

    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    module = cache.load_module(MODEL.format(7.0), "single")
    assert module is cache.load_module(MODEL.format(7.0), "single")
    for wrong in ([1.0, "text"], np.ones((1, 1)), np.ones(4)[::2], np.ones(1, dtype=np.float32)):
        with pytest.raises(TypeError):
            module.f(0, 0.5, wrong)


LAYERS = """
from nonsmooth.kernels.compile.cache import kernel, once


@once
def twice(a):
    return 2.0 * a


@kernel("float64(float64)")
def layered(a):
    return twice(a) + twice(a + 1.0)
"""


def test_a_compile_copies_no_names_of_what_it_inlines(tmp_path, monkeypatch):
    from numba.core import ir

    from nonsmooth.kernels.compile import cache

    def copied(self, memo):
        raise AssertionError("names are copied")

    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(ir.VarMap, "__deepcopy__", copied, raising=False)
    assert cache.load_module(LAYERS, "layers").layered(2.0) == 2.0 * 2.0 + 2.0 * 3.0
    assert not hasattr(ir.Scope, "__deepcopy__")  # Numba is left as it was


BELOW = """
from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.compile.lanes import apart


@device
def below(a):
    apart()
    return 2.0 * a


@kernel("float64(float64)")
def above(a):
    return below(a) + below(a + 1.0)
"""


def test_a_kernel_runs_the_code_that_was_made_with_it(tmp_path, monkeypatch):
    from nonsmooth.kernels.compile import cache

    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    module = cache.load_module(BELOW, "below")
    assert module.above(2.0) == 2.0 * 2.0 + 2.0 * 3.0
    (below,), (above,) = module.below.overloads.values(), module.above.overloads.values()
    (inside,) = (f for f in above.library._final_module.functions if f.name == below.fndesc.llvm_func_name)
    assert inside.linkage.name == "internal"  # an engine takes code of another name's first comer otherwise
    assert below.library._compiled_object is None and above.library._compiled_object


def test_imports_are_found_as_python_finds_them():
    from nonsmooth.kernels.compile import sources

    room = "nonsmooth.kernels"
    texts = sources._kernel_sources()
    for text in [
        *texts.values(),
        "from .low import (\n    x,\n    y as z,\n)",
        "if 1:\n    from . import low, \\\n mid",
    ]:
        names = set()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Import):
                names.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                package = ".".join(filter(None, [room if node.level else "", node.module]))
                names.update([package, *(f"{package}.{alias.name}" for alias in node.names)])
        ours = {name.removeprefix(f"{room}.") for name in names if name.startswith(f"{room}.")}
        found = sources._imported(text)
        assert ours <= found and not (found - ours) & set(texts)


def test_a_function_of_many_branches_is_compiled(tmp_path, monkeypatch):
    from nonsmooth.kernels.compile import cache

    branches = "".join(f"    if k == {i}:\n        y = x + {i}.5\n" for i in range(200))
    head = "from nonsmooth.kernels.compile.cache import kernel\n\n\n@kernel('f8(i8, f8)')\ndef deep(k, x):\n"
    head += "    y = z = 0.0\n"
    tail = "    if k > 199:\n        z = z + 0.5\n    return y + z\n"  # its z is sought through all the branches
    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(300)  # as 700 branches are to 1000
    try:
        module = cache.load_module(f"{head}{branches}{tail}", "deep", lasting=False)
        assert [module.deep(i, 1.0) for i in (0, 3, 199, 200)] == [1.5, 4.5, 200.5, 0.5]
        assert sys.getrecursionlimit() == 300
    finally:
        sys.setrecursionlimit(limit)


def test_failed_module_is_not_kept(tmp_path, monkeypatch):
    from nonsmooth.kernels.compile import cache

    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            cache.load_module("1 / 0", "broken")
