"""Every verb once, on small work: run by ``tests/versions.py`` with the oldest and the newest versions of libraries.

Each call is held to something known beforehand: a closed form, or what two verbs must agree on.
"""

from __future__ import annotations

import importlib.metadata
import sys
import tempfile
import threading
import time
import urllib.request
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import nonsmooth as ns

QUIET: dict[str, Any] = {"progress": False}
FEW: dict[str, Any] = {**QUIET, "transient": 60, "keep": 20}
LIBRARIES = ("numpy", "scipy", "sympy", "numba", "xarray", "h5netcdf", "h5py", "matplotlib", "tqdm", "zarr", "bokeh")
WALLS = {"x": (-0.02, 0.02), "v": (-0.2, 0.2)}


def steps(folder: Path) -> dict[str, Callable[[dict[str, Any]], Any]]:
    """The calls in order, by the verb; each is given the results of those before it."""
    s = ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.0)
    free = {"x": 0.01, "v": 0.0}
    rng = np.random.default_rng(1)
    time_ = np.arange(0.0, 10.0, 0.02)
    decay = np.exp(-0.1 * time_) * np.cos(np.sqrt(3.99) * time_)  # of x'' + 0.2 x' + 4 x = 0 from (1, -0.1)
    noisy = decay + 1e-3 * rng.standard_normal(time_.size)

    def mechanical(_: Any) -> ns.System:
        parameters = {"m": 1.0, "c": 0.2, "k": 4.0}
        return ns.mechanical(lambda p: p.m, lambda p: p.c, lambda p: p.k, parameters=parameters, coordinates=["q"])

    def fit(found: dict[str, Any]) -> Any:
        start = found["mechanical"].with_parameters(k=3.5)
        return ns.fit(start, {"q": (time_, noisy)}, ["k", "c"], tries=2, **QUIET)

    def select_model(found: dict[str, Any]) -> Any:
        system = found["mechanical"]
        models = {"true": (system, ["k", "c"]), "undamped": (system.with_parameters(c=0.0), ["k"])}
        return ns.select_model(models, {"q": (time_, noisy)}, folds=2, tries=1, **QUIET)

    def propagate(found: dict[str, Any]) -> Any:
        force = {"settings": {"rho": (0.14, 1e-3)}, "draws": 3}
        return ns.propagate({}, ns.sweep, s, "omega", [4.5], start=free, **force, **FEW)

    def plan_experiment(found: dict[str, Any]) -> Any:
        runs = {"short": {"duration": 2.0, "samples": 50, "start": {"q": 1.0}}}
        return ns.plan_experiment(found["mechanical"], runs, ["k", "c"], measured={"q": ns.Sensor(noise=1e-3)})

    def load_recording(_: Any) -> Any:
        lines = [f"{t:.2f},{value:.6f}" for t, value in zip(time_, noisy, strict=True)]
        (folder / "log.csv").write_text("\n".join(["Time (s),q (m)", *lines]))
        return [ns.load_recording(folder / "log.csv"), ns.load_recording(tdms(folder / "log.tdms", time_, noisy))]

    def compare(_: Any) -> Any:
        clock = np.arange(30.0, 60.0, 0.01)
        run = ns.simulate(s, duration=60.0, samples=clock, start=free)
        x = np.interp(clock, run["time"], run["u"].sel(state="x")) + 1e-6 * rng.standard_normal(clock.size)
        return ns.compare({"laser": (clock, x)}, s, channels={"x": "laser"}, settings={"g": 0.02})

    def control_based_continuation(_: Any) -> Any:
        return ns.control_based_continuation(
            ns.SimulatedRig(s, resolution=5.5e-5, start=free),
            "frequency",
            (4.9, 5.1),
            frequency=5.0,
            amplitude=0.14,
            points=2,
            holding=ns.Holding(release=0),
            **QUIET,
        )

    def identify(_: Any) -> Any:
        from nonsmooth_savi2007.rig import VirtualRig

        return ns.identify(str(VirtualRig(1).write_session(folder / "rig", truth=folder / "truth.toml")))

    def smoothing_report(_: Any) -> Any:
        return ns.smoothing_report(s, [1e-5, 1e-4], start=free, **QUIET)

    def equilibrium(_: Any) -> Any:
        valve = ns.models.relief_valve(q=9.0)
        return ns.continue_equilibrium(valve, "q", (8.0, 9.5), start={"y1": 2.0, "y3": 12.0})

    def curve(found: dict[str, Any]) -> Any:
        special = found["special_points"]
        folds = np.flatnonzero(special["kind"].values == "fold")
        return ns.continue_curve(special.isel(special=int(folds[0])), {"omega": (4.0, 7.0), "rho": (0.1, 0.2)})

    def manifolds(found: dict[str, Any]) -> Any:
        branch = found["continue_orbit"]
        unstable = branch.isel(point=np.flatnonzero(branch["stable"].values == 0))
        at = unstable.isel(point=unstable.sizes["point"] // 2)
        saddle = ns.find_orbit(
            s.with_parameters(omega=float(at["omega"])),
            start=at["section"].values,
            period_number=1,
            transient=0,
            **QUIET,
        )
        return ns.manifolds(saddle, length=1.0, distance=0.1)

    def explore(_: Any) -> str:
        heard: list[str] = []
        threading.Thread(target=_served, args=(heard.append,), daemon=True).start()
        end = time.monotonic() + 120
        while not heard and time.monotonic() < end:
            time.sleep(0.1)
        with urllib.request.urlopen(heard[0], timeout=60) as page:
            return str(page.read().decode())

    def chart(_: Any) -> Any:
        from distributed import Client

        work = {"grid": {"rho": [0.14, 0.2], "omega": [4.5, 5.0]}, "start": free, **FEW}
        with Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
            far = ns.chart(s, client=client, store=folder / "chart.zarr", **work)
        return [ns.chart(s, **work), far]

    return {
        "where": lambda _: ns.where(True, 1.0, 2.0),
        "mechanical": mechanical,
        "simulate": lambda _: ns.simulate(s, periods=2, start=free),
        "system_of": lambda found: ns.system_of(found["simulate"]),
        "sensitivity": lambda _: ns.sensitivity(s, periods=1, start=free),
        "poincare": lambda _: ns.poincare(s, n=300, start=free),
        "random_starts": lambda _: ns.random_starts(4, [-0.1, -0.1], [0.1, 0.1], seed=1),
        "amplitude_spectrum": lambda _: ns.amplitude_spectrum(s, periods=16, start=free),
        "sweep": lambda _: ns.sweep(s, "omega", [4.5, 4.8], start=free, **FEW),
        "frequency_response": lambda _: ns.frequency_response(s, [4.5, 4.8], direction="up", start=free, **FEW),
        "lyapunov": lambda _: ns.lyapunov(s, periods=200, start=free, **QUIET),
        "correlation_dimension": lambda _: ns.correlation_dimension(rng.uniform(size=(2000, 1))),
        "zero_one_test": lambda _: ns.zero_one_test(rng.uniform(size=2000)),
        "basins": lambda _: ns.basins(s, {name: np.linspace(*ends, 3) for name, ends in WALLS.items()}, **FEW),
        "basin_fractions": lambda _: ns.basin_fractions(s, "omega", [4.5, 4.6], n_starts=6, box=WALLS, **FEW),
        "chart": chart,
        "bifurcation_diagram": lambda _: ns.bifurcation_diagram(s, "omega", (4.4, 4.6), n=5, start=free, **QUIET),
        "find_orbit": lambda _: ns.find_orbit(s.with_parameters(omega=4.5), start=free, **QUIET),
        "continue_orbit": lambda found: ns.continue_orbit(found["find_orbit"], "omega", (4.0, 7.0)),
        "special_points": lambda found: ns.special_points(found["continue_orbit"]),
        "continue_curve": curve,
        "manifolds": manifolds,
        "continue_equilibrium": equilibrium,
        "smoothing_report": smoothing_report,
        "control_based_continuation": control_based_continuation,
        "load_recording": load_recording,
        "fit": fit,
        "select_model": select_model,
        "propagate": propagate,
        "plan_experiment": plan_experiment,
        "compare": compare,
        "identify": identify,
        "explore": explore,
        "table": lambda found: ns.table(found["simulate"], ["x"], step=0.1, file=folder / "run.csv"),
        "region": lambda found: ns.region(found["sweep"], "abs(x) < 1 and omega < 4.7"),
        "animate": lambda found: ns.animate(found["simulate"], seconds=1, rate=4).save(folder / "run.gif"),
        "save": lambda found: [ns.save(found["sweep"], folder / f"swept{suffix}") for suffix in (".nc", ".zarr")],
        "load": lambda found: [ns.load(path) for path in found["save"]],
    }


def tdms(path: Path, clock: Any, values: Any) -> Path:
    """A recording as LabVIEW writes it."""
    from nptdms import ChannelObject, TdmsWriter

    waveform = {"wf_increment": float(clock[1] - clock[0]), "wf_start_offset": 0.0, "unit_string": "m"}
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("log", "q", values, waveform)])
    return path


def _served(told: Callable[[str], object]) -> None:
    import asyncio

    asyncio.set_event_loop(asyncio.new_event_loop())  # the thread of this one
    ns.explore(port=None, browser=False, told=told)


#: Of a verb a fact that its result must have, given all results.
FACTS: dict[str, Callable[[Any, dict[str, Any]], bool]] = {
    "where": lambda found, _: found == 1.0,
    "simulate": lambda found, _: bool(np.isfinite(found["u"]).all()),
    "system_of": lambda found, _: found == ns.models.discontinuous_support(g=0.02, rho=0.14, omega=5.0),
    "correlation_dimension": lambda found, _: abs(float(found["dimension"]) - 1.0) < 0.1,  # points on a line
    "zero_one_test": lambda found, _: float(found) > 0.9,  # independent numbers
    "sweep": lambda found, _: bool((found["period_number"] == 1).all()),
    "chart": lambda found, _: found[0]["period_number"].identical(found[1]["period_number"]),  # here, and in a cluster
    "find_orbit": lambda found, _: bool(found.stable),
    "continue_orbit": lambda found, _: bool(np.isclose(found["omega"], 4.5).any()),  # where it was found
    "special_points": lambda found, _: "fold" in found["kind"].values,
    "lyapunov": lambda found, _: bool(float(found["exponents"].max()) < 0.0),  # the motion is a stable cycle
    "load_recording": lambda found, _: np.allclose(*(one.channel("q").values for one in found), atol=1e-6),
    "fit": lambda found, _: abs(found["k"] - 4.0) < 0.02,
    "select_model": lambda found, _: float(found["rms"].sel(model="true")) < float(found["rms"].sel(model="undamped")),
    "propagate": lambda found, _: bool((np.ptp(found["maximum_quantiles"].values, axis=0) > 0).any()),
    "plan_experiment": lambda found, _: bool(np.isfinite(found["uncertainty"]).all()),
    "compare": lambda found, _: int(found["measured_period_number"]) == int(found["theory_period_number"]) == 1,
    "control_based_continuation": lambda found, _: found.sizes["point"] == 2,
    "explore": lambda found, _: "nonsmooth explorer" in found,
    "table": lambda found, all_: abs(found["x (m)"][0] - float(all_["simulate"]["u"][0, 0])) < 1e-12,
    "region": lambda found, _: found.values.tolist() == [True, False],
    "load": lambda found, all_: all(one.identical(all_["sweep"]) for one in found),
}


def verbs() -> set[str]:
    """Names of the functions that the package exports, and of the one that its study brings."""
    return {"identify"} | {name for name in ns.__all__ if name.islower() and callable(getattr(ns, name))}


def main() -> int:
    """Call them all; the verbs that failed, each with its error, are printed."""
    wrong = []
    versions = (f"{name} {importlib.metadata.version(name)}" for name in LIBRARIES)
    print(sys.version.split()[0], *versions, flush=True)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found: dict[str, Any] = {}
        for verb, call in steps(Path(folder)).items():
            began = time.monotonic()
            try:
                found[verb] = call(found)
                said = "" if FACTS.get(verb, lambda *_: True)(found[verb], found) else "another result than known"
            except Exception as error:
                said = f"{type(error).__name__}: {error}"
            wrong += [verb] if said else []
            print(f"{verb:28s}{time.monotonic() - began:8.1f} s  {said}", flush=True)
        plot(found, Path(folder))
    print(f"{len(found)} verbs, wrong: {', '.join(wrong) or 'none'}")
    return 1 if wrong else 0


def plot(found: dict[str, Any], folder: Path) -> None:
    """Draw what was computed, into a file."""
    import matplotlib as mpl

    mpl.use("Agg")
    for name, figure in {
        "simulate": ns.plot.time_history,
        "poincare": ns.plot.section,
        "sweep": ns.plot.bifurcation,
        "frequency_response": ns.plot.frequency_response,
        "chart": ns.plot.chart,
        "basins": ns.plot.basins,
        "continue_orbit": ns.plot.branch,
        "manifolds": ns.plot.manifolds,
    }.items():
        ax = figure(found[name][0] if name == "chart" else found[name])
        ax.figure.savefig(folder / f"{name}.png")


if __name__ == "__main__":
    raise SystemExit(main())
