"""Jumps of the frequency responses of Figs. 9 and 10 against the closed-form grazing frequencies.

The orbit without contact grazes at g = rho / sqrt((2k - m omega^2)^2 + (c omega)^2). The fold beside it, where the
amplitude really jumps, lies 2e-5 to 3.4e-4 rad/s beyond (heyoka): far below one sweep step of 0.005 rad/s.
"""

from __future__ import annotations

import numpy as np
import pytest
import reference_values as known

import nonsmooth as ns

pytestmark = pytest.mark.physics

STEP = 0.005

#: rho, g, window of omega, direction of the sweep, grazing frequency's index (0 lower, 1 upper).
JUMPS = {
    # Begun above the fold at which the orbit in contact ends (5.8104 and 6.5312): only one orbit is there.
    "figure 9, falling": (0.14, 0.02, (5.0, 6.0), "down", 1),
    "figure 10, falling": (0.16, 0.0145, (5.5, 6.7), "down", 1),
    "figure 10, small jump, rising": (0.16, 0.0145, (2.66, 2.76), "up", 0),
}


@pytest.mark.parametrize("name", JUMPS)
def test_jump_lies_at_the_grazing_frequency(name: str) -> None:
    rho, g, (low, high), direction, which = JUMPS[name]
    graze = known.grazing_frequencies(rho, g)[which]
    system = ns.models.discontinuous_support().with_parameters(rho=rho, g=g)
    values = np.arange(low, high + STEP / 2, STEP)
    response = ns.frequency_response(system, values, direction=direction, progress=False)
    # From the amplitudes alone: the largest step between neighbours of the displacement's amplitude.
    amplitude = response["amplitude"].sel(state="x").squeeze().values
    steps = np.abs(np.diff(amplitude))
    at = int(np.argmax(steps))
    assert steps[at] > 5 * np.median(steps), "no jump in this window"
    assert values[at] - STEP <= graze <= values[at + 1] + STEP
    # And as the result reports it.
    reported = np.atleast_1d(response["jump_value"].values)
    print(f"\n{name}: grazing {graze:.5f}, step from {values[at]:.4f} to {values[at + 1]:.4f}, reported {reported}")
    assert np.min(np.abs(reported - graze)) <= STEP


@pytest.mark.parametrize(("name", "rho", "g"), [("figure 9 rising", 0.14, 0.02), ("figure 10 rising", 0.16, 0.0145)])
def test_rising_jump_lies_at_the_fold(name: str, rho: float, g: float) -> None:
    """With rising frequency the orbit in contact ends at a fold heyoka has found."""
    fold = known.FOLDS[name]
    system = ns.models.discontinuous_support().with_parameters(rho=rho, g=g)
    values = np.arange(4.5, fold + 0.1, STEP)
    response = ns.frequency_response(system, values, direction="up", progress=False)
    amplitude = response["amplitude"].sel(state="x").squeeze().values
    at = int(np.argmax(np.abs(np.diff(amplitude))))
    assert values[at] - STEP <= fold <= values[at + 1] + STEP
    assert np.min(np.abs(np.atleast_1d(response["jump_value"].values) - fold)) <= STEP
