"""A running explorer and a browser that looks at it; without a browser these tests are skipped."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import urllib.parse
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

FEW = "columns=61&transient=100&keep=40"  # so that nothing takes long where many columns do not matter
SIZE = {"width": 1280, "height": 800}
ROOT = Path(__file__).parents[2]
MOST_UNDONE = 12  # steps; beyond them a page is opened sooner than undone
HEARD = "(({sent, heard}) => sent === heard)(document.documentElement.dataset)"
CHANNEL = "name => Bokeh.documents[0].get_model_by_name(name).value"
PATIENCE = 120.0  # seconds; a cold cache compiles in them


class Server:
    """``nonsmooth explore`` in a process of its own."""

    def __init__(self, folder: Path) -> None:
        self.told = folder / "told"  # in which what is told to open the page writes its command line
        browser = folder / "browser"
        browser.write_text(
            f"#!{sys.executable}\nimport sys\nopen({str(self.told)!r}, 'w').write(sys.argv[1] + '\\n')\n"
        )
        browser.chmod(0o700)
        command = [sys.executable, "-m", "nonsmooth", "explore", "--port", "0"]
        command += ["--no-browser"] if os.name == "nt" else []
        heard = None  # a test run in the background of a shell ignores Ctrl-C, and so would what it starts
        if os.name != "nt":
            heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
        self.process = subprocess.Popen(
            command,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=heard,
            env={**os.environ, "BROWSER": f"{browser} %s"},
        )
        self.said: list[str] = []
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.said.append(line)
            if "http://" in line:
                break
        else:
            pytest.fail("".join(self.said))
        self.address = self.said[-1].split()[-1]
        self.origin, _, rest = self.address.partition("/?")
        self.token = rest.removeprefix("token=")
        threading.Thread(target=lambda: self.said.extend(self.process.stderr or []), daemon=True).start()

    def workers(self) -> list[int]:
        """Process numbers of the workers."""
        path = Path(f"/proc/{self.process.pid}/task")
        return [int(pid) for task in path.iterdir() for pid in (task / "children").read_text().split()]

    def page_told(self) -> Path:
        """The file that the browser is told to open."""
        wait_until(lambda: self.told.exists() and self.told.read_text().endswith("\n"), 60)
        address = urllib.parse.urlsplit(self.told.read_text().strip())
        assert (address.scheme, address.query) == ("file", "")
        return Path(urllib.parse.unquote(address.path))

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(30)


class Page:
    """One tab, with words for what a person does and sees."""

    def __init__(self, tab: Any) -> None:
        self.tab = tab
        self.faults: list[str] = []
        self.first: Any = None  # what it showed once it had been opened
        tab.on("pageerror", lambda error: self.faults.append(str(error)))
        tab.on("console", lambda line: self.faults.append(line.text) if line.type == "error" else None)

    def beside(self) -> Page:
        """Another tab of the same browser, with its cookies and its storage."""
        return Page(self.tab.context.new_page())

    def open(self, address: str) -> None:
        self.tab.goto(address)
        self.tab.wait_for_selector("html[data-ready]")

    def until(self, what: str, timeout: float = PATIENCE) -> Any:
        """Wait until a JavaScript expression is true."""
        try:
            return self.tab.wait_for_function(what, timeout=1000 * timeout, polling=20)
        except Exception as error:
            told = self.tab.evaluate("({...document.documentElement.dataset})")
            raise AssertionError(f"{what}: {told}, {self.readout()}, {self.notes()!r}, {self.ui()}") from error

    def until_done(self) -> None:
        """Wait until everything that was asked for is shown."""
        self.until(f"{HEARD} && document.documentElement.dataset.busy === ''")

    def begin(self, address: str) -> None:
        """Show what the page at an address shows first: undo all that was done to it, or else open it."""
        if self.first is None or self.first[0] != address or not self._undone():
            self.open(address)
            self.until_done()
            self.first = address, self._shown()

    def _undone(self) -> bool:
        for _ in range(MOST_UNDONE):
            if not self.tab.is_enabled("#undo"):
                self.until_done()
                return bool(self.first[1] == self._shown())
            self.tab.click("#undo")
            self.until(HEARD)  # and not until it is done: what lies between is not computed again
        return False

    def _shown(self) -> dict[str, Any]:
        """Channels by which one page differs from another at the same place in its history."""
        names = ("ui", "readout", "notes", "recording", "equations")  # a form stays as it was left
        channels = {name: json.loads(self.tab.evaluate(CHANNEL, name) or "null") or {} for name in names}
        for passing in ("heard", "can", "tabs", "models"):  # those that were built stay
            channels["ui"].pop(passing)
        for hidden in ("chart", "basins"):  # legends of views that nobody sees there
            channels["ui"]["legends"].pop(hidden)
        channels["recording"].pop("fraction", None)  # of what was done last
        return {**channels, "open": self.tab.locator("dialog[open]").count(), "play": self.tab.inner_text("#play")}

    def readout(self) -> dict[str, str]:
        return dict(json.loads(self.tab.evaluate('Bokeh.documents[0].get_model_by_name("readout").value')))

    def ui(self) -> dict[str, Any]:
        return dict(json.loads(self.tab.evaluate('Bokeh.documents[0].get_model_by_name("ui").value')))

    def value(self, name: str) -> float:
        return float(self.ui()["state"][f"p.{name}"])

    def write(self, field: str, text: str) -> None:
        self.tab.fill(f'[id="{field}"]', text)
        self.tab.press(f'[id="{field}"]', "Enter")

    def place(self, figure: str, x: float, y: float) -> tuple[float, float]:
        """Screen coordinates of a point of a figure."""
        found = self.tab.evaluate(
            """([name, x, y]) => {
                const model = Bokeh.documents[0].get_model_by_name(name);
                const view = Bokeh.index.find_one_by_id(model.id), box = view.canvas_view.el.getBoundingClientRect();
                return [box.x + view.frame.x_scale.compute(x), box.y + view.frame.y_scale.compute(y)];
            }""",
            [figure, x, y],
        )
        return float(found[0]), float(found[1])

    def picture(self, name: str) -> None:
        """A screenshot for the guide, where its folder is named in the environment variable NONSMOOTH_PICTURES."""
        if folder := os.environ.get("NONSMOOTH_PICTURES"):
            self.until_done()
            self.tab.wait_for_timeout(500)
            self.tab.screenshot(path=str(Path(folder) / f"explorer_{name}.png"))

    def notes(self) -> str:
        every = '[...document.querySelectorAll(".note:not([hidden]), .wrong")]'
        return str(self.tab.evaluate(f'{every}.map(one => one.textContent).join(" ").trim()'))


def browser_program() -> str | None:
    spec = importlib.util.spec_from_file_location("make_screenshots", ROOT / "docs" / "make_screenshots.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, module.BROWSERS)), None)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    pytest.importorskip("bokeh", reason="the explorer needs bokeh")
    one = Server(tmp_path_factory.mktemp("server"))
    yield one
    one.close()
    said = "".join(one.said)
    assert "Traceback" not in said, said


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="browser tests need the package playwright")
    program = browser_program()
    if program is None:
        pytest.skip("no Chromium found: install it, or name it in the environment variable CHROMIUM")
    with playwright.sync_playwright() as running:
        one = running.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield one
        one.close()


@pytest.fixture(scope="session")
def tab(browser: Any, server: Server) -> Iterator[Page]:
    """The tab in which one test after the other looks at a page: a new one compiles all scripts again.

    Who sits at it has been shown round, and asks for reduced motion."""
    seen = {"origin": server.origin, "localStorage": [{"name": "nonsmooth-tour", "value": "seen"}]}
    context = browser.new_context(
        viewport=SIZE,
        accept_downloads=True,
        reduced_motion="reduce",
        storage_state={"cookies": [], "origins": [seen]},
    )
    context.set_default_timeout(30_000)
    yield Page(context.new_page())
    context.close()


@pytest.fixture
def only_tab(tab: Page) -> Iterator[Page]:
    """The tab that tests share, with no page yet or that of an earlier one; it must not have an error."""
    tab.faults.clear()
    yield tab
    tab.tab.set_viewport_size(SIZE)
    assert tab.faults == []


@pytest.fixture
def page(server: Server, only_tab: Page) -> Page:
    """A page that nobody has done anything to yet."""
    only_tab.begin(f"{server.address}&{FEW}")
    return only_tab


def wait_until(fact: Callable[[], object], seconds: float = PATIENCE) -> None:
    end = time.monotonic() + seconds
    while not fact():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)
