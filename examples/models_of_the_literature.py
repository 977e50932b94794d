"""Twelve oscillators that have been published, one picture and one number each.

Each number is known from the literature or in closed form (the docstrings of the models say how) and asserted below.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Number = tuple[float, float, str]  # computed, known, and what it is


def bilinear(system: ns.System) -> Number:
    amplitude = np.hypot(1 - 0.7**2, 0.1 * 0.7) / 0.7**2
    orbit = ns.find_orbit(system.with_parameters(A=amplitude * (1 - 1e-12)))
    return orbit.maximum[0], 1.0, f"grazing at A = {amplitude:.4f}"


def gears(system: ns.System) -> Number:
    omega = brentq(lambda w: 0.05 * w**2 - 0.1 * np.hypot(1 - w**2, 0.1 * w), 0.5, 0.99)
    linear = 0.05 * omega**2 / (1 - omega**2 + 0.1j * omega)
    start = {"q": 1.1 + linear.real, "v_q": -omega * linear.imag}
    run = ns.simulate(system.with_parameters(omega=omega), periods=1, start=start, samples=2001)
    return float(run.u[:, 0].min()), 1.0, f"contact lost at {omega:.4f}"


def double_impact(system: ns.System) -> Number:
    a, b, f = 1.6 * np.sin(np.pi / 1.5) / (2 * (1 + np.cos(np.pi / 1.5))), 0.4 / 3, 1 / (1 - 1.5**2)
    known = (0.5 * a + np.sqrt((0.5 * a) ** 2 - (a * a + b * b) * (0.25 - f * f))) / (a * a + b * b)
    orbit = ns.find_orbit(system)
    run = ns.simulate(system, periods=1, start=orbit.u)
    return abs(float(run.u_before[0, 1])), known, f"impact speed {known:.4f}"


def damper(system: ns.System) -> Number:
    run = ns.simulate(system, periods=1, transient=600, start={"v_y": 0.2})
    speed, x = abs(run.u_before.values[0, 3]), -np.sign(run.u_before.values[0, 3]) * run.u_before.values[0, 0]
    return speed, (1 + 2 * -x) / np.pi, f"speed of the ball {speed:.4f}"


def grazing(system: ns.System) -> Number:
    x = 0.37 / (1 - 0.8**2 + 0.08j)
    start = {"x": x.real, "v": -0.8 * x.imag}
    run = ns.simulate(system.with_parameters(omega=0.8, A=0.37), periods=1, start=start)
    known = 0.8 * np.sqrt(abs(x) ** 2 - 1)
    return float(run.u_before[0, 1]), known, f"first impact speed {known:.4f}"


def duffing(system: ns.System) -> Number:
    run = ns.simulate(system, periods=20)
    before, after = (one.values[0, 3] - one.values[0, 2] for one in (run.u_before, run.u_after))
    return after / before, -0.8, "relative speed turned by -0.8"


def drift(system: ns.System) -> Number:
    run = ns.simulate(system, periods=4, transient=100, samples=40001)
    progress, travel = (np.trapezoid(y, run.time) for y in (run.slider_velocity, run.u[:, 1]))
    return progress, travel - float(run.u[-1, 0] - run.u[0, 0]), f"advance per period {progress / 4:.2f}"


def rotor(system: ns.System) -> Number:
    known = brentq(lambda r: (r - 1.05) ** 2 + (0.02 * r + 0.2 * (r - 1.05)) ** 2 - 0.2**4, 1.05, 2)
    run = ns.simulate(system, periods=1, transient=200, start={"x": 0.5})
    return float(np.hypot(run.u[-1, 0], run.u[-1, 1])), known, f"radius of the rub {known:.4f}"


def chua(system: ns.System) -> Number:
    b, beta = 2 / 7, 100 / 7
    known = brentq(lambda a: (1 + a * b) * (a * b - a + beta) - a * beta * b, 5, 8)
    start = {"x": 1.4, "y": 0.0, "z": -1.4}
    rests = ns.continue_equilibrium(system.with_parameters(alpha=6.5), "alpha", (6, 8), start=start, mode="diode_above")
    return float(ns.special_points(rests).alpha[0]), known, f"unstable from {known:.4f}"


def track(system: ns.System) -> Number:
    run = ns.simulate(system.with_parameters(zeta=0.0, A=0.0, d=2.0), duration=4 * ellipe(-0.64), start={"x": -0.8})
    return float(run.u[-1, 0]), -0.8, f"free period {4 * ellipe(-0.64):.4f}"


def rub_and_hit(system: ns.System) -> Number:
    slide = np.sin(np.pi / 0.8) / (0.8 * (1 + np.cos(np.pi / 0.8)))
    known = np.sqrt(1 / (1 - 0.8**2) ** 2 - (0.2 * slide) ** 2)
    return ns.find_orbit(system.with_parameters(g=10.0)).maximum[0], known, f"grazing at g = {known:.4f}"


def belt(system: ns.System) -> Number:
    run = ns.simulate(system.with_parameters(u_0=0.0), duration=60.0)
    off = [system.transitions[i].label.startswith("belt_stick") for i in run.crossing_transition.values]
    return float(run.u_before.values[off, 0].max()), 0.4, "lets go at x = 0.4"


PANELS: list[tuple[str, str, dict[str, float], dict[str, float], tuple[int, int], Any]] = [
    ("bilinear_oscillator", "Wiercigroch, Sin 1998", {}, {}, (0, 1), bilinear),
    ("gear_pair", "Kahraman, Singh 1990", {"omega": 0.85}, {"q": 1.1}, (0, 1), gears),
    ("double_impact_oscillator", "Peterka 2000", {}, {}, (0, 1), double_impact),
    ("impact_damper", "Masri, Caughey 1966", {}, {"v_y": 0.2}, (1, 0), damper),
    ("impact_oscillator", "Nordmark 1991", {"omega": 0.8, "A": 0.4}, {}, (0, 1), grazing),
    ("impact_duffing", "Iklodi, Dombovari", {}, {}, (0, 1), duffing),
    ("drifting_impact_oscillator", "Pavlovskaia et al. 2001", {}, {}, (0, 1), drift),
    ("rubbing_rotor", "Jiang, Ulbrich 2001", {"omega": 0.3}, {"x": 0.5}, (0, 1), rotor),
    ("chua_circuit", "Matsumoto et al. 1985", {}, {"x": 0.1}, (0, 2), chua),
    ("parabolic_track", "Todd, Virgin 1997", {}, {}, (0, 1), track),
    ("impact_friction_oscillator", "Virgin, Begley 1999", {}, {}, (0, 1), rub_and_hit),
    ("stribeck_oscillator", "Hinrichs et al. 1998", {}, {}, (0, 1), belt),
]


def main() -> Figure:
    """Draw a phase portrait of each model, with its number above."""
    with ns.plot.journal():
        figure, axes = plt.subplots(4, 3, figsize=(7.2, 8.6), layout="constrained")
        for ax, (name, source, values, start, (i, j), number) in zip(axes.flat, PANELS, strict=True):
            make = getattr(ns.models, name)
            system = make(**values)
            if name == "chua_circuit":
                run = ns.simulate(system, duration=60.0, start=start, samples=3000)
            else:
                run = ns.simulate(system, periods=6, transient=200, start=start, samples=3000)
            ns.plot.phase_portrait(run, ax, x=run.state.values[i], y=run.state.values[j], linewidth=0.7)
            computed, known, text = number(make())
            assert np.isclose(computed, known, rtol=1e-3 if name.startswith("drifting") else 1e-6), name
            ax.set_title(f"{system.name} ({source})\n{text}", fontsize=7)
    return figure


if __name__ == "__main__":
    ns.plot.save_figure(main(), "models_of_the_literature.pdf")
