r"""A symmetrically bilinear oscillator on a shaken base: Wiercigroch & Sin, J. Appl. Mech. 65 (1998) 657-663.

A mass on soft springs meets stiffer ones on both sides, each behind the gap g. Known in closed form: the motion
between the stiffer springs grazes them at A omega^2 = g sqrt((1 - omega^2)^2 + (2 zeta omega)^2), and free motion
without damping that leaves them with the speed v has the period
4 arcsin(g / a) + (4 / s) arctan(s v / g), a^2 = g^2 + v^2, s^2 = 1 + beta.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.system.derived.elements import Backlash

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def bilinear_oscillator(**parameters: float) -> System:
    r"""Return the symmetrically bilinear oscillator of Wiercigroch and Sin (1998), excited by its base.

    .. math::

        \ddot x + 2 \zeta \dot x + x + \beta f(x) = A \omega^2 \cos \omega t, \qquad
        f(x) = x - g \quad (x > g), \quad 0 \quad (|x| < g), \quad x + g \quad (x < -g)

    for the displacement x relative to the base; time in units of the free mass on its soft springs.

    Parameters
    ----------
    **parameters : float
        ``zeta`` 0.05 (damping ratio), ``beta`` 10 (stiffness of the outer springs over that of the inner ones),
        ``g`` 1 (gap), ``A`` 2 (amplitude of the base), ``omega`` 0.7; dimensionless, round values in place of a rig's.

    Returns
    -------
    System
        States ``x`` and ``v_x``; modes ``springs_free``, ``springs_above`` and ``springs_below``; output
        ``springs_force``, the force of the outer springs. It is symmetric: x to -x half a period later.

    References
    ----------
    M. Wiercigroch, V.W.T. Sin, J. Appl. Mech. 65 (1998) 657-663; S.W. Shaw, P.J. Holmes, J. Sound Vib. 90 (1983)
    129-155 (one-sided).

    Examples
    --------
    >>> import nonsmooth as ns
    >>> orbit = ns.find_orbit(ns.models.bilinear_oscillator())
    >>> orbit.period_number, orbit.stable
    (1, True)
    """
    from nonsmooth.system.derived.mechanical import mechanical

    return mechanical(
        1.0,
        lambda p: 2 * p.zeta,
        1.0,
        name="bilinear oscillator",
        coordinates="x",
        base=lambda t, p: -p.A * p.omega**2 * np.cos(p.omega * t),
        parameters={
            "zeta": (0.05, "", r"\zeta"),
            "beta": (10.0, "", r"\beta"),
            "g": 1.0,
            "A": 2.0,
            "omega": (0.7, "", r"\omega"),
        },
        elements={"springs": Backlash(at="x", half_width="g", stiffness="beta")},
        symmetry=(lambda u: (-u.x, -u.v_x), 0.5, {"springs_above": "springs_below", "springs_below": "springs_above"}),
    ).with_parameters(parameters)
