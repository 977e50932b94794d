"""The process that computes: it answers, hears that its work is not wanted, and says when it ends."""

from __future__ import annotations

import ctypes
import importlib
import queue
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import nonsmooth as ns
from nonsmooth.explorer.catalogue import first_state
from nonsmooth.explorer.worker import Answer, Worker, _Cancelled, end_spare, prepare

SYSTEM = ns.models.discontinuous_support()


@pytest.fixture(scope="module")
def answers() -> queue.Queue[Answer]:
    return queue.Queue()


@pytest.fixture
def cancelled(monkeypatch: pytest.MonkeyPatch) -> Iterator[_Cancelled]:
    """Cancelled work in this process, about to be interrupted."""
    monkeypatch.setattr("nonsmooth.explorer.worker._SILENT", 0.1)
    before, hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    one = _Cancelled()
    one.at_work = 7
    one.add(7)
    yield one
    one.at_work = 0
    signal.signal(signal.SIGINT, before)
    sys.unraisablehook = hook


@pytest.fixture
def worker(answers: queue.Queue[Answer]) -> Iterator[Worker]:
    """The process that the test before it left."""
    one = Worker.idle(answers.put)
    yield one
    one.close()


def job(view: str, **options: Any) -> dict[str, Any]:
    state = first_state("discontinuous_support", SYSTEM)
    return {
        "view": view,
        "text": SYSTEM.to_text(),
        "values": dict(state.values),
        "method": "auto",
        "eta": 0.0,
        "transient": 100,
        "keep": 20,
        "start": [0.0, 0.0],
        "begin": [0.0, 0.0],
        "over": "rho",
        "low": 0.2,
        "high": 0.5,
        "columns": 11,
        "direction": "both",
        **options,
    }


def last_of(answers: queue.Queue[Answer], number: int) -> Answer:
    while True:
        answer = answers.get(timeout=120)
        if answer[1] == number and answer[0] != "progress":
            return answer


def test_a_view_is_what_the_verb_returns(worker: Worker, answers: queue.Queue[Answer]) -> None:
    worker.ask(1, job("diagram"))
    kind, _, (found, warned) = last_of(answers, 1)
    assert (kind, warned) == ("done", [])
    alone = ns.sweep(
        SYSTEM,
        "rho",
        found["diagram"]["rho"].values,
        direction="both",
        start=[0.0, 0.0],
        transient=100,
        keep=20,
        progress=False,
    )
    assert found["diagram"].drop_attrs().identical(alone.drop_attrs())


def test_work_that_is_not_wanted_ends(worker: Worker, answers: queue.Queue[Answer]) -> None:
    worker.ask(2, job("diagram", columns=200_000))  # an hour
    while answers.get(timeout=120)[:2] != ("progress", 2):
        pass
    worker.cancel(2)
    assert last_of(answers, 2)[0] == "cancelled"


def test_work_that_does_not_ask_is_interrupted_and_the_process_stays(
    worker: Worker, answers: queue.Queue[Answer]
) -> None:
    chaotic = {**job("branches")["values"], "rho": 0.2}  # half a minute that reports nothing
    worker.ask(5, job("branches", values=chaotic, low=0.199, high=0.201, transient=10_000_000))
    time.sleep(0.3)
    worker.cancel(5)
    assert last_of(answers, 5)[0] == "cancelled"
    worker.ask(6, job("orbit"))
    assert last_of(answers, 6)[0] == "done"
    assert worker._popen.poll() is None


def test_a_package_is_loaded_whole_before_its_work_is_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    (tmp_path / "slow_to_load.py").write_text("import time\nfor _ in range(60):\n    time.sleep(0.01)\nwhole = True\n")
    monkeypatch.syspath_prepend(tmp_path)
    request.getfixturevalue("cancelled")
    with pytest.raises(KeyboardInterrupt):  # while it is loaded, or behind it
        time.sleep(20 if importlib.import_module("slow_to_load").whole else 0)
    assert sys.modules["slow_to_load"].whole


@pytest.mark.usefixtures("cancelled")
def test_an_interruption_that_c_ignores_comes_again() -> None:
    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
    def slowly(_one: int, _other: int) -> int:
        time.sleep(20)
        return 0

    def work() -> None:
        numbers = (ctypes.c_int * 2)()
        ctypes.CDLL(None).qsort(numbers, ctypes.c_size_t(2), ctypes.c_size_t(4), slowly)  # the sleep alone ends
        time.sleep(20)

    with pytest.raises(KeyboardInterrupt):
        work()


def test_an_error_is_a_sentence(worker: Worker, answers: queue.Queue[Answer]) -> None:
    worker.ask(3, job("first look", over="gap"))
    kind, _, said = last_of(answers, 3)
    assert kind == "error"
    assert "`gap` is not a parameter" in said


@pytest.mark.slow
def test_one_that_ends_says_so_and_another_begins() -> None:
    answers = queue.Queue[Answer]()
    Worker.idle(answers.put).end()
    while answers.get(timeout=60)[0] != "ended":
        pass
    other = Worker.idle(answers.put)
    other.ask(4, job("orbit"))
    assert last_of(answers, 4)[0] == "done"
    other.close()


def test_work_that_is_cancelled_while_it_waits_is_answered(worker: Worker, answers: queue.Queue[Answer]) -> None:
    """Else the page waits for it."""
    worker.ask(901, job("diagram", columns=60))
    worker.ask(902, job("diagram"))
    worker.cancel(902)
    assert last_of(answers, 902)[0] == "cancelled"


def test_a_page_takes_over_the_process_of_one_that_was_closed() -> None:
    """Cancelled is what the other one had asked, and its answers reach nobody."""
    first, second = queue.Queue[Answer](), queue.Queue[Answer]()
    one = Worker.idle(first.put)
    one.ask(1, job("diagram", columns=200_000))  # an hour
    while first.get(timeout=120)[:2] != ("progress", 1):
        pass
    one.close()
    end = time.monotonic() + 60
    while Worker.spare is not one:
        assert time.monotonic() < end
        time.sleep(0.02)
    other = Worker.idle(second.put)
    assert other is one
    other.ask(1, job("orbit"))
    assert last_of(second, 1)[0] == "done"
    assert {kind for kind, *_ in first.queue} <= {"progress"}
    prepare()  # one more waits
    waiting = Worker.spare
    other.close()
    one._popen.wait(30)  # of two that nobody hears one ends
    assert Worker.spare is waiting
    end_spare()


def test_work_that_a_closed_page_left_does_not_keep_the_program() -> None:
    """The thread that looks whether it has ended by then is one that Python does not wait for."""
    one = Worker.idle(queue.Queue[Answer]().put)
    one.ask(1, job("diagram", columns=200_000))  # an hour
    one.close()
    timers = [thread for thread in threading.enumerate() if isinstance(thread, threading.Timer)]
    assert timers and all(thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread())
    one.end()
    for timer in timers:
        timer.cancel()
