"""Files whose bytes were altered anywhere, headers and descriptions too: an error, or the very same content.

``pytest -m slow tests/results/test_altered_bytes.py -s`` alters 400 files of each format.
"""

from __future__ import annotations

import shutil
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nonsmooth.errors import DataFileError
from nonsmooth.results.store import load, save

Rng = np.random.Generator


def flip(data: bytearray, at: int, rng: Rng) -> None:
    data[at] ^= 1 << int(rng.integers(8))


def other_byte(data: bytearray, at: int, rng: Rng) -> None:
    data[at] ^= int(rng.integers(1, 256))


def other_letter(data: bytearray, at: int, rng: Rng) -> None:
    """Text stays text: a digit for a digit, a letter for a letter."""
    byte = data[at]
    for first, last in (b"09", b"az", b"AZ"):
        if first <= byte <= last:
            data[at] = first + (byte - first + int(rng.integers(1, last - first + 1))) % (last - first + 1)
            return
    flip(data, at, rng)


def noise(data: bytearray, at: int, rng: Rng) -> None:
    there = data[at : at + int(rng.integers(2, 64))]
    data[at : at + len(there)] = rng.bytes(len(there))


def zeros(data: bytearray, at: int, rng: Rng) -> None:
    there = data[at : at + int(rng.integers(1, 512))]
    data[at : at + len(there)] = bytes(len(there))


def copied(data: bytearray, at: int, rng: Rng) -> None:
    """A part of the file stands at another place."""
    length = min(int(rng.integers(8, 64)), len(data))
    begin = int(rng.integers(len(data) - length + 1))
    part = data[begin : begin + length]
    data[at : at + length] = part[: len(data[at : at + length])]


CHANGES: list[Callable[[bytearray, int, Rng], None]] = [flip, other_byte, other_letter, noise, zeros, copied]


def with_all_types(swept: xr.Dataset) -> xr.Dataset:
    """A result with scalars, text, complex numbers, NaN, flags, an array that is compressed, and an empty one."""
    return swept.assign(
        floquet_multipliers=("multiplier", np.array([1 + 2j, complex(np.nan, 1)]), {"long_name": "multipliers"}),
        ended_because=("end", np.array(["the range ends", "µ < 0"])),
        period=((), 2.5, {"units": "s"}),
        many=("sample", np.arange(6000) % 7 * 0.5),
        stable=("end", np.array([1, 0], np.int8)),
        touch=("hit", np.empty(0)),
    ).assign_attrs(comparison="sweep", level=0.95, counts=np.array([3, 4]))


def same(found: xr.Dataset, result: xr.Dataset) -> bool:
    """To the last bit, but for the type of a number in an attribute."""
    return found.identical(result) and all(
        found[name].dtype == array.dtype and found[name].values.tobytes() == array.values.tobytes()
        for name, array in result.variables.items()
    )


def altered(whole: Path, copy: Path, rng: Rng) -> str:
    """Alter a copy of a file, or of one file of a store; returns what was done."""
    if copy.is_dir():
        shutil.rmtree(copy)
    (shutil.copytree if whole.is_dir() else shutil.copyfile)(whole, copy)
    # A file of a store is taken at random, most are descriptions; or a byte of them all, most are numbers.
    files = sorted(file for file in copy.rglob("*") if file.is_file() and file.stat().st_size) or [copy]
    sizes = np.array([file.stat().st_size for file in files])
    file = files[int(rng.choice(len(files), p=None if rng.random() < 0.5 else sizes / sizes.sum()))]
    before = file.read_bytes()
    change = CHANGES[int(rng.integers(len(CHANGES)))]
    data = bytearray(before)
    while data == before:
        change(data, int(rng.integers(len(data))), rng)
    file.write_bytes(data)
    return f"{change.__name__} in {file.name}"


def campaign(results: list[xr.Dataset], ending: str, n: int, folder: Path, seed: int) -> Counter[str]:
    """Alter n files; how many were refused, and how many came back with the same content. Any other is an error."""
    rng = np.random.default_rng(seed)
    whole = [save(result, folder / f"whole_{k}.{ending}") for k, result in enumerate(results)]
    copy, outcome = folder / f"altered.{ending}", Counter[str]()
    for i in range(n):
        k = i % len(results)
        what = altered(whole[k], copy, rng)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # no altered file may pass for one from before there were hashes
            try:
                found = load(copy)
            except DataFileError:
                outcome["refused"] += 1
                continue
        assert same(found, results[k]), f"{what} (number {i}): loaded with other content"
        outcome["same"] += 1
    return outcome


@pytest.mark.parametrize("ending", ["nc", "zarr"])
def test_altered_bytes_are_refused(ending: str, swept: xr.Dataset, points: xr.Dataset, tmp_path: Path) -> None:
    outcome = campaign([with_all_types(swept), points], ending, 20, tmp_path, seed=1)
    assert outcome.total() == 20 and outcome["refused"] >= 5


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["nc", "zarr"])
def test_400_altered_files(
    ending: str, swept: xr.Dataset, points: xr.Dataset, trajectory: xr.Dataset, responded: xr.Dataset, tmp_path: Path
) -> None:
    outcome = campaign([with_all_types(swept), points, trajectory, responded], ending, 400, tmp_path, seed=2)
    print(f"\n{ending}: 400 altered, {outcome['refused']} refused, {outcome['same']} loaded with the same content")
    assert outcome.total() == 400 and outcome["refused"] >= 50
