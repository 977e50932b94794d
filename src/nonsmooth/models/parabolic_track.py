r"""A cart on a parabolic track that hits a stop: Todd & Virgin, Chaos Solitons Fractals 8 (1997) 699-714.

The restoring force is gravity on the track y = x^2 / 2. Known in closed form: without damping and forcing the cart that
turns at x = -a has the energy a^2 / 2 and the period 4 E(-a^2), complete elliptic integral of the second kind in its
parameter; from -a to a stop at x = d it takes E(-a^2) + E(arcsin(d / a) | -a^2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.derived.elements import Stop

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _cart(t: Any, u: Any, p: Any) -> Any:
    x, v = u
    push = p.A * p.omega**2 * np.cos(p.omega * t)
    return v, (push - x - x * v**2) / (1 + x**2) - 2 * p.zeta * v


def parabolic_track(**parameters: float) -> System:
    r"""Return the cart on a shaken parabolic track with a rigid stop, after Todd and Virgin (1997).

    .. math::

        (1 + x^2) (\ddot x + 2 \zeta \dot x) + x \dot x^2 + x = A \omega^2 \cos \omega t, \qquad
        \dot x^+ = -e \dot x^- \text{ at } x = d

    x is the horizontal position in units of the radius of curvature at the bottom, time in units of sqrt(radius / g);
    damping acts along the track.

    Parameters
    ----------
    **parameters : float
        ``zeta`` 0.02, ``A`` 0.2 (amplitude of the track's horizontal motion), ``omega`` 0.8, ``d`` 0.2 (the stop),
        ``e`` 0.6; dimensionless.

    Returns
    -------
    System
        States ``x`` and ``v``; modes ``stop_open`` and ``stop_rest``; output ``stop_force``.

    References
    ----------
    M.D. Todd, L.N. Virgin, Chaos Solitons Fractals 8 (1997) 699-714; K.N. Slade, L.N. Virgin, P.V. Bayly, Phys. Rev. E
    56 (1997) 3705-3708.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.parabolic_track(), periods=20)
    >>> bool(run.u.sel(state="x").max() <= 0.2)
    True
    """
    from nonsmooth.system.system import System

    return System(
        name="parabolic track",
        states=["x", "v"],
        modes={"cart": _cart},
        parameters={
            "zeta": (0.02, "", r"\zeta"),
            "A": 0.2,
            "omega": (0.8, "", r"\omega"),
            "d": 0.2,
            "e": 0.6,
        },
        elements={
            "stop": Stop(gap=lambda t, u, p: p.d - u.x, on={"v": lambda t, u, p: -1 / (1 + u.x**2)}, restitution="e")
        },
    ).with_parameters(parameters)
