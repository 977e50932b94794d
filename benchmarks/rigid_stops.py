"""50 masses in a row, each fifth one against a rigid stop: the exact flow for 100 states beside heyoka and SciPy."""

from __future__ import annotations

from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import nonsmooth as ns
from timing import interleaved, per_unit, ratio
from work import march, section

Array = NDArray[np.float64]

MASSES = 50
STOPS = tuple(range(4, MASSES, 5))
K, C, FORCE, OMEGA, E = 1.0, 0.05, 1.0, 0.6, 0.8
PART = 0.4  # gaps, over what the masses would move without stops: the motion is then periodic
PERIOD = 2 * np.pi / OMEGA
PERIODS = 50_000
COMPARED = 5  # periods after which the states are compared
BALANCED = 40  # periods of the balance of energy
RTOL, ATOL = 1e-8, 1e-8
STIFFNESS = K * (2 * np.eye(MASSES) - np.eye(MASSES, k=1) - np.eye(MASSES, k=-1))
DYNAMIC = STIFFNESS - (OMEGA**2 - 1j * OMEGA * C) * np.eye(MASSES)
REACH = FORCE * np.abs(np.linalg.inv(DYNAMIC)[0])
GAUSS = np.polynomial.legendre.leggauss(10)


def system() -> ns.System:
    names = [f"{letter}{i}" for letter in "xv" for i in range(MASSES)]

    def motion(t: Any, u: Any, p: Any) -> Any:
        x, v = list(u)[:MASSES], list(u)[MASSES:]
        return (*v, *forces(x, v, p.A * np.cos(p.w * t)))

    def rebound(i: int) -> Any:
        def reset(t: Any, u: Any, p: Any) -> Any:
            states = list(u)
            states[MASSES + i] = -p.e * states[MASSES + i]
            return tuple(states)

        return reset

    return ns.System(
        states=names,
        parameters={"A": FORCE, "w": OMEGA, "gaps": PART, "e": E},
        modes={"free": motion},
        indicators={f"over{i}": lambda t, u, p, i=i: list(u)[i] - p.gaps * float(REACH[i]) for i in STOPS},
        transitions=[ns.Transition("free", "free", when=f"over{i} > 0", reset=rebound(i)) for i in STOPS],
        name=f"{MASSES} masses with {len(STOPS)} rigid stops",
    )


def forces(x: list[Any], v: list[Any], drive: Any) -> list[Any]:
    """Springs to the ground and to the neighbours, dampers to the ground; the first mass is driven."""
    found = [-2 * K * a - C * b for a, b in zip(x, v, strict=True)]
    for i in range(MASSES - 1):
        found[i] = found[i] + K * x[i + 1]
        found[i + 1] = found[i + 1] + K * x[i]
    found[0] = found[0] + drive
    return found


class Peer:
    """heyoka's scalar integrator, tolerance 1e-14; each stop is a terminal event that turns the velocity."""

    def __init__(self) -> None:
        import heyoka as hy

        variables = hy.make_vars(*[f"{letter}{i}" for letter in "xv" for i in range(MASSES)])
        x, v = list(variables[:MASSES]), list(variables[MASSES:])

        def rebound(i: int) -> Any:
            def strike(integrator: Any, _direction: int) -> bool:
                integrator.state[MASSES + i] *= -E
                return True

            return strike

        self.integrator = hy.taylor_adaptive(
            list(zip(variables, [*v, *forces(x, v, FORCE * hy.cos(OMEGA * hy.time))], strict=True)),
            np.zeros(2 * MASSES),
            tol=1e-14,
            t_events=[
                hy.t_event(x[i] - PART * REACH[i], callback=rebound(i), direction=hy.event_direction.positive)
                for i in STOPS
            ],
        )
        self.done = 0

    def run(self, periods: int) -> Array:
        """March on by so many periods, landing at each; the state there."""
        for _ in range(periods):
            self.done += 1
            self.integrator.propagate_until(PERIOD * self.done)
        return np.array(self.integrator.state)


class SciPy:
    """`solve_ivp` with a terminal event for each stop, the field as one product with a matrix."""

    def __init__(self) -> None:
        n = MASSES
        self.matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-STIFFNESS, -C * np.eye(n)]])
        self.drive = np.eye(2 * n)[n] * FORCE
        self.events = [self.over(i) for i in STOPS]
        self.t, self.u = 0.0, np.zeros(2 * n)

    @staticmethod
    def over(i: int) -> Any:
        def event(_t: float, u: Array) -> float:
            return float(u[i] - PART * REACH[i])

        event.terminal, event.direction = True, 1.0  # type: ignore[attr-defined]
        return event

    def field(self, t: float, u: Array) -> Array:
        return self.matrix @ u + self.drive * np.cos(OMEGA * t)

    def run(self, periods: int) -> Array:
        end = self.t + periods * PERIOD
        while self.t < end:
            s = solve_ivp(self.field, (self.t, end), self.u, method="DOP853", rtol=RTOL, atol=ATOL, events=self.events)
            self.t, self.u = float(s.t[-1]), s.y[:, -1]
            for i, found in zip(STOPS, s.t_events, strict=True):
                if len(found):
                    self.u[i], self.u[MASSES + i] = PART * REACH[i], -E * self.u[MASSES + i]
        return self.u


def energy(u: Array) -> Array:
    x, v = u[..., :MASSES], u[..., MASSES:]
    return 0.5 * (v**2).sum(-1) + K * ((x**2).sum(-1) - (x[..., 1:] * x[..., :-1]).sum(-1))


def imbalance(ours: ns.System, periods: int) -> tuple[float, int]:
    """Energy at the end of a run from rest less the work of the force, dampers and impacts, over that of the force
    without its sign; and the number of impacts. The integrals are Gauss' sums over pieces between impacts."""
    first = ns.simulate(ours, periods=periods, samples=2, method="exact")
    ends = np.unique([*np.linspace(0.0, periods * PERIOD, 12 * periods + 1), *first["crossing_time"].values])
    ends = ends[np.append(True, np.diff(ends) > 1e-9)]
    middle, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    instants = (middle[:, None] + half[:, None] * GAUSS[0]).ravel()
    weights = (half[:, None] * GAUSS[1]).ravel()
    run = ns.simulate(ours, periods=periods, samples=instants, method="exact")
    kept = np.searchsorted(run["time"].values, instants)  # crossings stand in between
    v = run["u"].values[kept, MASSES:]
    power = FORCE * np.cos(OMEGA * instants) * v[:, 0]
    lost = energy(run["u_before"].values) - energy(run["u_after"].values)
    end = float(energy(first["u"].values[-1]))
    balance = end - float(weights @ (power - C * (v**2).sum(axis=1))) + float(lost.sum())
    return abs(balance) / float(weights @ np.abs(power)), len(lost)


def run(effort: float) -> tuple[list[str], list[tuple[str, str, str, bool]]]:
    periods = max(int(PERIODS * effort), 500)
    ours, peer, scipy = system(), Peer(), SciPy()
    near = ns.simulate(ours, periods=COMPARED, samples=2, method="exact")["u"].values[-1]
    difference = float(np.abs(peer.run(COMPARED) - near).max())
    apart = float(np.abs(scipy.run(COMPARED) - near).max())
    balance, impacts = imbalance(ours, BALANCED)
    chunks = {"heyoka": periods // 25, "SciPy": 2}
    times = per_unit(
        interleaved(
            {
                "exact": lambda: march(ours, None, periods, method="exact"),
                "exact, points": lambda: section(ours, None, periods // 5, method="exact"),
                "heyoka": lambda: peer.run(chunks["heyoka"]),
                "SciPy": lambda: scipy.run(chunks["SciPy"]),
            }
        ),
        {"exact": periods, "exact, points": periods // 5, **chunks},
    )
    shown = {name: median(values) for name, values in times.items()}
    over_heyoka, over_scipy = ratio(times, "heyoka", "exact"), ratio(times, "SciPy", "exact")
    lines = [
        f"## {MASSES} masses with {len(STOPS)} rigid stops: microseconds per forcing period, one core",
        "",
        "heyoka: scalar mode, tolerance 1e-14, landing every period. SciPy: `solve_ivp`, DOP853, rtol 1e-8. Both turn",
        "the velocity at terminal events.",
        "",
        "| states | impacts per period | exact | exact, section points | heyoka | SciPy | heyoka / exact "
        "| with sections | SciPy / exact | difference to heyoka | to SciPy | imbalance of energy |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
        f"| {2 * MASSES} | {impacts / BALANCED:.1f} | {shown['exact']:.1f} | {shown['exact, points']:.1f} "
        f"| {shown['heyoka']:.1f} | {shown['SciPy']:.3g} | {over_heyoka:.1f} "
        f"| {ratio(times, 'heyoka', 'exact, points'):.1f} | {over_scipy:.0f} | {difference:.1e} | {apart:.1e} "
        f"| {balance:.1e} |",
        "",
    ]
    what = f"{MASSES} masses with {len(STOPS)} rigid stops"
    verdicts = [
        (f"{what}: heyoka / exact", "2", f"{over_heyoka:.1f}", over_heyoka >= 2.0),
        (f"{what}: SciPy / exact", "100", f"{over_scipy:.0f}", over_scipy >= 100.0),
        (f"{what}: imbalance of energy", "1e-9", f"{balance:.1e}", balance <= 1e-9),
    ]
    return lines, verdicts
