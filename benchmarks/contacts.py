"""Every verb on systems of elements, each with its time: ``python benchmarks/contacts.py [name ...]``.

A friction oscillator, a stop with rest, and two masses with six elements; a row of fifty masses with 25 elements and
six stops that rub, by the verbs of ``LARGE``. First calls compile what their system needs; the second column is the
same call again.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import nonsmooth as ns

E = ns.elements
QUIET: dict[str, Any] = {"progress": False}


def harmonic(t: Any, p: Any) -> Any:
    return p.F * np.cos(p.w * t)


def friction(load: Any = None) -> ns.System:
    return ns.mechanical(
        1.0,
        0.05,
        1.0,
        coordinates=["q"],
        parameters={"F": 1.0, "w": 0.8, "mu": 0.4},
        forcing={"q": load or harmonic},
        elements={"rub": E.Coulomb(at="q", friction="mu")},
    )


def rest(load: Any = None) -> ns.System:
    return ns.mechanical(
        1.0,
        0.2,
        1.0,
        coordinates=["q"],
        parameters={"F": 1.0, "w": 0.8, "mu": 0.5},
        forcing={"q": load or harmonic},
        elements={"stop": E.Stop(at="q", position=0.2, restitution="mu")},
    )


def six(load: Any = None) -> ns.System:
    return ns.mechanical(
        np.diag([1.0, 0.8]),
        [[0.1, -0.02], [-0.02, 0.1]],
        [[3.0, -1.0], [-1.0, 2.0]],
        parameters={"F": 1.2, "w": 1.1, "mu": 0.3},
        forcing={"q1": load or harmonic},
        elements={
            "a": E.Coulomb(at="q1", friction="mu", static=0.4),
            "b": E.Coulomb(at={"q1": 1, "q2": -1}, friction=0.2),
            "s": E.Stop(at="q2", position=0.4, restitution=0.5),
            "r": E.Stop(at="q2", position=-0.4, side=-1),
            "e": E.ElasticStop(at="q1", position=0.5, stiffness=20.0),
            "f": E.ElasticStop(at="q1", position=-0.5, side=-1, stiffness=20.0),
        },
    )


def fifty(load: Any = None) -> ns.System:
    n = 50
    chain = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    elements: dict[str, Any] = {}
    for i in range(1, n - 2, 6):
        elements[f"s{i}"] = E.Stop(at=f"q{i}", position=0.5, restitution=0.6)
        elements[f"f{i}"] = E.Coulomb(at=f"q{i + 1}", friction="mu")
        elements[f"e{i}"] = E.ElasticStop(at=f"q{i + 2}", position=-0.5, side=-1, stiffness=20.0)
    elements["last"] = E.Stop(at=f"q{n}", position=0.2, restitution=0.3)
    return ns.mechanical(
        np.eye(n),
        0.1 * np.eye(n) + 0.1 * chain,
        10.0 * chain,
        parameters={"F": 2.0, "w": 0.5, "mu": 0.02},
        forcing={"q1": load or harmonic},
        elements=elements,
    )


def rubbing(load: Any = None) -> ns.System:
    n = 6
    names = [f"{axis}{i}" for i in range(1, n + 1) for axis in "xy"]
    chain = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    elements = {
        f"s{i}": E.Stop(at=f"y{i}", side=-1, restitution=0.4, friction="mu", tangent=f"x{i}") for i in range(1, n + 1)
    }
    forcing: dict[str, Any] = {f"y{i}": lambda t, p: -1.0 - 0.8 * np.sin(p.w * t) for i in range(1, n + 1)}
    return ns.mechanical(
        np.eye(2 * n),
        0.2 * np.eye(2 * n),
        np.kron(chain, np.diag([4.0, 1.0])),
        coordinates=names,
        parameters={"F": 1.5, "w": 1.1, "mu": 0.3},
        forcing={**forcing, "x1": load or harmonic},
        elements=elements,
    )


LARGE = ("simulate", "sweep", "find_orbit", "continue_orbit", "lyapunov", "sensitivity")


def verbs(s: ns.System, make: Callable[..., ns.System]) -> dict[str, Callable[[dict[str, Any]], Any]]:
    """The calls in order, each given the results of those before it; ``make`` makes the system with another load."""
    q, w = next(iter(s.states)), s.values["w"]
    v = f"v_{q}"
    some = np.linspace(0.95 * w, 1.05 * w, 5)
    near = 0.03 if len(s.states) < 10 else 0.0003
    plane = {"w": some[:3], "F": np.array([0.9, 1.0]) * s.values["F"]}
    clock = np.arange(0.0, 20.0, 0.05)

    def fit(found: dict[str, Any]) -> Any:
        run = ns.simulate(s, duration=20.0, samples=clock, start={q: 0.1})
        noisy = np.interp(clock, run.time, run.u.sel(state=q)) + 1e-4 * np.random.default_rng(1).normal(size=len(clock))
        guess = s.with_parameters(mu=0.9 * s.values["mu"])
        return ns.fit(guess, {q: (clock, noisy)}, ["mu"], start={q: 0.1}, tries=1, **QUIET)

    return {
        "simulate": lambda _: ns.simulate(s, periods=50),
        "poincare": lambda _: ns.poincare(s, n=200, transient=100),
        "sweep": lambda _: ns.sweep(s, "w", some, transient=100, keep=20, **QUIET),
        "frequency_response": lambda _: ns.frequency_response(s, some, parameter="w", **QUIET),
        "amplitude_spectrum": lambda _: ns.amplitude_spectrum(s, **QUIET),
        "chart": lambda _: ns.chart(s, plane, transient=100, **QUIET),
        "basins": lambda _: ns.basins(s, {q: np.linspace(-0.1, 0.1, 3), v: np.linspace(-1, 1, 3)}, **QUIET),
        "basin_fractions": lambda _: ns.basin_fractions(s, "w", [w], n_starts=8, box={q: (-0.1, 0.1)}, seed=1, **QUIET),
        "lyapunov": lambda _: ns.lyapunov(s, periods=200, transient=100, **QUIET),
        "sensitivity": lambda _: ns.sensitivity(s, periods=2, parameters=["mu", "F"]),
        "find_orbit": lambda _: ns.find_orbit(s),
        "continue_orbit": lambda found: ns.continue_orbit(found["find_orbit"], "w", ((1 - near) * w, (1 + near) * w)),
        "special_points": lambda found: ns.special_points(found["continue_orbit"]),
        "continue_equilibrium": lambda _: ns.continue_equilibrium(make(lambda t, p: p.F), "F", (0.0, 2.0)),
        "bifurcation_diagram": lambda _: ns.bifurcation_diagram(s, "w", ((1 - near) * w, (1 + near) * w), **QUIET),
        "fit": fit,
    }


def main(names: list[str]) -> None:
    warnings.simplefilter("ignore")
    for name, make in {"friction": friction, "rest": rest, "six": six, "fifty": fifty, "rubbing": rubbing}.items():
        if names and name not in names:
            continue
        begun = time.perf_counter()
        system = make()
        print(f"{name}: {len(system.modes)} modes, made in {time.perf_counter() - begun:.2f} s")
        found: dict[str, Any] = {}
        for verb, call in verbs(system, make).items():
            times: list[float] = []
            if name in ("fifty", "rubbing") and verb not in LARGE:
                continue
            try:
                for _ in range(2):
                    begun = time.perf_counter()
                    found[verb] = call(found)
                    times.append(time.perf_counter() - begun)
                print(f"  {verb:22s} {times[0]:8.2f} {times[1]:8.2f} s", flush=True)
            except Exception as error:
                print(f"  {verb:22s} {type(error).__name__}: {str(error)[:150]}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
