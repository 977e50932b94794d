r"""A Jeffcott rotor that rubs its stator: Jiang & Ulbrich, Nonlinear Dynamics 24 (2001) 269-283.

An unbalanced disc on a shaft meets an elastic ring at the clearance R_0, with Coulomb friction. Known in closed form:
the disc that does not rub whirls on a circle of radius omega^2 / sqrt((beta - omega^2)^2 + (2 zeta omega)^2); in full
annular rub the radius R solves (R (1 + beta - omega^2) - R_0)^2 + (2 zeta omega R + mu (R - R_0))^2 = omega^4. Far out
the motion obeys z'' + 2 zeta z' + (1 + beta + i mu) z = 0: backward whirl grows without bound (dry whip) where
mu > 2 zeta sqrt(1 + beta), 0.102 at the default values.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.derived.elements import ElasticStop

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _disc(t: Any, u: Any, p: Any) -> Any:
    x, y, v_x, v_y = u
    pull = p.omega**2
    return (
        v_x,
        v_y,
        pull * np.cos(p.omega * t) - 2 * p.zeta * v_x - p.beta * x,
        pull * np.sin(p.omega * t) - 2 * p.zeta * v_y - p.beta * y,
    )


def _radius(u: Any) -> Any:
    return np.sqrt(u.x**2 + u.y**2)


def rubbing_rotor(**parameters: float) -> System:
    r"""Return the Jeffcott rotor that rubs its stator.

    With :math:`z = x + i y` in units of the eccentricity and time in units of the stator's stiffness,

    .. math::

        \ddot z + 2 \zeta \dot z + \beta z + (1 - R_0 / |z|) (1 + i \mu) z \, [|z| > R_0] = \omega^2 e^{i \omega t}

    Parameters
    ----------
    **parameters : float
        ``zeta`` 0.05, ``beta`` 0.04 (stiffness of the shaft over that of the stator), ``R_0`` 1.05 (clearance), ``mu``
        0.2 (friction), ``omega`` 0.2 (speed of rotation); dimensionless. The friction does not change its sign: the
        surface of the disc is taken to be faster than any backward whirl. Above
        :math:`\mu = 2 \zeta \sqrt{1 + \beta}` a large backward whirl therefore grows without bound (dry whip; a real
        one ends where the disc rolls on the stator): with the values above runs from near the centre meet it, and end
        as ``diverged``, from about ``omega`` 0.46 on.

    Returns
    -------
    System
        States ``x``, ``y``, ``v_x``, ``v_y``; modes ``stator_open`` and ``stator_contact``; output ``stator_force``,
        the normal force. Start it away from the centre, ``{"x": 0.5}``, where the direction of the force is defined.

    References
    ----------
    J. Jiang, H. Ulbrich, Nonlinear Dynamics 24 (2001) 269-283.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.rubbing_rotor(), periods=1, transient=100, start={"x": 0.5})
    >>> float((run.stator_force > 0).mean())  # full annular rub
    1.0
    """
    from nonsmooth.system.system import System

    return System(
        name="rubbing rotor",
        states=["x", "y", "v_x", "v_y"],
        modes={"disc": _disc},
        parameters={
            "zeta": (0.05, "", r"\zeta"),
            "beta": (0.04, "", r"\beta"),
            "R_0": 1.05,
            "mu": (0.2, "", r"\mu"),
            "omega": (0.2, "", r"\omega"),
        },
        elements={
            "stator": ElasticStop(
                gap=lambda t, u, p: p.R_0 - _radius(u),
                on={
                    "v_x": lambda t, u, p: -(u.x - p.mu * u.y) / _radius(u),
                    "v_y": lambda t, u, p: -(u.y + p.mu * u.x) / _radius(u),
                },
                stiffness=1.0,
            )
        },
    ).with_parameters(parameters)
