"""Input of every picture of an identification: the data of a finding, and whether it is synthetic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["data_of", "number", "with_error"]


def data_of(finding: Any, *needed: str) -> xr.Dataset:
    """The Dataset of a ``Finding``, or the Dataset itself, with the variables that a picture needs.

    Raises
    ------
    ValueError
        No data, or a variable that is missing: this is the picture of another procedure.
    """
    data: Any = finding if hasattr(finding, "data_vars") else getattr(finding, "data", None)
    if data is None:
        raise ValueError("this finding kept no data to draw")
    if missing := [name for name in needed if name not in data.variables]:
        held = ", ".join(sorted(map(str, data.variables)))
        raise ValueError(f"this picture needs {', '.join(missing)}; the data of this finding hold {held}")
    return data


def number(data: xr.Dataset, name: str) -> float:
    """A scalar of the data, NaN where it is not there."""
    return float(data[name]) if name in data.variables else float("nan")


def with_error(value: float, error: float, unit: str = "") -> str:
    """``8.470 ± 0.012 N/m``: two digits of the error; without a finite one, four digits of the value."""
    tail = f" {unit}" if unit else ""
    if not (np.isfinite(error) and error > 0):
        return f"{value:.4g}{tail}"
    digits = max(0, 1 - int(np.floor(np.log10(error))))
    return f"{value:.{digits}f} ± {error:.{digits}f}{tail}"
