r"""Closed forms of the motion without contact, and of its grazing.

Below the gap the oscillator is linear, :math:`m \ddot x + c \dot x + 2 k x = \rho \cos \omega t`. Its steady motion
has the amplitude :math:`a = (\rho / m) / \sqrt{(2k/m - \omega^2)^2 + (c \omega / m)^2}` and just touches the support
where :math:`a = g`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


def grazing_frequencies(parameters: Mapping[str, float]) -> list[float]:
    r"""Frequencies at which the steady motion without contact just touches the support.

    The real positive roots of

    .. math:: (2k/m - \omega^2)^2 + (c \omega / m)^2 = (\rho / (m g))^2,

    a quadratic in :math:`\omega^2`.

    Parameters
    ----------
    parameters : mapping
        ``m``, ``k``, ``c``, ``rho`` and ``g``, such as the ``values`` of the system (g > 0).

    Returns
    -------
    list of float
        None, one or two frequencies in rad/s, rising.

    Raises
    ------
    ValueError
        A gap that is not positive: that support is pressed at rest, and no motion grazes it from below.
    """
    m, k, c, rho, g = (parameters[name] for name in ("m", "k", "c", "rho", "g"))
    if not g > 0:
        raise ValueError(f"grazing from below needs a gap g > 0, not {g}")
    # w2^2 - 2 b w2 + (2k/m)^2 - (rho/(m g))^2 = 0 with w2 = omega^2
    b = 2 * k / m - 0.5 * (c / m) ** 2
    rest = b * b - (2 * k / m) ** 2 + (rho / (m * g)) ** 2
    if rest < 0:
        return []
    return sorted(float(np.sqrt(square)) for square in {b - np.sqrt(rest), b + np.sqrt(rest)} if square > 0)


def free_amplitude(parameters: Mapping[str, float]) -> float:
    """Amplitude (m) of the steady motion without contact."""
    return abs(_response(parameters))


def steady_state(parameters: Mapping[str, float]) -> dict[str, float]:
    """State of the steady motion without contact at phase 0 of the forcing."""
    response = _response(parameters)
    return {"x": response.real, "v": (1j * parameters["omega"] * response).real}


def _response(parameters: Mapping[str, float]) -> complex:
    p = parameters
    return complex(p["rho"] / (2 * p["k"] - p["m"] * p["omega"] ** 2 + 1j * p["c"] * p["omega"]))
