"""Saves that are killed and disks that are full: nothing is lost, nothing stays behind, what others own is left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nonsmooth.cli import main as cli
from nonsmooth.errors import DataFileError
from nonsmooth.results import whole
from nonsmooth.results.store import load, save
from nonsmooth.results.whole import beside, clear, write_whole

FORMATS = ["nc", "zarr"]
RECORD = '{"version": "0.1.0", "verb": "test"}'
KILLED = """
import os, signal, sys, time
from pathlib import Path
from nonsmooth.results.whole import beside
with beside(Path(sys.argv[1])) as folder:
    (folder / "new").write_bytes(bytes(1000))
    print(folder, flush=True)
    time.sleep(600)
"""


def large(size: int = 100_000) -> xr.Dataset:
    """Numbers that cannot be compressed."""
    return xr.Dataset({"a": ("x", np.random.default_rng(0).random(size))}, attrs={"nonsmooth": RECORD})


def writer(target: Path) -> tuple[subprocess.Popen[str], Path]:
    """Another process that is writing ``target``, and its folder."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(target)], stdout=subprocess.PIPE, text=True, env=environment
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


@pytest.mark.parametrize("ending", FORMATS)
def test_what_a_killed_save_left_is_cleared_by_the_next(ending: str, tmp_path: Path) -> None:
    target = tmp_path / f"r.{ending}"
    process, folder = writer(target)
    try:
        assert folder.is_dir() and folder.parent == tmp_path
        save(large(10), target)
        assert folder.is_dir()  # its writer is alive
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    assert sorted(tmp_path.iterdir()) == sorted([folder, target])
    save(large(10), tmp_path / f"other.{ending}")
    assert folder.is_dir()  # of another file
    save(large(20), target)
    assert not folder.exists()
    assert load(target).identical(large(20))


def test_what_is_not_ours_stays(tmp_path: Path) -> None:
    target = tmp_path / "r.nc"
    mine, cut, own = (tmp_path / f".r.nc-{name}" for name in ("mine1234", "cut12345", "own12345"))
    for folder in (mine, cut, own):
        folder.mkdir()
    (mine / "letter.txt").write_text("keep")
    (cut / "writer.json").write_text('{"process": 1, "pla')
    (own / "writer.json").write_text(json.dumps({"place": whole._place(), "process": os.getpid()}))
    save(large(10), target)
    assert (mine / "letter.txt").read_text() == "keep" and cut.is_dir() and own.is_dir()


def test_a_folder_of_another_machine_is_left_for_a_day(tmp_path: Path) -> None:
    folder = tmp_path / ".r.nc-abcd1234"
    folder.mkdir()
    (folder / "writer.json").write_text(json.dumps({"place": ["other", "", 0], "process": 1}))
    clear(tmp_path / "r.nc")
    assert folder.is_dir()
    for path in (folder / "writer.json", folder):
        os.utime(path, (time.time() - 2 * 86400,) * 2)
    clear(tmp_path / "r.nc")
    assert not folder.exists()


def test_a_store_that_was_moved_away_when_its_process_was_killed_is_put_back(tmp_path: Path) -> None:
    """Killed between the two moves of a replacement."""
    target = save(large(10), tmp_path / "r.zarr")
    process, folder = writer(target)
    target.rename(folder / whole._OLD)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    clear(target)
    assert load(target).identical(large(10))
    assert [item.name for item in tmp_path.iterdir()] == ["r.zarr"]


@pytest.mark.parametrize("ending", FORMATS)
def test_what_stood_there_stays_where_the_move_fails(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, move = save(large(10), tmp_path / f"r.{ending}"), os.replace

    def fails(source: Path, place: Path) -> None:
        if Path(source).stem == "new":
            raise KeyboardInterrupt
        move(source, place)

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", fails)
        with pytest.raises(KeyboardInterrupt):
            save(large(20), target)
    assert load(target).identical(large(10))
    assert [item.name for item in tmp_path.iterdir()] == [target.name]


def test_nothing_is_left_of_an_error(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), beside(tmp_path / "r.nc"):
        raise RuntimeError
    with pytest.raises(OSError, match="No such file"):
        write_whole(tmp_path / "no" / "file", b"")
    write_whole(tmp_path / "file", b"all")
    assert [item.name for item in tmp_path.iterdir()] == ["file"]


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 200 kB in memory."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=200k", "none", str(place)]
    try:
        mounted = subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("a full disk is a small one that is mounted, and only an administrator may mount")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_full_disk_costs_nothing(ending: str, disk: Path) -> None:
    """One sentence with the way out, the file that was there, the result in the error, and a process that goes on."""
    target = save(large(100), disk / f"r.{ending}")
    with pytest.raises(DataFileError, match=rf"r\.{ending}: the disk is full .*make room.*nonsmooth\.save") as caught:
        save(large(), target)
    assert [item.name for item in disk.iterdir()] == [target.name]
    assert load(target).identical(large(100))
    assert caught.value.result.identical(large())
    assert load(save(caught.value.result, disk.parent / f"kept.{ending}")).identical(large())
    assert load(save(large(50), target)).identical(large(50))


@pytest.mark.parametrize("ending", FORMATS)
def test_a_command_keeps_its_result_elsewhere(
    ending: str, disk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (disk / "filling").write_bytes(bytes(196_000))
    study = tmp_path / "study.toml"
    study.write_text(
        f'[system]\nmodel = "discontinuous_support"\n[simulate]\nperiods = 3\n[output]\ndata = "disk/r.{ending}"\n'
    )
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert cli.main(["run", str(study), "--quiet"]) == 2
    said = capsys.readouterr().err
    (kept,) = (tmp_path / "here").iterdir()
    assert "the disk is full" in said and f"the result is kept in {kept}" in said
    assert load(kept).sizes["time"] > 1
