"""A thousand random actions over all controls: no unhandled error, and memory that does not grow."""

from __future__ import annotations

import os
import random
from pathlib import Path
from typing import Any

import pytest

ACTIONS = int(os.environ.get("NONSMOOTH_ACTIONS", "1000"))
#: Models that need no compiling beyond what the suite compiles anyway.
MODELS = ("discontinuous_support", "impact_oscillator", "border_collision")
TEXTS = ("0.3", "-1", "0", "1e400", "", "nan", "0,5", "drop table", "__import__('os')", "1e-9", "12")


def memory(*pids: int) -> float:
    """Resident memory in MB."""
    lines = [line for pid in pids for line in Path(f"/proc/{pid}/status").read_text().splitlines()]
    return sum(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def act(page: Any, chance: random.Random) -> None:
    tab = page.tab
    choice = chance.random()
    if choice < 0.25:
        sliders = tab.locator("input[type=range]:visible")
        box = sliders.nth(chance.randrange(sliders.count())).bounding_box()
        if box is not None:
            tab.mouse.click(box["x"] + chance.random() * box["width"], box["y"] + box["height"] / 2)
    elif choice < 0.45:
        fields = tab.locator("input:not([type=range]):visible")
        field = fields.nth(chance.randrange(fields.count()))
        if field.get_attribute("id") not in ("columns", "transient", "keep"):  # else a single action may take minutes
            field.fill(chance.choice(TEXTS))
            field.press("Enter")
    elif choice < 0.6:
        name = chance.choice(("over", "shown", "direction", "x", "y", "preset"))
        select = tab.locator(f"#{name}:visible")
        if select.count():
            values = select.locator("option").evaluate_all("all => all.map(one => one.value)")
            select.select_option(chance.choice(values))
    elif choice < 0.63:
        tab.select_option("#model", chance.choice(MODELS))
    elif choice < 0.75:
        button = tab.locator("#" + chance.choice(("undo", "redo", "reset", "dark", "large", "play")))
        if button.is_visible() and button.is_enabled():
            button.click()
    else:
        box = tab.locator(".plot").nth(chance.randrange(4)).bounding_box()
        place = [box["x"] + chance.random() * box["width"], box["y"] + chance.random() * box["height"]]
        tab.mouse.move(*place)
        if choice < 0.9:
            tab.mouse.click(*place)
        elif choice < 0.96:
            tab.mouse.wheel(0, chance.choice((-240, 240)))
        else:
            tab.mouse.down()
            tab.mouse.move(place[0] + 60, place[1] + 40)
            tab.mouse.up()


@pytest.mark.slow
def test_a_monkey_breaks_nothing_and_memory_stays(page: Any, server: Any) -> None:
    chance = random.Random(20070401)
    measured = []
    for k in range(ACTIONS):
        act(page, chance)
        page.tab.wait_for_timeout(50)
        if k % (ACTIONS // 10) == 0:
            measured.append(memory(server.process.pid, *server.workers()))
    if page.tab.inner_text("#play") != "▶":
        page.tab.click("#play")
    page.tab.select_option("#model", "discontinuous_support")
    page.tab.select_option("#preset", "Fig. 12 d")
    page.until_done()
    assert page.readout()["motion"] == "period 1"
    now = memory(server.process.pid, *server.workers())
    print(f"{ACTIONS} actions; MB at each tenth of them: {', '.join(f'{one:.0f}' for one in measured)}; now {now:.0f}")
    assert now < 1.1 * max(measured[: len(measured) // 2])  # by then every model has been seen
    assert "Traceback" not in "".join(server.said)
