"""The clearance of a mass that sticks: the friction that holds it against its load, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

F, W, PHASE = 1.0, 0.4, 0.7


def block(harmonic: int, share: float, mu: float) -> ns.System:
    """A mass on a spring with dry friction under two harmonics."""
    return ns.mechanical(
        1.0,
        0.2,
        1.0,
        parameters={"w": W},
        coordinates=["q"],
        elements={"rub": ns.elements.Coulomb(at="q", friction=mu)},
        forcing={"q": lambda t, p: F * (np.cos(p.w * t) + share * np.cos(harmonic * p.w * t + PHASE))},
    )


def held_by(orbit: ns.Orbit, harmonic: int, share: float) -> list[np.ndarray]:
    """The friction that holds the mass over each stick, densely."""
    run = orbit.trajectory()
    mode, segment, time = (run[name].values for name in ("mode", "segment", "time"))
    stick = run["mode"].attrs["flag_meanings"].split().index("rub_stick")
    found = []
    for k in np.unique(segment[mode == stick]):
        t = np.linspace(*time[segment == k][[0, -1]], 200_001)
        load = F * (np.cos(W * t) + share * np.cos(harmonic * W * t + PHASE))
        found.append(load - float(run["u"].values[segment == k][0, 0]))
    return found


def nearest(forces: list[np.ndarray], mu: float, sign: int) -> float:
    """The least distance from the limit at a turn of the friction within a stick."""
    left = np.inf
    for force in forces:
        f = sign * force
        turns = f[1:-1][(f[1:-1] >= f[:-2]) & (f[1:-1] > f[2:])]
        left = min(left, float((mu - turns).min(initial=np.inf)))
    return left


@pytest.mark.parametrize(
    ("harmonic", "share", "mu"), [(5, 0.15, 0.7), (7, 0.1, 0.65), (9, 0.08, 0.8), (25, 0.05, 0.8), (60, 0.03, 0.9)]
)
def test_the_clearance_of_a_stick_is_that_of_its_load(harmonic: int, share: float, mu: float) -> None:
    """No state moves while the mass sticks: the turns of the load alone tell, the first as well as the last, however
    many there are."""
    orbit = ns.find_orbit(block(harmonic, share, mu), progress=False)
    forces = held_by(orbit, harmonic, share)
    found = orbit.clearance["rub_over"], orbit.clearance["rub_under"]
    assert len(forces) == 2 and found == pytest.approx([nearest(forces, mu, sign) for sign in (-1, 1)], rel=1e-7)
