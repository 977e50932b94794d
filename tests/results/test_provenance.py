"""The record in a result is plain data and whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import package_version, provenance, read_provenance


@dataclass(frozen=True)
class Stroboscope:
    phase: float = 0.0


def test_the_record_holds_the_whole_input(labels: Labels) -> None:
    options = {"values": np.array([0.1, 0.2]), "section": Stroboscope(0.25), "start": None, "rtol": np.float64(1e-9),
               "bound": np.inf, "direction": "both", "keep": np.int64(100)}  # fmt: skip
    record = read_provenance(xr.Dataset(attrs=provenance(labels, "sweep", options, method="exact", seed=7)))
    assert record["version"] == package_version()
    assert record["system"]["text"] == labels.text
    assert record["system"]["parameters"] == {"rho": 0.3, "omega": 1.0, "g": 0.5}
    assert record["options"] == {
        "values": [0.1, 0.2], "section": {"type": "Stroboscope", "phase": 0.25}, "start": None, "rtol": 1e-9,
        "bound": "inf", "direction": "both", "keep": 100,
    }  # fmt: skip
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
