r"""What multiple shooting says of the support: gap and contact parameters, and how much of them one contact tells.

:math:`c_s/k_s` is half a millisecond and a contact eight samples: no sample shows it, but the speed that a contact
takes, some 3 %, shows in the free motion after it. The profile over one contact, everything else held as known, says
what that is worth; many contacts fitted together are worth the root of their number more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.multiple_shooting import ContactFit
from nonsmooth.identification.pieces import Problem
from nonsmooth.identification.uncertainty import profile_likelihood

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["contact_finding", "one_contact"]

FloatArray = NDArray[np.float64]
_GAMMA = 4  # index of c_s/m among the common parameters
_POINTS = 41


def contact_finding(found: ContactFit, mass: float, *, resolution: float) -> Finding:
    r"""Support damping, stiffness and the gap of each run from records with contact.

    Parameters
    ----------
    found : ContactFit
        Outcome of `shoot_contacts`.
    mass : float
        Mass (kg), taken as exact.
    resolution : float
        Length of a count (m).

    Returns
    -------
    Finding
        ``c_s_contact`` (N s/m), known to a factor. ``others``: ``k_s`` (N/m), and ``gap, Run #1`` and so on, the gap
        of each run in the sensor's count (m).
    """
    error = np.sqrt(np.diag(found.covariance))
    gaps = {
        f"gap, {run.name}": Estimate(float(found.values[found.place(i, 0)]), float(error[found.place(i, 0)]), "m")
        for i, run in enumerate(found.runs)
    }
    left = int(np.count_nonzero(~found.fit.used))
    value = float(found.values[_GAMMA]) * mass
    notes = [
        f"root of chi^2 per degree of freedom {np.sqrt(found.fit.reduced):.2f}; the clock jitters by "
        f"{1e6 * found.fit.jitter:.0f} µs",
        "one contact is 8 samples at 100 Hz: what is known of c_s comes from many fitted together",
    ]
    if left:
        notes.append(f"{left} of {len(found.pieces)} pieces are left out: they fit far worse than the others")
    return Finding(
        "c_s_contact", Estimate(value, float(error[_GAMMA]) * mass, "N s/m", logarithmic=value > 0),
        f"multiple shooting over {found.n_contacts} pieces split at contacts", found.fit.samples,
        tuple(run.name for run in found.runs), tuple(notes),
        {"k_s": Estimate(float(found.values[3]) * mass, float(error[3]) * mass, "N/m"), **gaps},
        data=_data(found, resolution), plot="multiple_shooting",
    )  # fmt: skip


def one_contact(found: ContactFit, mass: float, *, resolution: float) -> Finding:
    r"""The profile of c_s over a single piece with contact, all else known: what one contact tells.

    Parameters
    ----------
    found : ContactFit
    mass : float
        Mass (kg).
    resolution : float
        Length of a count (m).

    Returns
    -------
    Finding
        ``c_s_one_contact``, from the piece whose curvature is the median one.
    """
    theta = found.values
    pieces = [i for i in range(len(found.pieces)) if found.fit.used[i]]
    widths = np.array([_width(found, i, resolution) for i in pieces])
    chosen = pieces[int(np.argsort(widths)[len(widths) // 2])]
    piece, width = found.pieces[chosen], float(np.sort(widths)[len(widths) // 2])
    problem = Problem([piece], np.ones(len(theta)), resolution)
    local = theta[piece.which]
    weight = 1.0 / np.sqrt(resolution**2 / 12 + (found.fit.jitter * found.fit.fitted[chosen][:, 1]) ** 2)

    def residual(p: FloatArray) -> FloatArray:
        here = local.copy()
        here[_GAMMA] = p[0]
        motion = problem.motion(piece, here, p[1:] * [1e-3, 1e-2])
        return np.asarray((piece.x - motion[:, 0]) * weight)

    start = np.append(local[_GAMMA], found.fit.starts[chosen] / [1e-3, 1e-2])
    reach = min(4 * width, 0.98 * float(local[_GAMMA]))
    values = np.linspace(local[_GAMMA] - reach, local[_GAMMA] + 4 * width, _POINTS)
    scale = max(found.fit.reduced, 1.0)
    profile = profile_likelihood(residual, start, 0, values, scale=scale)
    best = mass * float(profile.values[int(np.argmin(profile.cost))])
    low, high = mass * profile.low, mass * profile.high
    bounded = np.isfinite(low) and np.isfinite(high) and low > 0
    error = (high - low) / (2 * 1.96) if bounded else width * mass
    return Finding(
        "c_s_one_contact", Estimate(best, error, "N s/m", logarithmic=best > 0),
        "profile likelihood of one piece with contact, all other parameters held", len(piece.x), (piece.label,),
        (
            (f"95 % limits {low:.3g} to {high:.3g} N s/m" if bounded else "the profile does not bound it on both sides")
            + "; the piece is the median one of all that were fitted",
        ),
        data=_profile(profile.values * mass, profile.cost, best, low, high, found), plot="profile",
    )  # fmt: skip


def _width(found: ContactFit, i: int, resolution: float) -> float:
    """Standard error of c_s/m from one piece, its start free and all else known, to first order."""
    piece = found.pieces[i]
    problem = Problem([piece], np.ones(len(found.values)), resolution)
    local, start = found.values[piece.which], found.fit.starts[i]

    def slope(step: FloatArray, parameter: bool) -> FloatArray:
        ends = []
        for sign in (1, -1):
            here, begun = (local + sign * step, start) if parameter else (local, start + sign * step)
            ends.append(problem.motion(piece, here, begun)[:, 0])
        return np.asarray((ends[0] - ends[1]) / (2 * np.max(step)))

    gamma = np.zeros(len(local))
    gamma[_GAMMA] = 1e-2
    columns = [slope(gamma, True), slope(np.array([1e-6, 0.0]), False), slope(np.array([0.0, 1e-5]), False)]
    weight = 1.0 / np.sqrt(resolution**2 / 12 + (found.fit.jitter * found.fit.fitted[i][:, 1]) ** 2)
    matrix = np.array(columns).T * weight[:, None]
    return float(np.sqrt(found.fit.reduced / max(_left_over(matrix), 1e-300)))


def _left_over(matrix: FloatArray) -> float:
    """Squared length of the first column that the others do not take."""
    rest = matrix[:, 1:]
    part, *_ = np.linalg.lstsq(rest, matrix[:, 0], rcond=None)
    return float(np.sum((matrix[:, 0] - rest @ part) ** 2))


def _data(found: ContactFit, resolution: float) -> xr.Dataset:
    """The run with the most pieces, sample by sample."""
    import xarray as xr

    names = [piece.label for piece in found.pieces]
    which = max(range(len(found.runs)), key=lambda i: names.count(found.runs[i].name))
    run = found.runs[which]
    time, x = run.time, run.positions
    fitted, segment = np.full(len(x), np.nan), np.full(len(x), -1)
    for i, piece in enumerate(found.pieces):
        if piece.label == run.name and found.fit.used[i]:
            begin = int(np.argmin(np.abs(time - piece.origin)))
            fitted[begin : begin + len(piece.x)] = found.fit.fitted[i][:, 0]
            segment[begin : begin + len(piece.x)] = i
    gap = float(found.values[found.place(which, 0)])
    return xr.Dataset(
        {
            "x": ("time", x, {"units": "m"}), "x_error": ("time", np.full(len(x), resolution / np.sqrt(12))),
            "fitted": ("time", fitted, {"units": "m"}), "residual": ("time", x - fitted, {"units": "m"}),
            "segment": ("time", segment),
            "in_contact": ("time", (np.where(np.isfinite(fitted), fitted, -np.inf) > gap).astype(np.int8)),
            "gap": ((), gap, {"units": "m"}),
            "gap_error": ((), float(np.sqrt(found.covariance[found.place(which, 0), found.place(which, 0)]))),
        },
        {"time": time}, {"synthetic": "yes" if run.synthetic else "no", "run": run.name},
    )  # fmt: skip


def _profile(
    value: FloatArray, cost: FloatArray, best: float, low: float, high: float, found: ContactFit
) -> xr.Dataset:
    import xarray as xr

    return xr.Dataset(
        {"cost": ("value", cost), "best": ((), best), "low": ((), low), "high": ((), high)},
        {"value": ("value", value, {"units": "N s/m"})},
        {
            "parameter": "c_s", "units": "N s/m",
            "synthetic": "yes" if any(run.synthetic for run in found.runs) else "no",
        },
    )  # fmt: skip
