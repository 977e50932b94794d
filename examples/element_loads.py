"""The energy of a shaken mass: what its damper, a dry friction and a stop take from it over the forcing frequency.

A mass on a spring with a damper rubs on the ground and hits a stop on one side. In a forcing period the force does
the work W = integral F v dt. The damper takes integral c v^2 dt, the friction integral mu |v| dt, and an impact at the
speed v takes (1 - e^2) m v^2 / 2 by the impulse (1 + e) m v. On a cycle the three add up to W.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

rig = ns.mechanical(
    "m",
    "c",
    "k",
    name="mass with a stop and friction",
    parameters={
        "m": (1.0, "kg"),
        "c": (0.1, "N s/m"),
        "k": (1.0, "N/m"),
        "F": (1.0, "N"),
        "omega": (1.0, "rad/s"),
        "mu": (0.15, "N"),
        "e": 0.6,
    },
    coordinates={"x": "m"},
    forcing={"x": lambda t, p: p.F * np.cos(p.omega * t)},
    elements={
        "rub": ns.elements.Coulomb(at="x", friction="mu"),
        "stop": ns.elements.Stop(at="x", position=1.2, restitution="e"),
    },
)


def main(points: int = 121) -> Axes:
    """Sweep up in frequency with loads, draw the energies on top of each other, and check them."""
    import matplotlib.pyplot as plt

    omega = np.linspace(0.4, 2.0, points)
    curve = ns.frequency_response(rig, omega, direction="up", loads=True, progress=False)
    cycles = curve.isel(omega=curve.period_number.values > 0)
    parts = [cycles.work_of_damping, cycles.rub_energy, cycles.stop_energy]

    with ns.plot.journal():
        _, ax = plt.subplots()
        ax.stackplot(cycles.omega, *parts, labels=["damper", "friction", "impacts"], alpha=0.7)
        ax.plot(cycles.omega, cycles.work_of_forcing, "k:", label="work of the force")
        ax.set(xlabel=r"$\omega$ (rad/s)", ylabel="energy per period (J)")
        ax.legend(loc="upper left")

    assert np.allclose(sum(parts), cycles.work_of_forcing, rtol=1e-9, atol=1e-9)
    once = cycles.isel(omega=(cycles.stop_impacts.values == 1.0) & (cycles.period_number.values == 1))
    v = once.stop_impact_speed_maximum
    assert once.sizes["omega"] > points // 8
    assert np.allclose(once.stop_impulse, (1 + 0.6) * v, rtol=1e-9)
    assert np.allclose(once.stop_energy, 0.5 * (1 - 0.6**2) * v**2, rtol=1e-9)
    assert curve.stop_impulse.attrs["units"] == "N s" and curve.rub_energy.attrs["units"] == "J"
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "element_loads.pdf")
