"""Labels that results read off a system."""

from __future__ import annotations

from nonsmooth import models
from nonsmooth.results.labels import flag_attributes, labels_of
from nonsmooth.system.system import System


def test_the_labels_of_the_papers_oscillator() -> None:
    system = models.discontinuous_support(g=0.0018)
    labels = labels_of(system)
    assert {name: quantity.unit for name, quantity in labels.states.items()} == {"x": "m", "v": "m/s"}
    assert labels.parameters["g"].value == 0.0018
    assert labels.parameters["omega"].unit == "rad/s"
    assert labels.parameters["k_s"].symbol == "k_{s}"
    assert labels.modes == ("free", "contact")
    assert labels.transition_labels == ("free_to_contact", "contact_to_free")
    assert labels.outputs["contact_force"].unit == "N"
    assert labels.time_unit == "s"
    assert System.from_text(labels.text) == system


def test_a_smoothed_system_brings_its_bands_memory_and_eta() -> None:
    labels = labels_of(models.discontinuous_support().smoothed(1e-5))
    assert labels.parameters["eta"].value == 1e-5
    assert labels.memory["v_a"].unit == "m/s"
    assert len(labels.modes) == 4
    for words in (labels.modes, labels.indicators, labels.transition_labels):
        attributes = flag_attributes(words)
        assert len(attributes["flag_meanings"].split()) == len(attributes["flag_values"]) == len(words)


def test_states_without_units_have_a_time_without_unit() -> None:
    assert labels_of(models.relief_valve()).time_unit == "1"
