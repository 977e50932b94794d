r"""Damping by the half-power bandwidth of the frequency response, without a fit of the model.

For :math:`\ddot x + 2\xi\omega_0\dot x + \omega_0^2 x = (F/m)\cos\omega t` the squared amplitude is half of its
largest at

.. math::

    \omega_{1,2}^2 = \omega_0^2 \left[1 - 2\xi^2 \mp 2\xi\sqrt{1 - \xi^2}\right],

so that with :math:`\xi = \sin\alpha`

.. math::

    \frac{\omega_2^2 - \omega_1^2}{\omega_2^2 + \omega_1^2} = \tan 2\alpha, \qquad
    \omega_0^2 = \frac{\omega_1^2 + \omega_2^2}{2 \cos 2\alpha}

exactly; the textbook's :math:`\xi \approx (\omega_2 - \omega_1)/2\omega_0` is its limit. The curve between the points
is a cubic for :math:`1/A^2` over :math:`\omega^2`, in which a linear oscillator is a parabola.

It takes dry friction for damping, as every method that looks at one amplitude does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.arrays import FloatArray
from nonsmooth_savi2007.identification.picture_data import picture_data
from nonsmooth_savi2007.identification.steady import Steady

_DEEPEST = 3.0  # amplitudes from a third of the largest on are used
_DRAWS = 200


def half_power_points(omega: FloatArray, amplitude: FloatArray) -> tuple[float, float, float]:
    r"""The two half-power frequencies and the largest amplitude of a response curve.

    Parameters
    ----------
    omega, amplitude : array (n,)
        At least eight points, on both sides of the half-power frequencies.

    Raises
    ------
    ValueError
        If the points do not enclose both half-power frequencies.
    """
    use = amplitude >= amplitude.max() / _DEEPEST
    if np.count_nonzero(use) < 8:
        raise ValueError(
            f"{np.count_nonzero(use)} points stand above a third of the largest amplitude, 8 are needed: step finer"
        )
    squares, middle = omega[use] ** 2, np.mean(omega[use] ** 2)
    width = np.ptp(squares) / 2
    # relative errors of the amplitudes are alike: those of 1/A^2 are 2 dA/A of it
    cubic = np.polynomial.Polynomial.fit(
        (squares - middle) / width, amplitude[use] ** -2.0, 3, domain=[-1, 1], w=amplitude[use] ** 2
    )
    q = np.linspace((squares.min() - middle) / width, (squares.max() - middle) / width, 2001)
    height = cubic(q)
    top = np.argmin(height)
    over = np.flatnonzero(np.diff(np.sign(height - 2 * height[top])))
    if len(over) != 2 or not over[0] < top < over[1]:
        raise ValueError("the runs do not enclose both half-power frequencies: step over a wider range")
    found = []
    for i in over:
        part = (2 * height[top] - height[i]) / (height[i + 1] - height[i])
        found.append(np.sqrt(middle + width * (q[i] + part * (q[i + 1] - q[i]))))
    return found[0], found[1], height[top] ** -0.5


def _damping(omega: FloatArray, amplitude: FloatArray) -> tuple[float, ...]:
    """xi, omega_0, omega_1, omega_2, largest amplitude."""
    first, second, largest = half_power_points(omega, amplitude)
    double = np.arctan((second**2 - first**2) / (second**2 + first**2))
    xi, natural = np.sin(double / 2), np.sqrt((first**2 + second**2) / (2 * np.cos(double)))
    return xi, natural, first, second, largest


def half_power(seen: Steady, mass: Quantity) -> Finding:
    r"""Viscous damping by half-power bandwidth, from the runs at the longest crank, where friction matters least.

    Parameters
    ----------
    seen : Steady
        Frequency steps without support.
    mass : Quantity
        Mass (kg) with its standard uncertainty.

    Returns
    -------
    Finding
        :math:`c = 2 m \xi \omega_0` (N s/m). ``others``: ``damping_ratio``, ``omega_0``, and ``c_`` with the length of
        every other crank.
    """
    by_crank = {}
    for longest in np.unique(seen.crank).tolist():
        part = seen.only(seen.crank == longest)
        value, error = _damping(part.omega, part.amplitude), _scatter(part)
        product = Estimate(2 * value[0] * value[1], 2 * error[5])
        by_crank[f"c_{1e3 * longest:.1f}mm"] = product.times(mass.value, mass.uncertainty, "N s/m")
    *others, (_, c) = by_crank.items()
    ratio = Estimate(value[0], error[0])
    notes = [
        f"half power at {value[2]:.4f} and {value[3]:.4f} rad/s, by a cubic of 1/A^2 over omega^2; uncertainty by "
        f"bootstrap over the {len(part)} runs at a crank of {1e3 * longest:.1f} mm"
    ]
    if others:
        notes.append("a c that falls as the crank grows is dry friction, not damping")
    return Finding(
        "c_half_power",
        c,
        "half-power bandwidth of the frequency response",
        part.samples,
        part.names,
        tuple(notes),
        {
            "damping_ratio": ratio,
            "omega_0": Estimate(value[1], error[1], "rad/s"),
            **dict(others),
        },
        data=picture_data(
            part.runs,
            {"run": part.curve},
            omega_low=value[2],
            omega_high=value[3],
            largest=value[4],
            damping_ratio=ratio,
            c=c,
        ),
        plot="half_power",
    )


def _scatter(part: Steady) -> FloatArray:
    """Standard deviations of xi, omega_0, omega_1, omega_2, largest amplitude and xi omega_0 by bootstrap over runs."""

    def again(rows: NDArray[np.intp]) -> FloatArray:
        try:
            row = np.array(_damping(part.omega[rows], part.amplitude[rows]))
        except ValueError:  # a draw without points on one side
            return np.full(6, np.nan)
        return np.append(row, row[0] * row[1])

    rng = np.random.default_rng(0)
    drawn = np.array([again(rng.integers(0, len(part), size=len(part))) for _ in range(_DRAWS)])
    return np.nanstd(drawn, axis=0, ddof=1)
