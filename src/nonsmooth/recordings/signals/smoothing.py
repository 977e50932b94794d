"""Position, velocity and acceleration from a quantised record, with standard errors; Savitzky-Golay beside it.

The signal is taken as a polynomial that is shaken: its n-th derivative is white noise, whose intensity is found by
maximum likelihood, so that nothing is to be tuned. An encoder's count is known to +- half a step, an error of variance
delta^2 / 12. Times may be uneven, samples may be missing. At an impact the position is continuous and the velocity is
free; nothing is carried across it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.recordings.signals.checks import even_rate, signal, unit_of, whose
from nonsmooth.results.labels import labelled
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Positive, at_least

#: The derivative that is white noise, by the name of the model.
MODELS = {"white_acceleration": 2, "white_jerk": 3, "white_snap": 4}


@checked
def smooth(
    time: ArrayLike,
    x: Any,
    *,
    resolution: Positive | None,
    noise: Annotated[float, at_least(0)] = 0.0,
    impacts: ArrayLike = (),
    contacts: Any = None,
    model: Literal["white_acceleration", "white_jerk", "white_snap", None] = None,
    intensity: Any = None,
) -> xr.Dataset:
    """Kalman smoother (Rauch-Tung-Striebel) of a quantised record, its process noise found by maximum likelihood.

    Each sample is the position plus an error of variance resolution^2 / 12 + noise^2. Where a slow motion stays on one
    count for several samples, their errors are one and the same: such samples count together as one.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds, increasing but not necessarily even, and the position. Values that are not finite are bridged, with a
        warning.
    resolution : float or None
        The step of the sensor, in the unit of ``x``. None: the variance of a sample is found by maximum likelihood.
    noise : float
        Standard deviation of what the sensor adds beside its step.
    impacts : array_like
        Times at which the velocity may jump. The position stays continuous.
    contacts : Dataset or (begin, end), optional
        Intervals of contact with a soft support, as :func:`~nonsmooth.recordings.signals.contacts.contacts` finds
        them. The velocity is continuous there, but the motion is quicker inside than outside: each has its own
        intensity.
    model : {"white_jerk", "white_snap", "white_acceleration"}, optional
        Which derivative is white noise: the third, the fourth, the second. The default is the third, which bears
        contacts that nobody has found yet; where ``contacts`` are given (none, ``((), ())``, is an answer too) it is
        the fourth, whose errors are a half to a third.
    intensity : float or (float, float), optional
        Intensity of that noise where it is known, e.g. from a longer record of the same kind; with ``contacts``
        that outside and that inside, ``(outside, inside)``.

    Returns
    -------
    Dataset
        ``x``, ``v``, ``a`` with ``x_error``, ``v_error``, ``a_error`` over ``time`` (no ``a`` for
        ``"white_acceleration"``), ``segment`` (impacts before the sample), and over ``impact`` what the smoother says
        of the two sides: ``impact_time``, ``impact_x``, ``v_before``, ``v_after`` with errors. The attributes
        hold the model, its ``intensity`` and the ``log_likelihood``.

    Raises
    ------
    ValueError
        If the record is too short, an impact lies outside it, or an argument is not as above.

    Notes
    -----
    The errors are standard deviations under the model. That a motion is a shaken polynomial is an assumption: it
    was tested on quantised sinusoids, decays and impacts (``tests/recordings/signals``), where the normalised errors
    of x and v have a root mean square near 1.

    Source: Rauch, Tung and Striebel, AIAA Journal 3 (1965) 1445-1450.
    """
    model = model or ("white_jerk" if contacts is None else "white_snap")
    order = MODELS[model]
    t, values = signal(time, x, least=2 * order, purpose="smoothing", missing="keep")
    places = np.unique(np.asarray(impacts, float).ravel())
    if len(places) and not (t[0] < places[0] and places[-1] < t[-1]):
        raise ValueError(
            f"{whose(x)}: impacts must lie inside the record, {t[0]:.9g} to {t[-1]:.9g} s; "
            f"given are {places[0]:.9g} to {places[-1]:.9g} s"
        )
    nodes = _Nodes(t, values, places, _bounds(contacts, x), order, resolution, noise)
    return nodes.result(nodes.likeliest() if intensity is None else nodes.scaled(intensity), model, x)


def _bounds(contacts: Any, x: Any) -> FloatArray:
    """Begin and end of each contact in turn."""
    pair = (contacts["begin"], contacts["end"]) if hasattr(contacts, "data_vars") else (contacts or ((), ()))
    begin, end = (np.asarray(side, float) for side in pair)
    if begin.ndim != 1 or begin.shape != end.shape or not (begin < end).all() or not (end[:-1] <= begin[1:]).all():
        raise ValueError(f"{whose(x)}: contacts must be a begin and an end each, begin before end, one after the other")
    return np.column_stack([begin, end]).ravel()


class _Nodes:
    """Samples and places between them in units in which the typical step and the error of a sample are 1."""

    def __init__(
        self,
        t: FloatArray,
        x: FloatArray,
        impacts: FloatArray,
        contacts: FloatArray,
        order: int,
        resolution: float | None,
        noise: float,
    ) -> None:
        self.t, self.order, self.impacts = t, order, impacts
        self.known = resolution is not None
        self.h = np.median(np.diff(t))
        good = np.isfinite(x)
        if resolution is not None:
            count, jitter = resolution / math.sqrt(12.0), noise
        else:
            # A first guess only, which the likelihood corrects: the fourth differences of a smooth signal are noise.
            rough = np.diff(x[good], 4) / math.sqrt(70.0)
            count, jitter = np.sqrt(np.mean(rough**2)) or 1e-9 * np.ptp(x[good]) or 1.0, 0.0
        self.sigma = math.hypot(count, jitter)
        self.offset = x[good][0]
        stay, *edges = _stays(t, x, resolution) if resolution is not None else (np.ones(len(t)), *np.zeros((3, 0)))
        # kind 0: sample, 1: before an impact, 2: after it, 3: bound of a contact, 4: edge of a count
        places = [t, impacts, impacts, contacts[(contacts > t[0]) & (contacts < t[-1])], edges[0]]
        kind, when = np.repeat(range(5), [*map(len, places)]), np.concatenate(places)
        values, shares = np.full(len(when), self.offset), np.full(len(when), np.inf)
        values[kind == 0], values[kind == 4] = np.where(good, x, self.offset), edges[1]
        shares[kind == 0], shares[kind == 4] = np.where(good, stay, np.inf), edges[2]
        sort = np.lexsort((kind, when))
        self.kind, self.y = kind[sort], (values[sort] - self.offset) / self.sigma
        self.r = (shares[sort] * count**2 + jitter**2) / self.sigma**2
        self.step = np.concatenate([[0.0], np.diff(when[sort])]) / self.h
        # At the bound of a soft contact the force turns off its course: the jerk jumps.
        self.jump = np.select([self.kind == 2, self.kind == 3], [1, min(3, order)], order).astype(np.int64)
        self.inside = np.searchsorted(contacts, when[sort] - 0.5 * self.step * self.h, side="right") % 2 == 1
        # Variances far above those of the state: a start, or a derivative that jumps, is not to be guided.
        steps, level, wide = np.diff(t[good] / self.h), (x[good] - self.offset) / self.sigma, []
        for _ in range(order):
            wide.append(1e2 * np.max(np.abs(level)) ** 2 + 1e2)
            level = np.diff(level) / np.maximum(steps[: len(level) - 1], 0.2)
        self.wide = np.array(wide)
        n, count_nodes = order, len(when)
        self.u, self.P = np.zeros((2, count_nodes, n)), np.zeros((2, count_nodes, n, n))  # predicted, filtered
        self.work, self.sums = np.zeros((5, n, n)), np.zeros(2)

    def scaled(self, intensity: float | tuple[float, float]) -> FloatArray:
        given = np.atleast_1d(np.asarray(intensity, float))
        if len(given) not in (1, 2) or not np.isfinite(given).all() or (given < 0).any():
            raise ValueError(f"intensity must be a number >= 0, or (outside, inside) of contacts, got {intensity!r}")
        return given[[0, -1]] * self.h ** (2 * self.order - 1) / self.sigma**2

    def cost(self, q: FloatArray) -> float:
        """-2 log likelihood of the samples, up to a constant; leaves the filtered states behind.

        ``q`` holds the intensities outside and inside of contacts.
        """
        from nonsmooth.recordings.signals.kalman import filter_nodes

        filter_nodes(
            self.order,
            self.step,
            self.y,
            self.r,
            self.jump,
            self.wide,
            np.where(self.inside, q[1], q[0]),
            self.u,
            self.P,
            self.work,
            self.sums,
        )
        if self.known:
            return self.sums[0] + self.sums[1]
        used = np.count_nonzero(np.isfinite(self.r))
        return used * math.log(self.sums[0] / (used - self.order)) + self.sums[1]

    def likeliest(self) -> FloatArray:
        """The intensities of the largest likelihood: on a grid over all that can matter, then refined."""
        from scipy.optimize import minimize, minimize_scalar

        # The least shakes the signal by a tenth of a sample's error within the whole record, the most by the whole
        # range within one step.
        power = 2 * self.order - 1
        low, high = -power * math.log10(max(len(self.t), 10)) - 2.0, 2.0 * math.log10(np.ptp(self.y) + 1.0) + 3.0
        grid = np.linspace(low, high, max(16, int((high - low) / 1.5)))
        best = int(np.argmin([self.cost(np.full(2, 10.0**g)) for g in grid]))
        around = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
        found = minimize_scalar(
            lambda g: self.cost(np.full(2, 10.0**g)), bounds=around, method="bounded", options={"xatol": 0.01}
        )
        one = found.x
        if not self.inside.any():
            return np.full(2, 10.0**one)
        start = np.array([[one, one], [one - 1.0, one], [one, one + 1.0]])
        both = minimize(
            lambda g: self.cost(10.0 ** np.clip(g, low, high)),
            start[0],
            method="Nelder-Mead",
            options={"initial_simplex": start, "xatol": 0.02, "fatol": 0.02, "maxfev": 400},
        )
        if not both.success:
            raise SolveError(
                "the intensities of the motion outside and inside of contacts were not found in 400 evaluations; give "
                "intensity=(outside, inside)"
            )
        return 10.0 ** np.clip(both.x, low, high)

    def result(self, q: FloatArray, model: str, x: Any) -> xr.Dataset:
        """Filter, smooth, and label."""
        from nonsmooth.recordings.signals.kalman import smooth_nodes

        n, cost = self.order, self.cost(q)
        smooth_nodes(n, self.step, np.where(self.inside, q[1], q[0]), self.u, self.P, self.work)
        used = np.count_nonzero(np.isfinite(self.r))
        sigma = self.sigma if self.known else self.sigma * math.sqrt(self.sums[0] / (used - n))
        units = [self.h**-k for k in range(n)]
        states = self.u[1] * self.sigma * units
        states[:, 0] += self.offset
        errors = np.sqrt(np.maximum(np.einsum("kii->ki", self.P[1]), 0.0)) * sigma * units
        sample, before, after = (self.kind == kind for kind in range(3))
        at_impacts = {"impact_time": labelled("impact", self.impacts, "time of the impact", "s")}
        for name, side, words in (
            ("impact_x", before, "position at the impact"),
            ("v_before", before, "velocity before the impact"),
            ("v_after", after, "velocity after the impact"),
        ):
            k = int(name != "impact_x")
            unit = unit_of(x) + "/s" * k
            at_impacts[name] = labelled("impact", states[side, k], words, unit)
            at_impacts[f"{name}_error"] = ("impact", errors[side, k], {"units": unit})
        attrs = {
            "method": "Kalman smoother (Rauch-Tung-Striebel)",
            "model": model,
            "intensity": q[0] * sigma**2 / self.h ** (2 * n - 1),
            "sample_error": sigma,
            "log_likelihood": -0.5 * cost,
        }
        if self.inside.any():
            attrs["intensity_in_contact"] = q[1] * sigma**2 / self.h ** (2 * n - 1)
        found = labelled_motion(self.t, states[sample].T[:3], errors[sample].T[:3], self.impacts, x)
        return found.assign(at_impacts).assign_attrs(attrs)


def labelled_motion(
    t: FloatArray, states: Iterable[FloatArray], errors: Iterable[FloatArray], impacts: FloatArray, x: Any
) -> xr.Dataset:
    """Position, velocity and acceleration (as many as are given) with their errors, in the unit of ``x``."""
    unit, data = unit_of(x), {}
    names = {"x": ("position", ""), "v": ("velocity", "/s"), "a": ("acceleration", "/s^2")}
    for (name, (long_name, per)), state, error in zip(names.items(), states, errors, strict=False):
        data[name] = labelled("time", state, long_name, unit + per)
        data[f"{name}_error"] = labelled("time", error, f"standard error of the {long_name}", unit + per)
    coords = {
        "time": labelled("time", t, "time", "s"),
        "segment": labelled("time", np.searchsorted(impacts, t, side="left"), "number of impacts before this sample"),
    }
    return xr.Dataset(data, coords)


def _stays(t: FloatArray, x: FloatArray, resolution: float) -> tuple[FloatArray, ...]:
    """Stays of an encoder on one count, and the instants at which it changes, which is all that it says of a slow
    motion: how many samples share a count, for each; time, value and variance of the changes, in that of a sample.

    While a count stays for ``n`` samples their errors are one and the same, and together they say as much as one
    sample: the variance of each grows by n. In exchange the change by one count between two samples is a position, the
    edge between the counts, known to 1/n of a count, n the shorter of the two stays: the error of a motion that passes
    a count in n samples, in the middle of a step.
    """
    ends = np.concatenate([[0], np.flatnonzero(np.diff(x) != 0) + 1, [len(x)]])
    lengths, last = np.diff(ends), ends[1:-1] - 1  # the last sample of each stay but the final one
    shorter = np.minimum(lengths[:-1], lengths[1:])
    single = np.abs(np.abs(x[last + 1] - x[last]) / resolution - 1.0) < 0.1
    use = single & (shorter >= 2)
    time, value = (0.5 * (one[last] + one[last + 1])[use] for one in (t, x))
    return np.repeat(lengths, lengths).astype(np.float64), time, value, 1.0 / shorter[use] ** 2


@checked
def savitzky_golay(
    time: ArrayLike,
    x: Any,
    *,
    resolution: Positive,
    window: int = 9,
    order: int = 4,
    impacts: ArrayLike = (),
) -> xr.Dataset:
    """Position, velocity and acceleration from a polynomial fitted to each sample's neighbours.

    Between two impacts the record is filtered by itself (``scipy.signal.savgol_filter``, ``mode="interp"``); its ends
    take the values of the polynomial fitted to the first and last ``window`` samples.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds at an even rate, and the position; no missing values.
    resolution : float
        The step of the sensor; a sample has the variance resolution^2 / 12.
    window, order : int
        Samples that the polynomial is fitted to (odd), and its order (2 or more, below ``window``).
    impacts : array_like
        Times at which the velocity jumps.

    Returns
    -------
    Dataset
        As :func:`~nonsmooth.recordings.signals.smoothing.smooth` gives, without what concerns impacts. The errors
        are those of the counts alone, sigma times the norm of the filter's weights; the largest difference from the
        same filter of order + 2, which shows what the polynomial cannot follow, stands in the attributes
        ``x_bias``, ``v_bias`` and ``a_bias`` (root mean squares).

    Raises
    ------
    ValueError
        If the rate is not even, values are missing, or a piece between impacts is shorter than the window.
    """
    from scipy.signal import savgol_coeffs, savgol_filter

    if window % 2 == 0 or not 2 <= order < window - 2:
        raise ValueError(f"window must be odd and order from 2 to window - 3, got window={window}, order={order}")
    t, values = signal(time, x, least=window, purpose="Savitzky-Golay smoothing")
    step = 1.0 / even_rate(t, x, "Savitzky-Golay smoothing")
    hits = np.unique(np.asarray(impacts, float).ravel())
    segment = np.searchsorted(hits, t, side="left")
    states, errors = np.empty((3, len(t))), np.empty((3, len(t)))
    attrs = {"method": "Savitzky-Golay", "window": window, "order": order}
    half = window // 2
    for k, name in enumerate("xva"):
        bias = []
        # Weights of each place in the window; the middle ones serve everywhere but at the ends.
        norms = [np.linalg.norm(savgol_coeffs(window, order, k, step, pos=i)) for i in range(window)]
        for part in np.unique(segment):
            here = np.flatnonzero(segment == part)
            if len(here) < window:
                raise ValueError(
                    f"{whose(x)}: only {len(here)} samples between impacts from t = {t[here[0]]:.9g} s on, and the "
                    f"window has {window}: take a shorter one, or smooth()"
                )
            piece = values[here]
            states[k, here] = savgol_filter(piece, window, order, deriv=k, delta=step)
            place = np.minimum(np.arange(len(here)), half)
            place = np.minimum(place, place[::-1])
            errors[k, here] = np.array(norms)[place] * resolution / math.sqrt(12.0)
            finer = savgol_filter(piece, window, min(order + 2, window - 1), deriv=k, delta=step)
            bias.append(finer[half:-half] - states[k, here][half:-half])
        attrs[f"{name}_bias"] = np.sqrt(np.mean(np.concatenate(bias) ** 2))
    return labelled_motion(t, states, errors, hits, x).assign_attrs(attrs)
