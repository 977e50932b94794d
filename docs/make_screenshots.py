"""Take pictures of the built pages in headless Chromium, wide and narrow, and check that they fit.

``make screenshots`` builds the pages first. Pictures go to ``docs/_build/screenshots``: look at them. The program fails
where a page is wider than its window, or where text outside of code and tables stands beyond the window's edge. With
names of pages (``guides/maps``) it takes these only; with ``all`` it checks every page and keeps no picture.
``CHROMIUM`` names the browser.
"""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

BUILT = Path(__file__).resolve().parent / "_build"
PAGES = ["index", "gallery/index", "gallery/branch", "tutorials/impact_oscillator", "api/verbs"]
WIDTHS = {1280: 900, 400: 800}
BROWSERS = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"]
LONGEST = 6000  # pixels of a page that a picture shows

# Opens what is folded up, then looks for text beyond the right edge.
BEYOND = """
(() => {
  document.querySelectorAll("article details").forEach(answer => { answer.open = true; });
  const edge = window.innerWidth;
  const boxed = element => {  // code, formulas and tables of numbers may scroll in themselves; text may not
    const table = element.closest("table");
    const numbers = table && table.querySelector("th:nth-child(4), td.text-right");
    return element.closest("pre, .math") || numbers || getComputedStyle(element).visibility === "hidden";
  };
  const found = [];
  const walker = document.createTreeWalker(document.querySelector("article"), NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    if (!walker.currentNode.data.trim()) continue;
    const range = document.createRange();
    range.selectNodeContents(walker.currentNode);
    if (range.getBoundingClientRect().right > edge + 1 && !boxed(walker.currentNode.parentElement))
      found.push(walker.currentNode.data.trim().slice(0, 60));
  }
  const wide = document.documentElement.scrollWidth - edge;
  return JSON.stringify({wide, found, height: document.documentElement.scrollHeight});
})()
"""


class Browser:
    """Chromium, spoken to over two pipes."""

    def __init__(self, folder: str) -> None:
        program = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), None)
        if program is None:
            raise SystemExit("no Chromium found: install it, or name it in the environment variable CHROMIUM")
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        options = "--headless --no-sandbox --disable-gpu --hide-scrollbars --remote-debugging-pipe"
        command = f'exec "$0" {options} --user-data-dir="$1" 3<&{theirs_in} 4>&{theirs_out}'
        self._process = subprocess.Popen(
            ["bash", "-c", command, program, folder], pass_fds=(theirs_in, theirs_out), stderr=subprocess.DEVNULL
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self._rest = b""
        self._count = 0
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.ask("Page.enable")

    _session: str | None = None

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            more = os.read(self._in, 1 << 20)
            if not more:
                raise SystemExit("Chromium ended by itself")
            self._rest += more
        one, self._rest = self._rest.split(b"\0", 1)
        answer: dict[str, Any] = json.loads(one)
        return answer

    def ask(self, method: str, until: str = "", **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result, after the event ``until`` where one is named."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        result: dict[str, Any] | None = None
        happened = not until
        while result is None or not happened:
            answer = self._message()
            happened = happened or answer.get("method") == until
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise SystemExit(f"{method}: {answer['error']['message']}")
                result = answer["result"]
        return result

    def look(self, page: Path, width: int, height: int, picture: Path | None) -> list[str]:
        """Open a page in a window of this size, keep a picture of it, and return what does not fit."""
        window = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.ask("Emulation.setDeviceMetricsOverride", **window)
        self.ask("Page.navigate", until="Page.loadEventFired", url=page.as_uri())
        told = json.loads(self.ask("Runtime.evaluate", expression=BEYOND)["result"]["value"])
        if picture:
            whole = {"x": 0, "y": 0, "width": width, "height": min(told["height"], LONGEST), "scale": 1}
            shot = self.ask("Page.captureScreenshot", clip=whole, captureBeyondViewport=True)
            picture.write_bytes(base64.b64decode(shot["data"]))
        wrong = [f"beyond the edge: {text!r}" for text in told["found"]]
        return ([f"the page is {told['wide']} pixels too wide"] if told["wide"] > 0 else []) + wrong

    def close(self) -> None:
        """End the browser."""
        self.ask("Browser.close")
        self._process.wait()


def main(wanted: list[str]) -> int:
    """Look at the pages named, at those of ``PAGES``, or at all."""
    html = BUILT / "html"
    if not (html / "index.html").is_file():
        raise SystemExit("the pages are not built: make docs")
    everything = wanted == ["all"]
    built = [str(file.relative_to(html))[:-5] for file in sorted(html.rglob("*.html"))]
    names = built if everything else wanted or PAGES
    names = [name for name in names if not name.startswith(("_modules/", "genindex", "py-modindex", "search"))]
    shots = BUILT / "screenshots"
    shots.mkdir(parents=True, exist_ok=True)
    count = 0
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = Browser(folder)
        for name in names:
            for width, height in WIDTHS.items():
                picture = None if everything else shots / f"{name.replace('/', '_')}_{width}.png"
                wrong = browser.look(html / f"{name}.html", width, height, picture)
                count += len(wrong)
                for text in wrong:
                    print(f"{name} at {width} pixels: {text}")
        browser.close()
    print(f"{len(names)} pages at {' and '.join(map(str, WIDTHS))} pixels: {count} faults; pictures in {shots}")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
