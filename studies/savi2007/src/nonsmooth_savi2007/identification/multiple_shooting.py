r"""Gap and contact parameters from records with contact: :func:`nonsmooth.fit` over windows with free starts.

.. math::

    \ddot x + \omega_0^2 (x - x_e) + b\,\dot x + f\,\mathrm{sign}\,\dot x
        + [\kappa (x - g) + \gamma \dot x]_{\text{contact}} = \tfrac12 \omega_0^2 D(\varphi)

with everything divided by the mass: a motion tells only such ratios. The crank's mean angle is known from the
photogate: a line through all passages, and for a motor that wanders, straight between two of them;
:math:`D = a \cos(\varphi + \theta) + D_c \cos 2\varphi + D_s \sin 2\varphi`. What the free decay has told,
:math:`\omega_0, b, f`, enters as known with its covariance; the crank's length a is known to 0.5 %, while the mark
:math:`\theta`, the second harmonic (string and ripple) and the place x_e about which the car swings are free in each
run. The gap comes out in the sensor's own count, and the place of the swing with it, so that their difference, the gap
*referred to the car's mean position under the drive*, needs no zero.

Each run is fitted alone, and those whose residuals are the sensor's are joined: the information of all of them, with
that of the decays once. How far the estimate moves with every other turn of the crank alone is added to its uncertainty
where the motor wanders.

A contact is eight samples, and none shows :math:`c_s/k_s`, half a millisecond: the speed that a contact takes, some
3 %, shows in the free motion after it. The profile over one contact tells how well; many tell it better.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.special import ndtri

from nonsmooth import ParameterSet, Sensor, SolveError, System, elements, fit, mechanical
from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.identification.cross_checks import inverse
from nonsmooth_savi2007.identification.evidence import Run, picture_data
from nonsmooth_savi2007.identification.free_decay import DecayFit

SHARED = ("omega_0", "b", "f", "kappa", "gamma")
OWN = ("g", "x_e", "crank", "mark", "cosine_2", "sine_2")  # of each run
_TURNING = ("omega", "turned")  # of an even drive: its angle is omega t + turned
_WINDOW = 1.3  # s: about as long as a motion with contact is told by its start
_LONGEST = 40.0  # s: of a run
_BEGINS = 2.0  # s within which a run begins, at its farthest from the support
_TRIED = 5  # windows with one contact, of which the median one is shown
_FAR = 1.5  # times the sensor's noise: residuals of a run that is not of this law


class ContactFit(NamedTuple):
    """Outcome: ``kappa`` = k_s/m, ``gamma`` = c_s/m, and for each run the gap and the place of the swing.

    ``values`` and ``covariance``: those that are `SHARED`, then per run its `OWN`; ``fits``: each run alone;
    ``by_turns``: how far the values move with every other turn of the crank; ``excess``: residuals over the sensor's
    noise; ``left``: a sentence on each run that is left out; ``poor``: whether most runs are not of the law.
    """

    values: FloatArray
    covariance: FloatArray
    runs: tuple[Run, ...]
    fits: tuple[ParameterSet, ...]
    by_turns: FloatArray
    excess: float
    left: tuple[str, ...] = ()
    poor: bool = False

    def place(self, run: int, which: int) -> int:
        """Index of a run's own parameter: 0 gap, 1 place, 2-5 drive."""
        return len(SHARED) + len(OWN) * run + which

    def estimate(self, place: int, unit: str = "", logarithmic: bool = False) -> Estimate:
        """The parameter at a place."""
        value, error = self.values[place], np.sqrt(self.covariance[place, place])
        return Estimate(value, error, unit, logarithmic=logarithmic and value > 0)

    @property
    def samples(self) -> int:
        """Samples that entered."""
        return sum(one.residuals.sizes["sample"] for one in self.fits)

    @property
    def n_contacts(self) -> int:
        """Number of contacts in what is fitted."""
        return sum(self._met(i, slice(None)) for i in range(len(self.fits)))

    def _met(self, run: int, samples: Any) -> int:
        """Number of contacts that begin among some samples of a run's fit."""
        above = self.fits[run].residuals["fitted"].values[samples] > self.values[self.place(run, 0)]
        return int(np.count_nonzero(~above[:-1] & above[1:]))

    def single(self) -> list[tuple[int, float, float]]:
        """Run, first and last time (s) of each window with one contact."""
        found = []
        for i, one in enumerate(self.fits):
            data = one.residuals
            for k in np.unique(data["window"].values):
                mine = data["window"].values == k
                if self._met(i, mine) == 1:
                    time = data["time"].values[mine]
                    found.append((i, time[0], time[-1]))
        return found


@cache
def _rig(wanders: bool) -> System:
    """The car between its springs, with the support; x in the sensor's count.

    The crank turns evenly, so that the model is linear in each mode; where the motor ``wanders`` its angle is an input.
    """

    def push(t: Any, p: Any) -> Any:
        angle = p.phi if wanders else p.omega * t + p.turned
        drive = p.crank * np.cos(angle + p.mark) + p.cosine_2 * np.cos(2 * angle) + p.sine_2 * np.sin(2 * angle)
        return p.omega_0**2 * (0.5 * drive + p.x_e)

    units = ("rad/s", "1/s", "N/kg", "1/s^2", "1/s", "m", "m", "m", "rad", "m", "m", "rad/s", "rad")
    names = (*SHARED, *OWN) if wanders else (*SHARED, *OWN, *_TURNING)
    return mechanical(
        1.0,
        "b",
        lambda p: [[p.omega_0**2]],
        coordinates={"x": "m"},
        forcing={"x": push},
        inputs={"phi": "rad"} if wanders else None,
        parameters={name: (1.0, unit) for name, unit in zip(names, units, strict=False)},
        elements={
            "dry": elements.Coulomb(at="x", friction="f"),
            "support": elements.ElasticStop(at="x", position="g", stiffness="kappa", damping="gamma"),
        },
        name="car with support",
    )


def known_before(run: Run, decay: DecayFit, mark: float = 0.0, **also: Estimate) -> ParameterSet:
    """Priors: what the decays, the settings of a run, and ``also`` others by themselves, tell of its motion."""
    crank, rest = run.crank, decay.rest
    values = (*decay.law, run.gap + rest, rest, crank, mark, 0.0, 0.0)
    # the gap as read to 1.5 mm; the crank as set to 0.5 %, a phase of the mark to 0.05 rad, a second harmonic to 3 %
    covariance = np.diag([0.0, 0.0, 0.0, 1.5e-3, 1e-3, 5e-3 * crank, 0.05, 0.03 * crank, 0.03 * crank]) ** 2
    covariance[:3, :3] = decay.covariance[:3, :3] + 1e-12 * np.diag(np.diag(decay.covariance)[:3])
    rows = zip((*SHARED[:3], *OWN), values, np.sqrt(np.diag(covariance)), strict=True)
    return ParameterSet(
        {name: Estimate(v, e) for name, v, e in rows} | also,
        block_diag(covariance, *(one.uncertainty**2 for one in also.values())),
    )


def fit_contact(
    run: Run,
    known: ParameterSet,
    first: Mapping[str, float],
    span: tuple[float, float],
    coarse: bool = False,
    **options: Any,
) -> ParameterSet:
    """Fit a run, or its part between two times (s), from first values; ``options`` of :func:`nonsmooth.fit`.

    ``coarse``: follow a crank that wanders by every other turn.
    """
    wanders, drive = not run.drive.wander()[1], run.drive.coarser if coarse else run.drive
    inside = (run.time >= span[0]) & (run.time <= span[1])
    recorded, set_to = {"x": (run.time[inside], run.positions[inside])}, {}
    if wanders:
        at = drive.turn_times
        at = np.unique(np.r_[span[0] - 0.1, at[(at > span[0]) & (at < span[1])], span[1] + 0.1])
        recorded["phi"] = at, drive.phase(at)
    else:
        set_to = dict(zip(_TURNING, np.polyfit(drive.turn_times, 2 * np.pi * drive.turns, 1).tolist(), strict=True))
    return fit(
        _rig(wanders).with_parameters({**first, **set_to}),
        recorded,
        dict.fromkeys([*SHARED, *OWN]) | {"gamma": (0.0, None)},
        measured={"x": Sensor(resolution=run.resolution)},
        priors=known,
        window=_WINDOW,
        tries=1,
        progress=False,
        mode="dry_stick_support_open",
        **options,
    )


def shoot_contacts(
    runs: Sequence[Run], decay: DecayFit, *, kappa: float, gamma: float, mark: float = 0.0
) -> ContactFit:
    """Fit the runs with contact, and join what they tell.

    Parameters
    ----------
    runs : sequence of Run
        With ``x``, ``turns``, and the settings ``crank_length`` and ``gap`` (a first guess).
    decay : DecayFit
        What the free decay told.
    kappa, gamma : float
        First guess of k_s/m (1/s^2) and c_s/m (1/s).
    mark : float
        About the crank's angle at the photogate (rad), from where it pulls towards the support.

    Raises
    ------
    ValueError
        If no run has a contact.
    SolveError
        If no run can be fitted.
    """
    rows: list[tuple[Run, ParameterSet, ParameterSet, FloatArray]] = []
    # those near enough to the support: the screw's reading may be off by a millimetre
    reach = {run: run.gap - 1e-3 if run.gap < 2e-3 else 0.5 * run.gap for run in runs}
    left, touched = [], [run for run in runs if run.positions.max() > decay.rest + reach[run]]
    if not touched:
        raise ValueError("no run shows a contact: the gap and the support cannot be found from them")
    for run in touched:
        # from where the car is farthest from the support
        begin = run.time[np.argmin(run.positions[run.time < run.time[0] + _BEGINS])]
        known, span = known_before(run, decay, mark), (begin, min(run.time[-1], begin + _LONGEST))
        first = {"kappa": kappa, "gamma": gamma, **known}
        try:
            found = fit_contact(run, known, first, span)
            if _excess(found, decay) > _FAR:
                found = fit_contact(run, known, first, span, leave_out=True)
        except SolveError as reason:
            left.append(f"contact {run.name}: left out: {reason}")
            continue
        moved = np.zeros(len(SHARED) + len(OWN))
        if not run.drive.wander()[1]:
            moved = _values(fit_contact(run, known, found, span, coarse=True)) - _values(found)
        rows.append((run, found, known, moved))
    sizes = [_excess(found, decay) for _, found, _, _ in rows]
    good = [row for row, size in zip(rows, sizes, strict=True) if size <= _FAR]
    poor = 2 * len(good) <= len(touched)
    if not poor:
        left += [
            f"contact {run.name}: left out: its residuals are {size:.3g} times the sensor's noise; look at its crank "
            "length, photogate and string"
            for (run, *_), size in zip(rows, sizes, strict=True)
            if size > _FAR
        ]
        rows = good
    if not rows:
        raise SolveError("; ".join(left))
    used, fits, *_ = zip(*rows, strict=True)
    values, covariance, moved = _joined([row[1:] for row in rows])
    return ContactFit(
        values,
        covariance + np.outer(moved, moved),
        used,
        fits,
        moved,
        np.median([_excess(one, decay) for one in fits]),
        tuple(left),
        poor,
    )


def _excess(found: ParameterSet, decay: DecayFit) -> float:
    """Residuals over the sensor's noise; infinite where a parameter is not determined."""
    told = np.isfinite(list(found.uncertainty.values())).all()
    return found.extra["x.noise"].value / decay.noise if told else np.inf


def _values(found: ParameterSet) -> FloatArray:
    return np.array([found.estimate(name).value for name in (*SHARED, *OWN)])


def _joined(rows: Sequence[tuple[ParameterSet, ParameterSet, FloatArray]]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values, covariance and shift by turns of all runs together: weights add, that of the decays counts once."""
    names, s, n = [*SHARED, *OWN], len(SHARED), len(SHARED) + len(OWN) * len(rows)
    total, pull, shift = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    for i, (found, known, moved) in enumerate(rows):
        here = np.r_[range(s), range(s + len(OWN) * i, s + len(OWN) * (i + 1))]
        information = inverse(found.full_covariance.sel(parameter=names, other=names).values)
        value = _values(found)
        if i:
            decays = inverse(known.full_covariance.values[:3, :3])
            information[:3, :3] -= decays
            pull[:3] += decays @ (value[:3] - [known[name] for name in SHARED[:3]])
        total[np.ix_(here, here)] += information
        pull[here] += information @ value
        shift[here] += information @ moved
    covariance = inverse(total)
    return covariance @ pull, covariance, covariance @ shift


def contact_finding(found: ContactFit, mass: Quantity | Estimate) -> Finding:
    """Support damping (known to a factor), and beside it stiffness and the gap of each run in the sensor's count."""
    gaps = {f"gap, {run.name}": found.estimate(found.place(i, 0), "m") for i, run in enumerate(found.runs)}
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
    longest = int(np.argmax([one.residuals.sizes["sample"] for one in found.fits]))
    run, fitted_of = found.runs[longest], found.fits[longest].residuals
    gap = found.estimate(found.place(longest, 0), "m")
    fitted, segment = np.full(len(run.time), np.nan), np.full(len(run.time), -1)
    at = np.searchsorted(run.time, fitted_of["time"].values)
    fitted[at], segment[at] = fitted_of["fitted"].values, fitted_of["window"].values
    touching = (np.where(np.isfinite(fitted), fitted, -np.inf) > gap.value).astype(np.int8)
    columns = {"time": run.time, "x": run.positions, "fitted": fitted, "segment": segment, "in_contact": touching}
    return Finding(
        "c_s_contact",
        found.estimate(4, logarithmic=True).times(mass.value, mass.uncertainty, "N s/m"),
        f"multiple shooting over {found.n_contacts} contacts",
        found.samples,
        tuple(run.name for run in found.runs),
        tuple(notes),
        {"k_s": found.estimate(3).times(mass.value, mass.uncertainty, "N/m"), **gaps},
        data=picture_data([run], {"time": columns}, gap=gap),
        plot="multiple_shooting",
    )


def one_contact(found: ContactFit, decay: DecayFit, mass: float, *, kappa_error: float) -> Finding:
    r"""The profile of c_s over a window with a single contact: what one contact tells on its own.

    Known besides is what does not come from contacts: the free oscillator, k_s/m to ``kappa_error``, and the drive as
    set. Gap, place and the drive's details are this window's own to find, as they were for all together. Of some
    windows the median one, in how well it tells c_s, is shown.
    """
    (kappa, gamma), windows = found.values[3:5].tolist(), found.single()
    alone = []
    for i, first, last in windows[:: max(len(windows) // _TRIED, 1)]:
        run = found.runs[i]
        known = known_before(
            run,
            decay,
            found.values[found.place(i, 3)],
            kappa=Estimate(kappa, kappa_error),
            gamma=Estimate(gamma, 10 * gamma),
        )
        try:
            one = fit_contact(run, known, known, (first, last), profile=["gamma"])
        except SolveError:
            continue
        if np.isfinite(one.uncertainty["gamma"]):
            alone.append((one.uncertainty["gamma"], run, one))
    if not alone:
        raise ValueError("no contact can be fitted on its own")
    width, run, one = sorted(alone, key=lambda row: row[0])[len(alone) // 2]
    data = next(finding.data for finding in one.findings if finding.name == "gamma, profile")
    assert data is not None
    best, low, high = (mass * float(data[name]) for name in ("best", "low", "high"))
    bounded = 0 < low and high < np.inf
    limits = f"95 % limits {low:.3g} to {high:.3g} N s/m" if bounded else "the profile does not bound it on both sides"
    error = best * np.log(high / low) / (2 * ndtri(0.975)) if bounded else mass * width
    shown = data.assign({name: data[name] * mass for name in ("best", "low", "high")})
    shown = shown.assign_coords(value=("value", mass * data["value"].values, {"units": "N s/m"}))
    return Finding(
        "c_s_one_contact",
        Estimate(best, error, "N s/m", logarithmic=bounded),
        "profile likelihood of one contact, its gap, place and drive found with it",
        one.residuals.sizes["sample"],
        (run.name,),
        (f"{limits}; the window is the median one of {len(alone)}",),
        data=shown.assign_attrs(parameter="c_s", units="N s/m", synthetic="yes" if run.synthetic else "no"),
        plot="profile",
    )
