"""Sessions that cannot be right: each is an error, or ends with a named anomaly, or its numbers are right."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.cli.identify import said
from nonsmooth.recordings import Recording
from nonsmooth_savi2007.rig import VirtualRig

TRUE = ("m", "k", "k_s", "c", "c_s")
LEVEL = 0.9999
STATED = ("crank_length", "gap", "voltage", "direction")


@dataclass
class Made:
    """A session in memory: runs by procedure, each with its sensors and settings, and the apparatus."""

    rig: VirtualRig
    runs: dict[str, list[tuple[dict[str, Any], dict[str, Any]]]]
    apparatus: dict[str, Any] = field(default_factory=dict)

    def copy(self) -> Made:
        return Made(
            self.rig, {p: [(dict(s), dict(t)) for s, t in rows] for p, rows in self.runs.items()}, dict(self.apparatus)
        )

    def identify(self) -> ns.ParameterSet:
        given = {}
        for procedure, rows in self.runs.items():
            sensors = {f"Run #{i + 1}": row[0] for i, row in enumerate(rows)}
            recording = Recording.from_runs(sensors, synthetic=True)
            given[procedure] = [(recording, f"Run #{i + 1}", row[1]) for i, row in enumerate(rows)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ns.identify(given, apparatus=self.apparatus)


def session(seed: int) -> Made:
    """Springs, support, taps, drop, response and contact of a virtual rig, few runs of each."""
    rig = VirtualRig(seed)
    made = {
        "springs": rig.springs(n=2),
        "support": rig.support(n=2),
        "impulse": rig.impulse(velocities=(0.5, -0.35, 0.2)),
        "drop": rig.drop(n=2),
        "contact": rig.contact(regimes=((11.15, 0.039), (6.0, 0.0165), (8.0, 0.03))),
        "response": rig.response(voltages=tuple(np.linspace(3.0, 7.3, 8).round(3).tolist())),
    }
    runs = {}
    for procedure, recording in made.items():
        runs[procedure] = [
            (
                {name: node.to_dataset() for name, node in recording.tree[run].children.items()},
                {k: v for k, v in recording.tree[run].attrs.items() if k in STATED},
            )
            for run in recording.runs
        ]
    t = rig.truth
    known = {
        "distance_per_turn": 0.0789,
        "counts_per_turn": 1440,
        "force_gain_limit": 0.01,
        "force_resolution": 0.03,
        "mass": (t["m"], 0.001),
        "test_mass": (t["test_mass"], 0.001),
        "string_length": (t["string_length"], 0.005),
    }
    return Made(rig, runs, known)


@pytest.fixture(scope="module")
def sane() -> Made:
    return session(3)


def settings(name: str, factor: float, *procedures: str, every: int = 1) -> Callable[[Made], None]:
    """A setting written down with a factor too much."""

    def change(made: Made) -> None:
        for procedure in procedures:
            for _, stated in made.runs[procedure][::every]:
                stated[name] *= factor

    return change


def apparatus(name: str, factor: float) -> Callable[[Made], None]:
    def change(made: Made) -> None:
        value = made.apparatus[name]
        made.apparatus[name] = (value[0] * factor, value[1]) if isinstance(value, tuple) else value * factor

    return change


def channel(name: str, change: Callable[[Any], Any], *procedures: str) -> Callable[[Made], None]:
    """Change the readings of a channel of these procedures."""

    def changed(made: Made) -> None:
        for procedure in procedures:
            for sensors, _ in made.runs[procedure]:
                for key, dataset in sensors.items():
                    if name in dataset:
                        sensors[key] = dataset.assign({name: dataset[name].copy(data=change(dataset[name].values))})

    return changed


def clock(factor: float, *procedures: str) -> Callable[[Made], None]:
    """The time labelled in another unit."""

    def changed(made: Made) -> None:
        for procedure in procedures or tuple(made.runs):
            for sensors, _ in made.runs[procedure]:
                for key, dataset in sensors.items():
                    time = dataset["time"]
                    sensors[key] = dataset.assign_coords(time=time.copy(data=time.values * factor))

    return changed


def exchanged(one: str, other: str) -> Callable[[Made], None]:
    """The files of two procedures under each other's name."""

    def changed(made: Made) -> None:
        first, second = made.runs[one], made.runs[other]
        stated = first[0][1], second[0][1]
        made.runs[one] = [(sensors, dict(stated[0])) for sensors, _ in second]
        made.runs[other] = [(sensors, dict(stated[1])) for sensors, _ in first]

    return changed


def swapped_columns(made: Made) -> None:
    for sensors, _ in made.runs["springs"]:
        for key, dataset in sensors.items():
            angle, force = dataset["Angle"], dataset["Force"]
            sensors[key] = dataset.assign(Angle=angle.copy(data=force.values), Force=force.copy(data=angle.values))


def turns(factor: float, *procedures: str) -> Callable[[Made], None]:
    """A photogate that sees every second turn (2), or each turn twice (0.5)."""

    def changed(made: Made) -> None:
        for procedure in procedures:
            for sensors, _ in made.runs[procedure]:
                gate = sensors["Turn"]
                time = gate["time"].values
                at = np.interp(np.arange(0, len(time) - 1 + 1e-9, factor), np.arange(len(time)), time)
                sensors["Turn"] = (
                    ns.Recording.from_runs(
                        {"a": {"Turn": gate.isel(time=np.zeros(len(at), int)).assign_coords(time=at)}}, synthetic=True
                    )
                    .tree["a/Turn"]
                    .to_dataset()
                )

    return changed


def masses_exchanged(made: Made) -> None:
    known = made.apparatus
    known["mass"], known["test_mass"] = known["test_mass"], known["mass"]


def taps_of_another_rig(made: Made) -> None:
    made.runs["impulse"] = session(8).runs["impulse"]


def copied(made: Made) -> None:
    made.runs["support"] = made.runs["springs"]


def cranks_exchanged(made: Made) -> None:
    lengths = {0.0165: 0.035, 0.035: 0.0165}
    for _, stated in made.runs["response"]:
        stated["crank_length"] = lengths[stated["crank_length"]]


def driven_for_taps(made: Made) -> None:
    made.runs["impulse"] = [({"Angle": sensors["Angle"]}, {}) for sensors, _ in made.runs["response"][5:8]]


def one_gap_in_mm(made: Made) -> None:
    for _, stated in made.runs["contact"][1:]:
        stated["gap"] *= 1000


ABSURD: Mapping[str, Callable[[Made], None]] = {
    "cranks of 16.5 and 39 m": settings("crank_length", 1000, "response", "contact"),
    "a gap of 1.8 m": settings("gap", 1000, "contact"),
    "a gap of 1.8 m in all runs but one": one_gap_in_mm,
    "time labelled ms": clock(1e-3),
    "time of the taps labelled ms": clock(1e-3, "impulse"),
    "time of the pulls labelled ms": clock(1e-3, "springs"),
    "angle and force exchanged": swapped_columns,
    "files of taps and drop exchanged": exchanged("impulse", "drop"),
    "files of springs and support exchanged": exchanged("springs", "support"),
    "springs in place of the support": copied,
    "a constant force": channel("Force", lambda v: 0 * v + 1.2, "springs"),
    "a constant angle": channel("Angle", lambda v: 0 * v, "response"),
    "a wheel 1.4 % wrong": apparatus("distance_per_turn", 1.014),
    "radius for circumference": apparatus("distance_per_turn", 1 / (2 * np.pi)),
    "a mass 7 % wrong": apparatus("mass", 1.07),
    "a mass in g": apparatus("mass", 1000),
    "a test mass 7 % wrong": apparatus("test_mass", 0.93),
    "masses exchanged": masses_exchanged,
    "degrees labelled rad": channel("Angle", np.rad2deg, "springs", "impulse", "response", "contact"),
    "force in g labelled N": channel("Force", lambda v: v * 102.0, "springs", "support"),
    "diameters for cranks": settings("crank_length", 2, "response", "contact"),
    "crank lengths exchanged": cranks_exchanged,
    "each turn seen twice": turns(0.5, "response", "contact"),
    "every second turn": turns(2.0, "response", "contact"),
    "taps of another rig": taps_of_another_rig,
    "driven motion for taps": driven_for_taps,
}


def wrong(found: ns.ParameterSet, truth: Mapping[str, float]) -> list[str]:
    """The parameters that are off by more than their interval."""
    return [name for name in TRUE if name in found and not _inside(found.interval(name, LEVEL), truth[name])]


def _inside(interval: tuple[float, float], value: float) -> bool:
    return interval[0] <= value <= interval[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", ABSURD)
def test_no_absurd_session_ends_well_with_a_wrong_number(sane: Made, name: str) -> None:
    made = sane.copy()
    ABSURD[name](made)
    try:
        found = made.identify()
    except (ValueError, ns.SolveError) as error:
        sentence = str(error)
    else:
        sentence = "; ".join(found.anomalies)
        assert said(found) == 3 or not wrong(found, made.rig.truth)
    print(f"{name}: {sentence}")
    assert not sentence or (len(sentence) > 60 and "nan" not in sentence)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_session_that_is_right_has_no_anomaly(seed: int) -> None:
    found = session(seed).identify()
    assert said(found) == 0, found.anomalies
    assert not wrong(found, VirtualRig(seed).truth)
