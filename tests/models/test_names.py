"""The room of models as a user who misspells sees it."""

from __future__ import annotations

import pytest

import nonsmooth as ns


def test_a_misspelt_model_names_the_nearest():
    with pytest.raises(AttributeError, match="nearest: discontinuous_support"):
        _ = ns.models.discontinous_support


def test_an_output_keeps_the_names_of_its_extremes():
    with pytest.raises(ns.SystemDefinitionError, match="'force_maximum' cannot name a parameter"):
        ns.System(
            states={"x": "m", "v": "m/s"},
            parameters={"force_maximum": (1.0, "1/s^2")},
            modes={"only": lambda t, u, p: (u.v, -p.force_maximum * u.x)},
            outputs={"force": (lambda t, u, p: u.x, "m")},
        )
