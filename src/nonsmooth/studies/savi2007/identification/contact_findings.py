r"""Findings of multiple shooting on the support: gap and contact parameters, and how much of them one contact tells.

:math:`c_s/k_s` is half a millisecond and a contact eight samples: no sample shows it, but the speed that a contact
takes, some 3 %, shows in the free motion after it. The profile over one contact gives the uncertainty of that;
many contacts fitted together have a smaller one, by the root of their number and by what they tell of gap and drive.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import SolveError
from nonsmooth.identification import Estimate, Finding
from nonsmooth.identification.profiles import Profile, profile_of
from nonsmooth.identification.uncertainty import coverage_factor
from nonsmooth.recordings import Quantity
from nonsmooth.studies.savi2007.identification.multiple_shooting import ContactFit
from nonsmooth.studies.savi2007.identification.shooting import ShootingFit, shoot

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["contact_finding", "one_contact"]

_KAPPA, _GAMMA = 3, 4  # indices of k_s/m and c_s/m among the parameters
_POINTS = 24
_TRIED = 15  # pieces of which the median one is shown


def contact_finding(found: ContactFit, mass: Quantity, *, resolution: float) -> Finding:
    r"""Support damping, stiffness and the gap of each run from records with contact.

    Parameters
    ----------
    found : ContactFit
        Outcome of `shoot_contacts`.
    mass, resolution
        As in `decay_damping`.

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
    value = float(found.values[_GAMMA])
    stiff = Estimate(float(found.values[_KAPPA]), float(error[_KAPPA])).times(mass.value, mass.uncertainty, "N/m")
    notes = [
        f"root of chi^2 per degree of freedom {np.sqrt(found.fit.reduced):.2f}; the clock jitters by "
        f"{1e6 * found.fit.jitter:.0f} µs",
        "one contact is 8 samples at 100 Hz: what is known of c_s comes from many fitted together",
    ]
    if found.short:
        notes.append(
            f"the fit stands {found.short:.2g} standard uncertainties short of its minimum, where friction or a graze "
            "gives the sum of squares a corner; what is left of the way is in the uncertainties"
        )
    if found.grazing:
        notes.append(
            f"{found.grazing} pieces in which the car grazes the support, or friction all but holds it, are left out"
        )
    if left:
        notes.append(f"{left} of {len(found.pieces)} pieces are left out: they fit far worse than the others")
    return Finding(
        "c_s_contact",
        Estimate(value, float(error[_GAMMA]), logarithmic=value > 0).times(mass.value, mass.uncertainty, "N s/m"),
        f"multiple shooting over {found.n_contacts} pieces split at contacts", found.fit.samples,
        tuple(run.name for run in found.runs), tuple(notes),
        {"k_s": stiff, **gaps},
        data=_data(found, resolution), plot="multiple_shooting",
    )  # fmt: skip


def one_contact(found: ContactFit, mass: float, *, resolution: float, kappa_error: float) -> Finding:
    r"""The profile of c_s over a single piece with contact: what one contact tells on its own.

    Known besides is what does not come from contacts: the free oscillator, k_s/m, and the drive as set. Gap, place and
    the drive's details are this piece's own to find, as they were for all pieces together.

    Parameters
    ----------
    found : ContactFit
    mass : float
        Mass (kg).
    resolution : float
        Length of a count (m).
    kappa_error : float
        Standard uncertainty of k_s/m from elsewhere (1/s^2).

    Returns
    -------
    Finding
        ``c_s_one_contact``, from the piece that is the median one in how well it tells c_s.
    """
    used = [i for i in range(len(found.pieces)) if found.fit.used[i]]
    alone = {i: _Alone(found, i, resolution, kappa_error) for i in used[:: max(len(used) // _TRIED, 1)]}
    widths = {i: one.width() for i, one in alone.items()}
    order = sorted((i for i in widths if np.isfinite(widths[i])), key=lambda i: widths[i])
    if not order:
        raise ValueError("no piece with contact can be fitted on its own")
    chosen = order[len(order) // 2]
    one, width, gamma = alone[chosen], widths[chosen], float(found.values[_GAMMA])
    low_end = max(gamma - 3.5 * width, 0.02 * gamma)
    values = np.append(np.linspace(low_end, gamma, _POINTS // 2, endpoint=False),
                       np.linspace(gamma, gamma + 3.5 * width, _POINTS - _POINTS // 2))  # fmt: skip
    cost = np.array([one.cost(float(value)) for value in values])
    kept = np.isfinite(cost)
    values, cost = values[kept], (cost[kept] - np.min(cost[kept])) / max(found.fit.reduced, 1.0)
    top = int(np.argmin(cost))
    profile = profile_of(values * mass, cost, mass * float(values[top]))
    best, low, high = profile.best, profile.low, profile.high
    bounded = bool(np.isfinite(low) and np.isfinite(high))
    error = best * float(np.log(high / low)) / (2 * coverage_factor()) if bounded else mass * width
    return Finding(
        "c_s_one_contact", Estimate(best, error, "N s/m", logarithmic=True),
        "profile likelihood of one piece with contact, its gap, place and drive found with it",
        len(found.pieces[chosen].x), (found.pieces[chosen].label,),
        (
            (f"95 % limits {low:.3g} to {high:.3g} N s/m" if bounded else "the profile does not bound it on both sides")
            + f"; the piece is the median one of {len(order)}",
        ),
        data=_profile(profile, found), plot="profile",
    )  # fmt: skip


class _Alone:
    """One piece with the eleven parameters that act on it, and what is known of them besides contacts."""

    def __init__(self, found: ContactFit, i: int, resolution: float, kappa_error: float) -> None:
        piece = found.pieces[i]
        self.piece = replace(piece, which=np.arange(len(piece.which)), start=found.fit.starts[i])
        self.rows = piece.which
        self.values, self.resolution, self.jitter = found.values[self.rows], resolution, found.fit.jitter
        self.known = found.known[self.rows].copy()
        self.known[_KAPPA] = self.values[_KAPPA]
        self.precision = found.precision[np.ix_(self.rows, self.rows)].copy()
        self.precision[_KAPPA, _KAPPA] += kappa_error**-2.0
        self.steps = np.array([1e-6, 1e-6, 1e-7, 1e-6 * self.values[_KAPPA], 1e-4, 3e-8, 3e-8, *[1e-7] * 4])

    def fit(self, gamma: float, hold: float) -> ShootingFit:
        """The other parameters at this c_s/m, which is held with the precision ``hold``."""
        values, known, precision = self.values.copy(), self.known.copy(), self.precision.copy()
        values[_GAMMA] = known[_GAMMA] = gamma
        precision[_GAMMA, _GAMMA] = hold
        return shoot(
            [self.piece], values, self.steps, resolution=self.resolution, known=known, precision=precision,
            jitter=self.jitter,
        )  # fmt: skip

    def width(self) -> float:
        """Standard error of c_s/m, free but for a factor of ten; inf where this piece cannot be fitted alone."""
        gamma = float(self.values[_GAMMA])
        try:
            return float(np.sqrt(self.fit(gamma, (10 * gamma) ** -2.0).covariance[_GAMMA, _GAMMA]))
        except SolveError:
            return float("inf")

    def cost(self, gamma: float) -> float:
        """chi^2 of readings and of what is known, the rest fitted; NaN where that fails."""
        try:
            found = self.fit(gamma, (1e-4 * gamma) ** -2.0)
        except SolveError:
            return float("nan")
        weight = 1.0 / (self.resolution**2 / 12 + (self.jitter * found.fitted[0][:, 1]) ** 2)
        off = found.values - self.known
        off[_GAMMA] = 0.0
        return float(np.sum(found.residuals[0] ** 2 * weight) + off @ self.precision @ off)


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


def _profile(profile: Profile, found: ContactFit) -> xr.Dataset:
    import xarray as xr

    return xr.Dataset(
        {
            "cost": ("value", profile.cost), "best": ((), profile.best), "low": ((), profile.low),
            "high": ((), profile.high),
        },
        {"value": ("value", profile.values, {"units": "N s/m"})},
        {
            "parameter": "c_s", "units": "N s/m",
            "synthetic": "yes" if any(run.synthetic for run in found.runs) else "no",
        },
    )  # fmt: skip
