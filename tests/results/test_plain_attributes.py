"""Plain attributes of saved files: parameters, units and states for readers without this package."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

TOLD = {
    "nonsmooth_system": "discontinuous support",
    "nonsmooth_verb": "sweep",
    "nonsmooth_version": ns.__version__,
    "nonsmooth_parameters": "m = 0.838 kg, k = 8.47 N/m, k_s = 1210 N/m, c = 0.87 N s/m, c_s = 0.6 N s/m, "
    "g = 0.02 m, omega = 3.69 rad/s",
    "nonsmooth_states": "x (m), v (m/s)",
}


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> tuple[xr.Dataset, Path]:
    result = ns.sweep(ns.models.discontinuous_support(g=0.02), "rho", [0.1, 0.2], keep=4, progress=False)
    return result, ns.save(result, tmp_path_factory.mktemp("plain") / "sweep.nc")


def test_h5py_reads_them(saved) -> None:
    with h5py.File(saved[1]) as file:
        assert {name: file.attrs[name] for name in TOLD} == TOLD
        assert file["rho"].attrs["units"] == "N"
        assert file["omega"].attrs["units"] == "rad/s"
        assert float(file["omega"][()]) == 3.69


def test_xarray_reads_them_in_a_process_without_nonsmooth(saved) -> None:
    code = (
        "import json, sys, xarray\n"
        f"data = xarray.open_dataset({str(saved[1])!r}, engine='h5netcdf')\n"
        "assert 'nonsmooth' not in sys.modules\n"
        "print(json.dumps([{k: v for k, v in data.attrs.items() if k != 'nonsmooth'}, float(data.maximum[1, 0])]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    told, value = json.loads(done.stdout)
    assert told == TOLD
    assert value == float(saved[0].maximum[1, 0])


@pytest.mark.skipif(importlib.util.find_spec("netCDF4") is None, reason="netCDF4 is not installed")
def test_netcdf4_reads_them(saved) -> None:
    import netCDF4

    with netCDF4.Dataset(saved[1]) as file:
        assert {name: file.getncattr(name) for name in TOLD} == TOLD


def test_a_result_read_back_does_not_have_them(saved) -> None:
    result, path = saved
    again = ns.load(path)
    assert again.identical(result)
    assert not [name for name in again.attrs if str(name).startswith("nonsmooth_")]
    assert np.array_equal(again.section, result.section)


def test_a_unit_keeps_its_last_digit(tmp_path: Path) -> None:
    system = ns.mechanical(1.0, 0.1, "k", parameters={"k": (2.0, "N m^-1"), "w": 1.0}, coordinates={"q": "m"})
    ns.save(ns.simulate(system, duration=1.0, start={"q": 1.0}), tmp_path / "run.nc")
    with h5py.File(tmp_path / "run.nc") as file:
        assert file.attrs["nonsmooth_parameters"] == "k = 2 N m^-1, w = 1"
