"""A block on a moving belt, held by a spring: stick and slip, with one state fewer while it sticks.

The force of friction is at most f_s while the block sticks and f_d while it slips. From k x = f_s on it slips along
an arc of the circle about x = f_d / k, of radius R = sqrt(D^2 + (v_b / w)^2) with D = (f_s - f_d) / k and
w = sqrt(k / m), until its speed is that of the belt again. Its largest extension is f_d / k + R, and one slip lasts
(pi + 2 atan(v_b / (D w))) / w.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def stick(t: Any, u: Any, p: Any) -> Any:
    """The block moves with the belt: its velocity is no state here."""
    return (p.v_b,)


def slip(t: Any, u: Any, p: Any) -> Any:
    """The spring pulls back, dry friction drags along."""
    return u.v, (p.f_d - p.k * u.x) / p.m


belt = ns.System(
    name="block on a belt",
    states={"x": "m", "v": "m/s"},
    parameters={
        "m": (1.0, "kg"),
        "k": (1.0, "N/m"),
        "f_s": (1.0, "N"),
        "f_d": (0.5, "N"),
        "v_b": (0.2, "m/s"),
    },
    modes={"stick": ns.Mode(stick, states=["x"]), "slip": slip},
    indicators={
        "strain": lambda t, u, p: p.k * u.x - p.f_s,
        "catch": lambda t, u, p: u.v - p.v_b,
    },
    transitions=[
        ns.Transition("stick", "slip", when="strain > 0", reset=lambda t, u, p: (u.x, p.v_b)),
        ns.Transition("slip", "stick", when="catch > 0", reset=lambda t, u, p: (u.x,)),
    ],
    outputs={"velocity": ({"stick": lambda t, u, p: p.v_b, "slip": lambda t, u, p: u.v}, "m/s")},
)


def main() -> Axes:
    """Simulate from the unstrained spring, and compare one cycle with its closed form."""
    run = ns.simulate(belt, duration=40.0, samples=4001)
    ax = ns.plot.phase_portrait(run, y="velocity")
    with ns.plot.journal():
        ax.legend(loc="center")

    drop, turn = 0.5, np.arctan2(0.2, 0.5)  # (f_s - f_d) / k and the angle of the first point of the slip
    begins, ends = run.crossing_time.values[0::2], run.crossing_time.values[1::2]
    assert np.isclose(begins[0], 1.0 / 0.2, rtol=1e-12)
    assert np.allclose(ends - begins[: len(ends)], np.pi + 2 * turn, rtol=1e-9)
    assert np.isclose(run.u.sel(state="x").max(), 0.5 + np.hypot(drop, 0.2), rtol=1e-5)  # of samples, not the extreme
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "stick_slip.pdf")
