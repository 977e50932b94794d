"""Dry friction with stick, and impacts that end in rest: elements on the exact flow beside heyoka and SciPy."""

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

ZETA, FORCE, OMEGA, MU = 0.05, 1.0, 0.5, 0.6  # sticks twice a period
GAP, E, RATE = 0.3, 0.5, 0.4  # a stop at which the mass chatters and rests once a period
WAIT = 1e-9  # after an event of heyoka's, in which it is not looked for again
SLOW = 1e-7  # speed below which an impact is the last, for all three
PERIODS = 200_000
COMPARED = 10
RTOL, ATOL = 1e-8, 1e-8


def rubbing() -> ns.System:
    return ns.mechanical(
        1.0,
        2 * ZETA,
        1.0,
        parameters={"w": OMEGA, "mu": MU},
        forcing={"q": lambda t, p: FORCE * np.cos(p.w * t)},
        elements={"rub": ns.elements.Coulomb(at="q", friction="mu")},
        name="dry friction with stick",
    )


def resting() -> ns.System:
    return ns.mechanical(
        1.0,
        2 * ZETA,
        1.0,
        parameters={"w": RATE, "d": GAP},
        forcing={"q": lambda t, p: FORCE * np.cos(p.w * t)},
        elements={"stop": ns.elements.Stop(at="q", position="d", restitution=E, creep=SLOW)},
        name="impacts that end in rest",
    )


class Rules:
    """Return the state after an event, for both peers: fields ``free`` (with a friction force) or ``held``."""

    def __init__(self, omega: float, mu: float, gap: float) -> None:
        self.omega, self.mu, self.gap = omega, mu, gap

    def push(self, t: float, u: Array) -> float:
        return FORCE * float(np.cos(self.omega * t)) - u[0] - 2 * ZETA * u[1]

    def halt(self, t: float, u: Array) -> tuple[bool, float]:
        """Return True where it sticks when the speed has become zero, and the friction force."""
        u[1] = 0.0
        push = self.push(t, u)
        return abs(push) < self.mu, -self.mu if push > 0 else self.mu

    def strike(self, t: float, u: Array) -> bool:
        """Return True where it rests behind an impact."""
        rests = u[1] < SLOW and self.push(t, u) > 0
        u[0], u[1] = self.gap, 0.0 if rests else -E * u[1]
        return rests


class Heyoka:
    """Scalar integrator, tolerance 1e-14; field with the parameters moves (0 or 1) and friction force."""

    def __init__(self, rules: Rules, impacts: bool) -> None:
        import heyoka as hy

        self.rules, self.impacts, self.done = rules, impacts, 0
        # the forcing is a state: while the mass rests, nothing else would hold the steps to what an event needs
        x, v, c, s = hy.make_vars("x", "v", "c", "s")
        push = FORCE * c - x - 2 * ZETA * v
        moves, waits = hy.par[0], 1.0 - hy.par[0]  # an event that is not looked for is one that cannot vanish
        up, down = hy.event_direction.positive, hy.event_direction.negative
        if impacts:
            events = [
                hy.t_event(moves * (x - rules.gap) - waits, callback=self.strike, direction=up, cooldown=WAIT),
                hy.t_event(waits * push + moves, callback=self.let_go, direction=down, cooldown=WAIT),
            ]
        else:
            events = [
                hy.t_event(moves * v + waits, callback=self.halt, direction=down, cooldown=WAIT),
                hy.t_event(moves * v - waits, callback=self.halt, direction=up, cooldown=WAIT),
                hy.t_event(waits * (push - rules.mu) - moves, callback=self.forward, direction=up, cooldown=WAIT),
                hy.t_event(waits * (push + rules.mu) + moves, callback=self.back, direction=down, cooldown=WAIT),
            ]
        self.integrator = hy.taylor_adaptive(
            [(x, moves * v), (v, moves * (push + hy.par[1])), (c, -rules.omega * s), (s, rules.omega * c)],
            [0.0, 0.0, 1.0, 0.0],
            tol=1e-14,
            pars=[1.0, 0.0 if impacts else -rules.mu],
            t_events=events,
        )

    def halt(self, ta: Any, direction: int) -> bool:
        if ta.pars[0] and direction * ta.pars[1] > 0:  # against the motion that friction brakes
            sticks, force = self.rules.halt(ta.time, ta.state)
            ta.pars[0], ta.pars[1] = 0.0 if sticks else 1.0, force
        return True

    def forward(self, ta: Any, _direction: int) -> bool:
        if not ta.pars[0]:
            ta.pars[0], ta.pars[1] = 1.0, -self.rules.mu
        return True

    def back(self, ta: Any, _direction: int) -> bool:
        if not ta.pars[0]:
            ta.pars[0], ta.pars[1] = 1.0, self.rules.mu
        return True

    def strike(self, ta: Any, _direction: int) -> bool:
        ta.pars[0] = 0.0 if self.rules.strike(ta.time, ta.state) else 1.0
        return True

    def let_go(self, ta: Any, _direction: int) -> bool:
        ta.pars[0] = 1.0
        return True

    def run(self, periods: int) -> Array:
        for _ in range(periods):
            self.done += 1
            self.integrator.propagate_until(2 * np.pi / self.rules.omega * self.done)
        return np.array(self.integrator.state[:2])


class SciPy:
    """`solve_ivp` with terminal events."""

    def __init__(self, rules: Rules, impacts: bool) -> None:
        self.rules, self.impacts = rules, impacts
        self.t, self.u, self.moves, self.force = 0.0, np.zeros(2), True, 0.0 if impacts else -rules.mu

    def events(self) -> list[Any]:
        rules = self.rules
        if self.impacts:
            wanted = [(lambda t, u: u[0] - rules.gap, 1.0)] if self.moves else [(rules.push, -1.0)]
        elif self.moves:
            wanted = [(lambda t, u: u[1], np.sign(self.force))]
        else:
            wanted = [(lambda t, u: rules.push(t, u) - rules.mu, 1.0), (lambda t, u: rules.push(t, u) + rules.mu, -1.0)]
        for event, direction in wanted:
            function = event.__func__ if hasattr(event, "__func__") else event
            function.terminal, function.direction = True, direction
        return [event for event, _ in wanted]

    def field(self, t: float, u: Array) -> Array:
        return np.array([u[1], self.rules.push(t, u) + self.force]) if self.moves else np.zeros(2)

    def run(self, periods: int) -> Array:
        end = self.t + periods * 2 * np.pi / self.rules.omega
        while self.t < end:
            events = self.events()
            longest = np.inf if self.moves else 0.5 / self.rules.omega
            s = solve_ivp(
                self.field,
                (self.t, end),
                self.u,
                method="DOP853",
                rtol=RTOL,
                atol=ATOL,
                events=events,
                max_step=longest,
            )
            self.t, self.u = float(s.t[-1]), s.y[:, -1].copy()
            which = next((k for k, found in enumerate(s.t_events) if len(found)), None)
            if which is None:
                continue
            if not self.moves:
                self.moves = True
                if not self.impacts:
                    self.force = -self.rules.mu if which == 0 else self.rules.mu
            elif self.impacts:
                self.moves = not self.rules.strike(self.t, self.u)
            else:
                sticks, self.force = self.rules.halt(self.t, self.u)
                self.moves = not sticks
        return self.u


def run(effort: float) -> tuple[list[str], list[tuple[str, str, str, bool]]]:
    periods = max(int(PERIODS * effort), 2000)
    lines = [
        "## Friction and rest: microseconds per forcing period, one core",
        "",
        "heyoka: scalar mode, tolerance 1e-14, landing every period. SciPy: `solve_ivp`, DOP853, rtol 1e-8. Both",
        "decide at terminal events what sticks or rests.",
        "",
        "| system | transitions per period | exact | exact, section points | heyoka | SciPy | heyoka / exact "
        "| with sections | SciPy / exact | difference to heyoka | to SciPy |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    verdicts = []
    for ours, impacts, rules in (
        (rubbing(), False, Rules(OMEGA, MU, 0.0)),
        (resting(), True, Rules(RATE, 0.0, GAP)),
    ):
        peer, scipy = Heyoka(rules, impacts), SciPy(rules, impacts)
        near = ns.simulate(ours, periods=COMPARED, samples=2)
        state = near["u"].values[-1]
        difference = float(np.abs(peer.run(COMPARED) - state).max())
        apart = float(np.abs(scipy.run(COMPARED) - state).max())
        chunks = {"heyoka": periods // 50, "SciPy": max(periods // 20_000, 2)}
        calls = {
            "exact": lambda s=ours: march(s, None, periods),
            "exact, points": lambda s=ours: section(s, None, periods // 5),
            "heyoka": lambda p=peer, n=chunks["heyoka"]: p.run(n),
            "SciPy": lambda p=scipy, n=chunks["SciPy"]: p.run(n),
        }
        times = per_unit(interleaved(calls), {"exact": periods, "exact, points": periods // 5, **chunks})
        shown = {key: median(values) for key, values in times.items()}
        over_heyoka, over_scipy = ratio(times, "heyoka", "exact"), ratio(times, "SciPy", "exact")
        count = len(near["crossing_time"]) / COMPARED
        lines.append(
            f"| {ours.name} | {count:.1f} | {shown['exact']:.3g} | {shown['exact, points']:.3g} "
            f"| {shown['heyoka']:.3g} | {shown['SciPy']:.3g} | {over_heyoka:.1f} "
            f"| {ratio(times, 'heyoka', 'exact, points'):.1f} "
            f"| {over_scipy:.0f} | {difference:.1e} | {apart:.1e} |"
        )
        verdicts += [
            (f"{ours.name}: heyoka / exact", "10", f"{over_heyoka:.1f}", over_heyoka >= 10.0),
            (f"{ours.name}: SciPy / exact", "2000", f"{over_scipy:.0f}", over_scipy >= 2000.0),
        ]
    return [*lines, ""], verdicts
