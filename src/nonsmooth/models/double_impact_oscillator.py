r"""A forced mass between two rigid stops: Peterka, Facta Universitatis 2 (10) (2000), the double impact oscillator.

Known in closed form for c = 0: in the symmetric motion with one impact on each stop per period the impact velocity V
solves a quadratic equation. With S = sin(pi / omega), C = cos(pi / omega), k = (1 + e) S / (2 (1 + C)): (g - k V)^2 +
((1 - e) V / (2 omega))^2 = 1 / (1 - omega^2)^2. Its bounds are those where an eigenvalue of the map from one impact to
the next is 1 (saddle-node), -1 (loss of symmetry) or where the mass also grazes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.system.derived.elements import Stop

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def double_impact_oscillator(**parameters: float) -> System:
    r"""Return the double impact oscillator: one forced mass on a spring between two rigid stops.

    :math:`\ddot x + c \dot x + x = \cos \omega t`, and :math:`\dot x^+ = -e \dot x^-` at :math:`x = \pm g`.

    Parameters
    ----------
    **parameters : float
        ``c`` 0 (damping), ``g`` 0.5 (clearance on either side over the static deflection), ``e`` 0.6 (restitution),
        ``omega`` 1.5; dimensionless.

    Returns
    -------
    System
        States ``x`` and ``v_x``; modes by what each of the elements ``right`` and ``left`` does (``open`` or
        ``rest``); outputs ``right_force`` and ``left_force`` while it rests. It is symmetric.

    References
    ----------
    F. Peterka, Facta Universitatis, Mechanics, Automatic Control and Robotics 2 (10) (2000).

    Examples
    --------
    >>> import nonsmooth as ns
    >>> orbit = ns.find_orbit(ns.models.double_impact_oscillator())
    >>> orbit.period_number, orbit.stable
    (1, True)
    """
    from nonsmooth.system.derived.mechanical import mechanical

    return mechanical(
        1.0,
        lambda p: p.c,
        1.0,
        name="double impact oscillator",
        coordinates="x",
        forcing={"x": lambda t, p: np.cos(p.omega * t)},
        parameters={"c": 0.0, "g": 0.5, "e": 0.6, "omega": (1.5, "", r"\omega")},
        elements={
            "right": Stop(at="x", position="g", restitution="e"),
            "left": Stop(at="x", position=lambda t, u, p: -p.g, side=-1, restitution="e"),
        },
        symmetry=(
            lambda u: (-u.x, -u.v_x),
            0.5,
            {
                "left_open_right_rest": "left_rest_right_open",
                "left_rest_right_open": "left_open_right_rest",
            },
        ),
    ).with_parameters(parameters)
