r"""An impact damper: a ball in a cavity of a vibrating mass, Masri & Caughey, J. Appl. Mech. 33 (1966) 586-592.

Known in closed form: the symmetric motion with two impacts per period. The ball flies with the speed w, the momentum
is kept, so that the mass leaves an impact with the velocity -2 mu w less that of its arrival. With the free flow Phi
of the mass over half a period, (Phi + 1) h = (0, -2 mu w) gives its free part h, and the impact's phase follows from a
quadratic equation for w.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.system.derived.elements import Stop

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def impact_damper(**parameters: float) -> System:
    r"""Return the impact damper of Masri and Caughey (1966): a free ball in a box on a forced oscillator.

    .. math::

        \ddot x + 2 \zeta \dot x + x = F \cos \omega t, \qquad \ddot y = 0, \qquad |y - x| \le d / 2

    with impacts of restitution e between the unit mass and the ball of mass mu, which keep the momentum.

    Parameters
    ----------
    **parameters : float
        ``zeta`` 0.01, ``mu`` 0.1 (mass of the ball over that of the oscillator), ``e`` 0.75, ``d`` 1 (clearance), ``F``
        0.05, ``omega`` 1; dimensionless.

    Returns
    -------
    System
        States ``x``, ``y`` (the ball), ``v_x``, ``v_y``; modes by what the elements ``right`` and ``left`` of the box
        do (``open`` or ``rest``); outputs ``right_force`` and ``left_force``. It is symmetric.

    References
    ----------
    S.F. Masri, T.K. Caughey, J. Appl. Mech. 33 (1966) 586-592.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> damper = ns.models.impact_damper()
    >>> run = ns.simulate(damper, periods=5, transient=200, start={"v_y": 0.2})
    >>> float(run.u.sel(state="x").max()) < 0.05 / (2 * 0.01) / 5  # a fifth of the amplitude without the ball
    True
    """
    from nonsmooth.system.derived.mechanical import mechanical

    return mechanical(
        lambda p: [[1.0, 0.0], [0.0, p.mu]],
        lambda p: [[2 * p.zeta, 0.0], [0.0, 0.0]],
        np.diag([1.0, 0.0]),
        name="impact damper",
        coordinates=["x", "y"],
        forcing={"x": lambda t, p: p.F * np.cos(p.omega * t)},
        parameters={
            "zeta": (0.01, "", r"\zeta"),
            "mu": (0.1, "", r"\mu"),
            "e": 0.75,
            "d": 1.0,
            "F": 0.05,
            "omega": (1.0, "", r"\omega"),
        },
        elements={
            "right": Stop(at={"y": 1, "x": -1}, position=lambda t, u, p: p.d / 2, restitution="e"),
            "left": Stop(at={"y": 1, "x": -1}, position=lambda t, u, p: -p.d / 2, side=-1, restitution="e"),
        },
        symmetry=(
            lambda u: (-u.x, -u.y, -u.v_x, -u.v_y),
            0.5,
            {
                "left_open_right_rest": "left_rest_right_open",
                "left_rest_right_open": "left_open_right_rest",
            },
        ),
    ).with_parameters(parameters)
