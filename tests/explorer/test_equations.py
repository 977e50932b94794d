"""Equations as a page writes them, read back as text."""

from __future__ import annotations

import html
import re

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.sketch import equations_of


def read(system: ns.System) -> dict[str, list[str]]:
    """Headings and their lines, with stars for products."""
    found = {}
    for heading, lines in equations_of(system):
        texts = [re.sub(r"<[^>]+>", "", line) for line in lines.split("</p>") if line]
        found[heading] = [html.unescape(one.replace("&InvisibleTimes;", "*")).replace("\xa0", " ") for one in texts]
    return found


def test_a_sum_over_a_denominator_stands_in_brackets() -> None:
    system = ns.System(
        states=["x", "v"],
        parameters={"m": 2.0, "k": 3.0, "c": 0.1},
        modes={
            "free": lambda t, u, p: (u.v, (np.cos(t) - p.k * u.x - p.c * u.v) / p.m),
            "held": lambda t, u, p: (u.v, -p.c * u.v / p.m),
        },
        indicators={"edge": lambda t, u, p: u.x - 1},
        transitions=[ns.Transition("free", "held", when="edge > 0"), ns.Transition("held", "free", when="edge < 0")],
    )
    found = read(system)
    assert list(found) == ["free", "held", "changes at"]
    assert found["free"][0] == "x˙ = v" and re.fullmatch(r"v˙ = \([^()]*cos\(t\)[^()]*\) / m", found["free"][1])
    left = found["free"][1].removeprefix("v˙ = (").removesuffix(") / m").replace("−", "-").replace("- ", "-")
    assert sorted(left.replace("+ ", "").split()) == sorted(["-c*v", "-k*x", "cos(t)"])
    assert len(found["held"]) == 1 and found["held"][0].endswith("m") and "/ m" not in found["held"][0]  # a fraction
    assert found["changes at"] in (["0 = x − 1"], ["0 = −1 + x"])


def test_a_map_is_shown_by_its_branches() -> None:
    """Not by what holds between iterates, where nothing moves; a region without a branch shows nothing."""
    system = ns.Map(states=["x"], parameters={"r": 3.0}, branches=[ns.Branch(lambda u, p: (p.r * u.x * (1 - u.x),))])
    assert read(system)[""] == ["x′ = r*x*(1−x)"]
    regions = {
        "x < 0 and edge < 0": 0.5,
        "x > 0 and edge < 0": 2.0,
        "x > 0 and edge > 0": -1.0,
    }  # x < 0 and x > 1 is none
    pieces = [ns.Branch(lambda u, p, a=a: (a * u.x, u.y / 2), when=when) for when, a in regions.items()]
    found = read(
        ns.Map(states=["x", "y"], parameters={"r": 3.0}, branches=pieces, indicators={"edge": lambda u, p: u.x - 1})
    )
    borders = ("border x <= 0 and edge <= 0", "border x >= 0 and edge <= 0", "border x >= 0 and edge >= 0")
    assert list(found) == [*borders, "changes at"]
    first, second, third, _ = found.values()
    assert len(first) == 2 and first[0].startswith("x′ = ") and second[0] == "x′ = 2*x" and third[0] == "x′ = −x"
