"""A rig of three masses with a stop: sketch, resonance, a safe region, and files for a colleague.

Where nothing touches, amplitudes are those of the linear system,
a = |(K - w^2 M + i w C)^-1 F|, at every coordinate; an impact of impulse J and approach speed v loses (1 - e) J v / 2.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

M, C = np.diag([2.0, 1.5, 1.0]), np.array([[6.0, -3.0, 0.0], [-3.0, 6.0, -3.0], [0.0, -3.0, 3.0]])
K = np.array([[4000.0, -2000.0, 0.0], [-2000.0, 3500.0, -1500.0], [0.0, -1500.0, 1500.0]])
GAP, E = 0.004, 0.6

rig = ns.mechanical(
    M,
    C,
    K,
    coordinates={"q1": "m", "q2": "m", "q3": "m"},
    parameters={"F": (5.0, "N"), "omega": (18.0, "rad/s"), "g": (GAP, "m"), "e": E},
    forcing={"q1": lambda t, p: p.F * np.cos(p.omega * t)},
    elements={"stop": ns.elements.Stop(at="q3", position="g", restitution="e")},
)


def linear(omega: np.ndarray, force: float) -> np.ndarray:
    """Amplitudes (frequencies, 3) without the stop."""
    load = np.array([force, 0.0, 0.0])
    return np.array([np.abs(np.linalg.solve(K - w**2 * M + 1j * w * C, load)) for w in omega])


def main(points: int = 61, forces: int = 25) -> Figure:
    """Draw the rig, its response and its safe region; compare with the linear system where nothing touches."""
    import matplotlib.pyplot as plt

    omega = np.linspace(8.0, 44.0, points)
    response = ns.frequency_response(rig, omega, loads=True, progress=False)
    plane = {"omega": omega, "F": np.linspace(0.5, 12.0, forces)}
    chart = ns.chart(rig, plane, loads=True, progress=False)
    condition = "abs(q3) < 6e-3 and impact_speed < 0.1"
    safe = ns.region(chart, condition)

    with ns.plot.journal():
        figure = plt.figure(figsize=(ns.plot.PAGE, 4.6), layout="constrained")
        grid = figure.add_gridspec(2, 2, height_ratios=[1.0, 2.1])
        ns.plot.mechanism(rig, figure.add_subplot(grid[0, :]))
        left, right = (figure.add_subplot(grid[1, k]) for k in (0, 1))
        for name in [*rig.states][:3]:
            one = response.sel(direction="up")
            left.plot(omega, 1e3 * one.amplitude.sel(state=name), label=f"${name[0]}_{name[1]}$")
        left.set(xlabel=r"$\omega$ (rad/s)", ylabel="amplitude (mm)")
        left.legend()
        ns.plot.chart(chart, right, show="stop_impact_speed_maximum", contours={"q1_amplitude": [0.002]}, region=safe)

    with tempfile.TemporaryDirectory() as folder:  # for a colleague
        ns.table(response, file=Path(folder) / "response.csv")
        ns.table(ns.simulate(rig, periods=5, transient=50), step=0.001, file=Path(folder) / "run.csv")
        ns.save(chart, Path(folder) / "chart.nc")
        assert (Path(folder) / "run.csv").read_text().startswith("time (s),q1 (m),q2 (m),q3 (m)")

    quiet = response.stop_impacts == 0
    free = linear(omega, 5.0)
    for k, name in enumerate(rig.states):
        if k < 3:
            found = response.amplitude.sel(state=name)
            assert np.allclose(found.where(quiet, 0.0), free[:, [k]] * quiet, rtol=0, atol=1e-10)
    assert bool((free[:, 2] < GAP)[quiet.any("direction").values].all())
    lost = 0.5 * (1 - E) * response.stop_impulse * response.stop_impact_speed_maximum
    once = (response.stop_impacts == 1) & (response.period_number == 1)
    assert once.sum() > points / 10
    assert np.allclose(response.stop_energy.where(once, 0.0), lost.where(once, 0.0), rtol=1e-9, atol=1e-15)
    by_hand = np.maximum(abs(chart.maximum), abs(chart.minimum)).sel(state="q3") < 6e-3
    assert bool((safe == (by_hand & (chart.stop_impact_speed_maximum < 0.1))).all())
    assert 0.2 < float(safe.mean()) < 0.9
    return figure


if __name__ == "__main__":
    ns.plot.save_figure(main(), "three_masses.pdf")
