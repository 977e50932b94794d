"""50 masses with 10 rigid stops, 10 elastic stops and 5 friction contacts: the exact flow beside SciPy.

The elements have more than 10^11 combinations of phases; a mode is made when the motion first visits it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import nonsmooth as ns
from timing import interleaved, per_unit, ratio

Array = NDArray[np.float64]

MASSES = 50
C, FORCE, OMEGA, E, STIFF, DAMPER = 0.05, 1.0, 0.6, 0.6, 3.0, 0.1
STIFFNESS = 2 * np.eye(MASSES) - np.eye(MASSES, k=1) - np.eye(MASSES, k=-1)
REACH = FORCE * np.abs(np.linalg.inv(STIFFNESS - (OMEGA**2 - 1j * OMEGA * C) * np.eye(MASSES))[0])
RIGID = {j: 0.8 * REACH[j] for j in range(4, MASSES, 5)}  # mass and gap, on its right
SOFT = {j: 0.8 * REACH[j] for j in range(2, MASSES, 5)}  # mass and gap, on its left
RUBS = {j: (0.02 * REACH[j], 0.03 * REACH[j]) for j in range(1, MASSES, 10)}  # mass, kinetic and static friction
PERIOD = 2 * np.pi / OMEGA
CREEP = 1e-7  # of the speed: that of the elements
RTOL, ATOL = 1e-9, 1e-11
COMPARED, BALANCED, MARCHED = 5, 40, 2_000
GAUSS = np.polynomial.legendre.leggauss(10)


def system() -> ns.System:
    elements: dict[str, Any] = {
        f"wall{j}": ns.elements.Stop(at=f"q{j + 1}", position=float(gap), restitution=E, creep=CREEP)
        for j, gap in RIGID.items()
    }
    elements |= {
        f"soft{j}": ns.elements.ElasticStop(at=f"q{j + 1}", position=-float(gap), side=-1, stiffness=STIFF,
                                            damping=DAMPER)
        for j, gap in SOFT.items()
    }  # fmt: skip
    elements |= {
        f"rub{j}": ns.elements.Coulomb(at=f"q{j + 1}", friction=float(kinetic), static=float(static))
        for j, (kinetic, static) in RUBS.items()
    }
    return ns.mechanical(
        np.eye(MASSES), C * np.eye(MASSES), STIFFNESS, parameters={"F": FORCE, "w": OMEGA},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)}, elements=elements, name="50 masses with 25 elements",
    )  # fmt: skip


class SciPy:
    """`solve_ivp` with terminal events, the rules written down apart from the package's."""

    def __init__(self) -> None:
        n = MASSES
        self.matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-STIFFNESS, -C * np.eye(n)]])
        self.rest: set[int] = set()
        self.soft: set[int] = set()
        self.rub = dict.fromkeys(RUBS, 0)  # 0 sticks, 1 slips forward, -1 back
        self.t, self.u = 0.0, np.zeros(2 * n)
        self.crossings = 0

    def free(self, t: float, u: Array) -> Array:
        """Accelerations under springs, dampers, the drive and what elastic stops push."""
        a: Array = self.matrix[MASSES:] @ u
        a[0] += FORCE * np.cos(OMEGA * t)
        for j in self.soft:
            a[j] += self.push(j, u)
        return a

    @staticmethod
    def push(j: int, u: Array) -> float:
        return float(-STIFF * (u[j] + SOFT[j]) - DAMPER * u[MASSES + j])

    def field(self, t: float, u: Array) -> Array:
        a = self.free(t, u)
        for j, way in self.rub.items():
            a[j] = 0.0 if way == 0 else a[j] - way * RUBS[j][0]
        for j in self.rest:
            a[j] = 0.0
        return np.concatenate([u[MASSES:], a])

    def events(self) -> list[tuple[str, int, Any]]:
        """What may happen, with a function that rises through zero where it does."""
        found: list[tuple[str, int, Any]] = []
        for j, gap in RIGID.items():
            if j in self.rest:
                found.append(("lift", j, lambda t, u, j=j: -self.field_without(t, u, j)))
            else:
                found.append(("impact", j, lambda t, u, j=j, gap=gap: u[j] - gap))
        for j, gap in SOFT.items():
            if j in self.soft:
                found.append(("loose", j, lambda t, u, j=j: -self.push(j, u)))
            else:
                found.append(("touch", j, lambda t, u, j=j, gap=gap: min(-gap - u[j], self.push(j, u))))
        for j, way in self.rub.items():
            if way == 0:
                found.append(("forward", j, lambda t, u, j=j: self.free(t, u)[j] - RUBS[j][1]))
                found.append(("back", j, lambda t, u, j=j: -self.free(t, u)[j] - RUBS[j][1]))
            else:
                found.append(("halt", j, lambda t, u, j=j, way=way: -way * u[MASSES + j]))
        return found

    def field_without(self, t: float, u: Array, j: int) -> float:
        """The acceleration of a mass at its stop if that let it go."""
        return float(self.free(t, u)[j])

    def happen(self, name: str, j: int) -> None:
        t, u = self.t, self.u
        self.crossings += 1
        if name == "lift":
            self.rest.discard(j)
        elif name in ("loose", "touch"):
            (self.soft.discard if name == "loose" else self.soft.add)(j)
        elif name in ("forward", "back"):
            self.rub[j] = 1 if name == "forward" else -1
        elif name == "halt":
            u[MASSES + j] = 0.0
            needed = self.free(t, u)[j]
            self.rub[j] = 0 if abs(needed) <= RUBS[j][1] else int(np.sign(needed))
        else:
            u[j] = RIGID[j]
            slow = u[MASSES + j] < CREEP
            if slow and self.free(t, u)[j] > 0:
                u[MASSES + j] = 0.0
                self.rest.add(j)
            else:
                u[MASSES + j] *= -E

    def run(self, periods: float) -> Array:
        end = self.t + periods * PERIOD
        done: tuple[str, int] | None = None
        while self.t < end:
            known = self.events()
            functions = []
            for name, j, rule in known:
                def event(t: float, u: Array, rule: Any = rule) -> float:
                    return float(rule(t, u))

                event.terminal, event.direction = True, 1.0  # type: ignore[attr-defined]
                functions.append(event)
            # what has just become zero is not met again: a short step without events
            short = min(1e-9 if done is not None else 0.0, end - self.t)
            if short > 0.0:
                part = solve_ivp(self.field, (self.t, self.t + short), self.u, method="DOP853", rtol=RTOL, atol=ATOL)
                self.t, self.u = float(part.t[-1]), part.y[:, -1]
            over = [(name, j) for (name, j, rule) in known if rule(self.t, self.u) > 0]
            if over and done is not None:
                done = over[0]
                self.happen(*done)
                continue
            s = solve_ivp(
                self.field, (self.t, end), self.u, method="DOP853", rtol=RTOL, atol=ATOL, events=functions
            )
            self.t, self.u = float(s.t[-1]), s.y[:, -1].copy()
            if s.status == 1:
                hits = [(times[0], k) for k, times in enumerate(s.t_events) if len(times)]
                name, j, _ = known[min(hits)[1]]
                done = name, j
                self.happen(name, j)
        return self.u
