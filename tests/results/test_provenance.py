"""The record in a result is plain data and whole."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
import zlib
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.results import schema
from nonsmooth.results.labels import Labels, QuantityLabel, labels_of
from nonsmooth.results.provenance import ATTRIBUTE, COORDINATE, package_version, provenance, read_provenance
from nonsmooth.results.store import load, save


@dataclass(frozen=True)
class Stroboscope:
    phase: float = 0.0


def test_the_record_holds_the_whole_input(labels: Labels) -> None:
    options = {
        "values": np.array([0.1, 0.2]),
        "section": Stroboscope(0.25),
        "start": None,
        "rtol": np.float64(1e-9),
        "bound": np.inf,
        "direction": "both",
        "keep": np.int64(100),
    }
    record = read_provenance(xr.Dataset(attrs=provenance(labels, "sweep", options, method="exact", seed=7)))
    assert record["version"] == package_version()
    assert record["system"]["text"] == labels.text
    assert record["system"]["parameters"] == {"rho": 0.3, "omega": 1.0, "g": 0.5}
    assert record["options"] == {
        "values": [0.1, 0.2],
        "section": {"type": "Stroboscope", "phase": 0.25},
        "start": None,
        "rtol": 1e-9,
        "bound": "inf",
        "direction": "both",
        "keep": 100,
    }
    assert (record["method"], record["seed"], record["created"]) == ("exact", 7, None)


def test_numbers_survive_exactly(labels: Labels) -> None:
    values = np.random.default_rng(0).normal(size=100) * 10.0 ** np.arange(-50, 50)
    record = read_provenance(xr.Dataset(attrs=provenance(labels, "sweep", {"values": values}, method="exact")))
    assert record["options"]["values"] == values.tolist()


def test_equal_input_gives_equal_records(labels: Labels) -> None:
    once, twice = (provenance(labels, "simulate", {"periods": 3}, method="exact") for _ in range(2))
    assert once == twice
    assert read_provenance(xr.Dataset(attrs=provenance(labels, "simulate", {}, method="exact", date=True)))["created"]


def test_what_is_no_data_is_refused(labels: Labels) -> None:
    with pytest.raises(TypeError, match="function cannot be written down"):
        provenance(labels, "simulate", {"ramps": {"rho": lambda t: t}}, method="exact")


def test_a_dataset_without_a_record_is_refused() -> None:
    with pytest.raises(ValueError, match="no attribute 'nonsmooth'"):
        read_provenance(xr.Dataset())


def test_the_seed_zero_is_a_seed(labels: Labels) -> None:
    """Drawing from seed 0 can be repeated; None says that nothing was drawn."""
    record = read_provenance(xr.Dataset(attrs=provenance(labels, "basins", {}, method="exact", seed=0)))
    assert record["seed"] == 0 and record["seed"] is not None


def chain_of_masses(masses: int) -> ns.System:
    """A chain on springs, clamped at one end, with a stop behind the first mass."""
    places, speeds = [f"x{i}" for i in range(masses)], [f"v{i}" for i in range(masses)]

    def field(t, u, p):
        x = [getattr(u, name) for name in places]
        pull = [p.k * (right - left) for left, right in pairwise([0.0, *x, 0.0])]
        return (*(getattr(u, name) for name in speeds), *((b - a) / p.m for a, b in pairwise(pull)))

    def bounce(t, u, p):
        return (*(getattr(u, name) for name in places), -p.e * u.v0, *(getattr(u, name) for name in speeds[1:]))

    return ns.System(
        states=[*places, *speeds],
        parameters={"k": 1.0, "m": 1.0, "e": 0.8, "g": 0.1},
        modes={"free": field},
        indicators={"stop": lambda t, u, p: u.x0 - p.g},
        transitions=[ns.Transition("free", "free", when="stop > 0", reset=bounce)],
    )


def swept_over(labels: Labels, values: np.ndarray, starts: np.ndarray, **options: object) -> xr.Dataset:
    """A sweep as the verb builds it, for the record it carries."""
    arrays = {"status": np.zeros((1, len(starts), len(values)), np.int8)}
    given = {"parameter": "rho", "values": values, "start": starts, **options}
    return schema.sweep(
        labels,
        provenance(labels, "sweep", given, method="exact"),
        "rho",
        values,
        arrays,
        directions=("up",),
        starts=starts,
        squeeze=("direction",),
    )


def test_the_attribute_is_short_and_its_record_whole() -> None:
    """Twenty masses, 5000 values, 300 initial conditions: 260 kB of JSON."""
    system = chain_of_masses(20)
    labels = replace(labels_of(system), parameters={"rho": QuantityLabel("N", "", 0.3)})
    rng = np.random.default_rng(0)
    values, starts = rng.normal(size=5000), rng.normal(size=(300, 40))
    result = swept_over(labels, values, starts)
    assert len(result.attrs[ATTRIBUTE]) <= 2000
    assert COORDINATE not in result.coords
    record = read_provenance(result)
    assert record["options"] == {"parameter": "rho", "values": values.tolist(), "start": starts.tolist()}
    assert record["system"]["text"] == system.to_text()
    assert record["system"]["parameters"] == {"rho": 0.3}


def test_an_option_whose_coordinate_was_cut_stays_a_reference(labels: Labels) -> None:
    """The values that are left are not those of the call, and are not passed off as such."""
    values, starts = np.linspace(0.1, 0.9, 33), np.zeros((1, 2))
    result = swept_over(labels, values, starts)
    assert read_provenance(result)["options"]["values"] == values.tolist()
    for other in (result.isel(rho=slice(1, None)), result.sortby("rho", ascending=False), result.drop_vars("rho")):
        assert read_provenance(other)["options"]["values"]["coordinate"] == "rho"


@pytest.mark.parametrize("ending", ["nc", "zarr"])
def test_a_record_too_long_for_the_attribute_is_a_coordinate(labels: Labels, ending: str, tmp_path: Path) -> None:
    weights = np.random.default_rng(1).normal(size=1000)
    result = swept_over(labels, np.linspace(0, 1, 5), np.zeros((1, 2)), weights=weights)
    assert len(result.attrs[ATTRIBUTE]) <= 2000
    assert read_provenance(result)["options"]["weights"] == weights.tolist()
    back = load(save(result, tmp_path / f"long.{ending}"))
    assert read_provenance(back) == read_provenance(result)
    with pytest.raises(ValueError, match="'provenance', which has been dropped"):
        read_provenance(result.drop_vars(COORDINATE))


def test_a_record_from_before_it_was_compressed_is_read() -> None:
    """As version 0.1.0 wrote it until then: all in plain JSON."""
    system = {"name": "s", "text": "the text", "parameters": {"k": 2.0}}
    options = {"values": [0.1, 0.2]}
    record = {
        "version": "0.1.0",
        "verb": "sweep",
        "system": system,
        "options": options,
        "method": "exact",
        "seed": None,
        "created": None,
    }
    assert read_provenance(xr.Dataset(attrs={ATTRIBUTE: json.dumps(record)})) == record


def packed(data: bytes, cut: int | None = None) -> str:
    return base64.b64encode(zlib.compress(data)[:cut]).decode()


@pytest.mark.parametrize(
    "text",
    [
        "!!",
        base64.b64encode(b"no zlib").decode(),
        packed(b'{"text": "all of it", "parameters": {}}', -2),
        packed(b"[1]"),
        packed(bytes(2**26 + 1)),
    ],
)
def test_a_compressed_system_that_is_damaged_or_too_large_is_refused(text: str) -> None:
    record = json.dumps({"version": "0.1.0", "system": {"name": "s", "zlib": text}})
    with pytest.raises(ValueError, match="compressed system"):
        read_provenance(xr.Dataset(attrs={ATTRIBUTE: record}))


NOT_INSTALLED = """
from importlib import metadata
def version(name, real=metadata.version):
    if name == "nonsmooth":
        raise metadata.PackageNotFoundError(name)
    return real(name)
metadata.version = version

import json, pathlib, sys
import nonsmooth as ns
run = ns.simulate(ns.models.discontinuous_support(), periods=1)
ns.save(run, pathlib.Path(sys.argv[1]) / "run.nc")
print(ns.__version__, json.loads(ns.load(pathlib.Path(sys.argv[1]) / "run.nc").attrs["nonsmooth"])["version"])
"""


#: The same without a run, its libraries and its file.
RECORDED = """
from nonsmooth.results.labels import Labels, QuantityLabel
from nonsmooth.results.provenance import provenance
one = {"x": QuantityLabel("m")}
labels = Labels("a", one, {}, ("m",), (), (), {}, "text")
print(ns.__version__, json.loads(provenance(labels, "simulate", {}, method="exact")["nonsmooth"])["version"])
"""


@pytest.mark.parametrize(
    "code",
    [NOT_INSTALLED.partition("run = ")[0] + RECORDED, pytest.param(NOT_INSTALLED, marks=pytest.mark.slow)],
    ids=["record", "run"],
)
def test_files_that_were_copied_without_being_installed_work(code: str, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["unknown", "unknown"]


def test_the_inputs_of_a_run_are_recorded_by_their_ends_and_not_as_arrays() -> None:
    cart = ns.mechanical(2.0, 0.0, 0.0, forcing={"q": lambda t, p: p.force}, inputs={"force": "N"})
    pushed = ns.Input([0.0, 1.0, 2.5], [4.0, 0.0, -4.0], between="steps", delay=0.25)
    run = ns.simulate(cart, duration=3.0, inputs={"force": pushed})
    recorded = json.loads(run.attrs["nonsmooth"])["options"]["inputs"]
    assert recorded == {"force": {"samples": 3, "first": 0.0, "last": 2.5, "between": "steps", "delay": 0.25}}
