"""The saddle between the jumps of the oscillator with a support: its stable manifold separates two basins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def main() -> Axes:
    """Compute the manifolds of the middle orbit between the folds, and the orbits reached from points beside them."""
    oscillator = ns.models.discontinuous_support(rho=0.14, g=0.02, omega=4.5)
    branch = ns.continue_orbit(ns.find_orbit(oscillator), "omega", (3.0, 7.0))
    folds = branch.special_point.values[branch.special_kind.values == "fold"]
    middle = branch.isel(point=int(folds.sum()) // 2)
    system = oscillator.with_parameters(omega=float(middle.omega))
    saddle = ns.find_orbit(system, start=middle.section.values, period_number=1, transient=0)
    arms = ns.manifolds(saddle, length=4.0, distance=0.05)
    first, last = (arms.section.values[arms.arc_number.values == arm][-1] for arm in (0, 1))
    stable = [ns.find_orbit(system, start=end) for end in (first, last)]
    with ns.plot.journal():
        ax = ns.plot.manifolds(arms)
        ax.plot(*np.transpose([orbit.u for orbit in stable]), "s", color=ns.plot.COLORS["third"], label="stable orbits")
        ax.legend()
    assert [orbit.contacts_per_period for orbit in stable] in ([1.0, 0.0], [0.0, 1.0])
    for end, orbit in zip((first, last), stable, strict=True):
        assert np.abs((end - orbit.u) / arms["size"].values).max() < 1e-3

    # Initial conditions on the two sides of the stable manifold reach different orbits.
    for arm in (2, 3):
        curve = arms.section.values[arms.arc_number.values == arm]
        for i in np.linspace(10, len(curve) - 11, 5).astype(int):
            along = (curve[i + 1] - curve[i - 1]) / arms["size"].values
            across = np.array([-along[1], along[0]]) / np.hypot(*along) * arms["size"].values
            sides = [ns.find_orbit(system, start=curve[i] + step * across).u for step in (1e-3, -1e-3)]
            assert np.abs(sides[0] - sides[1]).max() > 1e-3
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "saddle_manifolds.pdf")
