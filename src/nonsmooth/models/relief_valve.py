r"""A pressure relief valve that chatters on its seat (Hos & Champneys, Physica D 241 (2012) 2068-2076).

Dimensionless valve lift y1, its velocity y2 and the reservoir's pressure y3; the disc impacts on the seat
at y1 = 0. Known in closed form: the equilibrium loses stability in a Hopf bifurcation at
q = 8.4911176352 (Routh-Hurwitz). The cycle at q = 8 spans 0.668282564 <= y1 <= 6.009885866 with period 2.392389442;
below about q = 7.56 it hits the seat.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.transition import Transition

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _open(t: Any, u: Any, p: Any) -> Any:
    y1, y2, y3 = u
    return y2, -p.k * y2 - (y1 + p.delta) + y3, p.beta * (p.q - y1 * np.sqrt(y3))


def relief_valve(**parameters: float) -> System:
    r"""Return the relief valve: an autonomous nonlinear system with impacts.

    .. math::

        \dot y_1 = y_2, \quad \dot y_2 = -\kappa y_2 - (y_1 + \delta) + y_3, \quad
        \dot y_3 = \beta (q - y_1 \sqrt{y_3}); \qquad y_2^+ = -r y_2^- \text{ at } y_1 = 0

    Parameters
    ----------
    **parameters : float
        ``k`` 1.25 (damping, the paper's kappa), ``delta`` 10 (precompression), ``beta`` 20 (compressibility), ``r`` 0.8
        (restitution), ``q`` 5 (inflow, 0.2 to 10).

    Returns
    -------
    System
        One mode ``open``; indicators ``seat`` (y1) and ``lift_velocity`` (y2; falling through 0 at the maxima of
        the lift: the section of the published scans). Give a start with a pressure, such as
        ``{"y1": 0.2, "y2": 0.0, "y3": 10.0}``: at the default one, all zero, the valve is on its seat and the root
        of the pressure has no derivative.

    References
    ----------
    C. Hos, A.R. Champneys, Physica D 241 (2012) 2068-2076; MPGOS, tutorial 6.
    """
    from nonsmooth.system.system import System

    return System(
        name="relief valve",
        states={"y1": "", "y2": "", "y3": ""},
        parameters={
            "k": (1.25, "", r"\kappa"),
            "delta": 10.0,
            "beta": 20.0,
            "r": 0.8,
            "q": 5.0,
        },
        modes={"open": _open},
        indicators={"seat": lambda t, u, p: u.y1, "lift_velocity": lambda t, u, p: u.y2},
        transitions=[Transition("open", "open", when="seat < 0", reset=lambda t, u, p: (0.0, -p.r * u.y2, u.y3))],
        scale={"y1": 1.0, "y2": 1.0, "y3": 10.0},
    ).with_parameters(parameters)
