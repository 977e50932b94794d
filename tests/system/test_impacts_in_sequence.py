"""Impacts of one instant one after the other (``impacts="sequential"``), beside Newton's law at once."""

import sys
from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns

E = ns.elements
sys.path.insert(0, str(Path(__file__).parents[1] / "independent"))
from contact_impacts import sequential  # noqa: E402


def balls(restitution, impacts, count=3):
    between = {
        f"c{i}": E.Stop(at={f"q{i + 1}": 1, f"q{i}": -1}, side=-1, restitution=restitution) for i in range(1, count)
    }
    none = np.zeros((count, count))
    return ns.mechanical(np.eye(count), none, none, parameters={}, elements=between, impacts=impacts)


@pytest.mark.parametrize(
    ("restitution", "impacts", "speeds"),
    [
        (1.0, "simultaneous", (-1 / 3, 2 / 3, 2 / 3)),
        (1.0, "sequential", (0, 0, 1)),
        (0.0, "simultaneous", (1 / 3, 1 / 3, 1 / 3)),
        (0.0, "sequential", (1 / 3, 1 / 3, 1 / 3)),
    ],
)
def test_three_balls_that_touch(restitution, impacts, speeds):
    """Of a row in touch the last one leaves (Newton's cradle), or all part at once."""
    run = ns.simulate(balls(restitution, impacts), duration=1.0, start={"v_q1": 1.0})
    np.testing.assert_allclose(run.u[-1, 3:], speeds, atol=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_random_rows_against_the_reference(seed):
    """Masses, restitutions and speeds at random, against a program written apart; momentum is kept."""
    draw = np.random.default_rng(seed)
    count = int(draw.integers(3, 6))
    masses, restitution = draw.uniform(0.5, 2.0, count), draw.uniform(0.0, 0.9, count - 1)
    v = draw.normal(size=count)
    between = {
        f"c{i}": E.Stop(at={f"q{i + 1}": 1, f"q{i}": -1}, side=-1, restitution=restitution[i - 1])
        for i in range(1, count)
    }
    none = np.zeros((count, count))
    row = ns.mechanical(np.diag(masses), none, none, parameters={}, elements=between, impacts="sequential")
    run = ns.simulate(row, duration=1e-9, start={f"v_q{i + 1}": v[i] for i in range(count)})
    W = np.diff(np.eye(count), axis=0)
    change, _ = sequential(np.diag(1 / masses), W, W @ v, restitution, 1e-7)
    after = run.u.values[-1, count:]
    np.testing.assert_allclose(after, v + change, atol=1e-8)
    assert after @ masses == pytest.approx(masses @ v, abs=1e-12)


def test_a_cradle_of_five_hands_the_motion_on():
    run = ns.simulate(balls(1.0, "sequential", 5), duration=1.0, start={"v_q1": 1.0, "v_q2": 1.0})
    np.testing.assert_allclose(run.u[-1, 5:], [0, 0, 0, 1, 1], atol=1e-12)


def test_what_is_no_law_is_refused_and_the_law_is_kept_in_text():
    with pytest.raises(ns.SystemDefinitionError, match="one of 'simultaneous', 'sequential', not 'both'"):
        balls(1.0, "both")
    again = ns.System.from_text(balls(1.0, "sequential").to_text())
    run = ns.simulate(again, duration=1.0, start={"v_q1": 1.0})
    np.testing.assert_allclose(run.u[-1, 3:], (0, 0, 1), atol=1e-12)
