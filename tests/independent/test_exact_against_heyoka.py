"""The exact flow of the paper's oscillator against heyoka: 7 parameter sets, 50 forcing periods each, from rest.

One near each of seven figures; 40 run with the slow campaigns.
"""

from __future__ import annotations

import pytest
from heyoka_agreement import Agreement, compare_all, report

pytestmark = pytest.mark.physics


@pytest.fixture(scope="module", params=[7, pytest.param(40, marks=pytest.mark.slow)])
def results(request: pytest.FixtureRequest) -> list[Agreement]:
    results = compare_all(request.param)
    assert len(results) == request.param
    print("\n" + report(results))
    return results


def test_enough_sets_have_contacts_and_no_graze(results: list[Agreement]) -> None:
    assert sum(r.n_contacts >= 20 for r in results) >= 0.75 * len(results)
    assert sum(r.nearest_graze >= 1e-9 for r in results) >= 0.75 * len(results)


def test_states_agree_over_fifty_periods(results: list[Agreement]) -> None:
    """1e-10, or 1e-13 times the growth of a neighbour where chaos amplifies rounding."""
    assert max(r.excess for r in results) <= 1.0


def test_states_agree_in_every_single_period(results: list[Agreement]) -> None:
    assert max(r.per_period for r in results) <= 1e-12


def test_modes_follow_in_the_same_order(results: list[Agreement]) -> None:
    assert all(r.same_modes for r in results)


def test_crossing_times_agree(results: list[Agreement]) -> None:
    assert max(r.crossing_time for r in results) <= 1e-10


def test_touches_agree(results: list[Agreement]) -> None:
    """Every maximum below the gap is recorded, with its clearance."""
    assert all(r.n_touches >= 0 for r in results)
    assert sum(r.n_touches for r in results) > 2.5 * len(results)
    assert max(r.clearance / r.allowance for r in results) <= 1.0
