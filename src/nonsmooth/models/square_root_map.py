r"""Nordmark's square-root map: an impact oscillator near the amplitude at which it grazes its stop.

Between impacts the return map is linear; an impact of low speed adds a square root, whose slope is infinite at the
border x = 0. With :math:`s = \sqrt{x}` the period-m orbit with one point beyond the border solves

.. math:: (1 - \lambda^m) s^2 + \lambda^{m-1} s = \mu \frac{1 - \lambda^m}{1 - \lambda}

and has the multiplier :math:`\lambda^m - \lambda^{m-1} / (2 s)`: it is stable from the flip at
:math:`s = \lambda^{m-1} / (2 (1 + \lambda^m))` up to the border collision at
:math:`\sqrt\mu = \lambda^{m-2} (1 - \lambda) / (1 - \lambda^m)`. The intervals of neighbouring m overlap for
:math:`\lambda < 1/4` (period adding), leave gaps with chaos between them for :math:`1/4 < \lambda < 2/3`, and do not
exist for :math:`\lambda > 2/3` (chaos at once), as published.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from nonsmooth.system.derived.maps import Map


def _free(u: Any, p: Any) -> Any:
    return (p.lam * u.x + p.mu,)


def _impact(u: Any, p: Any) -> Any:
    return (p.lam * u.x + p.mu - np.sqrt(u.x),)


def square_root_map(**parameters: float) -> Map:
    r"""Return the square-root map of Nordmark: the normal form of a grazing impact in one dimension.

    :math:`x \to \lambda x + \mu` for :math:`x \le 0`, :math:`\lambda x + \mu - \sqrt x` for :math:`x > 0`

    Parameters
    ----------
    **parameters : float
        ``lam`` 0.2 (:math:`\lambda`, 0 to 1), ``mu`` 0.05 (distance from the graze, which is at 0).

    Returns
    -------
    Map
        The branches free (x < 0) and impact (x > 0).

    References
    ----------
    A.B. Nordmark, J. Sound Vib. 145 (1991) 279-297; W. Chin, E. Ott, H.E. Nusse, C. Grebogi, Phys. Rev. E 50 (1994)
    4427-4444.
    """
    from nonsmooth.system.derived.maps import Branch, Map

    return Map(
        name="square-root map",
        states={"x": ""},
        parameters={"lam": (0.2, "", r"\lambda"), "mu": (0.05, "", r"\mu")},
        branches=[Branch(_free, when="x < 0"), Branch(_impact, when="x > 0")],
    ).with_parameters(parameters)
