"""Random systems whose contacts and frictions decide together, beside a program written apart (contact_reference.py).

Seeds of the campaign (contact_campaign.py, ``make contacts``). Rules for one element at a time gave another motion, or
an error, for those of ``HARD``. Some of them run in the suite with modes that are made when visited, fewer with modes
that are written out, of rows and of Taylor series; the rest with the slow campaigns.
"""

from __future__ import annotations

import itertools

import contact_campaign as campaign
import numpy as np
import pytest
from contact_draws import as_nonsmooth, random_contact_system

pytestmark = pytest.mark.physics

HARD = (
    3,
    7,
    10,
    17,
    18,
    25,
    28,
    29,
    38,
    41,
    49,
    57,
    68,
    69,
    84,
    100,
    106,
    110,
    121,
    122,
    128,
    140,
    141,
    144,
    163,
    164,
    176,
    177,
    189,
    192,
    196,
    199,
    2119,
    4062,
    4210,
    4225,
    5171,
    5260,
    5386,
    5591,
    5600,
)
OTHERS = (1, 2, 4, 8, 11, 12, 13, 14, 19, 20, 22, 23, 26, 30, 31, 32, 34, 35, 36, 37, 39, 40, 44, 45, 50, 51, 53, 58)
PERIODS, INSTANTS = 2.5, 150
QUICK = [seed for seed in HARD if seed < 200]  # less than a second, their modes written out
CASES = [(seed, "visited") for seed in (*HARD[::3], *OTHERS[::8])]
CASES += [(seed, "rows") for seed in QUICK[1::12]] + [(seed, "series") for seed in QUICK[::16]]
LONG = [one for one in itertools.product(HARD + OTHERS, ("visited", "rows", "series")) if one not in CASES]


def compared(seed: int, periods: float) -> None:
    """States beside those of the reference, as far as it agrees with itself under 1e-14."""
    draw = random_contact_system(seed)
    times = np.linspace(0, periods * draw.period, INSTANTS + 1)
    states, agreed, failure, _ = campaign.reference(draw, times)
    assert not failure
    assert agreed > INSTANTS // 2
    error = np.abs(campaign.tested(draw, times) - states)[:agreed] / (1 + np.abs(states[:agreed]))
    assert error.max() < campaign.DIFFERENT, draw.words()


@pytest.mark.parametrize(("seed", "calculus"), CASES + [pytest.param(*one, marks=pytest.mark.slow) for one in LONG])
def test_states_are_those_of_the_reference(seed: int, calculus: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Elements are asked by rows of numbers, and by Taylor series as where something is not affine."""
    if calculus == "visited":
        monkeypatch.setattr("nonsmooth.system.derived.combinations.MOST", 1)
    if calculus == "rows":
        monkeypatch.setattr(campaign, "as_nonsmooth", lambda *given: as_nonsmooth(*given).written_out())
    if calculus == "series":
        monkeypatch.setattr("nonsmooth.system.derived.combinations._affine", lambda *given: None)
    compared(seed, PERIODS)


@pytest.mark.parametrize("seed", [89, 821, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (520, 736))])
def test_what_holds_stays_where_it_is(seed: int) -> None:
    """Frictions, preloaded springs and stops that hold one coordinate: rounding lets none of them go (six periods)."""
    compared(seed, campaign.PERIODS)
