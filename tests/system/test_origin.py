"""From a result back to its system."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.results.provenance import provenance


def oscillator() -> ns.System:
    return ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045)


def test_a_result_and_its_file_give_the_system_back(tmp_path: Path) -> None:
    system = oscillator().smoothed(2e-4)
    run = ns.simulate(system, periods=1, method="rkf45", rtol=1e-6)
    assert ns.system_of(run) == system
    assert ns.system_of(ns.load(ns.save(run, tmp_path / "run.nc"))) == system


def test_one_point_of_a_sweep_gives_the_system_at_that_point() -> None:
    diagram = ns.sweep(oscillator(), "rho", [0.40, 0.45], transient=5, keep=2, progress=False)
    assert ns.system_of(diagram) == oscillator()  # rho varies: it keeps what the system had
    assert ns.system_of(diagram.sel(rho=0.40)) == oscillator().with_parameters(rho=0.40)


def test_an_orbit_is_a_result_too() -> None:
    orbit = ns.find_orbit(oscillator())
    assert ns.system_of(orbit) == orbit.system == ns.system_of(orbit.to_dataset())


def test_what_holds_no_system_is_refused() -> None:
    with pytest.raises(TypeError, match="takes a result .* not dict"):
        ns.system_of({})
    with pytest.raises(ValueError, match="no attribute 'nonsmooth'"):
        ns.system_of(xr.Dataset({"a": ("b", np.zeros(3))}))
    with pytest.raises(ValueError, match="of 'identify'.* holds none"):
        ns.system_of(ns.ParameterSet({}, np.zeros((0, 0))).to_dataset())


def test_a_parameter_lost_as_nan_keeps_its_recorded_value() -> None:
    from nonsmooth.results.labels import labels_of

    system = oscillator()
    bare = xr.Dataset(coords={"rho": np.nan}, attrs=provenance(labels_of(system), "chart", {}, method="exact"))
    assert ns.system_of(bare) == system
