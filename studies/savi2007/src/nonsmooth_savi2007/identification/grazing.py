r"""The gap from the grazing frequency: where the free motion, as the drive is stepped, first reaches the support.

Up to the graze the support changes nothing, so the last free runs tell all about the motion that would have been: its
amplitude over frequency is the free response, here scaled to the runs themselves. A soft support hardly distorts the
motion at first, but it pushes one way only: the sign of contact is that the mean position leaves its place. The first
run in which it does bounds the graze from the other side. A push that is too light to be seen widens the bracket: a
motion of amplitude A that goes by p beyond the gap is pushed by :math:`\tfrac43 k_s p \sqrt{2p/A}/(2\pi)` on the mean,
and its place moves by this over 2k.

Between the two lies the gap, with the uncertainty of the bracket (uniform), of the sensor and, at rest, of the zero.

Contact may begin too early: where a motion with contact exists beside the free one, the transient of a step (or of a
start from rest) leads to it before the free motion reaches the support. The first run with contact shows this by
itself. Per period it takes the impulse :math:`J = 2k\,T\,\Delta x` from the shift :math:`\Delta x` of its mean. A
contact that goes by p beyond the gap while springs and drive hold the car back by :math:`a_0` gives

.. math::

    J = 2 m \omega_s (R \sin\theta - q\,\theta), \qquad
    \omega_s^2 = k_s/m, \quad q = a_0/\omega_s^2, \quad R = p + q, \quad \cos\theta = q/R,

the solution of :math:`\ddot y = -\omega_s^2 y - a_0` from contact to release. So the largest position less p is the
gap, between the values for :math:`a_0 = 0` and for that of the free motion at its top. Where p is more than the width
of the bracket, contact has not begun gently, and the gap is taken to lie between the larger of both lower and the
larger of both upper ends.

The screw's zero does not enter, and the place about which the car swings is seen in the same runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding, uniform
from nonsmooth_savi2007.identification.evidence import Run, picture_data
from nonsmooth_savi2007.identification.free_decay import DecayFit
from nonsmooth_savi2007.identification.response_fits import grazing_amplitude
from nonsmooth_savi2007.identification.steady import Steady, steady

_FIRST = 4  # runs that must be free
_SIGMAS = 5.0  # by which the mean must leave its place
_STEADY = 0.5  # counts: by which the mean of free runs may move
_COUNTS = 0.06  # and by how much of a count: what the mean of a run can be off by rounding
_ALIKE = 3.0  # counts by which the tops of contacts that are alike may differ
_PUSHED = 0.03  # of the depth: what the law of the push leaves out (damping, drive during contact)


def grazing_gap(runs: Sequence[Run], decay: DecayFit, *, kappa: float) -> Finding:
    r"""The gap referred to the mean position under the drive, from frequency steps through the first contact.

    Parameters
    ----------
    runs : sequence of Run
        Steady runs in the order of the steps, with ``x``, ``turns``, one ``crank_length`` and one ``gap`` at the screw,
        the support mounted; the first four free.
    decay : DecayFit
        The free oscillator.
    kappa : float
        About k_s/m (1/s^2): what a push tells.

    Returns
    -------
    Finding
        ``gap_grazing`` (m), counted from the mean position of the car under this drive. ``others``: ``at_rest`` (m),
        counted from where the car rests with the motor off, and ``grazing_frequency`` (rad/s).

    Raises
    ------
    ValueError
        If the first four runs are not free or none has contact, the crank's length or the screw changes, or a free run
        comes after contact has begun.
    """
    if len(readings := {run.gap for run in runs if run.mounted}) > 1:
        raise ValueError(
            f"the graze is sought at one gap, these runs have readings of {sorted(readings)} m at the screw: give one "
            "of them at a time"
        )
    seen = steady(runs)
    if len(set(seen.crank.tolist())) != 1:
        raise ValueError(
            "the graze is sought in steps of the frequency at one crank length, these runs have "
            f"{sorted(set(seen.crank.tolist()))} m: give one of them at a time"
        )
    first, limit = _touching(seen)
    if not np.all(seen.amplitude[:first] < seen.amplitude[first]):
        raise ValueError("the motion does not grow towards the first contact; the steps must go towards resonance")
    last, contact = first - 1, np.arange(len(seen)) >= first
    free = ~contact
    height = _height(seen, free, decay)
    ends = seen.omega[[last, first]]
    low, high = height(ends)
    place = seen.mean[free].mean()
    low -= _unseen(limit, seen.amplitude[last], kappa / decay.law[0] ** 2)
    normal = _sensor_error(seen, free, height)
    least, most, depth = _by_push(seen, first, place, decay, kappa)
    by = f"by the width of the step, {1e6 * normal:.1f} µm by the sensor"
    if depth > abs(high - low):
        by = (
            f"by the step and the push of the first run with contact, which goes {1e6 * depth:.0f} µm beyond the gap "
            "at once: a transient may have begun contact before the free motion reached the gap"
        )
        if least > high:
            by += f", and did, {1e6 * (0.5 * (least + most) - high):.0f} µm early"
        low, high = max(low, least), max(high, most)
    gap, half = 0.5 * (low + high), 0.5 * abs(high - low)
    zero, zero_error = decay.rest, decay.error("x_e")
    at_rest = np.hypot(np.hypot(normal, zero_error), uniform(half))
    total = np.hypot(normal, uniform(half))
    width = 0.5 * np.ptp(ends)
    return Finding(
        "gap_grazing",
        Estimate(gap, total, "m", half_width=half),
        "largest free motion between the last run without contact and the first with it",
        seen.samples,
        seen.names,
        (
            f"contact begins between {ends.min():.3f} and {ends.max():.3f} rad/s: the gap lies within "
            f"±{1e6 * half:.1f} µm {by}",
            f"counted from the mean position under the drive at a crank of {1e3 * seen.crank[0]:.2f} mm, "
            f"{1e6 * (place - zero):+.0f} µm from where the car rests",
        ),
        {
            "at_rest": Estimate(gap + place - zero, at_rest, "m", half_width=half),
            "grazing_frequency": Estimate(ends.mean(), uniform(width), "rad/s", half_width=width),
        },
        data=picture_data(
            seen.runs,
            {
                "run": {
                    "setting": seen.omega,
                    "amplitude": seen.highest - place,
                    "amplitude_error": np.hypot(seen.error, seen.mean_error),
                    "contact": contact.astype(np.int8),
                }
            },
            grazing_low=ends.min(),
            grazing_high=ends.max(),
            gap=Estimate(gap, total, "m"),
        ),
        plot="grazing",
    )


def _touching(seen: Steady) -> tuple[int, float]:
    """The first run that touches, and the distance of a mean from that of the free runs that tells so.

    All runs from the first with contact on have left it: a single mean that strays among free runs is no contact.
    """
    n = len(seen)
    if n <= _FIRST:
        raise ValueError(f"{n} runs are too few to find the graze: {_FIRST} free ones and those with contact")
    turn = np.sign(np.diff(seen.omega))
    if not np.all(turn == turn[0]):
        raise ValueError("the frequency does not go one way from run to run: give the steps of one direction")
    if np.std(seen.mean[:_FIRST], ddof=1) > _STEADY * seen.resolution:
        raise ValueError(
            f"the mean position moves among the first {_FIRST} runs: they touch already, or are not steady; begin "
            "farther away from resonance, in free motion (where contact ends is not where it begins)"
        )
    begun, limit = _FIRST, 0.0
    for _ in range(len(seen.mean)):  # the scatter of the means from the free runs, the free runs from the scatter
        free = seen.mean[:begun]
        limit = max(_SIGMAS * free.std(ddof=1), _COUNTS * seen.resolution)
        near = np.flatnonzero(np.abs(seen.mean - np.mean(free)) <= limit)
        before, begun = begun, max(near[-1] + 1 if len(near) else 0, _FIRST)
        if begun == before:
            break
    else:
        raise ValueError(
            "which runs are free cannot be told: their mean position drifts towards that of contact; zero the sensor, "
            "and step finer"
        )
    if begun == n:
        raise ValueError(f"none of the {n} runs touches: step on from free motion into contact")
    return begun, limit


def _unseen(limit: float, amplitude: float, stiff: float) -> float:
    """Penetration of a motion whose mean moves by ``limit``; ``stiff`` is k_s/(2k)."""
    return (1.5 * np.pi * limit / stiff * np.sqrt(amplitude / 2)) ** (2 / 3)


def _by_push(seen: Steady, first: int, place: float, decay: DecayFit, kappa: float) -> tuple[float, float, float]:
    """Least and largest gap that the first run with contact allows, from the place of the free motion, and its depth.

    Where one contact is not like the other the push of each is not known: then the gap lies below the highest position,
    and the depth is infinite.
    """

    run, last, (natural, _, f) = seen.runs[first], first - 1, decay.law
    period = 2 * np.pi / seen.omega[first]
    turn = np.floor((run.time - run.time[0]) / period).astype(int)
    tops = np.array([run.positions[turn == i].max() for i in range(turn.max())]) - place
    # dry friction moves the mean of a motion that goes longer one way
    shift = place - seen.mean[first] - f / natural**2 * (seen.lean[first] - np.mean(seen.lean[:first]))
    stiff, impulse = np.sqrt(kappa), natural**2 * period * max(shift, 0.0)
    if np.ptp(tops) > _ALIKE * seen.resolution:
        return 0.0, tops.max(), np.inf

    def depth(q: float) -> float:
        def excess(p: float) -> float:
            theta = np.arccos(q / (p + q))
            return 2 * stiff * ((p + q) * np.sin(theta) - q * theta) - impulse

        return brentq(excess, 0.0, impulse / (2 * stiff) + 10 * (impulse**2 * q / stiff**2) ** (1 / 3) + 1e-9)

    held = (seen.omega[last] ** 2 * seen.amplitude[last]) / kappa
    most, least = depth(held), depth(1e-6 * held)
    own = 0.5 * seen.resolution + _PUSHED * most  # a top lies between samples, too
    return tops.mean() - most - own, tops.mean() - least + own, most


def _height(seen: Steady, free: NDArray[np.bool_], decay: DecayFit) -> Callable[[FloatArray], FloatArray]:
    """Height of the free motion above its mean, over frequency.

    The crank's length and the balance of friction are known to a few parts in a thousand: the model is scaled to the
    free runs that are nearest to the graze. A second harmonic, by string and ripple, hardly changes among them.
    """

    def model(omega: FloatArray) -> FloatArray:
        return grazing_amplitude(omega, seen.crank[0], *decay.law)

    rows = np.flatnonzero(free)
    near = rows[np.argsort(np.abs(seen.omega[rows] - seen.omega[rows[-1]]))[: max(_FIRST, len(rows) // 2)]]
    scale = np.mean(seen.amplitude[near] / model(seen.omega[near]))
    more = np.mean(seen.highest[near] - seen.mean[near] - seen.amplitude[near])
    return lambda omega: scale * model(omega) + more


def _sensor_error(seen: Steady, free: NDArray[np.bool_], height: Callable[[FloatArray], FloatArray]) -> float:
    """Of a height above the mean, by the scatter of the free runs about the curve, not less than rounding allows."""
    n = int(np.count_nonzero(free))
    scatter = np.std(seen.highest[free] - seen.mean[free] - height(seen.omega[free]), ddof=1)
    return max(scatter, seen.resolution / np.sqrt(12 * n)) / np.sqrt(min(n, _FIRST))
