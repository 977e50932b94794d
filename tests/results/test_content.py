"""The hash of a result's content: the same through every format, another for every change, and checked by load."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import nonsmooth as ns
from nonsmooth.errors import DataFileError
from nonsmooth.results import memory
from nonsmooth.results.store import load, save
from nonsmooth.results.whole import content, digest, seal, sealed, stamp, unstamp

FORMATS = ["nc", "zarr"]
RECORD = '{"version": "0.1.0", "verb": "test"}'


def hash_of(result: xr.Dataset) -> str:
    return digest(content(result.attrs, [(str(n), n in result.coords, v) for n, v in result.variables.items()]))


def hash_in(path: Path) -> str:
    """As any other program finds it."""
    if path.suffix == ".nc":
        with h5py.File(path) as file:
            text = file.attrs["nonsmooth"]
    else:
        text = json.loads((path / ".zattrs").read_text())["nonsmooth"]
    found: str = json.loads(text)["sha256"]
    return found


letters = st.characters(codec="utf-8", exclude_characters="\0")
words = st.text(letters, max_size=6)
numbers = st.one_of(st.integers(-(2**63), 2**63 - 1), st.floats(width=64))
attributes = st.dictionaries(
    st.sampled_from(["units", "long_name", "symbol", "level", "limits"]),
    st.one_of(words, numbers, hnp.arrays(st.sampled_from(["f8", "i4", "f4"]), st.integers(0, 4))),
    max_size=3,
)
TYPES = ["f8", "f4", "i1", "i2", "i4", "i8", "u1", "u8", "?", "c16", "c8", ">f8", "U"]
types = st.sampled_from(TYPES)
#: One of each type, with and without entries, and a name that is no ASCII.
OF_EVERY_TYPE = xr.Dataset(
    {f"{type}{n}": (("q", f"p{n}"), np.arange(3 * n).reshape(3, n).astype(type)) for type in TYPES for n in (0, 2)},
    {"Ω": ((), 2.5, {"units": "s", "limits": np.array([1.0, -2.0])})},
    {"nonsmooth": RECORD, "level": 0.95},
)


@st.composite
def datasets(draw: st.DrawFn) -> xr.Dataset:
    sizes = {"p": draw(st.integers(0, 3)), "q": draw(st.integers(1, 3))}
    variables: dict[str, Any] = {}
    for name in draw(st.lists(st.sampled_from(["a", "b", "Ω", "k_s", "u1"]), unique=True)):
        dims = draw(st.sampled_from([(), ("p",), ("q",), ("q", "p")]))
        dtype, shape = draw(types), tuple(sizes[dim] for dim in dims)
        if dtype == "U":
            values = np.array(draw(st.lists(words, min_size=int(np.prod(shape)), max_size=int(np.prod(shape)))), str)
            values = values.reshape(shape)
        else:
            values = draw(hnp.arrays(dtype, shape))
        variables[name] = (dims, values, draw(attributes))
    coordinates = [name for name in variables if draw(st.booleans())]
    return xr.Dataset(variables, attrs={**draw(attributes), "nonsmooth": RECORD}).set_coords(coordinates)


DRAWN: dict[str, Any] = {"deadline": None, "suppress_health_check": [HealthCheck.function_scoped_fixture]}


@settings(max_examples=3, **DRAWN)
@example(result=OF_EVERY_TYPE)
@given(result=datasets())
def test_one_hash_through_memory_and_both_formats(result: xr.Dataset, tmp_path: Path) -> None:
    has_one_hash(result, tmp_path)


@pytest.mark.slow
@settings(max_examples=100, **DRAWN)
@given(result=datasets())
def test_one_hash_of_many(result: xr.Dataset, tmp_path: Path) -> None:
    has_one_hash(result, tmp_path)


def has_one_hash(result: xr.Dataset, tmp_path: Path) -> None:
    for ending in FORMATS:
        path = save(result, tmp_path / f"r.{ending}")
        back = load(path)
        assert hash_in(path) == hash_of(result) == hash_of(back)
        for name, array in result.variables.items():
            assert back[name].values.tolist() == array.values.tolist() or array.dtype.kind in "fc"
            assert back[name].dims == array.dims and (name in back.coords) == (name in result.coords)
            if array.dtype.kind in "fc":
                native = array.values.astype(array.dtype.newbyteorder("="))
                np.testing.assert_array_equal(back[name].values.astype(native.dtype), native)
                assert back[name].dtype.itemsize == array.dtype.itemsize


def base() -> xr.Dataset:
    return xr.Dataset(
        {
            "section": (("rho", "state"), np.arange(6.0).reshape(3, 2), {"long_name": "section"}),
            "status": ("rho", np.array([0, 1, 0], np.int8), {"flag_values": np.array([0, 1], np.int8)}),
            "period": ((), 1.5),
            "note": ("rho", np.array(["a", "b", "c"])),
        },
        {"rho": ("rho", [1.0, 2.0, 3.0], {"units": "N"}), "g": ((), 0.02, {"units": "m"})},
        {"nonsmooth": RECORD, "level": 0.95},
    )


def _with_value(ds: xr.Dataset) -> xr.Dataset:
    ds["section"][2, 1] = np.nextafter(5.0, 6.0)
    return ds


CHANGES: dict[str, Callable[[xr.Dataset], xr.Dataset]] = {
    "the last bit of a value": _with_value,
    "a scalar": lambda ds: ds.assign(period=((), 1.25)),
    "the sign of zero": lambda ds: ds.assign(section=(("rho", "state"), ds["section"].values * [[-1, 1]] * 1.0)),
    "a coordinate": lambda ds: ds.assign_coords(rho=("rho", [1.0, 2.0, 3.5], {"units": "N"})),
    "a scalar coordinate": lambda ds: ds.assign_coords(g=((), 0.03, {"units": "m"})),
    "text": lambda ds: ds.assign(note=("rho", np.array(["a", "b", "d"]))),
    "text cut elsewhere": lambda ds: ds.assign(note=("rho", np.array(["a", "", "bc"]))),
    "a type": lambda ds: ds.assign(status=ds["status"].astype(np.int16)),
    "a type of equal bytes": lambda ds: ds.assign(status=ds["status"].astype(np.uint8)),
    "float for integer": lambda ds: ds.assign(status=ds["status"].astype(np.float32)),
    "a name": lambda ds: ds.rename(period="Period"),
    "a dim": lambda ds: ds.rename(state="State"),
    "a shape": lambda ds: ds.assign(section=(("state2", "rho"), ds["section"].values.reshape(2, 3))),
    "a coordinate made data": lambda ds: ds.reset_coords("g"),
    "a variable less": lambda ds: ds.drop_vars("period"),
    "an attribute": lambda ds: ds.assign_attrs(level=0.9),
    "an attribute's name": lambda ds: ds.assign_attrs(Level=0.95),
    "an attribute of a variable": lambda ds: ds.assign_coords(g=((), 0.02, {"units": "mm"})),
    "an attribute more": lambda ds: ds.assign(period=((), 1.5, {"units": "s"})),
    "a number as text": lambda ds: ds.assign_attrs(level="0.95"),
    "an integer for a float": lambda ds: ds.assign_attrs(level=1),
    "the provenance": lambda ds: ds.assign_attrs(nonsmooth=RECORD.replace("test", "best")),
}


@pytest.mark.parametrize("change", CHANGES)
def test_every_change_is_another_hash(change: str) -> None:
    assert hash_of(CHANGES[change](base())) != hash_of(base())


def test_what_is_no_content_does_not_change_the_hash() -> None:
    ds = base()
    wider = ds.assign(note=("rho", np.array(["a", "b", "c"], "U40")))
    turned = ds.assign(
        section=(("rho", "state"), np.asfortranarray(ds["section"].values.astype(">f8")), {"long_name": "section"})
    )
    other_order = ds[["note", "period", "status", "section"]]
    one = ds.assign_attrs(level=[0.95])
    for same in (wider, turned, other_order, one, ds.assign_attrs(level=np.float64(0.95))):
        assert hash_of(same) == hash_of(ds)


@pytest.mark.parametrize("what", ["scalar", "attribute", "unit", "name", "text", "extra"])
def test_another_program_changes_a_netcdf_file(what: str, tmp_path: Path) -> None:
    path = save(base(), tmp_path / "r.nc")
    with h5py.File(path, "r+") as file:
        if what == "scalar":
            file["period"][()] = 1.25
        elif what == "attribute":
            file.attrs["level"] = 0.9
        elif what == "unit":
            file["g"].attrs["units"] = "mm"
        elif what == "name":
            file.move("period", "Period")
        elif what == "text":
            file["note"][1] = "B"
        else:
            file.attrs["added"] = 1
    with pytest.raises(DataFileError, match=r"r\.nc: its content is not what was written.*take a copy that is whole"):
        load(path)


def test_a_damaged_file_is_not_given_to_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """HDF5 1.14 never ends on some: every byte up to the end that it reads is compared before."""
    path = save(base(), tmp_path / "r.nc")
    whole = path.read_bytes()
    assert whole[-83:-65] == b"\nnonsmooth sha256 "
    assert hashlib.sha256(whole[:-83]).hexdigest().encode() == whole[-65:-1]
    monkeypatch.setattr(memory, "of_netcdf", lambda source: pytest.fail("opened"))
    for at in range(0, len(whole) - 83, 97):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :])
        with pytest.raises(DataFileError, match="not what was written"):
            load(path)


def test_a_netcdf_file_that_another_program_has_written_anew(tmp_path: Path) -> None:
    """The same content in other bytes: without the hash of the bytes, with that of the content."""
    path = save(base(), tmp_path / "r.nc")
    xr.load_dataset(path, engine="h5netcdf").to_netcdf(tmp_path / "again.nc", engine="h5netcdf")
    again = load(tmp_path / "again.nc")
    assert again.identical(base())


def test_another_program_changes_a_zarr_store(tmp_path: Path) -> None:
    path = save(base(), tmp_path / "r.zarr")
    for name, old, new in (
        (".zmetadata", '"units": "m"', '"units": "mm"'),
        (".zattrs", '"level": 0.95', '"level": 0.94'),
        (".zmetadata", "period", "Period"),
        (".zmetadata", '"<f8"', '"<i8"'),
    ):
        before = (path / name).read_text()
        assert old in before
        (path / name).write_text(before.replace(old, new))
        with pytest.raises(DataFileError, match=r"r\.zarr"):
            load(path)
        (path / name).write_text(before)
    assert load(path).identical(base())


def test_a_stamp_is_never_mistaken_for_a_file_without() -> None:
    stamped = stamp(RECORD, "0" * 64)
    assert json.loads(stamped)["verb"] == "test"
    assert unstamp(stamped) == ("0" * 64, RECORD) and unstamp(RECORD) == (None, RECORD)
    for at in range(len('{"sha256": "') + 64):
        for byte in range(256):
            other = bytearray(stamped.encode("latin1"))
            other[at] = byte
            try:
                found, _ = unstamp(other.decode("latin1"))
            except ValueError:
                continue
            assert found is not None


def test_records_carry_their_own_hash() -> None:
    record = seal({"chunk": 3, "seconds": 0.25, "host": "a"})
    assert sealed(json.loads(json.dumps(record)))
    assert not sealed({**record, "seconds": 0.5}) and not sealed({**record, "more": 1})
    assert not sealed({"chunk": 3}) and not sealed([record]) and not sealed(None)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_file_without_a_hash_loads_with_a_warning(ending: str, tmp_path: Path) -> None:
    path = save(base(), tmp_path / f"r.{ending}")
    if ending == "nc":
        with h5py.File(path, "r+") as file:
            file.attrs["nonsmooth"] = RECORD
    else:
        for file in (path / ".zattrs", path / ".zmetadata"):
            document = json.loads(file.read_text())
            document.get("metadata", {".zattrs": document})[".zattrs"]["nonsmooth"] = RECORD
            file.write_text(json.dumps(document))
    with pytest.warns(UserWarning, match=rf"r\.{ending}: was written without a hash.*save it again"):
        back = load(path)
    assert back.identical(base())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load(save(back, path)).identical(base())


def test_a_file_written_through_netcdf4_loads() -> None:
    """Written by this package when it wrote NetCDF with the library netCDF4, and no hash; its numbers are formulas."""
    with pytest.warns(UserWarning, match="without a hash"):
        old = load(Path(__file__).with_name("written_by_netcdf4.nc"))
    n = np.arange(6)
    expected = xr.Dataset(
        {
            "section": (("point", "state"), np.column_stack([n**2.0, -n / 4]), {"long_name": "section points"}),
            "floquet_multipliers": ("point", n * (0.5 - 0.25j), {"long_name": "multipliers"}),
            "status": (
                "point",
                (n % 2).astype(np.int8),
                {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "ok slow"},
            ),
            "many": ("sample", np.arange(5000) % 7 * 0.5),
            "touch_time": ("touch", np.empty(0)),
        },
        {
            "point": ("point", n.astype(float), {"units": "N"}),
            "state": np.array(["x", "v"]),
            "g": ((), 0.02, {"units": "m", "symbol": "g"}),
        },
        {"nonsmooth": '{"version": "0.1.0", "verb": "sweep"}'},
    )
    xr.testing.assert_identical(old, expected)
    assert old["status"].dtype == np.int8 and old["floquet_multipliers"].dtype == complex


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (lambda ds: ds.assign_attrs(note="a\0b"), ValueError, "'note' of the Dataset holds the character NUL"),
        (lambda ds: ds.assign_attrs(note="\ud800"), ValueError, "'note' of the Dataset is not valid text"),
        (lambda ds: ds.assign(when=np.datetime64("2020-01-01", "ns")), TypeError, "'when' is of type datetime64"),
        (lambda ds: ds.assign(mixed=("rho", np.array([1, "a", None], object))), TypeError, "'mixed' holds a int"),
        (lambda ds: ds.assign_coords({"car mass": 1.0}), TypeError, "variable 'car mass'; use names without spaces"),
        (lambda ds: ds.drop_attrs(), ValueError, "no attribute 'nonsmooth', so load would refuse it"),
        (lambda ds: ds.assign(period=((), 1.5, {"scale_factor": 2.0})), TypeError, "variable 'period'"),
    ],
)
@pytest.mark.filterwarnings("ignore")  # xarray says it too, in its own words
@pytest.mark.parametrize("ending", FORMATS)
def test_what_would_not_come_back_is_refused_and_nothing_is_written(
    change: Any, error: type[Exception], message: str, ending: str, tmp_path: Path
) -> None:
    changed = change(base())
    with pytest.raises(error, match=message):
        save(changed, tmp_path / f"r.{ending}")
    assert not list(tmp_path.iterdir())


def test_files_of_equal_results_are_equal(tmp_path: Path) -> None:
    first, second = (save(base(), tmp_path / name).read_bytes() for name in ("a.nc", "b.nc"))
    assert first == second


def test_saving_leaves_the_settings_of_zarr_alone(tmp_path: Path) -> None:
    import zarr

    before = zarr.config.get("array.write_empty_chunks"), zarr.config.get("threading.max_workers")
    load(save(base(), tmp_path / "r.zarr"))
    assert (zarr.config.get("array.write_empty_chunks"), zarr.config.get("threading.max_workers")) == before


def test_recordings_and_parameters_are_checked_too(tmp_path: Path) -> None:
    from nonsmooth.identification.finding import Estimate
    from nonsmooth.identification.parameter_set import ParameterSet

    time = xr.Dataset({"Angle": ("time", np.arange(5.0), {"units": "rad"})}, {"time": np.arange(5) / 8})
    recording = ns.Recording.from_runs({"Run #1": {"Angle": time}}, synthetic=False)
    found = ParameterSet({"k": Estimate(4.5, 0.1, "N/m")}, np.array([[0.01]]), extra={}, findings=[])
    for name, result, variable in (("r", recording.to_dataset(), "channel_1_1"), ("p", found.to_dataset(), "value")):
        path = save(result, tmp_path / f"{name}.nc")
        assert load(path).identical(result)
        with h5py.File(path, "r+") as file:
            file[variable][0] += 1e-12
        with pytest.raises(DataFileError, match="not what was written"):
            load(path)
