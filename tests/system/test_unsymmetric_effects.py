"""Forces that act on rates as no units make symmetric: decided by trying combinations, against closed forms."""

import numpy as np
import pytest

import nonsmooth as ns

E = ns.elements


def follower(first, second, bound):
    """v1' = first + a, v2' = second + a/2 + b: friction a, within 1, acts on v2 too; b, within a bound, on v2 only."""
    return ns.System(
        states=["v1", "v2"],
        parameters={},
        modes={"all": lambda t, u, p: (first + 0 * u.v1, second + 0 * u.v2)},
        elements={
            "a": E.Coulomb(speed=lambda t, u, p: u.v1, friction=1.0, on={"v1": 1.0, "v2": 0.5}),
            "b": E.Coulomb(speed=lambda t, u, p: u.v2, friction=bound, on={"v2": 1.0}),
        },
    )


@pytest.mark.parametrize(
    ("first", "second", "bound", "rates"),
    [
        (0.8, 1.2, 1.0, (0.0, 0.0)),  # a = -.8, b = -.8
        (1.5, 1.2, 1.0, (0.5, 0.0)),  # a = -1 slips, b = -.7 holds
        (1.5, 1.2, 0.5, (0.5, 0.2)),
        (0.8, 1.2, 0.5, (0.0, 0.3)),
        (-1.5, 1.0, 0.5, (-0.5, 1.0)),  # a = 1 pushes v2 on
    ],
)
def test_two_frictions_of_which_one_acts_on_both(first, second, bound, rates):
    run = ns.simulate(follower(first, second, bound), duration=2.0)
    np.testing.assert_allclose(run.u[-1], 2.0 * np.array(rates), atol=1e-12)


@pytest.mark.parametrize("bound", [0.2, 0.6])
def test_it_stops_and_holds_where_it_can(bound):
    """From v2 = -1: v2' = .3 + bound until it stops; then it holds where .3 lies within the bound."""
    run = ns.simulate(follower(0.4, 0.5, bound), duration=6.0, start={"v2": -1.0})
    stop = 1.0 / (0.3 + bound)
    assert float(run.crossing_time[0]) == pytest.approx(stop, abs=1e-12)
    assert float(run.u[-1, 1]) == pytest.approx(max(0.0, 0.3 - bound) * (6.0 - stop), abs=1e-12)
