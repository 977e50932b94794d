"""Resonance curves of a mass with dry friction, with and without sticking, against Den Hartog's closed form.

J. P. Den Hartog, Forced vibrations with combined Coulomb and viscous friction, *Transactions of the ASME* 53 (1931)
107-115. The motion turns round without sticking where the acceleration omega^2 a at the turn exceeds the friction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FRICTION = [0.3, 0.5, 0.7, 0.78, 0.9]  # over the amplitude of the forcing; from pi / 4 on resonance is bounded
OMEGA = np.concatenate([np.arange(0.52, 0.985, 0.01), np.arange(1.02, 1.61, 0.01)])


def main() -> Axes:
    """Sweep omega for several frictions and compare with the closed form where the mass never sticks."""
    import matplotlib.pyplot as plt

    oscillator = ns.mechanical(
        1.0,
        0.0,
        1.0,
        coordinates=["x"],
        parameters={"omega": 0.8, "F": 0.5},
        forcing={"x": lambda t, p: np.cos(p.omega * t)},
        elements={"rub": ns.elements.Coulomb(at="x", friction="F")},
    )
    v, u = 1 / (1 - OMEGA**2), np.tan(np.pi / 2 / OMEGA) / OMEGA
    limit = np.abs(v) / np.sqrt(1 + OMEGA**4 * u**2)  # omega^2 a = F in a^2 = v^2 - (F u)^2
    with ns.plot.journal():
        _, ax = plt.subplots(figsize=(ns.plot.COLUMN, 0.8 * ns.plot.COLUMN))
        for side, label in ((OMEGA < 1, "sticks"), (OMEGA > 1, None)):
            ax.fill_between(OMEGA[side], limit[side], color="0.92", label=label)
        for friction in FRICTION:
            response = ns.sweep(oscillator.with_parameters(F=friction), "omega", OMEGA, direction=None, progress=False)
            amplitude = (response.maximum - response.minimum).sel(state="x").values / 2
            slips = response.crossings_per_period.values == 2
            closed = np.sqrt(v[slips] ** 2 - (friction * u[slips]) ** 2)
            assert np.array_equal(slips, friction < OMEGA**2 * limit)
            assert np.allclose(amplitude[slips], closed, rtol=1e-6)
            for side in (OMEGA < 1, OMEGA > 1):
                ax.plot(OMEGA[side], amplitude[side], color=ns.plot.COLORS["first"])
            (dots,) = ax.plot(OMEGA[slips][::3], closed[::3], "o", markersize=2, color=ns.plot.COLORS["second"])
        dots.set_label("Den Hartog (1931)")
        ax.set(xlim=(OMEGA[0], 1.6), ylim=(0, 8), xlabel="forcing frequency", ylabel="amplitude")
        ax.legend(loc="upper right")
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "den_hartog.pdf")
