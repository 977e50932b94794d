"""Equilibria of random piecewise-linear systems beside their enumeration from force balances alone.

``python tests/independent/equilibria_campaign.py 0 200`` (``make equilibria``) is the whole campaign.
"""

from __future__ import annotations

import equilibria_campaign
import equilibria_enumeration
import numpy as np
import pytest

SOME = (0, 9, 44, pytest.param(213, marks=pytest.mark.slow))  # those that take less


@pytest.mark.parametrize("seed", SOME)
def test_all_components_and_no_other(seed: int) -> None:
    """By starts near them and two random ones, along branches, at their ends, and by runs from neighbours."""
    components, faults = equilibria_campaign.check(seed, 2)
    assert not faults and components >= 0


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, 20])
def test_forty_systems(first: int) -> None:
    faults = {seed: equilibria_campaign.check(seed)[1] for seed in range(first, first + 20)}
    assert {seed: told for seed, told in faults.items() if told} == {}


def test_the_enumeration_knows_an_interval_and_a_stop() -> None:
    """|P - 2 q| <= .5 up to a stop at 1: from P = 1.5 on the upper end is the stop."""
    one = equilibria_enumeration.Draw(
        0,
        np.eye(1),
        0.3 * np.eye(1),
        2.0 * np.eye(1),
        np.zeros(1),
        np.ones(1),
        (
            equilibria_enumeration.Part("friction", np.ones(1), mu=0.5),
            equilibria_enumeration.Part("stop", np.ones(1), position=1.0),
        ),
    )
    for P, low, high in ((0.0, -0.25, 0.25), (1.7, 0.6, 1.0), (3.0, 1.0, 1.0)):
        (found,) = equilibria_enumeration.components(one, P)
        assert [found.lower[0], found.upper[0]] == pytest.approx([low, high], abs=1e-9)
