"""Measure what the guide "which method" states: errors and times of the methods, and the smoothed switch against eta.

Run it from anywhere: ``python docs/measure_methods.py``. It takes about a minute on one core and writes
``docs/theory/measured_methods.md`` (the tables, included by the guide) and ``docs/pictures/effect_of_eta.png``.
"""

from __future__ import annotations

import platform
import re
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from make_pictures import keep

import nonsmooth as ns
from nonsmooth.plot.labels import symbol_of

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent / "benchmarks"))

from work import march  # noqa: E402

ETAS = np.array([3e-5, 1e-5, 3e-6, 1e-6])
PAPER = {"method": "rkf45", "rtol": 1e-6}  # with eta = 1e-5
FINE = {"method": "rkf45", "rtol": 1e-11}
PERIODS = 4
COLORS = [ns.plot.COLORS[name] for name in ("first", "second", "third", "fourth", "zone", "muted")]

ORBITS: dict[str, dict[str, float]] = {
    "Fig. 9, omega 4.8 rad/s": {"rho": 0.14, "g": 0.02, "omega": 4.8},
    "Fig. 10, omega 5.2 rad/s": {"rho": 0.16, "g": 0.0145, "omega": 5.2},
    "Fig. 11, rho 0.45 N": {"rho": 0.45, "g": -0.0045, "omega": 3.69},
    "Fig. 11, rho 0.39 N": {"rho": 0.39, "g": -0.0045, "omega": 3.69},
    "Fig. 13, g -1.2 mm": {"rho": 0.33, "g": -0.0012, "omega": 11.15},
    "Fig. 13, g 0.9 mm": {"rho": 0.33, "g": 0.0009, "omega": 11.15},
}


def on_attractor(system: ns.System) -> np.ndarray:
    """The state after 400 periods from rest, by the exact flow."""
    return ns.simulate(system, periods=400, samples=2).u.values[-1]


def end(system: ns.System, start: np.ndarray, **options: Any) -> np.ndarray:
    """The state four periods later."""
    return ns.simulate(system, periods=PERIODS, start=start, samples=2, **options).u.values[-1]


def distance(system: ns.System, u: np.ndarray, truth: np.ndarray) -> float:
    """Euclidean, in units of the states' scale (1 mm and 1 cm/s for the oscillator)."""
    return float(np.linalg.norm((u - truth) / system.scale_vector()))


def seconds(run: Callable[[int], Any], few: int, many: int) -> float:
    """Time of one return: the difference of a long and a short run, so that what a call costs drops out."""
    run(few)
    best = {few: np.inf, many: np.inf}
    for _ in range(5):
        for n in best:
            begin = time.perf_counter()
            run(n)
            best[n] = min(best[n], time.perf_counter() - begin)
    return (best[many] - best[few]) / (many - few)


def short(value: float, form: str = ".1e") -> str:
    """A number in the tables, without the zero in its exponent."""
    return f"{value:{form}}".replace("e-0", "e-")


def oscillator_table() -> list[str]:
    """Error after four periods and time per period of every method, on an orbit with four contacts in two periods."""
    system = ns.models.discontinuous_support(**ORBITS["Fig. 11, rho 0.39 N"])
    start = on_attractor(system)
    exact = end(system, start)
    smooth = system.smoothed(eta=1e-5)
    settings: list[tuple[str, ns.System, Mapping[str, Any], int]] = [
        ("exact", system, {"method": "exact"}, 4000),
        ("taylor, rtol 1e-14", system, {"method": "taylor", "rtol": 1e-14}, 400),
        ("taylor, rtol 1e-9", system, {"method": "taylor", "rtol": 1e-9}, 400),
        ("rkf45, rtol 1e-12", system, {"method": "rkf45", "rtol": 1e-12}, 200),
        ("rkf45, rtol 1e-9", system, {"method": "rkf45", "rtol": 1e-9}, 400),
        ("rkf45, rtol 1e-6", system, {"method": "rkf45", "rtol": 1e-6}, 400),
        ("smoothed, eta 1e-5: rkf45, rtol 1e-11", smooth, FINE, 200),
        ("smoothed, eta 1e-5: rkf45, rtol 1e-6 (the paper's setting)", smooth, PAPER, 400),
        ("smoothed, eta 1e-5: taylor, rtol 1e-9", smooth, {"method": "taylor", "rtol": 1e-9}, 400),
    ]
    lines = ["| how | difference from the exact flow after 4 periods | microseconds per period |", "|---|--:|--:|"]
    for name, model, options, many in settings:
        error = distance(system, end(model, start, **options), exact)

        def run(n: int, model: ns.System = model, options: Mapping[str, Any] = options) -> Any:
            return march(model, start, n, **options)  # every period, those too in which the motion repeats itself

        cost = seconds(run, many // 10, many)
        shown = "-" if options["method"] == "exact" else short(error)
        lines.append(f"| {name} | {shown} | {1e6 * cost:.3g} |")
    return lines


def valve_table() -> list[str]:
    """The same on a nonlinear system with impacts, per return to the section of maxima."""
    system = ns.models.relief_valve(q=5.0)
    section = ns.Poincare("lift_velocity", rising=False)
    first = {"y1": 0.2, "y2": 0.0, "y3": 10.0}
    start = ns.poincare(system, section=section, n=1, transient=300, start=first, rtol=1e-13).section.values[-1]

    def run(n: int, **options: Any) -> np.ndarray:
        return ns.poincare(system, section=section, n=1, transient=n, start=start, **options).section.values[-1]

    truth = run(10, method="taylor", rtol=1e-14)
    lines = ["| how | difference from taylor at 1e-14 after 11 returns | microseconds per return |", "|---|--:|--:|"]
    for method, rtol in (("taylor", 1e-12), ("taylor", 1e-9), ("rkf45", 1e-12), ("rkf45", 1e-9), ("rkf45", 1e-6)):
        options: dict[str, Any] = {"method": method, "rtol": rtol}
        error = distance(system, run(10, **options), truth)
        cost = seconds(lambda n, options=options: run(n, **options), 100, 1000)
        lines.append(f"| {method}, rtol {short(rtol, 'g')} | {short(error)} | {1e6 * cost:.3g} |")
    return lines


def eta_errors() -> tuple[list[str], dict[str, np.ndarray], dict[str, float]]:
    """Table, errors (over ETAS) and error of the paper's setting, for each orbit."""
    lines = [
        "| orbit | "
        + " | ".join(f"eta {short(eta, 'g')}" for eta in ETAS)
        + " | order | paper's setting | slowest crossing |",
        "|---|" + "--:|" * (len(ETAS) + 3),
    ]
    errors, paper = {}, {}
    for name, parameters in ORBITS.items():
        system = ns.models.discontinuous_support(**parameters)
        start = on_attractor(system)
        run = ns.simulate(system, periods=PERIODS, start=start, samples=2)
        exact, slowest = run.u.values[-1], float(abs(run.u_before.sel(state="v")).min())
        errors[name] = np.array([distance(system, end(system.smoothed(eta), start, **FINE), exact) for eta in ETAS])
        paper[name] = distance(system, end(system.smoothed(1e-5), start, **PAPER), exact)
        order = np.polyfit(np.log(ETAS), np.log(errors[name]), 1)[0]
        row = " | ".join(map(short, errors[name]))
        lines.append(f"| {name} | {row} | {order:.3f} | {short(paper[name])} | {slowest:.3f} m/s |")
    return lines, errors, paper


def grazing(g: float, rho: float = 0.14) -> float:
    """The frequency above resonance at which the motion without contact has the amplitude g: closed form."""
    p = ns.models.discontinuous_support().values
    m, k, c = p["m"], p["k"], p["c"]
    return float(np.sqrt(np.roots([m * m, c * c - 4 * k * m, 4 * k * k - (rho / g) ** 2]).real.max()))


def smoothed_grazing(eta: float, g: float = 0.02, rho: float = 0.14) -> float:
    """The frequency below which the steady motion without contact enters the band, by bisection to 1e-10 rad/s."""
    model = ns.models.discontinuous_support(rho=rho, g=g)
    p = model.values

    def enters(omega: float) -> bool:
        response = rho / (2 * p["k"] - p["m"] * omega**2 + 1j * p["c"] * omega)
        start = [response.real, (1j * omega * response).real]
        system = model.with_parameters(omega=omega).smoothed(eta)
        run = ns.simulate(system, periods=1, start=start, samples=2, method="rkf45", rtol=1e-12)
        return run.sizes["crossing"] > 0

    low, high = grazing(g) - 1e-4, grazing(g) + 1e-2
    while high - low > 1e-10:
        middle = (low + high) / 2
        low, high = (middle, high) if enters(middle) else (low, middle)
    return (low + high) / 2


def grazing_table() -> tuple[list[str], np.ndarray]:
    """Grazing frequencies of the smoothed model of Fig. 9, against the closed forms of the gaps g - eta and g."""
    found = np.array([smoothed_grazing(eta) for eta in ETAS])
    lines = [
        "| eta | smoothed model grazes at | closed form, gap g - eta | closed form, gap g |",
        "|---|---|---|---|",
    ]
    for eta, omega in zip(ETAS, found, strict=True):
        lines.append(f"| {short(eta, 'g')} | {omega:.9f} | {grazing(0.02 - eta):.9f} | {grazing(0.02):.9f} |")
    return lines, found


def draw(errors: Mapping[str, np.ndarray], paper: Mapping[str, float], found: np.ndarray) -> None:
    """Left: error over eta; right: shift of the grazing frequency over eta."""
    with ns.plot.journal():
        figure, (left, right) = plt.subplots(1, 2, figsize=(6.85, 3.6))
        widths = 1e6 * ETAS  # in micrometres
        for (name, values), color, mark in zip(errors.items(), COLORS, "osD^vP", strict=True):
            label = re.sub(r"(omega|rho|g) (?=[-\d])", lambda found: f"{symbol_of(found[1])} = ", name)
            left.loglog(widths, values, f"{mark}-", color=color, label=label, markersize=3)
            left.loglog(10, paper[name], "x", color=color, markersize=5)
        left.plot([], [], "x", color="black", markersize=5, label="rtol $10^{-6}$, as in the paper's setting")
        guide = min(values[-1] for values in errors.values()) / 3
        left.loglog(widths, guide * (ETAS / ETAS[-1]) ** 2, ":", color="0.4", label="slope 2")
        left.set_ylabel(r"error, $[(\Delta x / 1\,\mathrm{mm})^2 + (\Delta v / 10\,\mathrm{mm/s})^2]^{1/2}$")
        right.loglog(widths, found - grazing(0.02), "o", markersize=3, label="smoothed model")
        line = np.geomspace(ETAS.min(), ETAS.max(), 50)
        right.loglog(
            1e6 * line,
            [grazing(0.02 - eta) - grazing(0.02) for eta in line],
            "-",
            color="0.4",
            zorder=1,
            label=r"closed form, gap $g - \eta$",
        )
        right.set_ylabel("shift of the grazing frequency (rad/s)")
        for ax in (left, right):
            ax.set_xlabel("half width of the band, $\\eta$ (\N{MICRO SIGN}m)")
            ax.xaxis.set_major_formatter("{x:g}")
            ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        keep(figure, "effect_of_eta")


def main() -> None:
    """Measure, write the tables, draw the picture."""
    mpl.use("Agg")
    (DOCS / "pictures").mkdir(exist_ok=True)
    rows, errors, paper = eta_errors()
    graze, found = grazing_table()
    draw(errors, paper, found)
    place = f"{platform.machine()}, Python {platform.python_version()}, one core"
    parts = [
        f"*Written by `python docs/measure_methods.py` ({place}). Times are the best of five runs.*",
        "**The paper's oscillator**, Fig. 11 at rho = 0.39 N, errors in units of 1 mm and 1 cm/s:",
        "\n".join(oscillator_table()),
        "**The relief valve** at q = 5, which hits its seat once per return:",
        "\n".join(valve_table()),
        "**The smoothed switch** after four periods, by RKF45 at rtol 1e-11, and in the paper's setting (rtol 1e-6):",
        "\n".join(rows),
        "**Grazing of the smoothed switch**, Fig. 9 above resonance, in rad/s:",
        "\n".join(graze),
    ]
    (DOCS / "theory" / "measured_methods.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    print("\n\n".join(parts))


if __name__ == "__main__":
    main()
