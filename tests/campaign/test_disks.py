"""Disks that are really full or really read-only: one sentence, nothing damaged, and the run goes on afterwards."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from simple_work import Squares, hashes, right

import nonsmooth as ns
from nonsmooth.campaign.run import run
from nonsmooth.campaign.store import describe_store
from nonsmooth.errors import DataFileError

QUIET = {"progress": False}
LARGE = Squares(size=40_000, step=1000, name="squares of many places")


def mount(*words: str) -> bool:
    try:
        return subprocess.run(["mount", *words], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 200 kB in memory."""
    place = tmp_path / "disk"
    place.mkdir()
    if not mount("-t", "tmpfs", "-o", "size=200k", "none", str(place)):
        pytest.skip("a full disk is a small one that is mounted, and only an administrator may mount")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.parametrize("threads", [1, 3])
def test_a_full_disk(disk: Path, threads: int) -> None:
    """Work that was finished before the disk was full is whole, and is not computed again once there is room."""
    path = disk / "squares.zarr"
    with pytest.raises(DataFileError, match=r"squares\.zarr: the disk is full .* run it again to go on"):
        run(LARGE, store=path, threads=threads, **QUIET)
    done = describe_store(path)["done"]
    assert 3 < done < LARGE.n_chunks()
    marks = {file: file.read_bytes() for file in (path / "run").glob("*.json")}
    assert not list((path / "run").glob(".*"))  # no half of a mark is left
    with pytest.raises(DataFileError, match="the disk is full"):  # still
        run(LARGE, store=path, threads=threads, **QUIET)
    assert mount("-o", "remount,size=4m", str(disk))
    assert right(run(LARGE, store=path, threads=threads, **QUIET), LARGE)
    assert all(file.read_bytes() == data for file, data in marks.items())
    run(LARGE, store=disk / "calm.zarr", threads=1, **QUIET)
    assert hashes(path) == hashes(disk / "calm.zarr")


def test_a_disk_too_small_for_an_empty_store(disk: Path) -> None:
    (disk / "filling").write_bytes(bytes(196_000))
    with pytest.raises(DataFileError, match="the disk is full"):
        run(LARGE, store=disk / "squares.zarr", **QUIET)
    assert [file.name for file in disk.iterdir()] == ["filling"]


def test_tables_figures_and_films_on_a_full_disk(disk: Path) -> None:
    run = ns.simulate(ns.models.impact_oscillator(), periods=1)
    film, ax = ns.animate(run, seconds=0.5, rate=10, pixels=150), ns.plot.time_history(run)
    for filled in (196_000, 204_800):  # a little of a file fits, or none
        (disk / "filling").write_bytes(bytes(filled))
        for write in (
            lambda: ns.table(run, samples=4000, file=disk / "run.csv"),
            lambda: ns.plot.save_figure(ax, disk / "run.png"),
            lambda: film.save(disk / "run.gif"),
            lambda: film.save(disk / "run.html"),
        ):
            with pytest.raises(DataFileError, match="the disk is full .*make room"):
                write()
            assert [file.name for file in disk.iterdir()] == ["filling"]


def test_a_read_only_disk(disk: Path) -> None:
    work, path = Squares(), disk / "squares.zarr"
    with pytest.raises(RuntimeError):
        run(Squares(fails_at=9), threads=1, store=path, **QUIET)
    before = hashes(path)
    assert mount("-o", "remount,ro", str(disk))
    with pytest.raises(DataFileError, match="the disk is read-only"):
        run(work, store=path, **QUIET)
    with pytest.raises(DataFileError, match="the disk is read-only"):
        run(work, store=disk / "other.zarr", **QUIET)
    assert hashes(path) == before
    assert describe_store(path)["done"] == 9
    assert mount("-o", "remount,rw", str(disk))
    assert right(run(work, store=path, **QUIET), work)
    assert mount("-o", "remount,ro", str(disk))
    assert right(run(work, store=path, **QUIET), work)  # whole: it is read, not written


def test_a_chart_of_another_model_leaves_the_store_as_it_is(tmp_path: Path) -> None:
    grid = {"omega": np.linspace(3, 7, 8), "rho": np.linspace(0.1, 0.3, 8)}
    path = tmp_path / "chart.zarr"
    support = ns.models.discontinuous_support(g=0.02)
    first = ns.chart(support, grid, store=path, **QUIET)
    before = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    other = ns.models.discontinuous_support(g=0.02).smoothed(1e-5)
    with pytest.raises(DataFileError, match=r"is the store of another work.*give another name"):
        ns.chart(other, grid, store=path, **QUIET)
    with pytest.raises(DataFileError, match=r"is the store of another work.*transient"):
        ns.chart(support, grid, store=path, transient=600, **QUIET)
    assert {file: file.read_bytes() for file in path.rglob("*") if file.is_file()} == before
    assert ns.chart(support, grid, store=path, **QUIET).identical(first)
