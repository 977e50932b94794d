"""A sweep's `period_number` near the first four flips of Fig. 11 is right or the point is `slow`: never wrong.

The flips are heyoka's (shooting, central differences). Values of rho around each, default settings, against (1) the
cascade itself where it is known and (2) a transient many times longer.
"""

from __future__ import annotations

import numpy as np
import pytest
import reference_values as known

import nonsmooth as ns

pytestmark = pytest.mark.physics

WIDTH = 0.02  # the window reaches 2 % either side of the flip


def sweep(values: np.ndarray, **options: object) -> tuple[np.ndarray, np.ndarray]:
    """Period numbers and a mask of the points whose status is `slow`, rho falling as the cascade unfolds."""
    system = ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045)
    result = ns.sweep(system, "rho", values, direction="down", progress=False, **options)
    status = result["status"]
    meanings = str(status.attrs["flag_meanings"]).split()
    flags = dict(zip(meanings, np.atleast_1d(status.attrs["flag_values"]), strict=True))
    return result["period_number"].squeeze().values, status.squeeze().values == flags["slow"]


def cascade(rho: np.ndarray) -> np.ndarray:
    """Period number from heyoka's flips; -1 where it does not follow from them.

    Nothing is claimed below the fourth flip (period 16 and beyond), nor between 0.3 and 0.34, where two period-2
    orbits coexist.
    """
    flips = known.FLIPS_FIGURE_11
    period = np.select([rho > flips[1], rho > flips[2], rho > flips[4], rho > flips[8]], [1, 2, 4, 8], -1)
    return np.where((rho > 0.3) & (rho < 0.34), -1, period)


@pytest.mark.parametrize(("points", "longer"), [(40, 20), pytest.param(200, 50, marks=pytest.mark.slow)])
@pytest.mark.parametrize("n", list(known.FLIPS_FIGURE_11))
def test_never_a_wrong_period_number(n: int, points: int, longer: int) -> None:
    flip = known.FLIPS_FIGURE_11[n]
    rho = flip * np.linspace(1 - WIDTH, 1 + WIDTH, points)
    found, slow = sweep(rho)
    long, slow_long = sweep(rho, transient=longer * 500)
    truth = cascade(rho)
    decided = ~slow
    wrong = decided & ~slow_long & (found != long)
    false = decided & (truth > 0) & (found != truth)
    far = np.abs(rho / flip - 1) > 0.01
    # Other flips of the cascade inside the window are flips too.
    for other in known.FLIPS_FIGURE_11.values():
        far &= np.abs(rho / other - 1) > 0.01
    share = float(np.mean(slow[far])) if far.any() else 0.0
    print(
        f"\nflip of period {n} at {flip:.6f}: {slow.sum()} of {points} slow ({slow_long.sum()} after the long"
        f" transient), {wrong.sum()} differ from it, {false.sum()} from the cascade; slow farther than 1 %: {share:.1%}"
    )
    assert not wrong.any(), (
        f"differs from a transient {longer} times longer at rho = {rho[wrong]}: {found[wrong]}, {long[wrong]}"
    )
    assert not false.any(), f"differs from the cascade at rho = {rho[false]}: {found[false]}, {truth[false]}"
    assert share <= 0.05
