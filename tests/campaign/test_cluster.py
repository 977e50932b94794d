"""A cluster whose workers and client are killed: the store is bit for bit that of an undisturbed run."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from simple_work import Squares, hashes, right

import nonsmooth as ns
from nonsmooth.campaign.run import on_cluster, run
from nonsmooth.campaign.store import describe_store

QUIET = {"progress": False}
HERE = Path(__file__).parent
CAMPAIGN = """
import sys
sys.path.insert(0, {here!r})
from distributed import Client
from simple_work import Squares
from nonsmooth.campaign.run import on_cluster, run
with Client({address!r}) as client:
    run(Squares(size={size}, step=7, seconds={seconds}), store={store!r}, client=client, progress=False)
"""


def test_without_dask_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match="cluster"):
        on_cluster(Squares(), [0], print, None, None)


class Crew:
    """Worker processes of a run, each put back when it is gone, as a batch system would."""

    def __init__(self, address: str, size: int) -> None:
        self.command = [
            sys.executable,
            "-c",
            "from distributed.cli.dask_worker import main; main()",
            address,
            "--nthreads",
            "1",
            "--no-nanny",
            "--no-dashboard",
            "--memory-limit",
            "0",
        ]
        self.environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(HERE), *filter(None, sys.path)])}
        self.members = [self._begin() for _ in range(size)]
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self._watch)
        self.thread.start()

    def _begin(self) -> subprocess.Popen[bytes]:
        quiet = subprocess.DEVNULL
        return subprocess.Popen(self.command, env=self.environment, stdout=quiet, stderr=quiet)

    def _watch(self) -> None:
        while not self.stop.wait(0.3):
            for k, member in enumerate(self.members):
                if member.poll() is not None:
                    self.members[k] = self._begin()

    def close(self) -> None:
        self.stop.set()
        self.thread.join()
        for member in self.members:
            member.kill()
            member.wait()


@pytest.fixture
def workers(request):
    """A client and its crew; two unless a test says how many."""
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed (extra `cluster`)")
    with (
        distributed.LocalCluster(n_workers=0, processes=True, dashboard_address=None, silence_logs=50) as found,
        distributed.Client(found) as client,
    ):
        size = getattr(request, "param", 2)
        crew = Crew(client.scheduler.address, size)
        try:
            client.wait_for_workers(size, timeout=120)
            yield client, crew
        finally:
            crew.close()


def test_a_cluster_computes_the_same(workers, tmp_path: Path) -> None:
    work = Squares()
    assert right(run(work, client=workers[0], **QUIET), work)
    assert right(run(work, client=workers[0], store=tmp_path / "far.zarr", **QUIET), work)
    run(work, threads=1, store=tmp_path / "here.zarr", **QUIET)
    assert hashes(tmp_path / "far.zarr") == hashes(tmp_path / "here.zarr")


@pytest.mark.slow
def test_one_process_and_eight_workers_write_the_same_chart(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed (extra `cluster`)")
    system = ns.models.discontinuous_support(omega=11.15)
    grid = {"g": np.linspace(-0.0015, 0.002, 200), "rho": np.linspace(0.2, 0.5, 200)}
    one = ns.chart(system, grid, store=tmp_path / "one.zarr", threads=1, **QUIET)
    with (
        distributed.LocalCluster(
            n_workers=8, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
        ) as run,
        distributed.Client(run) as client,
    ):
        client.wait_for_workers(8, timeout=120)
        eight = ns.chart(system, grid, store=tmp_path / "eight.zarr", client=client, **QUIET)
        far = ns.chart(system, grid, client=client, **QUIET)
    assert eight.identical(one) and far.identical(one)
    assert hashes(tmp_path / "one.zarr") == hashes(tmp_path / "eight.zarr")
    marks = [json.loads(file.read_text()) for file in (tmp_path / "eight.zarr" / "run").glob("*.json")]
    assert len(marks) == 10 and len({mark["process"] for mark in marks}) > 2


def disturbed(client, crew: Crew, path: Path, chunks: int, seconds: float, kills: int, client_kills: int) -> int:
    """Run a campaign in a process of its own while workers and that process are killed. Returns the kills made."""
    program = CAMPAIGN.format(
        here=str(HERE), address=client.scheduler.address, size=7 * chunks, seconds=seconds, store=str(path)
    )
    made, rng, stop = [0], random.Random(5), threading.Event()

    def killer() -> None:
        span = chunks * seconds / 3
        while made[0] < kills and not stop.wait(rng.uniform(0.3, 1.7) * span / kills):
            started = path / "run" / "started.log"  # kill whoever began last: it is busy
            if not started.exists():
                continue
            lines = [json.loads(line) for line in started.read_text().splitlines()]
            busy = [m for m in crew.members if m.poll() is None and m.pid in {line["process"] for line in lines[-3:]}]
            if busy:
                os.kill(rng.choice(busy).pid, signal.SIGKILL)
                made[0] += 1

    thread = threading.Thread(target=killer)
    thread.start()
    try:
        for life in range(client_kills + 1):
            process = subprocess.Popen([sys.executable, "-c", program])
            if life < client_kills:
                wanted = (life + 1) * chunks // (client_kills + 2)
                while len(list((path / "run").glob("*.json"))) < wanted and process.poll() is None:
                    time.sleep(0.2)
                process.kill()
                process.wait()
            else:
                assert process.wait(timeout=1200) == 0
    finally:
        stop.set()
        thread.join()
    return made[0]


@pytest.mark.slow
@pytest.mark.parametrize("workers", [3], indirect=True)
@pytest.mark.parametrize(("chunks", "seconds", "kills", "client_kills"), [(60, 0.5, 4, 1)])
def test_killed_workers_and_clients_change_nothing(
    workers, tmp_path: Path, chunks: int, seconds: float, kills: int, client_kills: int
) -> None:
    if "NONSMOOTH_FAULTS" in os.environ:  # for example 400,1.0,30,2
        words = os.environ["NONSMOOTH_FAULTS"].split(",")
        chunks, seconds, kills, client_kills = int(words[0]), float(words[1]), int(words[2]), int(words[3])
    path = tmp_path / "disturbed.zarr"
    made = disturbed(*workers, path, chunks, seconds, kills, client_kills)
    assert made == kills
    calm = tmp_path / "calm.zarr"
    run(Squares(size=7 * chunks), threads=1, store=calm, **QUIET)
    assert hashes(path) == hashes(calm)
    found = describe_store(path)
    assert found["done"] == found["chunks"] == chunks
    print(f"{made} workers and {client_kills} clients killed, {found['started'] - chunks} chunks begun again")
    assert found["started"] - chunks <= made + client_kills  # one for each kill
    for file in (path / "run").glob("*.json"):
        other = json.loads((calm / "run" / file.name).read_text())
        assert json.loads(file.read_text())["content"] == other["content"]


def test_an_address_is_no_client() -> None:
    with pytest.raises(TypeError, match=r"client = 'tcp.*give dask\.distributed\.Client\(address\)"):
        run(Squares(size=4, step=2, seconds=0.0), client="tcp://127.0.0.1:8786", **QUIET)
