"""Files that claim more than they hold, point out of themselves, or would run code: refused before anything is read."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from nonsmooth.errors import DataFileError
from nonsmooth.results import memory
from nonsmooth.results.store import load, save

RECORD = '{"version": "0.1.0", "verb": "test"}'
GB8 = 8 * 10**9


def small(path: Path) -> Path:
    return save(xr.Dataset({"a": ("x", np.arange(3.0))}, attrs={"nonsmooth": RECORD}), path)


def claim(path: Path) -> Path:
    """A small file that claims 8 GB, as another program can make it."""
    small(path)
    if path.suffix == ".nc":
        with h5py.File(path, "r+") as file:
            file.create_dataset("large", (10**9,), "f8", fillvalue=0.5)
            file.create_dataset("chunked", (10**9,), "f8", chunks=(10**6,), compression="gzip")
    else:
        for name in ("a/.zarray", ".zmetadata"):
            whole = json.loads((path / name).read_text())
            array = whole.get("metadata", {"a/.zarray": whole})["a/.zarray"]
            array["shape"] = array["chunks"] = [10**9]
            (path / name).write_text(json.dumps(whole))
    return path


def test_a_small_file_that_claims_8_GB(tmp_path: Path) -> None:
    """Refused without the memory: the limit of the process is far below what the file claims."""
    if sys.platform != "linux":
        pytest.skip("the memory of a process is limited so on Linux")
    paths = [claim(tmp_path / f"large.{ending}") for ending in ("nc", "zarr")]
    program = (
        "import resource, sys\nimport h5netcdf, xarray, zarr\nfrom nonsmooth.results.store import load\n"
        "used = int(open('/proc/self/statm').read().split()[0]) * 4096\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + 2 * 10**9,) * 2)\n"
        "for path in sys.argv[1:]:\n    try:\n        load(path)\n    except Exception as error:\n"
        "        print(type(error).__name__, error, sep=': ')"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run([sys.executable, "-c", program, *paths], capture_output=True, text=True, env=environment)
    lines = done.stdout.splitlines()
    assert len(lines) == 2, done.stderr
    for line, path in zip(lines, paths, strict=True):
        assert line.startswith(f"DataFileError: {path}:")
        assert "claims 8000000000 bytes, and the file holds" in line


@pytest.mark.parametrize("ending", ["nc", "zarr"])
def test_a_file_larger_than_memory_is_named(ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = small(tmp_path / f"r.{ending}")
    monkeypatch.setattr(memory, "free_memory", lambda: 20)
    monkeypatch.setattr(memory, "SMALL", 0)
    with pytest.raises(MemoryError, match=rf"the content of .*r\.{ending} takes .* more memory"):
        load(path)


def test_nothing_is_read_from_another_file(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_bytes(np.arange(3.0).tobytes())
    for kind in ("link", "soft", "external", "virtual"):
        path = small(tmp_path / f"{kind}.nc")
        with h5py.File(path, "r+") as file:
            if kind == "link":
                file["b"] = h5py.ExternalLink(str(small(tmp_path / "other.nc")), "/a")
            elif kind == "soft":
                file["b"] = h5py.SoftLink("/a")
            elif kind == "external":
                file.create_dataset("b", (3,), "f8", external=[(str(secret), 0, 24)])
            else:
                layout = h5py.VirtualLayout((3,), "f8")
                layout[:] = h5py.VirtualSource(str(tmp_path / "other.nc"), "a", (3,))
                file.create_virtual_dataset("b", layout)
        with pytest.raises(DataFileError, match=rf"{kind}\.nc: .*'b'.* not (followed|read)"):
            load(path)


def test_a_codec_that_runs_code_is_not_used(tmp_path: Path) -> None:
    path = small(tmp_path / "r.zarr")
    for name in ("a/.zarray", ".zmetadata"):
        whole = json.loads((path / name).read_text())
        array = whole.get("metadata", {"a/.zarray": whole})["a/.zarray"]
        array.update(dtype="|O", filters=[{"id": "vlen-utf8"}, {"id": "pickle"}], compressor=None, fill_value="")
        (path / name).write_text(json.dumps(whole))
    ran = tmp_path / "ran"
    (path / "a" / "0").write_bytes(f"cos\nmkdir\n(S'{ran}'\ntR.".encode() + bytes(40))
    with pytest.raises(DataFileError, match=r"r\.zarr: 'a' is to be decoded by .*, which is not done"):
        load(path)
    assert not ran.exists()


def test_a_pipe_does_not_block(tmp_path: Path) -> None:
    if not hasattr(os, "mkfifo"):
        pytest.skip("no pipes with a name here")
    os.mkfifo(tmp_path / "pipe.nc")
    with pytest.raises(DataFileError, match=r"pipe\.nc: is not a file"):
        load(tmp_path / "pipe.nc")
