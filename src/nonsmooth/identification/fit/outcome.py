"""A finished fit as a ``ParameterSet``: uncertainties, what is not identifiable, and where the model fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.arrow import Sandwich, concerned, sandwich
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.fit.first_level import BETTER
from nonsmooth.identification.fit.first_windows import turns_of
from nonsmooth.identification.fit.growth import SHORT, Grown
from nonsmooth.identification.fit.likelihood import profiled
from nonsmooth.identification.fit.noise import OUTLYING, robust_size
from nonsmooth.identification.fit.residuals import by_place, residual_data, steady_data
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.results.progress import Progress

_TOGETHER = 0.98  # correlation from which two parameters are said to be known only together
_POOR = 2.0  # residuals over noise, from which the model is said not to be the motion
_NOTHING = 0.5  # residuals over the readings' own variation, from which the model is said to explain nothing
_SEEN, _BETWEEN = 200, 16  # readings at the beginning of a record, and instants that are looked at for each
_PER_SWING, _SWINGS = 4, 3  # readings for each swing, below which other motions have them too; swings that tell it
_DECADES = 3.0  # from a first guess, by which a stiffness is off in a record of minutes or milliseconds
_SHARED = 8  # readings that share the record's extreme value
_FEW, _NAMED = 0.05, 6  # part of the readings that outliers are at most; outliers of which the times are named
METHOD_STEADY = "least squares over the steady states that sweeps up and down reach, derivatives of the periodic orbits"
METHOD = (
    "least squares over windows with free starts, derivatives through every transition (Bock 1981); covariance from "
    "the scatter of the scores (Newey and West 1987)"
)


def outcome(
    grown: Grown,
    options: Mapping[str, Any],
    synthetic: bool = False,
    profiles: Sequence[str] = (),
    watched: Progress = False,
    left: Sequence[str] = (),
    beside: Sequence[Finding] = (),
) -> ParameterSet:
    """The parameters, with what is known of how well."""
    problem, theta = grown.problem, grown.theta
    u = problem.unknowns
    found = sandwich(problem, theta, grown.starts)
    loose = dict[int, set[int]]()  # unknowns that the records leave open, each with those that it may be traded for
    for direction in concerned(grown.loose(found.state)).T:
        together = np.flatnonzero(direction).tolist()
        for i in together:
            loose.setdefault(i, set()).update(together)
    starts, follow, own = _starts(grown, found)
    noise = _noise(grown, found)
    jacobian = np.vstack([np.eye(len(theta)), *follow])
    of_theta = found.covariance + np.outer(grown.left, grown.left)
    m, s, q = len(theta), len(jacobian), len(noise)
    covariance = np.zeros((s + q, s + q))
    covariance[:s, :s] = jacobian @ of_theta @ jacobian.T
    covariance[m:s, m:s] += own
    covariance[range(s, s + q), range(s, s + q)] = [one.uncertainty**2 for one in noise.values()]
    lost = np.flatnonzero(~(np.diag(covariance) >= 0.0))  # also of a fit that went so wrong that nothing is left
    for i in {*loose, *lost.tolist()}:
        covariance[i] = covariance[:, i] = 0.0
        covariance[i, i] = np.inf
    known = [i for i in range(m) if np.isfinite(covariance[i, i])]
    asked = [u.names[i] for i in known if u.names[i] in profiles or i in grown.doubted]
    profile = profiled(grown, asked, found.normal + u.precision, found.covariance, synthetic, watched)
    doubted = {i: one for i, one in zip(map(u.names.index, asked), profile, strict=True) if i in grown.doubted}
    for i, one in doubted.items():
        _widen(covariance, i, one)
    told = {name: (v, unit) for name, v, unit in zip(u.names, theta, u.units, strict=True)} | starts
    rows = [Estimate(v, np.sqrt(covariance[i, i]), unit) for i, (v, unit) in enumerate(told.values())]
    found_of = list(zip(told, rows, strict=True))
    a = sum(name in u.active for name in u.names)
    estimates, extra = dict(found_of[:a]), {**dict(found_of[a:]), **noise}
    mark, samples = {"synthetic": "yes" if synthetic else "no"}, grown.readings
    data = residual_data(grown, options).assign_attrs(mark) if problem.pieces else None
    if problem.steady:
        steady = steady_data(grown, options).assign_attrs(mark)
        beside = [_of_steady(grown, steady, rows[0]), *beside]
        samples += steady.sizes["sample"]
    beside = [*profile, *beside]
    notes = [*left, *(_notes(grown, found, data) if data is not None else [])]
    notes += [note for finding in beside for note in finding.notes]
    finding = Finding(
        "fit",
        next(iter({**estimates, **extra}.values())),
        METHOD,
        samples,
        grown.runs,
        tuple(notes),
        data=data,
        plot="fit_residuals" if data is not None else "",
    )
    return ParameterSet(
        estimates,
        covariance,
        extra=extra,
        findings=[finding, *beside],
        identifiability=_sentences(grown, covariance[:m, :m], loose, samples)
        | {
            one.name.removesuffix(", profile"): one.notes[0].partition(": ")[2] + "; its sum of squares is no parabola"
            for one in doubted.values()
        },
        notes=notes,
        anomalies=[*_anomalies(grown, data), *_far_off(grown)],
        synthetic=synthetic,
        bounds={name: pair for name, pair in u.bounds.items() if name in estimates},
    )


def _widen(covariance: FloatArray, i: int, profile: Finding) -> None:
    """Widen the uncertainty of an unknown to the limits of its profile; infinite where the profile does not end."""
    data = profile.data
    assert data is not None
    within = profile.estimate.interval()
    far = max(float(profile.value - data["low"]), float(data["high"] - profile.value))
    if np.isfinite(float(data["low"] + data["high"])):
        factor = max(1.0, far / (within[1] - profile.value))
        covariance[i] *= factor
        covariance[:, i] *= factor
    else:
        covariance[i] = covariance[:, i] = 0.0
        covariance[i, i] = np.inf


def _starts(grown: Grown, found: Sandwich) -> tuple[dict[str, tuple[float, str]], list[FloatArray], FloatArray]:
    """Free starts of the records with their units, how they follow the unknowns, and what their own readings leave
    open: NaN where it is the spread that holds a start, rather than readings."""
    from scipy.linalg import block_diag

    problem, system = grown.problem, grown.problem.system
    states = [*system.states.items(), *system.memory.items()]
    starts: dict[str, tuple[float, str]] = {}
    rows, own = list[FloatArray](), [np.zeros((0, 0))]
    for i, window in enumerate(problem.pieces):
        if i and problem.pieces[i - 1].record == window.record:
            continue
        inverse, cross, _ = found.back[i]
        follows = np.zeros((len(window.start), len(grown.theta)))
        follows[:, window.which] = -inverse @ cross
        label = f", {problem.records[window.record].name}" if len(problem.records) > 1 else ""
        starts |= {f"{states[k][0]}(0){label}": (grown.starts[i][k], states[k][1]) for k in window.free}
        rows.append(follows[window.free])
        left = (inverse @ inverse.T)[np.ix_(window.free, window.free)]
        left[np.diag(np.diag(left) > 0.5 * window.spread[window.free] ** 2)] = np.nan
        own.append(left * found.reduced)
    return starts, rows, block_diag(*own)


def _noise(grown: Grown, found: Sandwich) -> dict[str, Estimate]:
    """Standard deviations of readings, rounding included, where they were found from the residuals."""
    problem = grown.problem
    units = {**problem.system.states, **problem.system.outputs}
    rows = {}
    for c, (name, sensor) in enumerate(problem.sensors.items()):
        n = sum(int(np.sum(window.readings[1] == c)) for window in problem.pieces)
        if sensor.noise is None and n:
            size = problem.noise[c]
            unit = units[name] if sensor.gain == 1 else ""
            rows[f"{name}.noise"] = Estimate(size, size * np.sqrt(found.correlation / (2.0 * n)), unit)
    return rows


def _sentences(grown: Grown, covariance: FloatArray, loose: Mapping[int, set[int]], samples: int) -> dict[str, str]:
    """A sentence for each unknown: what it rests on, or that the record does not determine it."""
    u, theta = grown.problem.unknowns, grown.theta
    error = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = np.nan_to_num(covariance / np.outer(error, error))
    np.fill_diagonal(correlation, 0.0)
    rows = {}
    for i, name in enumerate(u.names):
        others = [u.names[k] for k in sorted(loose.get(i, ())) if k != i]
        closest = int(np.argmax(np.abs(correlation[i])))
        if i in loose and others:
            text = f"not identifiable: only a combination of it and {', '.join(others)} is; give one its value"
        elif i in loose:
            text = "not identifiable: the recorded motion does not depend on it, or another start makes up for it"
        elif theta[i] in (u.low[i], u.high[i]):
            text = "at its bound: the record draws it beyond, so its uncertainty does not hold"
        elif error[i] > abs(theta[i]) and name in u.active:
            text = "hardly identifiable: its uncertainty is larger than its value"
        elif abs(correlation[i, closest]) > _TOGETHER:
            text = f"known mainly together with {u.names[closest]} (correlation {correlation[i, closest]:.4f})"
        else:
            measured = dict.fromkeys([*grown.problem.sensors, *(q for s in grown.problem.steady for q in s.quantities)])
            text = f"{samples} readings of {', '.join(measured)}"
        rows[name] = text
    return rows


def _of_steady(grown: Grown, data: xr.Dataset, estimate: Estimate) -> Finding:
    notes = []
    for one in grown.problem.steady:
        kind, known = "amplitudes" if one.amplitude else "section points", np.isfinite(one.error)
        found = "" if known.all() else f"; their noise, which is not known, is {np.median(one.noise[~known]):.3g}"
        notes.append(
            f"run {one.name}: {len(one.measured)} {kind} of steady states at {len(one.values)} settings{found}"
        )
        if one.left:
            notes.append(f"run {one.name}: {one.left} settings are not used, which have no period number or no reading")
        if n := int((~one.used).sum()):
            notes.append(f"run {one.name}: {n} readings are not used: the model's motion there has no period")
    return Finding(
        "steady states",
        estimate,
        METHOD_STEADY,
        data.sizes["sample"],
        tuple(one.name for one in grown.problem.steady),
        tuple(notes),
        data=data,
        plot="steady_readings",
    )


def _far_off(grown: Grown) -> list[str]:
    """Sentences on readings of steady states that lie far from those of the model."""
    found = []
    for i, one in enumerate(grown.problem.steady):
        left = one.measured - grown.problem.of_steady(grown.theta, i)[0]
        known = np.isfinite(one.error) & one.used
        for size, mine, most, words in (
            (one.error, known, _POOR, "their errors"),
            (np.full(len(left), np.std(one.measured)), ~known, _NOTHING, "their own variation"),
        ):
            if mine.any() and (rms := np.sqrt(np.mean((left / size)[mine] ** 2))) > most:
                found.append(
                    f"the readings of run {one.name} are {rms:.3g} times {words} away from the steady states of the "
                    "model: it does not describe them (are they in its units?), and the uncertainties do not hold"
                )
    return found


def _notes(grown: Grown, found: Sandwich, data: xr.Dataset) -> list[str]:
    problem = grown.problem
    n, records = len(problem.pieces), len(problem.records)
    if n == records:
        notes = [f"one window for each of {records} records" if records > 1 else "one window over the whole record"]
    else:
        notes = [
            f"{n} windows of about {grown.length:.4g}, each with its own start: over longer ones the motion is not "
            "followed"
        ]
    for c in range(len(problem.sensors)):
        notes += _of_readings(grown, c, data)
    if found.correlation > 2.0:
        notes.append(f"the residuals correlate over {found.correlation:.3g} readings; the uncertainties account for it")
    notes += [note for i in range(records) for note in _of_inputs(grown, i)]
    modes = list(problem.system.modes)
    for record, mode, excess in grown.begins:
        label = f"run {problem.records[record].name} begins" if records > 1 else "the record begins"
        words = f"chi^2 is {excess:.3g} higher in any other" if np.isfinite(excess) else "it has no motion in any other"
        if excess < BETTER:
            words = f"chi^2 is only {excess:.2g} higher in another: the readings do not tell which"
        notes.append(f"{label} in mode {modes[mode]!r}; {words}")
    u = problem.unknowns
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = np.abs(grown.theta / u.guess)
        decades = np.abs(np.log10(factors))
    k = int(np.argmax(np.where(np.isfinite(decades), decades, 0.0)))
    if _DECADES < decades[k] < np.inf:
        notes.append(
            f"{u.names[k]} is {factors[k]:.2g} times its first guess: if that was more than a guess, see whether the "
            "record's times and readings are in the units of the model"
        )
    places = [row for row in by_place(data) if row[2] >= 5]
    if len(places) > 1:
        notes.append(
            "rms of the residuals, over all: 1; " + "; ".join(f"{name}: {rms:.2f}" for name, rms, _ in places[:4])
        )
    return notes


def _of_inputs(grown: Grown, run: int) -> list[str]:
    """Notes on the inputs of a run that were sampled at other times than its readings."""
    record, values = grown.problem.records[run], grown.problem.at(grown.theta, run).values
    if record.drive is None or values is None:
        return []
    course = record.drive.at(dict(zip(grown.problem.system.parameters, values.tolist(), strict=True)))
    time, notes = record.time, []
    label = f"run {record.name}" if len(grown.problem.records) > 1 else "the record"
    for name, (t, _) in zip(record.drive.inputs, course.courses, strict=True):
        within = int(np.count_nonzero((t >= time[0]) & (t <= time[-1])))
        off = int(np.count_nonzero((time < t[0]) | (time > t[-1])))
        words = f"of {label} lie before the first or behind the last sample of the input {name!r}"
        if len(t) > 1 and off > _FEW * len(time):
            notes.append(f"{off} of {len(time)} readings {words} ({t[0]:.6g} to {t[-1]:.6g}): its value there is kept")
        if within < min(_FEW * len(t), len(t) - 2):
            notes.append(
                f"{within} of {len(t)} samples of the input {name!r} lie within the time of {label}: see "
                "whether both count time from one instant, in one unit"
            )
    return notes


def _of_readings(grown: Grown, c: int, data: xr.Dataset) -> list[str]:
    """Notes on the readings of a quantity: coloured noise, outliers, readings at a limit of the sensor."""
    problem, name = grown.problem, list(grown.problem.sensors)[c]
    mine, notes = data["quantity"].values == c, []
    r, time = (data["measured"] - data["fitted"]).values[mine], data["time"].values[mine]
    if problem.colour[c]:
        notes.append(
            f"the noise of {name} correlates by {problem.colour[c]:.2f} from reading to reading ({problem.step[c]:.3g} "
            "apart, the shortest where runs differ), and is weighed by that"
        )
    out = np.flatnonzero(np.abs(r) > OUTLYING * max(robust_size(r), problem.least[c]))
    if 0 < len(out) < _FEW * len(r):
        at = ", ".join(f"{t:.6g}" for t in time[out[:_NAMED]]) + (", ..." if len(out) > _NAMED else "")
        weighed = "has weighed them down" if np.isfinite(problem.loss) else "weighs such readings down"
        notes.append(
            f"{len(out)} outliers of {name}, {OUTLYING:g} noise deviations off or more, at t = {at}; "
            f"loss='huber' {weighed}"
        )
    at_limits = sum(int(np.count_nonzero(problem.limits(w)[w.readings[1] == c])) for w in problem.pieces)
    if at_limits:
        notes.append(f"{at_limits} readings of {name} are at a limit of its sensor: they count as there or beyond")
    return notes


def _ends(grown: Grown, data: xr.Dataset) -> list[str]:
    """Sentences on quantities of which many readings share an extreme value that the fit exceeds."""
    found = []
    for c, (name, sensor) in enumerate(grown.problem.sensors.items()):
        y, fitted = (data[column].values[data["quantity"].values == c] for column in ("measured", "fitted"))
        for sign, word in ((1.0, "largest"), (-1.0, "smallest")):
            end = sign * np.max(sign * y, initial=-np.inf)
            beyond = sign * (fitted[y == end] - end)
            if sensor.range is None and len(beyond) >= _SHARED and np.mean(beyond) > 0.5 * grown.problem.noise[c]:
                found.append(
                    f"{len(beyond)} readings of {name} share its {word} value, {end:.6g}, and the fit goes beyond it: "
                    "if the sensor ends there, say so by Sensor(range=...)"
                )
    return found


def _aliases(grown: Grown) -> list[str]:
    """A sentence on a fitted motion that swings faster than its readings show, at the records' beginnings."""
    problem, rng = grown.problem, np.random.default_rng(0)
    counts, pairs = np.zeros((2, len(problem.sensors))), [*zip(problem.pieces, grown.starts, strict=True)]
    for window, start in {window.record: (window, start) for window, start in pairs[::-1]}.values():
        if not (k := min(_SEEN, len(window.time) - 1)):
            continue
        # At no rate, which could have aliases too.
        time = np.sort(rng.uniform(window.time[0], window.time[k], _BETWEEN * k))
        fine = replace(window, time=time, values=np.zeros((len(time), counts.shape[1])))
        if (motion := problem.marched(grown.theta, fine, start)) is not None:
            predicted = problem.readings(grown.theta, fine, motion, False)[0].reshape(fine.values.shape)
            counts += np.isfinite(window.values[:k]).sum(axis=0), [0.5 * turns_of(y) for y in predicted.T]
    read, swings = counts
    best = int(np.argmax(read / np.maximum(swings, 1e-300)))  # the quantity that shows most of the motion
    if swings[best] <= _SWINGS or read[best] >= _PER_SWING * swings[best]:
        return []
    name, each = list(problem.sensors)[best], read[best] / swings[best]
    return [
        f"the fitted motion of {name} has {each:.2g} readings for each of its swings: so few are those of slower or "
        "faster motions too; see whether the record's times are in the unit of the model"
    ]


def _anomalies(grown: Grown, data: xr.Dataset | None) -> list[str]:
    found = [] if data is None else [*_aliases(grown), *_ends(grown, data)]
    if data is not None and (grown.rms > _POOR or grown.missing):
        name, rms, _ = next(row for row in by_place(data) if row[2] >= min(5, data.sizes["sample"]))
        found.append(
            f"the residuals are {grown.rms:.3g} times the noise that the record's own irregularity shows"
            f"{', with a structure that no noise has' if grown.missing else ''}: the model does not describe this "
            f"record, least of all in {name} ({rms:.2f} times the mean); the uncertainties do not hold"
        )
    elif grown.opened:
        found.append(
            "short windows with starts of their own fit better than noise allows: the fit is at another minimum than "
            "theirs, or the model lacks a part; the uncertainties do not hold"
        )
    elif grown.problem.colour.any() and not grown.whole:
        found.append(
            "the residuals over windows with starts of their own correlate: the noise is coloured, or the model lacks "
            "a part, and windows so short do not tell which"
        )
    if grown.unused:
        found.append(
            f"{grown.unused} of {grown.unused + grown.readings} readings are not used: the model has no motion "
            "there (it begins beyond a stop, or does not come to an end)"
        )
    if grown.stuck:
        found.append(
            f"the model follows this record over windows of {grown.length:.3g} only, though neighbouring motions do "
            "not separate faster: it does not describe the record over longer times, or another first guess does"
        )
    if grown.short > SHORT:
        found.append(
            f"the fit stands {grown.short:.2g} standard uncertainties short of its minimum: the sum of squares has "
            "corners (grazes, rest), where no step leads on; what is left of the way is in the uncertainties"
        )
    return found
