"""Stops with rest and dry friction against SciPy with events, on fields and rules written down apart."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nonsmooth as ns
from nonsmooth.elements import Coulomb, Stop
from nonsmooth.system.derived import combinations

END = 25.0


class Reference:
    """Two masses: the first rubs (static and kinetic friction), the second meets a wall at ``d`` on its right."""

    def __init__(self, rng: np.random.Generator) -> None:
        a, b, c = rng.uniform(0.5, 2.0, 3)
        self.M = np.diag(rng.uniform(0.5, 2.0, 2))
        self.K = np.array([[a + b, -b], [-b, b + c]])
        self.C = 0.05 * self.K
        self.w, self.F = rng.uniform(0.3, 1.5), rng.uniform(0.5, 2.0)
        self.kinetic = rng.uniform(0.1, 0.5)
        self.static = self.kinetic * rng.uniform(1.0, 1.4)
        self.e, self.d = rng.uniform(0.0, 0.6), rng.uniform(0.1, 0.5)

    def system(self) -> ns.System:
        return ns.mechanical(
            self.M,
            self.C,
            self.K,
            parameters={"w": self.w, "F": self.F, "e": self.e},
            forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
            elements={
                "rub": Coulomb(at="q1", friction=self.kinetic, static=self.static),
                "wall": Stop(at="q2", position=self.d, restitution="e"),
            },
        )

    def pushes(self, t: float, u: np.ndarray) -> np.ndarray:
        """Forces on both masses without friction and wall."""
        return np.array([self.F * np.cos(self.w * t), 0.0]) - self.C @ u[2:] - self.K @ u[:2]

    def field(self, rub: str, wall: str, t: float, u: np.ndarray) -> np.ndarray:
        force = self.pushes(t, u)
        force[0] -= {"stick": force[0], "forward": self.kinetic, "back": -self.kinetic}[rub]
        if wall == "rest":
            force[1] = 0.0
        return np.array([u[2], u[3], *(force / np.diag(self.M))])

    def run(self) -> tuple[list[tuple[str, str]], np.ndarray]:
        """Sequence of (friction, wall) and the state at the end; begins at rest in the middle."""
        t, u, rub, wall = 0.0, np.zeros(4), "stick", "open"
        if abs(self.F) > self.static:
            rub = "forward"
        visited, name = [(rub, wall)], ""
        while t < END:
            events = []

            def add(function: object, direction: int, name: str, found: list = events) -> None:
                function.terminal, function.direction, function.name = True, direction, name  # type: ignore[attr-defined]
                found.append(function)

            if rub == "stick":
                add(lambda t, u: self.pushes(t, u)[0] - self.static, 1, "forward")
                add(lambda t, u: self.pushes(t, u)[0] + self.static, -1, "back")
            else:
                add(lambda t, u: u[2], -1 if rub == "forward" else 1, "halt")
            if wall == "open":
                add(lambda t, u: u[1] - self.d, 1, "impact")
            else:
                add(lambda t, u: self.pushes(t, u)[1], -1, "lift")
            # a first short step: what has just become zero is not met again
            short = min(1e-4 if name == "lift" else 1e-10, END - t)
            part = solve_ivp(
                lambda t, u, a=rub, b=wall: self.field(a, b, t, u),
                (t, t + short),
                u,
                method="DOP853",
                rtol=1e-12,
                atol=1e-14,
            )
            inside = [f for f in events if f.direction * f(part.t[-1], part.y[:, -1]) < 0]
            if len(inside) < len(events):
                t, u = part.t[-1], part.y[:, -1]
                name = next(f.name for f in events if f not in inside)
            else:
                run = solve_ivp(
                    lambda t, u, a=rub, b=wall: self.field(a, b, t, u),
                    (part.t[-1], END),
                    part.y[:, -1],
                    method="DOP853",
                    rtol=1e-12,
                    atol=1e-14,
                    events=events,
                )
                t, u = run.t[-1], run.y[:, -1].copy()
                if run.status == 0:
                    break
                name = next(f.name for f, times in zip(events, run.t_events, strict=True) if len(times))
            if name in ("forward", "back"):
                rub = name
            elif name == "halt":
                u[2] = 0.0
                need = self.pushes(t, u)[0]
                rub = "stick" if abs(need) < self.static else ("forward" if need > 0 else "back")
            elif name == "lift":
                wall = "open"
            else:
                u[1] = self.d
                if u[3] > 1e-6 or self.pushes(t, u)[1] < 0:
                    u[3] *= -self.e
                else:
                    u[3], wall = 0.0, "rest"
            if (rub, wall) != visited[-1]:
                visited.append((rub, wall))
        return visited, u


def agrees(seed: int, written: bool = False) -> None:
    reference = Reference(np.random.default_rng(seed))
    system = reference.system().written_out() if written else reference.system()
    run = ns.simulate(system, duration=END, samples=2)
    jumps = [system.transitions[k] for k in run["crossing_transition"].values]
    found = [system.modes[int(ns.simulate(system, duration=1e-9, samples=2)["mode"][-1])]]
    for jump in jumps:
        if jump.target != jump.source:
            found.append(system.modes[jump.target])
    expected, end = reference.run()
    names = [f"rub_{rub}_wall_{wall}" for rub, wall in expected]
    assert found == names
    assert np.allclose(run["u"].values[-1], end, atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_friction_and_impacts_with_rest(seed: int) -> None:
    agrees(seed, written=True)


@pytest.mark.parametrize("seed", range(5))
def test_the_same_with_modes_that_are_made_when_they_are_visited(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(combinations, "MOST", 0)
    agrees(seed)


@pytest.mark.slow
def test_fifty_systems_with_friction_and_impacts() -> None:
    for seed in range(5, 55):
        agrees(seed)
