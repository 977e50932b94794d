r"""A harmonically forced oscillator that hits a rigid stop: the rigid relative of the discontinuous support.

Dankowicz & Schilder, *Recipes for Continuation* (SIAM 2013), Ex. 15.2. Known in closed form: the orbit that does not
reach the stop grazes it at A = d sqrt((k - omega^2)^2 + (c omega)^2) (0.1 at the default values); the monodromy matrix
of an orbit with one impact per period T has the determinant e^2 exp(-c T). It is Nordmark's oscillator, too (J. Sound
Vib. 145 (1991) 279-297): from motion of an amplitude X above d the first impact has the speed omega sqrt(X^2 - d^2),
the square root of its normal form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.transition import Transition

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _motion(t: Any, u: Any, p: Any) -> Any:
    x, v = u
    return v, p.A * np.cos(p.omega * t) - p.k * x - p.c * v


def impact_oscillator(**parameters: float) -> System:
    r"""Return the impact oscillator: a forced mass on a spring that hits a rigid stop.

    :math:`\ddot x + c \dot x + k x = A \cos \omega t`, and :math:`\dot x^+ = -e \dot x^-` at :math:`x = d`.

    Parameters
    ----------
    **parameters : float
        ``k`` 1, ``c`` 0.1, ``omega`` 1, ``d`` 1 (the stop), ``e`` 0.8 (restitution), ``A`` 1; dimensionless.

    Returns
    -------
    System
        One mode ``motion``; indicator ``stop`` (x - d); one transition into the same mode with a reset.

    References
    ----------
    H. Dankowicz, F. Schilder, *Recipes for Continuation*, SIAM 2013, Ex. 15.2; A.B. Nordmark, J. Sound Vib. 145 (1991)
    279-297.
    """
    from nonsmooth.system.system import System

    return System(
        name="impact oscillator",
        states={"x": "", "v": ""},
        parameters={"k": 1.0, "c": 0.1, "omega": 1.0, "d": 1.0, "e": 0.8, "A": 1.0},
        modes={"motion": _motion},
        indicators={"stop": lambda t, u, p: u.x - p.d},
        transitions=[Transition("motion", "motion", when="stop > 0", reset=lambda t, u, p: (u.x, -p.e * u.v))],
    ).with_parameters(parameters)
