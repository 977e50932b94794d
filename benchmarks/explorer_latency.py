"""Milliseconds from a slider's move to the picture, in a real browser: the explorer at the paper's oscillator.

One parameter is moved at a time, and the next move waits until all is drawn. Each answer is timed in the browser, from
the event of the slider to the frame behind the change of what is drawn: the orbit, the history, the sketch, the quick
preview of the diagram (600 columns of 300 and 100 periods) and the diagram with its period numbers. Needs playwright
and Chromium (or the environment variable CHROMIUM); run it on a quiet machine.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

WATCH = """() => {
    window.shown = {};
    const drawn = name =>
        requestAnimationFrame(() => setTimeout(() => { window.shown[name] ??= performance.now() - window.begun; }));
    const note = (name, model, property) => model.properties[property].change.connect(() => drawn(name));
    const one = name => Bokeh.documents[0].get_model_by_name(name);
    note("orbit", one("portrait").renderers[0].data_source, "data");
    note("history", one("history").renderers[0].data_source, "data");
    note("sketch", one("sketch"), "value");
    const image = one("diagram image");
    image.properties.data.change.connect(() => {
        const {of, stage} = image.data;
        if (JSON.parse(of[0]).values.g === window.sent)
            drawn(stage[0]);
    });
}"""
MOVE = """value => {
    const slider = document.getElementById("s-p.g");
    slider.value = value;
    window.sent = Number(slider.value);
    window.shown = {};
    window.begun = performance.now();
    slider.dispatchEvent(new Event("input"));
}"""
ANSWERS = {
    "orbit": "orbit",
    "history": "history",
    "sketch": "sketch",
    "first look": "quick preview",
    "judged": "diagram",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("moves", nargs="?", type=int, default=20)
    moves = parser.parse_args().moves
    from playwright.sync_api import sync_playwright
    from tests.explorer.conftest import Page, Server, browser_program

    server = Server()
    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=browser_program(), args=["--no-sandbox"])
        page = Page(browser.new_page(viewport={"width": 1280, "height": 800}))
        page.tab.add_init_script("localStorage.setItem('nonsmooth-tour', 'seen')")
        page.open(server.address)
        page.until_done()
        page.tab.evaluate(WATCH)
        taken: dict[str, list[float]] = {name: [] for name in ANSWERS}
        for k in range(moves + 2):  # two to warm up
            page.tab.evaluate(MOVE, -0.0045 - 0.0001 * (k + 1))
            page.until('"judged" in window.shown && "sketch" in window.shown')
            page.until_done()
            time.sleep(0.2)
            for name, value in page.tab.evaluate("window.shown").items():
                taken[name].append(value)
        browser.close()
    server.close()
    print(f"median of {moves} moves, longest; load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} threads")
    for name, words in ANSWERS.items():
        print(f"{words:14s} {median(taken[name][2:]):6.0f} ms {max(taken[name][2:]):6.0f} ms")


if __name__ == "__main__":
    main()
