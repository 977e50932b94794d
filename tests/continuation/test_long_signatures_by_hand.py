"""Orbits with more transitions than Newton's method can take."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.continuation.events import neighbours
from nonsmooth.results import memory


def orbit() -> ns.Orbit:
    """A mass that meets an elastic stop where its amplitude reaches 1."""
    stop = ns.elements.ElasticStop(at="q", position=1.0, stiffness=3.0)
    load = {"q": lambda t, p: p.F * np.cos(2.0 * t)}
    system = ns.mechanical(
        1.0, 0.4, 1.0, parameters={"F": 2.0}, coordinates=["q"], elements={"stop": stop}, forcing=load
    )
    return ns.find_orbit(system, progress=False)


def test_a_signature_that_is_too_long_is_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Behind the graze the orbit has two transitions more."""
    begun = orbit()
    monkeypatch.setattr(neighbours, "_along", lambda common: iter(()))
    whole = ns.continue_orbit(begun, "F", (2.0, 4.0))
    assert list(whole["special_kind"].values) == ["grazing"] and whole["crossings_per_period"].max() == 2
    monkeypatch.setattr(neighbours, "MOST", 1)
    ended = ns.continue_orbit(begun, "F", (2.0, 4.0))
    assert list(ended["special_kind"].values) == ["grazing"] and ended["crossings_per_period"].max() == 0


def test_equations_that_no_memory_holds_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    found = orbit()
    monkeypatch.setattr(memory, "SMALL", 0)
    monkeypatch.setattr(memory, "free_memory", lambda: 50)
    with pytest.raises(MemoryError, match="Newton's method on an orbit with 0 transitions takes .* raise the creep"):
        ns.continue_orbit(found, "F", (2.0, 4.0))
