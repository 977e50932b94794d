r"""``zero_one_test``: is a series regular (0) or chaotic (1)?

With the observations :math:`\phi_j` the translations :math:`p_c(n) + i q_c(n) = \sum_{j \le n} \phi_j e^{ijc}` stay
bounded for regular motion and wander like a Brownian path for chaos. K is the correlation of their mean square
displacement with the time, the median over random c.

It needs no equations and no derivatives, so it is a cross-check of a Lyapunov exponent, not a replacement: near the
onset of chaos, and for a slow approach to a periodic orbit, it takes long series to decide.

References
----------
G.A. Gottwald, I. Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009) 129-145 (Eqs. 2.1, 3.1-3.5;
the mean is taken out beforehand, so that the oscillation of Eq. 3.3 is zero).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.results.memory import room_for
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least, float_array

if TYPE_CHECKING:
    import xarray as xr

LEAST = 100


@checked
def zero_one_test(
    section: Any, *, n_frequencies: Annotated[int, at_least(1)] = 100, seed: Annotated[int, at_least(0)] = 0
) -> xr.DataArray:
    """K of the 0-1 test for every state: near 0 for regular motion, near 1 for chaos.

    Parameters
    ----------
    section : xarray.Dataset, xarray.DataArray or array
        A result of ``poincare`` or ``sweep`` (with all its points), or observations (N,) or (N, n) at section returns.
        Observations taken more often than a few times per oscillation look regular: use a section.
    n_frequencies : int
        Number of random c between pi/5 and 4 pi/5.
    seed : int
        Seed of ``numpy.random.default_rng``.

    Returns
    -------
    xarray.DataArray
        K with the dims of ``section`` without ``iterate``; NaN where a point failed. 0 for a series without motion.

    Raises
    ------
    ValueError, TypeError
        Fewer than 100 observations.
    """
    import xarray as xr

    data = section["section"] if hasattr(section, "data_vars") and "section" in section else section
    if not isinstance(data, xr.DataArray):
        if hasattr(data, "data_vars"):
            raise ValueError("a Dataset must be a result of poincare or sweep, with section(..., iterate, state)")
        values = float_array(data, "observations")
        if values.ndim not in (1, 2):
            raise ValueError(f"observations must be (N,) or (N, n), not of shape {values.shape}")
        data = xr.DataArray(values, dims=("iterate", "state")[: values.ndim])
    if "iterate" not in data.dims:
        raise ValueError(f"the section must have the dim iterate, not only {data.dims}")
    data = data.transpose(..., "iterate")
    n = data.sizes["iterate"]
    if n < LEAST:
        raise ValueError(f"the 0-1 test needs {LEAST} observations or more, better 1000; there are {n}")
    room_for(40.0 * n_frequencies * n, f"n_frequencies = {n_frequencies:.6g} over {n} observations", "take fewer")
    c = np.random.default_rng(seed).uniform(np.pi / 5, 4 * np.pi / 5, n_frequencies)
    series = data.values.reshape(-1, n)
    k = np.array([_k(one, c) for one in series]).reshape(data.shape[:-1])
    coords = {name: coord for name, coord in data.coords.items() if "iterate" not in coord.dims}
    return xr.DataArray(k, coords, data.dims[:-1], name="K", attrs={"long_name": "K of the 0-1 test"})


def _k(phi: FloatArray, c: FloatArray) -> float:
    """The median of K_c over the frequencies c."""
    if not np.isfinite(phi).all():
        return np.nan
    size = np.ptp(phi)
    if size <= 1e-9 * np.abs(phi).max():
        return 0.0
    n = len(phi)
    cut = n // 10
    lags = np.arange(1, cut + 1)
    phi = (phi - phi.mean()) / size  # a constant makes p and q swing, and would hide how they wander
    waves = np.exp(1j * np.outer(c, np.arange(1, n + 1)))
    path = np.cumsum(waves * phi, axis=1)
    displacement = np.empty((len(c), cut))
    for k, lag in enumerate(lags):
        moved = path[:, lag : n - cut + lag] - path[:, : n - cut]
        displacement[:, k] = (moved.real**2 + moved.imag**2).mean(axis=1)
    x = lags - lags.mean()
    centred = displacement - displacement.mean(axis=1, keepdims=True)
    spread = np.sqrt((centred**2).sum(axis=1) * (x**2).sum())
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(spread > 0.0, centred @ x / spread, 0.0)
    return float(np.median(each))
