"""The hash of a result sees everything that a reader could tell apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from nonsmooth.results.whole import content, digest


def hashed(whole: dict[str, Any] | None = None, coordinate: bool = False, name: str = "x", **variable: Any) -> str:
    given = {"dims": ("a", "b"), "data": np.arange(4.0).reshape(2, 2), "attrs": {"units": "m"}} | variable
    return digest(content(whole or {"title": "t"}, [(name, coordinate, xr.Variable(**given))]))


@pytest.mark.parametrize(
    "changed",
    [
        {"dims": ("b", "a")},
        {"data": np.arange(4.0).reshape(2, 2).T},
        {"data": np.arange(4).reshape(2, 2)},
        {"data": np.arange(4.0, dtype=np.float32).reshape(2, 2)},
        {"attrs": {"units": "mm"}},
        {"attrs": {"unit": "m"}},
        {"dims": ("a", "c")},
        {"coordinate": True},
        {"name": "y"},
        {"attrs": {}},
        {"data": np.nextafter(np.arange(4.0), 9.0).reshape(2, 2)},
        {"attrs": {"units": ["m", "m"]}},
        {"data": np.array([["0", "1"], ["2", "3"]])},
        {"attrs": {"units": 1}},
    ],
)
def test_it_sees(changed: dict[str, Any]) -> None:
    assert hashed(**changed) != hashed()


def test_it_does_not_see_how_numbers_are_stored() -> None:
    swapped = np.arange(4.0).reshape(2, 2).astype(">f8")
    assert hashed(data=swapped) == hashed() == hashed(data=np.asfortranarray(np.arange(4.0).reshape(2, 2)))


def test_it_sees_an_attribute_of_the_whole() -> None:
    assert len({hashed(whole=one) for one in ({"a": 1}, {"a": 1.0}, {"a": "1"}, {"b": 1}, {"a": [1, 1]})}) == 5
