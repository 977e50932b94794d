"""A thousand random actions over all controls: no unhandled error, and memory that does not grow."""

from __future__ import annotations

import base64
import os
import random
import statistics
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ACTIONS = int(os.environ.get("NONSMOOTH_ACTIONS", "1000"))
FEW = 12  # actions of the run that is part of the suite
#: Models that need no compiling beyond what the suite compiles anyway.
MODELS = ("discontinuous_support", "impact_oscillator", "border_collision")
TEXTS = ("0.3", "-1", "0", "1e400", "", "nan", "0,5", "drop table", "__import__('os')", "1e-9", "12")
#: One of these would make a single action take minutes, or end the run.
LEFT_OUT = ("columns", "transient", "keep", "model", "save", "recording-fit", "building-save", "recording-open")
_TIME = np.arange(0.0, 20.0, 0.02)
FILES = {
    "steady.csv": b"time (s),x (m)\n" + "".join(f"{t:.3f},{0.02 * np.sin(3.69 * t):.6f}\n" for t in _TIME).encode(),
    "other.csv": b"time (s),v (m/s)\n" + "".join(f"{t:.3f},{0.1 * np.cos(t):.6f}\n" for t in _TIME).encode(),
    "picture.png": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    "words.csv": b"not,a\nrecording,at all\n",
    "empty.mat": b"",
}
#: Acts on one visible control that is chosen by two numbers from 0 to 1, as a person's hand would, and says which.
HAND = """([kind, which, value, leftOut]) => {
    const open = document.querySelector("dialog[open]") || document;
    const all = [...open.querySelectorAll(kind)].filter(one => one.checkVisibility() && !one.disabled &&
        !leftOut.includes(one.id));
    const one = all[Math.floor(which * all.length)];
    if (!one) return "";
    const tell = name => one.dispatchEvent(new Event(name, {bubbles: true}));
    if (one.tagName === "BUTTON" || one.type === "checkbox") one.click();
    else if (one.tagName === "SELECT") { one.selectedIndex = Math.floor(value * one.options.length); tell("change"); }
    else if (one.type === "range") {
        one.value = Number(one.min) + value * (one.max - one.min); tell("input"); tell("change");
    } else { one.value = value; tell("input"); tell("change"); }
    return one.id || one.dataset.key || one.textContent;
}"""
DROP = """([name, content]) => {
    const bytes = Uint8Array.from(atob(content), letter => letter.charCodeAt(0)), transfer = new DataTransfer();
    transfer.items.add(new File([bytes], name));
    document.body.dispatchEvent(new DragEvent("drop", {dataTransfer: transfer, bubbles: true}));
}"""


def memory(server: Any) -> float:
    """Resident memory of the server and its workers in MB."""
    lines = []
    for pid in (server.process.pid, *server.workers()):
        try:
            lines += Path(f"/proc/{pid}/status").read_text().splitlines()
        except OSError:  # a worker that has just ended
            continue
    return sum(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def hand(page: Any, kind: str, chance: random.Random, value: Any) -> str:
    return str(page.tab.evaluate(HAND, [kind, chance.random(), value, LEFT_OUT]))


def drop(page: Any, name: str) -> None:
    page.tab.evaluate(DROP, [name, base64.b64encode(FILES[name]).decode()])


def act(page: Any, chance: random.Random) -> None:
    tab = page.tab
    choice = chance.random()
    if choice < 0.25:
        hand(page, "input[type=range]", chance, chance.random())
    elif choice < 0.42:
        hand(page, "input:not([type=range]):not([type=file]):not([type=checkbox])", chance, chance.choice(TEXTS))
    elif choice < 0.58:
        hand(page, "select", chance, chance.random())
    elif choice < 0.62:
        tab.select_option("#model", chance.choice(MODELS), force=True)
    elif choice < 0.75:
        hand(page, "button, input[type=checkbox]", chance, 0)
    elif choice < 0.79:
        drop(page, chance.choice(list(FILES)))
    elif choice < 0.8:
        hand(page, "#recording-fit", random.Random(0), 0)
        tab.wait_for_timeout(chance.random() * 1000)
        hand(page, "#recording-cancel", random.Random(0), 0)
    elif choice < 0.81:
        tab.evaluate('document.dispatchEvent(new Event("build"))')
    elif choice < 0.83:
        tab.keyboard.press(chance.choice(("d", "l", "Control+z", "Control+Shift+z", "Escape", "Tab")))
    else:
        boxes = [box for one in tab.locator(".plot").all() if (box := one.bounding_box())]
        box = chance.choice(boxes)
        place = [box["x"] + chance.random() * box["width"], box["y"] + chance.random() * box["height"]]
        tab.mouse.move(*place)
        if choice < 0.92:
            tab.mouse.click(*place)
        elif choice < 0.97:
            tab.mouse.wheel(0, chance.choice((-240, 240)))
        else:
            tab.mouse.down()
            tab.mouse.move(place[0] + 60, place[1] + 40)
            tab.mouse.up()


def settle(page: Any) -> None:
    """End what goes on, and come back to a motion that is known."""
    tab = page.tab
    tab.keyboard.press("Escape")
    tab.evaluate('document.querySelector("dialog[open]")?.close()')
    if tab.inner_text("#play") != "▶":
        tab.click("#play")
    tab.select_option("#model", "discontinuous_support")
    page.until('JSON.parse(Bokeh.documents[0].get_model_by_name("ui").value).state.model === "discontinuous_support"')
    tab.select_option("#preset", "Fig. 12 d")
    for field, text in {"columns": "61", "transient": "100", "keep": "40"}.items():
        if tab.input_value(f"#{field}") != text:
            page.write(field, text)
    tab.select_option("#method", "auto")
    page.until_done()


def test_a_few_random_actions_break_nothing(page: Any, server: Any) -> None:
    chance = random.Random(1)
    for _ in range(FEW):
        act(page, chance)
    settle(page)
    assert page.readout()["motion"] == "period 1"
    assert "Traceback" not in "".join(server.said)


@pytest.mark.slow
def test_a_monkey_breaks_nothing_and_memory_stays(page: Any, server: Any) -> None:
    chance = random.Random(20070401)
    for model in MODELS:  # what each needs is loaded and compiled once
        page.tab.select_option("#model", model)
        page.until_done()
    drop(page, "steady.csv")
    page.tab.wait_for_selector("#recording-body:visible")
    measured = []
    for k in range(ACTIONS):
        act(page, chance)
        page.tab.wait_for_timeout(20)
        if (k + 1) % max(ACTIONS // 10, 1) == 0:
            settle(page)
            measured.append(memory(server))
            print(f"{k + 1} actions: {measured[-1]:.0f} MB", flush=True)
    assert page.readout()["motion"] == "period 1"
    half = len(measured) // 2  # what was computed last makes a tenth of difference either way
    begun, ended = statistics.median(measured[:half]), statistics.median(measured[half:])
    print(f"server and worker: {begun:.0f} MB in the first half, {ended:.0f} MB in the second")
    assert ended < 1.1 * begun
    assert "Traceback" not in "".join(server.said)
