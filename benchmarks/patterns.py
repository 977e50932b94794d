"""50 masses with 10 rigid stops, 10 elastic stops and 5 friction contacts: the exact flow beside SciPy.

The elements have more than 10^8 combinations of phases; a mode is made when the motion first visits it.
"""

from __future__ import annotations

from statistics import median
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import nonsmooth as ns
from timing import interleaved, per_unit, ratio
from work import section

Array = NDArray[np.float64]

MASSES = 50
C, FORCE, OMEGA, E, STIFF, DAMPER = 0.1, 1.0, 0.6, 0.1, 3.0, 0.1
STIFFNESS = 2 * np.eye(MASSES) - np.eye(MASSES, k=1) - np.eye(MASSES, k=-1)
REACH = FORCE * np.abs(np.linalg.inv(STIFFNESS - (OMEGA**2 - 1j * OMEGA * C) * np.eye(MASSES))[0])
# mass and gap: rigid stops on the right, the nearest so close that masses rest there; elastic ones on the left
RIGID = {j: float((0.1 if j < 15 else 0.9) * REACH[j]) for j in range(4, MASSES, 5)}
SOFT = {j: float(0.9 * REACH[j]) for j in range(2, MASSES, 5)}
RUBS = {j: (float(0.02 * REACH[j]), float(0.03 * REACH[j])) for j in range(1, MASSES, 10)}  # kinetic, static friction
PERIOD = 2 * np.pi / OMEGA
CREEP = 1e-7  # speed below which an impact is the last
RTOL, ATOL = 1e-9, 1e-11
COMPARED, BALANCED, PERIODS = 5, 40, 20_000
GAUSS = np.polynomial.legendre.leggauss(10)


def system() -> ns.System:
    elements: dict[str, Any] = {
        f"wall{j}": ns.elements.Stop(at=f"q{j + 1}", position=gap, restitution=E, creep=CREEP)
        for j, gap in RIGID.items()
    }
    for j, gap in SOFT.items():
        elements[f"soft{j}"] = ns.elements.ElasticStop(
            at=f"q{j + 1}", position=-gap, side=-1, stiffness=STIFF, damping=DAMPER
        )
    for j, (kinetic, static) in RUBS.items():
        elements[f"rub{j}"] = ns.elements.Coulomb(at=f"q{j + 1}", friction=kinetic, static=static)
    return ns.mechanical(
        np.eye(MASSES),
        C * np.eye(MASSES),
        STIFFNESS,
        parameters={"F": FORCE, "w": OMEGA},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        elements=elements,
        name=f"{MASSES} masses with {len(elements)} elements",
    )


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
        """All that may happen, each with a function that rises through zero where it does."""
        found: list[tuple[str, int, Any]] = []
        for j, gap in RIGID.items():
            if j in self.rest:
                found.append(("lift", j, lambda t, u, j=j: -self.free(t, u)[j]))
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

    @staticmethod
    def event(rule: Any) -> Any:
        def event(t: float, u: Array) -> float:
            return float(rule(t, u))

        event.terminal, event.direction = True, 1.0  # type: ignore[attr-defined]
        return event

    def run(self, periods: float) -> Array:
        end = self.t + periods * PERIOD
        done: tuple[str, int] | None = None
        while self.t < end:
            known = self.events()
            functions = [self.event(rule) for _, _, rule in known]
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
            if self.t >= end:
                break
            s = solve_ivp(self.field, (self.t, end), self.u, method="DOP853", rtol=RTOL, atol=ATOL, events=functions)
            self.t, self.u = float(s.t[-1]), s.y[:, -1].copy()
            if s.status == 1:
                hits = [(times[0], k) for k, times in enumerate(s.t_events) if len(times)]
                name, j, _ = known[min(hits)[1]]
                done = name, j
                self.happen(name, j)
        return self.u


def energy(u: Array) -> Array:
    q, v = u[..., :MASSES], u[..., MASSES:]
    return 0.5 * (v**2).sum(-1) + 0.5 * np.einsum("...i,ij,...j->...", q, STIFFNESS, q)


def imbalance(ours: ns.System, periods: int) -> tuple[float, int]:
    """Energy at the end of a run from rest less the work of force, dampers, elements and impacts, over that of the
    force without its sign; and the number of transitions. Integrals are Gauss' sums over pieces between transitions."""
    first = ns.simulate(ours, periods=periods, samples=2)
    ends = np.unique([*np.linspace(0.0, periods * PERIOD, 12 * periods + 1), *first["crossing_time"].values])
    ends = ends[np.append(True, np.diff(ends) > 1e-9)]
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    instants = (middle[:, None] + half[:, None] * GAUSS[0]).ravel()
    weights = (half[:, None] * GAUSS[1]).ravel()
    run = ns.simulate(ours, periods=periods, samples=instants)
    kept = np.searchsorted(run["time"].values, instants)  # transitions stand in between
    v = run["u"].values[kept, MASSES:]
    drive = FORCE * np.cos(OMEGA * instants) * v[:, 0]
    power = drive - C * (v**2).sum(axis=1)
    for j in RIGID:
        power -= run[f"wall{j}_force"].values[kept] * v[:, j]
    for j in SOFT:
        power += run[f"soft{j}_force"].values[kept] * v[:, j]
    for j in RUBS:
        power += run[f"rub{j}_force"].values[kept] * v[:, j]
    lost = energy(run["u_before"].values) - energy(run["u_after"].values)
    balance = float(energy(first["u"].values[-1])) - float(weights @ power) + float(lost.sum())
    return abs(balance) / float(weights @ np.abs(drive)), len(lost)


def run(effort: float) -> tuple[list[str], list[tuple[str, str, str, bool]]]:
    periods = max(int(PERIODS * effort), 500)
    ours, scipy = system(), SciPy()
    near = ns.simulate(ours, periods=COMPARED, samples=2)
    apart = float(np.abs(scipy.run(COMPARED) - near["u"].values[-1]).max())
    same = scipy.crossings == near.sizes["crossing"]
    balance, crossings = imbalance(ours, BALANCED)
    begin = process_time()
    ns.poincare(ours, n=1)
    ns.poincare(ours, n=BALANCED)
    made = process_time() - begin
    times = per_unit(
        interleaved({"exact": lambda: section(ours, None, periods), "SciPy": lambda: scipy.run(2)}, repeats=3),
        {"exact": periods, "SciPy": 2},
    )
    over = ratio(times, "SciPy", "exact")
    what = f"{MASSES} masses with 25 elements"
    lines = [
        f"## {what}: microseconds per forcing period, one core",
        "",
        "10 rigid stops with rest, 10 elastic stops and 5 friction contacts; modes are made when they are first",
        f"visited, which is part of the time over {periods} periods. SciPy: `solve_ivp`, DOP853, rtol {RTOL:g},",
        "terminal events.",
        "",
        "| states | patterns visited | transitions per period | seconds to make the patterns | exact | SciPy "
        "| SciPy / exact | difference to SciPy | same transitions | imbalance of energy |",
        "|---|---|---|---|---|---|---|---|---|---|",
        f"| {2 * MASSES} | {len(ours.modes)} | {crossings / BALANCED:.1f} | {made:.1f} | {median(times['exact']):.0f} "
        f"| {median(times['SciPy']):.3g} | {over:.0f} | {apart:.1e} | {'yes' if same else 'no'} | {balance:.1e} |",
        "",
    ]
    verdicts = [
        (f"{what}: SciPy / exact", "100", f"{over:.0f}", over >= 100.0),
        (f"{what}: imbalance of energy", "1e-9", f"{balance:.1e}", balance <= 1e-9),
        (f"{what}: the transitions are SciPy's", "all", "all" if same else "not all", same),
    ]
    return lines, verdicts
