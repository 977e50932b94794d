"""A campaign from the command line: interrupted and gone on with, on a scheduler that is killed and comes back."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from simple_work import hashes

from nonsmooth.campaign.store import describe_store

STUDY = """
[system]
model = "discontinuous_support"
parameters = { omega = 11.15 }

[chart]
grid = { g = { from = -0.0015, to = 0.002, n = 240 }, rho = { from = 0.2, to = 0.5, n = 240 } }
extremes = false

[output]
store = "chart.zarr"
data = "chart.nc"
"""


def program(*words: str, **options: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "nonsmooth.cli.main", *words]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    pipe = subprocess.PIPE
    # A shell in the background ignores Ctrl-C, and so would what it starts.
    options = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL), **options}
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment, **options)


def finished(process: subprocess.Popen[str], code: int) -> str:
    out, err = process.communicate(timeout=600)
    assert process.returncode == code, out + err
    return out + err


def wait_for(fact: Callable[[], bool], seconds: float = 120.0) -> None:
    ends = time.monotonic() + seconds
    while not fact():
        assert time.monotonic() < ends, "it did not happen"
        time.sleep(0.05)


def marks(path: Path) -> list[Path]:
    return sorted((path / "run").glob("*.json"))


@pytest.mark.slow
def test_ctrl_c_and_the_same_command_again(tmp_path: Path) -> None:
    study, path = tmp_path / "chart.toml", tmp_path / "chart.zarr"
    study.write_text(STUDY, encoding="utf-8")
    first = program("run", str(study))
    wait_for(lambda: len(marks(path)) >= 3)
    first.send_signal(signal.SIGINT)
    said = finished(first, 130)
    done, begun = (describe_store(path)[name] for name in ("done", "started"))
    assert f"interrupted: {done} of 15 chunks are kept in" in said and "Traceback" not in said
    assert 3 <= done < describe_store(path)["chunks"]
    kept = {file: file.read_bytes() for file in marks(path)}
    assert f"{done} of 15 chunks are there" in finished(program("show", str(path)), 0)
    said = finished(program("run", str(study)), 0)
    assert "chart.nc" in said and "chunks are kept in" in said
    assert all(file.read_bytes() == data for file, data in kept.items())
    assert describe_store(path)["started"] == begun + 15 - done  # what was in hand once more, what was done not
    assert "remains     nothing" in finished(program("show", str(path)), 0)


@pytest.fixture
def port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


class Cluster:
    """A scheduler and two workers, as three commands would start them."""

    def __init__(self, port: int) -> None:
        self.port, self.processes = port, []
        self.address = f"tcp://127.0.0.1:{port}"

    def start(self) -> None:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        words = [["scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard"]]
        words += [["worker", self.address, "--nthreads", "1", "--no-dashboard", "--no-nanny"]] * 2
        code = "from distributed.cli.dask_{0} import main; main()"
        self.processes = [
            subprocess.Popen(
                [sys.executable, "-c", code.format(one[0]), *one[1:]],
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            for one in words
        ]

    def stop(self) -> None:
        for process in self.processes:
            process.kill()
            process.wait()


@pytest.fixture
def cluster(port: int) -> Iterator[Cluster]:
    pytest.importorskip("distributed", reason="dask.distributed is not installed (extra `cluster`)")
    found = Cluster(port)
    found.start()
    yield found
    found.stop()


@pytest.mark.slow
def test_a_scheduler_that_is_killed_and_comes_back(cluster: Cluster, tmp_path: Path) -> None:
    study, path = tmp_path / "chart.toml", tmp_path / "chart.zarr"
    study.write_text(STUDY, encoding="utf-8")
    command = ("run", str(study), "--scheduler", cluster.address)
    first = program(*command)
    wait_for(lambda: len(marks(path)) >= 3)
    cluster.processes[0].kill()
    said = finished(first, 2)
    assert "is gone" in said and "start it again with its workers, and run again" in said
    cluster.stop()
    kept = {file: file.read_bytes() for file in marks(path)}
    assert 3 <= len(kept) < 15
    cluster.start()
    finished(program(*command), 0)
    assert all(file.read_bytes() == data for file, data in kept.items())
    assert describe_store(path)["done"] == 15
    other = tmp_path / "alone"
    other.mkdir()
    (other / "chart.toml").write_text(STUDY, encoding="utf-8")
    finished(program("run", str(other / "chart.toml")), 0)
    assert hashes(path) == hashes(other / "chart.zarr")
    for file in marks(path):
        alone = json.loads((other / "chart.zarr" / "run" / file.name).read_text())
        assert json.loads(file.read_text())["content"] == alone["content"]


@pytest.mark.slow
def test_no_scheduler_there(port: int, tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed (extra `cluster`)")
    study = tmp_path / "chart.toml"
    study.write_text(STUDY, encoding="utf-8")
    said = finished(program("run", str(study), "--scheduler", f"tcp://127.0.0.1:{port}"), 2)
    assert "no scheduler answers at tcp://127.0.0.1" in said and "dask scheduler" in said
    assert not (tmp_path / "chart.zarr").exists()
