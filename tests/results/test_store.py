"""Saved and loaded, a result is the same; damaged and foreign files are refused by name."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.errors import DataFileError
from nonsmooth.results.store import load, save

FORMATS = ["nc", "zarr"]
RESULTS = ["trajectory", "swept", "responded", "points"]


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("name", RESULTS)
def test_nothing_is_lost(name: str, ending: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    result: xr.Dataset = request.getfixturevalue(name)
    back = load(save(result, tmp_path / f"result.{ending}"))
    xr.testing.assert_identical(back, result)
    for key, variable in result.variables.items():
        assert back[key].dtype == variable.dtype, key
        if "flag_values" in variable.attrs:
            assert back[key].attrs["flag_values"].dtype == variable.dtype
    again = load(save(back, tmp_path / f"again.{ending}"))
    xr.testing.assert_identical(again, result)


def test_one_state_of_a_result_is_saved_and_drawing_it_says_what_is_missing(
    trajectory: xr.Dataset, tmp_path: Path
) -> None:
    name = str(trajectory["state"].values[0])
    one = trajectory.sel(state=name)
    xr.testing.assert_identical(load(save(one, tmp_path / "one.nc")), one)
    with pytest.raises(ValueError, match=rf"one state was taken out of this result.*sel\(state=\['{name}'\]\)"):
        ns.plot.time_history(one)


@pytest.mark.parametrize("ending", FORMATS)
def test_complex_variables_come_back_bit_by_bit(ending: str, swept: xr.Dataset, tmp_path: Path) -> None:
    values = np.array([[1 + 2j, complex(np.nan, 1)], [complex(2, np.inf), 0j]] * 5)[:5]
    result = swept.assign(floquet_multipliers=(("rho", "multiplier"), values, {"long_name": "multipliers"}))
    back = load(save(result, tmp_path / f"r.{ending}"))
    found = back["floquet_multipliers"]
    assert found.dims == ("rho", "multiplier")
    assert found.attrs == {"long_name": "multipliers"}
    np.testing.assert_array_equal(found.values.view(np.int64), values.view(np.int64))


@pytest.mark.parametrize("ending", FORMATS)
def test_saving_again_replaces(ending: str, swept: xr.Dataset, points: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / f"r.{ending}"
    save(swept, path)
    save(points, path)
    xr.testing.assert_identical(load(path), points)
    assert [item.name for item in tmp_path.iterdir()] == [path.name]


def test_a_truncated_netcdf_is_named(trajectory: xr.Dataset, tmp_path: Path) -> None:
    path = save(trajectory, tmp_path / "cut.nc")
    whole = path.read_bytes()
    for share in (0.95, 0.5, 0.01, 0.0):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(DataFileError, match=r"cut\.nc.*damaged or cut short.*expected"):
            load(path)


def test_a_zarr_store_with_a_missing_chunk_is_named(trajectory: xr.Dataset, tmp_path: Path) -> None:
    path = save(trajectory, tmp_path / "cut.zarr")
    next(item for item in (path / "mode").iterdir() if not item.name.startswith(".")).unlink()
    with pytest.raises(DataFileError, match=r"cut\.zarr: 1 of 1 chunks of 'mode' are missing"):
        load(path)
    shutil.rmtree(path / "u")
    with pytest.raises(DataFileError, match=r"cut\.zarr"):
        load(path)


def test_foreign_and_missing_files_are_named(tmp_path: Path) -> None:
    foreign = tmp_path / "weather.nc"
    xr.Dataset({"rain": ("day", [1.0])}).to_netcdf(foreign)
    with pytest.raises(DataFileError, match=r"weather\.nc.*not a result of this package"):
        load(foreign)
    (tmp_path / "text.nc").write_text("no data")
    with pytest.raises(DataFileError, match=r"text\.nc"):
        load(tmp_path / "text.nc")
    (tmp_path / "folder.zarr").mkdir()
    with pytest.raises(DataFileError, match=r"folder\.zarr: is not a Zarr store"):
        load(tmp_path / "folder.zarr")
    for ending in FORMATS:
        with pytest.raises(DataFileError, match="no such file"):
            load(tmp_path / f"none.{ending}")


def test_wrong_arguments_are_refused_before_anything_is_written(swept: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"must end in \.nc .* or \.zarr"):
        save(swept, tmp_path / "result.csv")
    with pytest.raises(TypeError, match=r"xarray\.Dataset"):
        save(swept["section"], tmp_path / "result.nc")
    with pytest.raises(DataFileError, match="does not exist"):
        save(swept, tmp_path / "nowhere" / "result.nc")
    with pytest.raises(TypeError, match=r"attribute 'converged' .* bool"):
        save(swept.assign_attrs(converged=True), tmp_path / "result.nc")
    (tmp_path / "mine.zarr").mkdir()
    (tmp_path / "mine.zarr" / "letter.txt").write_text("keep")
    with pytest.raises(DataFileError, match="left alone"):
        save(swept, tmp_path / "mine.zarr")
    assert (tmp_path / "mine.zarr" / "letter.txt").read_text() == "keep"


def test_other_programs_see_units_and_flags(swept: xr.Dataset, tmp_path: Path) -> None:
    with h5netcdf.File(save(swept, tmp_path / "r.nc")) as plain:
        assert plain["rho"].attrs["units"] == "N"
        assert plain["status"].dtype == np.int8
        assert plain["status"].attrs["flag_meanings"].split()[0] == "ok"
