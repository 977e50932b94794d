"""Processor time of the tests by cause, a pytest plugin: ``python -m pytest -p tests.costs -n 0`` (`make test-times`).

Compiling is what Numba's dispatchers take, importing what import statements take (collecting is mostly that), children
are processes that have ended, the browser those of tests that look at one; the rest is what is left. ``--called FILE``
writes the tests that run each function of the package, in child processes too, for ``tests/mutants_sample.py``.
"""

from __future__ import annotations

import builtins
import cProfile
import json
import os
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

CAUSES = ("compiling", "importing", "children", "browser", "rest")
SOURCES = str(Path(__file__).parents[1] / "src" / "nonsmooth") + os.sep
ROOT = Path(__file__).parents[1]
CHILDREN = ROOT / "tests" / "children"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--called", help="a file for the tests that run each function of the package")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Costs(config.getoption("--called")), "the costs")


class Costs:
    """Seconds of processor time, by file and cause."""

    def __init__(self, called: str | None) -> None:
        self.spent: dict[str, dict[str, float]] = defaultdict(lambda: dict.fromkeys(CAUSES, 0.0))
        self.inside: dict[str, float] = dict.fromkeys(CAUSES, 0.0)
        self.depth = 0
        self.called: dict[str, set[str]] = defaultdict(set)
        self.took: dict[str, float] = {}
        self.seen: set[Any] = set()
        self.into = called
        if called:
            descriptor, self.children = tempfile.mkstemp()  # tests/children/sitecustomize.py writes there
            os.close(descriptor)
            os.environ["NONSMOOTH_CALLED"] = self.children
            sys.path.append(str(CHILDREN))
            os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), str(CHILDREN)]))
        builtins.__import__ = self._timed("importing", builtins.__import__)

    def _timed(self, cause: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function with its time counted; what it calls itself counts as its own."""

        def timed(*arguments: Any, **named: Any) -> Any:
            if self.depth or threading.current_thread() is not threading.main_thread():
                return function(*arguments, **named)
            self.depth, begun = 1, time.process_time()
            try:
                return function(*arguments, **named)
            finally:
                self.depth = 0
                self.inside[cause] += time.process_time() - begun

        return timed

    def _watch_numba(self) -> None:
        module = sys.modules.get("numba.core.dispatcher")
        if module is not None and not hasattr(module.Dispatcher.compile, "watched"):
            module.Dispatcher.compile = self._timed("compiling", module.Dispatcher.compile)
            module.Dispatcher.compile.watched = True
        module = sys.modules.get("nonsmooth.kernels.compile.direct")
        if module is not None and not hasattr(module.Callback.__init__, "watched"):
            module.Callback.__init__ = self._timed("compiling", module.Callback.__init__)
            module.Callback.__init__.watched = True

    def _count(self, file: str, browser: bool) -> Iterator[None]:
        before, children, begun = dict(self.inside), _children(), time.process_time()
        yield
        here = self.spent[file]
        here["browser" if browser else "children"] += _children() - children
        left = time.process_time() - begun
        for cause in ("compiling", "importing"):
            took = self.inside[cause] - before[cause]
            here[cause] += took
            left -= took
        here["rest"] += left

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Any:
        counting = self._count(_file(collector.path), False) if isinstance(collector, pytest.Module) else iter("x")
        next(counting)
        report = yield
        next(counting, None)
        return report

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> Any:
        self._watch_numba()
        begun = time.process_time()
        browser = bool({"browser", "page", "tab"} & set(getattr(item, "fixturenames", ())))
        browser = browser or nextitem is None  # which ends with the session
        counting = self._count(_file(item.path), browser)
        next(counting)
        if self.into:
            self.seen = set()
            profiler = cProfile.Profile(builtins=False)  # a function of Python's takes thrice as long
            profiler.enable()
            threading.setprofile(self._profile)
        result = yield
        if self.into:
            profiler.disable()
            threading.setprofile(None)
            self.seen |= {entry.code for entry in profiler.getstats()}
            self._keep(item.nodeid)
        next(counting, None)
        self.took[item.nodeid] = round(time.process_time() - begun, 3)
        return result

    def _profile(self, frame: Any, event: str, argument: Any) -> None:
        if event == "call":
            self.seen.add(frame.f_code)

    def _keep(self, nodeid: str) -> None:
        for code in self.seen.copy():  # threads that still run add to it
            if code.co_filename.startswith(SOURCES):
                self.called[f"{code.co_filename.removeprefix(SOURCES)}:{code.co_qualname}"].add(nodeid)
        with open(self.children, "r+", encoding="utf-8") as file:
            for place in file.read().splitlines():
                self.called[place].add(nodeid)
            file.truncate(0)

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        write = terminalreporter.write_line
        total = {cause: sum(one[cause] for one in self.spent.values()) for cause in CAUSES}
        rows = sorted(self.spent.items(), key=lambda one: -sum(one[1].values()))
        terminalreporter.section("processor time by cause, s")
        write(f"{'file':56}{'all':>8}" + "".join(f"{cause:>11}" for cause in CAUSES))
        for name, row in [("all files", total), *rows]:
            write(f"{name:56}{sum(row.values()):8.1f}" + "".join(f"{row[cause]:11.1f}" for cause in CAUSES))
        if self.into:
            called = {place: sorted(tests) for place, tests in sorted(self.called.items())}
            Path(self.children).unlink()
            Path(self.into).write_text(json.dumps({"took": self.took, "called": called}), encoding="utf-8")


def _children() -> float:
    ended = os.times()
    return ended.children_user + ended.children_system


def _file(path: Path) -> str:
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else str(path)
