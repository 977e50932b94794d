"""Chains of N masses, the last one against an elastic stop: the exact flow for 2 N states beside heyoka."""

from __future__ import annotations

from statistics import median
from typing import Any

import numpy as np

import nonsmooth as ns
from timing import geometric_mean, interleaved, per_unit, ratio
from work import march

SIZES = (1, 2, 3, 5, 10)
K, C, FORCE, OMEGA, STOP = 1.0, 0.05, 1.0, 1.0, 20.0
GAPS = {1: 0.5, 2: 0.5, 3: 0.2, 5: 0.2, 10: 0.5}  # each motion is periodic, so that no point is run on
PERIODS = 20_000
COMPARED = 5  # periods after which the states are compared


def system(masses: int) -> ns.System:
    names = [f"{letter}{i}" for letter in "xv" for i in range(masses)]

    def field(stopped: bool) -> Any:
        def motion(t: Any, u: Any, p: Any) -> Any:
            x, v = list(u)[:masses], list(u)[masses:]
            return (*v, *forces(x, v, p.A * np.cos(p.w * t), p.k_s * (x[-1] - p.g) if stopped else 0.0))

        return motion

    last = names[masses - 1]
    return ns.System(
        states=names,
        parameters={"A": FORCE, "w": OMEGA, "k_s": STOP, "g": GAPS[masses]},
        modes={"free": field(False), "contact": field(True)},
        indicators={"over": lambda t, u, p: getattr(u, last) - p.g},
        transitions=[
            ns.Transition("free", "contact", when="over > 0"),
            ns.Transition("contact", "free", when="over < 0"),
        ],
        name=f"chain of {masses} masses",
    )


def forces(x: list[Any], v: list[Any], drive: Any, stop: Any) -> list[Any]:
    found = [-2 * K * a - C * b for a, b in zip(x, v, strict=True)]
    for i in range(len(x) - 1):
        found[i] += K * x[i + 1]
        found[i + 1] += K * x[i]
    found[0] += drive
    found[-1] -= stop
    return found


class Peer:
    """heyoka's scalar integrator; the stop is switched by a parameter at a terminal event."""

    def __init__(self, masses: int) -> None:
        import heyoka as hy

        n = masses
        variables = hy.make_vars(*[f"{letter}{i}" for letter in "xv" for i in range(n)])
        x, v = list(variables[:n]), list(variables[n:])
        over = x[-1] - GAPS[n]
        right = [*v, *forces(x, v, FORCE * hy.cos(OMEGA * hy.time), hy.par[0] * STOP * over)]

        def switch(integrator: Any, direction: int) -> bool:
            integrator.pars[0] = 1.0 if direction > 0 else 0.0
            return True

        self.integrator = hy.taylor_adaptive(
            list(zip(variables, right, strict=True)),
            np.zeros(2 * n),
            tol=1e-14,
            t_events=[hy.t_event(over, callback=switch)],
        )

        self.done = 0

    def run(self, periods: int) -> Any:
        """March on by so many periods; the state there."""
        for _ in range(periods):
            self.done += 1
            self.integrator.propagate_until(2 * np.pi / OMEGA * self.done)
        return self.integrator.state.copy()


def run(effort: float) -> tuple[list[str], list[tuple[str, str, str, bool]]]:
    periods = max(int(PERIODS * effort), 500)
    lines = [
        "## Chains of N masses, the last one against a stop: microseconds per forcing period, one core",
        "",
        "heyoka: scalar mode, tolerance 1e-14, landing every period, the stop switched at terminal events.",
        "",
        "| N | states | transitions per period | exact | heyoka | heyoka / exact | difference |",
        "|---|---|---|---|---|---|---|",
    ]
    ratios = []
    for masses in SIZES:
        ours, peer = system(masses), Peer(masses)
        values = [GAPS[masses]]
        near = ns.simulate(ours, periods=COMPARED, method="exact")["u"].values[-1]
        difference = float(np.abs(peer.run(COMPARED) - near).max())
        chunk = periods // 5
        times = per_unit(
            interleaved(
                {
                    "exact": lambda ours=ours: march(ours, None, periods, method="exact"),
                    "heyoka": lambda peer=peer, chunk=chunk: peer.run(chunk),
                }
            ),
            {"exact": periods, "heyoka": chunk},
        )
        exact, theirs = median(times["exact"]), median(times["heyoka"])
        ratios.append(ratio(times, "heyoka", "exact"))
        shown = ns.sweep(ours, "g", values, transient=50, keep=20, progress=False)
        per_period = float(shown["crossings_per_period"][0])
        lines.append(
            f"| {masses} | {2 * masses} | {per_period:.1f} | {exact:.2f} | {theirs:.2f} "
            f"| {ratios[-1]:.1f} | {difference:.1e} |"
        )
    mean = geometric_mean(ratios)
    lines += ["", f"Geometric mean of heyoka / exact: {mean:.1f}, least {min(ratios):.1f}.", ""]
    verdicts = [
        ("chains of 1 to 10 masses: heyoka / exact, geometric mean", "5", f"{mean:.1f}", mean >= 5.0),
        ("chains of 1 to 10 masses: heyoka / exact, least", "3", f"{min(ratios):.1f}", min(ratios) >= 3.0),
    ]
    return lines, verdicts
