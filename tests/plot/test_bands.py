"""Bands of 95 % are 1.96 standard errors wide on either side."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

from nonsmooth.plot import identification

Z = norm.ppf(0.975)


@pytest.mark.parametrize(("name", "scale"), [("backbone", 1.0), ("modal_damping", 100.0)])
def test_a_band_over_the_amplitude(name: str, scale: float) -> None:
    a = np.linspace(1e-3, 5e-3, 9)
    y, error = 0.02 + a, 1e-3 + 0.1 * a
    key = "f_n" if name == "backbone" else "zeta"
    data = xr.Dataset(
        {
            key: ("amplitude", y),
            f"{key}_error": ("amplitude", error),
            "curve_amplitude": ("curve_point", a[:4]),
            f"curve_{key}": ("curve_point", y[:4]),
        },
        {"amplitude": ("amplitude", a, {"units": "m"})},
        attrs={"synthetic": "yes"},
    )
    ax = getattr(identification, name)(data)
    (band,) = (one for one in ax.collections if one.get_label() == "95 %")
    corners = band.get_paths()[0].vertices
    for k, at in enumerate(a):
        height = corners[np.isclose(corners[:, 0], at), 1]
        ends = scale * (y[k] + np.array([-Z, Z]) * error[k])
        assert (height.min(), height.max()) == pytest.approx(ends, rel=1e-3)
    (line,) = (one for one in ax.lines if one.get_label() == "mode")
    assert line.get_ydata() == pytest.approx(scale * y)
    (each,) = (one for one in ax.containers if one.get_label() == "each curve by itself")
    assert each.lines[0].get_ydata() == pytest.approx(scale * y[:4])
    plt.close(ax.figure)
