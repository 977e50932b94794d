r"""Findings of multiple shooting on the support: gap and contact parameters, and how much of them one contact tells.

:math:`c_s/k_s` is half a millisecond and a contact eight samples: no sample shows it, but the speed that a contact
takes, some 3 %, shows in the free motion after it. The profile over one contact gives the uncertainty of that;
many contacts fitted together have a smaller one, by the root of their number and by what they tell of gap and drive.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.special import ndtri

from nonsmooth import SolveError
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth.recordings.signals.phase import drive_phase
from nonsmooth_savi2007.identification.free_decay import DecayFit
from nonsmooth_savi2007.identification.multiple_shooting import ContactFit, fit_contact, known_before
from nonsmooth_savi2007.identification.picture_data import picture_data

_KAPPA, _GAMMA = 3, 4  # indices of k_s/m and c_s/m among the parameters
_TRIED = 5  # windows of which the median one is shown


def contact_finding(found: ContactFit, mass: Quantity | Estimate, *, resolution: float) -> Finding:
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
    value = float(found.values[_GAMMA])
    stiff = Estimate(float(found.values[_KAPPA]), float(error[_KAPPA])).times(mass.value, mass.uncertainty, "N/m")
    notes = [
        f"residuals {found.excess:.2f} times the sensor's noise",
        "one contact is 8 samples at 100 Hz: what is known of c_s comes from many fitted together",
        *found.left,
    ]
    notes += [
        f"{run.name}: {note}"
        for run, one in zip(found.runs, found.fits, strict=True)
        for note in (*one.notes, *one.anomalies)
        if note.startswith(("left out", "the fit stands"))
    ]
    return Finding(
        "c_s_contact",
        Estimate(value, float(error[_GAMMA]), logarithmic=value > 0).times(mass.value, mass.uncertainty, "N s/m"),
        f"multiple shooting over {found.n_contacts} contacts",
        found.samples,
        tuple(run.name for run in found.runs),
        tuple(notes),
        {"k_s": stiff, **gaps},
        data=_data(found, resolution),
        plot="multiple_shooting",
    )


def one_contact(found: ContactFit, decay: DecayFit, mass: float, *, resolution: float, kappa_error: float) -> Finding:
    r"""The profile of c_s over a window with a single contact: what one contact tells on its own.

    Known besides is what does not come from contacts: the free oscillator, k_s/m, and the drive as set. Gap, place and
    the drive's details are this window's own to find, as they were for all together.

    Parameters
    ----------
    found : ContactFit
    decay : DecayFit
        The free oscillator.
    mass : float
        Mass (kg).
    resolution : float
        Length of a count (m).
    kappa_error : float
        Standard uncertainty of k_s/m from elsewhere (1/s^2).

    Returns
    -------
    Finding
        ``c_s_one_contact``, from the window that is the median one, of some, in how well it tells c_s.
    """
    kappa, gamma, windows = float(found.values[_KAPPA]), float(found.values[_GAMMA]), found.single()
    alone = []
    for i, first, last in windows[:: max(len(windows) // _TRIED, 1)]:
        run, drive = found.runs[i], drive_phase(found.runs[i].passages)
        known = known_before(
            run,
            decay,
            float(found.values[found.place(i, 3)]),
            kappa=Estimate(kappa, kappa_error),
            gamma=Estimate(gamma, 10 * gamma),
        )
        try:
            one = fit_contact(
                run, drive, not drive.wander()[1], known, known, resolution, (first, last), profile=["gamma"]
            )
        except SolveError:
            continue
        if np.isfinite(one.uncertainty["gamma"]):
            alone.append((float(one.uncertainty["gamma"]), run, one))
    if not alone:
        raise ValueError("no contact can be fitted on its own")
    width, run, one = sorted(alone, key=lambda row: row[0])[len(alone) // 2]
    data = next(finding.data for finding in one.findings if finding.name == "gamma, profile")
    assert data is not None
    best, low, high = (mass * float(data[name]) for name in ("best", "low", "high"))
    bounded = bool(0 < low and np.isfinite(high))
    error = best * float(np.log(high / low)) / (2 * ndtri(0.975)) if bounded else mass * width
    shown = data.assign({name: data[name] * mass for name in ("best", "low", "high")})
    shown = shown.assign_coords(value=("value", mass * data["value"].values, {"units": "N s/m"}))
    return Finding(
        "c_s_one_contact",
        Estimate(best, error, "N s/m", logarithmic=bounded),
        "profile likelihood of one contact, its gap, place and drive found with it",
        int(one.residuals.sizes["sample"]),
        (run.name,),
        (
            (f"95 % limits {low:.3g} to {high:.3g} N s/m" if bounded else "the profile does not bound it on both sides")
            + f"; the window is the median one of {len(alone)}",
        ),
        data=shown.assign_attrs(parameter="c_s", units="N s/m", synthetic="yes" if run.synthetic else "no"),
        plot="profile",
    )


def _data(found: ContactFit, resolution: float) -> xr.Dataset:
    """The longest run, sample by sample."""
    which = max(range(len(found.runs)), key=lambda i: found.fits[i].residuals.sizes["sample"])
    run, fitted_of = found.runs[which], found.fits[which].residuals
    time, x = run.time, run.positions
    fitted, segment = np.full(len(x), np.nan), np.full(len(x), -1)
    at = np.searchsorted(time, fitted_of["time"].values)
    fitted[at], segment[at] = fitted_of["fitted"].values, fitted_of["window"].values
    gap = float(found.values[found.place(which, 0)])
    gap_error = float(np.sqrt(found.covariance[found.place(which, 0), found.place(which, 0)]))
    return picture_data(
        [run],
        {
            "time": {
                "time": time,
                "x": x,
                "x_error": np.full(len(x), resolution / np.sqrt(12)),
                "fitted": fitted,
                "residual": x - fitted,
                "segment": segment,
                "in_contact": (np.where(np.isfinite(fitted), fitted, -np.inf) > gap).astype(np.int8),
            }
        },
        gap=Estimate(gap, gap_error, "m"),
    ).assign_attrs(run=run.name)
