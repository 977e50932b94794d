"""Stores of chunks: resumed, whole, of one work only; threads; the plan."""

from __future__ import annotations

import errno
import json
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
import zarr
from simple_work import Squares, Zeros, hashes, right

import nonsmooth as ns
from nonsmooth.attractors.basins import basins
from nonsmooth.campaign import store as stores
from nonsmooth.campaign import work
from nonsmooth.campaign.plan import plan
from nonsmooth.campaign.run import run
from nonsmooth.campaign.store import describe_store, open_store
from nonsmooth.campaign.work import difference
from nonsmooth.cli.main import main
from nonsmooth.diagrams.chart import chart, plan_chart
from nonsmooth.errors import DataFileError

QUIET = {"progress": False}


@pytest.mark.parametrize("threads", [1, 3])
def test_every_chunk_once(threads: int) -> None:
    for size in (1, 6, 7, 8, 100):
        work = Squares(size)
        assert right(run(work, threads=threads, **QUIET), work)


def test_a_store_holds_the_same_and_is_gone_on_with(tmp_path: Path) -> None:
    work, path = Squares(), tmp_path / "squares.zarr"
    with pytest.raises(RuntimeError, match="chunk 9"):
        run(Squares(fails_at=9), threads=1, store=path, **QUIET)
    assert describe_store(path)["done"] == 9
    marks = {file: file.read_bytes() for file in (path / "run").glob("*.json")}
    assert right(run(work, threads=2, store=path, **QUIET), work)
    assert describe_store(path)["done"] == describe_store(path)["chunks"] == 15
    assert all(file.read_bytes() == data for file, data in marks.items())  # what was there was not computed again
    assert right(run(Squares(fails_at=3), store=path, **QUIET), work)  # nothing is computed any more
    other = tmp_path / "other.zarr"
    run(work, threads=1, store=other, **QUIET)
    assert hashes(path) == hashes(other) and len(hashes(path)) > 30


def test_ctrl_c_says_what_is_kept_and_that_it_can_be_gone_on_with(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "squares.zarr"

    def interrupted() -> dict[str, np.ndarray]:
        return run(Squares(), threads=1, store=path, progress=lambda share: share < 0.3)

    said = f"cancelled by the function given as progress: 5 of 15 chunks are kept in {path}; run it again to go on"
    with pytest.raises(KeyboardInterrupt) as told:
        interrupted()
    assert str(told.value) == said and describe_store(path)["done"] == 5
    monkeypatch.setattr("nonsmooth.models.names", interrupted)
    assert main(["models"]) == 130 and f"of 15 chunks are kept in {path}" in capsys.readouterr().err


def test_a_chunk_cut_short_is_computed_again(tmp_path: Path) -> None:
    work, path = Squares(), tmp_path / "squares.zarr"
    run(work, store=path, **QUIET)
    whole = hashes(path)
    (path / "run" / "000004.json").write_text('{"chunk": 4, "ke')  # a mark cut short
    (path / "run" / "000005.json").unlink()
    (path / "results" / "square" / "c" / "0").write_bytes(b"torn")
    first = json.loads((path / "run" / "000000.json").read_text())
    (path / "run" / "000000.json").unlink()
    assert describe_store(path)["done"] == 12
    assert right(run(work, store=path, **QUIET), work)
    assert hashes(path) == whole
    assert json.loads((path / "run" / "000000.json").read_text())["content"] == first["content"]
    (path / "results" / "pair" / "c" / "3" / "0").write_bytes(b"rotten")  # after it was marked as done
    with pytest.raises(DataFileError, match="1 chunks are damaged .3."):
        run(work, store=path, **QUIET)
    assert right(run(work, store=path, **QUIET), work)


def test_chunks_of_zeros_are_files_too_however_many_threads_write(tmp_path: Path) -> None:
    """Bit for bit those of one thread, counted beforehand; the library's settings stay the user's own meanwhile."""
    work, seen = Zeros(size=100, step=5), set()

    class Watching(Zeros):
        def compute(self, chunk: int) -> dict[str, object]:
            seen.add((zarr.config.get("array.write_empty_chunks"), zarr.config.get("threading.max_workers")))
            return super().compute(chunk)

    with zarr.config.set({"array.write_empty_chunks": False, "threading.max_workers": 5}):
        run(work, threads=1, store=tmp_path / "1.zarr", **QUIET)
        for threads in (2, 8):
            run(Watching(size=100, step=5), threads=threads, store=tmp_path / f"{threads}.zarr", **QUIET)
        assert seen == {(False, 5)}
    first = hashes(tmp_path / "1.zarr")
    assert len(first) == 2 * work.n_chunks() + 3  # a file per column and chunk; the descriptions
    assert hashes(tmp_path / "2.zarr") == hashes(tmp_path / "8.zarr") == first
    contents = {describe_store(tmp_path / f"{threads}.zarr")["content"] for threads in (1, 2, 8)}
    assert len(contents) == 1 and None not in contents


def test_altered_facts_and_descriptions(tmp_path: Path) -> None:
    """The description that a store gives of itself is checked like its numbers: refused, or computed again."""
    work, path = Squares(), tmp_path / "squares.zarr"
    run(work, store=path, **QUIET)
    whole = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    mark = path / "run" / "000003.json"
    mark.write_bytes(whole[mark].replace(b'"seconds": 0.0', b'"seconds": 9.0'))
    assert mark.read_bytes() != whole[mark]
    assert describe_store(path)["done"] == 14 and describe_store(path)["content"] is None
    assert right(run(work, store=path, **QUIET), work)
    for file, old, new, message in (
        (path / "zarr.json", rb'"verb\": \"squares', rb'"verb\": \"squared', "what it says of its work was altered"),
        (path / "results" / "pair" / "zarr.json", b'"int32"', b'"int16"', "column 'pair' was altered"),
        (path / "results" / "pair" / "zarr.json", b"100", b"900", "column 'pair' was altered"),
        (path / "results" / "square" / "zarr.json", b'"float64"', b'"flo', "column 'square' is damaged"),
    ):
        assert old in whole[file]
        file.write_bytes(whole[file].replace(old, new))
        with pytest.raises(DataFileError, match=rf"squares\.zarr: .*{message}.*give another name"):
            run(work, store=path, **QUIET)
        file.write_bytes(whole[file])
    assert right(run(work, store=path, **QUIET), work)


@pytest.mark.parametrize("many", [8, pytest.param(30, marks=pytest.mark.slow)])
def test_altered_bytes_of_a_finished_store(tmp_path: Path, many: int) -> None:
    """One byte anywhere: the same columns, or an error; what is reported as damaged is computed again."""
    work, path, rng = Squares(), tmp_path / "squares.zarr", np.random.default_rng(3)
    run(work, store=path, **QUIET)
    files = sorted(file for file in path.rglob("*") if file.is_file())
    refused = 0
    for _ in range(many):
        file = files[rng.integers(len(files))]
        before = file.read_bytes()
        data = bytearray(before)
        data[rng.integers(len(data))] ^= int(rng.integers(1, 256))
        file.write_bytes(data)
        try:
            assert right(run(work, threads=1, store=path, **QUIET), work)
        except DataFileError:
            refused += 1
        if not file.exists() or file.parent.name != "run":
            file.write_bytes(before)
        assert right(run(work, threads=1, store=path, **QUIET), work)
    assert refused > many // 15


def test_the_store_of_another_work_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "squares.zarr"
    run(Squares(), store=path, **QUIET)
    before = hashes(path)
    for other, message in (
        (Squares(name="cubes"), "another work: it differs in system"),
        (Squares(size=101), "options differ in size"),
        (Squares(step=8), "differs in chunks"),
    ):
        with pytest.raises(DataFileError, match=message):
            run(other, store=path, **QUIET)
    with monkeypatch.context() as patched:
        patched.setattr(stores, "processor_type", lambda device: "another")
        with pytest.raises(DataFileError, match="any_cpu=True"):
            run(Squares(), store=path, **QUIET)
        assert right(run(Squares(), store=path, any_cpu=True, **QUIET), Squares())
    with monkeypatch.context() as patched:
        patched.setattr(work, "_kernel_version", lambda: "older")
        with pytest.raises(DataFileError, match="another version"):
            run(Squares(), store=path, **QUIET)
    assert hashes(path) == before


def test_other_rules_of_judgement_are_another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    """Labels are decided by analysis as much as by the kernels."""
    version, read = work._kernel_version.__wrapped__, Path.read_bytes
    now = version()
    for changed in ("kernels/judging/judge.py", "flow/engines/linear.py", "kernels/linear/stepper.py"):
        with monkeypatch.context() as patched:

            def edited(file: Path, end: str = changed) -> bytes:
                return read(file) + (b"#" if file.as_posix().endswith(end) else b"")

            patched.setattr(Path, "read_bytes", edited)
            assert version() != now
    assert version() == now


def test_trouble_while_reading_takes_no_mark_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunks that cannot be read for want of memory, or by a fault of the disk, are not damaged."""
    path = tmp_path / "squares.zarr"
    run(Squares(), store=path, **QUIET)
    before = hashes(path)
    for trouble in (MemoryError("no room"), OSError(errno.EIO, "the cable is loose")):

        def fail(*_: object, error: BaseException = trouble) -> None:
            raise error

        with monkeypatch.context() as patched:
            patched.setattr(stores, "_content", fail)
            with pytest.raises(type(trouble)):
                run(Squares(), store=path, **QUIET)
        assert hashes(path) == before and len(stores.open_store(path, Squares()).done()) == Squares().n_chunks()


def test_places_that_cannot_be_a_store(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"\.zarr"):
        run(Squares(), store=tmp_path / "squares.nc", **QUIET)
    with pytest.raises(DataFileError, match="does not exist"):
        run(Squares(), store=tmp_path / "no" / "squares.zarr", **QUIET)
    (tmp_path / "taken.zarr").mkdir()
    (tmp_path / "taken.zarr" / "file").write_text("mine")
    with pytest.raises(DataFileError, match="not a store"):
        run(Squares(), store=tmp_path / "taken.zarr", **QUIET)
    assert (tmp_path / "taken.zarr" / "file").read_text() == "mine"


@pytest.mark.parametrize(("number", "words"), [(errno.ENOSPC, "disk is full"), (errno.EROFS, "read-only")])
def test_trouble_with_the_disk_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, words: str
) -> None:
    work, path = Squares(), tmp_path / "squares.zarr"
    store = open_store(path, work)
    store.write(work, 0, work.compute(0), 0.0)
    with monkeypatch.context() as patched:

        def refuse(*_: object) -> None:
            raise OSError(number, os.strerror(number))

        patched.setattr(stores, "write_whole", refuse)
        with pytest.raises(DataFileError, match=words):
            store.write(work, 1, work.compute(1), 0.0)
    assert store.done() == {0}
    assert right(run(work, store=path, **QUIET), work)


def test_charts_and_basins_in_a_store(tmp_path: Path) -> None:
    system = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.5)
    grid = {"omega": np.linspace(3, 7, 8), "rho": np.linspace(0.1, 0.3, 5)}
    plain = chart(system, grid, **QUIET)
    assert chart(system, grid, store=tmp_path / "chart.zarr", **QUIET).identical(plain)
    assert chart(system, grid, store=tmp_path / "chart.zarr", **QUIET).identical(plain)
    with pytest.raises(DataFileError, match="parameters differ in g"):
        chart(system.with_parameters(g=0.01), grid, store=tmp_path / "chart.zarr", **QUIET)
    plane = {"x": np.linspace(-0.04, 0.02, 8), "v": np.linspace(-0.2, 0.2, 6)}
    assert basins(system, plane, store=tmp_path / "b.zarr", **QUIET).identical(basins(system, plane, **QUIET))


def test_a_grid_named_the_other_way_round_is_another_work(tmp_path: Path) -> None:
    """Places lie row by row in the order of the grid's names."""
    system, omega, rho = ns.models.discontinuous_support(), np.linspace(3, 7, 4), np.linspace(0.1, 0.3, 3)
    chart(system, {"omega": omega, "rho": rho}, store=tmp_path / "chart.zarr", **QUIET)
    with pytest.raises(DataFileError, match="its options differ in grid"):
        chart(system, {"rho": rho, "omega": omega}, store=tmp_path / "chart.zarr", **QUIET)
    one, other = ({"options": dict.fromkeys(names, 1)} for names in ("ab", "ba"))
    assert difference(one, other) == "its options differ in their order"


def two_frictions() -> ns.System:
    """Its modes are made, and numbered, as they are visited; each call gives it with none visited."""
    rubs = {name: ns.elements.Coulomb(at="q", friction=mu, belt=0.2) for name, mu in (("a", 0.1), ("b", 0.05))}
    stop = ns.elements.Stop(at="q", position=0.3, restitution=0.5)
    force = {"q": lambda t, p: p.F * np.cos(p.w * t)}
    return ns.mechanical(1.0, 0.1, 1.0, forcing=force, parameters={"F": 0.8, "w": 0.9}, elements={**rubs, "stop": stop})


def test_modes_in_a_store_do_not_depend_on_what_a_process_has_visited(tmp_path: Path) -> None:
    plane = {"q": np.linspace(-0.8, 0.2, 3), "v_q": np.linspace(-0.5, 0.5, 2)}
    plain, other = basins(two_frictions(), plane, **QUIET), two_frictions()
    ns.simulate(other, periods=3, start={"v_q": -1.0})
    for system in (two_frictions(), other):
        assert basins(system, plane, store=tmp_path / "b.zarr", **QUIET).identical(plain)
    first, second = (plan_chart(s, {"F": [0.8], "w": [0.9]}, keep=20).work.settler for s in (system, two_frictions()))
    names = list(system.modes)
    found = second.retold(first.told(np.arange(len(names))))
    assert [list(second.system.modes)[k] for k in found] == names


def test_a_section_in_a_mode_travels_with_the_mode() -> None:
    system = two_frictions()
    ns.simulate(system, periods=3, start={"v_q": -1.0})
    section = ns.Poincare("stop_gap", rising=None, mode="a_back_b_back_stop_open")
    work = plan_chart(system, {"F": [0.8], "w": [0.9, 1.0]}, section=section, keep=10, transient=5).work
    there = pickle.loads(pickle.dumps(work)).compute(0)
    for name, values in work.compute(0).items():
        np.testing.assert_array_equal(values, there[name])


def test_a_chunk_in_another_process_is_the_same() -> None:
    """A settler travels as the system's text; what comes back has the same bits."""
    work = plan_chart(
        ns.models.discontinuous_support(g=0.02), {"omega": np.linspace(3, 7, 12), "rho": np.linspace(0.1, 0.3, 9)}
    ).work
    there = pickle.loads(pickle.dumps(work)).compute(0)
    for name, values in work.compute(0).items():
        np.testing.assert_array_equal(values, there[name])


def test_the_plan_of_a_work_whose_cost_is_known() -> None:
    """Bytes are exact; the time is that of the sampled chunks scaled up."""
    found = plan(Squares(size=7000, step=70), seconds=0.05)
    assert (found.places, found.chunks, found.result_bytes) == (7000, 100, 7000 * 16)
    assert 8 <= found.sampled <= 100
    assert found.seconds(4) == pytest.approx(found.core_seconds / 4)
    assert "7000 points in 100 chunks" in found.text(8) and "8 cores" in found.text(8)
