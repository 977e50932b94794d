r"""A ball on a vibrating table that bounces so high that the displacement of the table does not matter.

The orbit that bounces once in n periods of the table, :math:`v = 2 \pi n`,
:math:`\cos\theta = -2 \pi n (1 - \alpha) / \gamma`, appears in a fold at :math:`\gamma = 2 \pi n (1 - \alpha)` and
loses stability in a flip at :math:`\gamma = 2 \sqrt{\pi^2 n^2 (1 - \alpha)^2 + (1 + \alpha)^2}`: for n = 1 at
3.141593 and 4.344 with :math:`\alpha = 0.5`, at 1.256637 and 3.813 with 0.8. Its determinant is :math:`\alpha`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from nonsmooth.system.derived.maps import Map


def _bounce(u: Any, p: Any) -> Any:
    landing = u.theta + u.v
    # The phase between 0 and 2 pi: its derivative in the landing phase is 1.
    phase = np.pi + np.arctan2(-np.sin(landing), -np.cos(landing))
    return phase, p.alpha * u.v - p.gamma * np.cos(landing)


def bouncing_ball_map(**parameters: float) -> Map:
    r"""Return the high-bounce map of a ball on a vibrating table.

    :math:`\theta \to \theta + v` (between 0 and :math:`2\pi`), :math:`v \to \alpha v - \gamma \cos(\theta + v)`

    Parameters
    ----------
    **parameters : float
        ``alpha`` 0.5 (coefficient of restitution), ``gamma`` 4 (:math:`2 (1 + \alpha) \omega^2 A / g` for a table that
        moves as :math:`A \sin \omega t`).

    Returns
    -------
    Map
        One branch; the states are the table's phase at an impact and the ball's velocity behind it, in units of
        :math:`g / (2 \omega)`. Give a start such as ``{"theta": 4.0, "v": 6.3}``: it decides which orbit is reached.

    References
    ----------
    P.J. Holmes, J. Sound Vib. 84 (1982) 173-189; J. Guckenheimer, P. Holmes, *Nonlinear Oscillations, Dynamical
    Systems, and Bifurcations of Vector Fields*, Springer 1983, sec. 2.4.
    """
    from nonsmooth.system.derived.maps import Branch, Map

    return Map(
        name="bouncing ball map",
        states={"theta": "", "v": ""},
        parameters={"alpha": (0.5, "", r"\alpha"), "gamma": (4.0, "", r"\gamma")},
        branches=[Branch(_bounce)],
    ).with_parameters(parameters)
