r"""Two masses on hardening springs that hit one another: the impact Duffing oscillator with two degrees of freedom.

The example of a tuned mass damper with limited room in PWSDDE-cont (Iklodi & Dombovari). Known in closed form: an
impact keeps the momentum v1 + mu v2 and turns the relative velocity round, times r; with linear springs the motion
without impacts just touches at the clearance |X2 - X1| of the linear response.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.derived.elements import Stop

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _motion(t: Any, u: Any, p: Any) -> Any:
    x1, x2, v1, v2 = u
    coupling = 2 * p.xi * (v1 - v2) + p.phi**2 * (x1 - x2) + p.eta_2 * (x1 - x2) ** 3
    return v1, v2, np.cos(p.omega * t) - 2 * p.zeta * v1 - x1 - p.eta_1 * x1**3 - p.mu * coupling, coupling


def impact_duffing(**parameters: float) -> System:
    r"""Return the impact Duffing oscillator with two degrees of freedom.

    .. math::

        \ddot x_1 + 2 \zeta \dot x_1 + x_1 + \eta_1 x_1^3 + \mu q = \cos \omega t, \quad \ddot x_2 = q, \quad
        q = 2 \xi (\dot x_1 - \dot x_2) + \varphi^2 (x_1 - x_2) + \eta_2 (x_1 - x_2)^3

    with :math:`-\delta_2 \le x_2 - x_1 \le \delta_1`. An impact with restitution r leaves
    :math:`\dot x_i^+ = (1 + r) v_s - r \dot x_i^-`, :math:`v_s = (\dot x_1 + \mu \dot x_2) / (1 + \mu)`.

    Parameters
    ----------
    **parameters : float
        ``mu`` 0.1 (mass ratio), ``r`` 0.8, ``zeta`` 0.05, ``xi`` 0.05, ``phi`` 1 (frequency ratio), ``eta_1`` 0.01,
        ``eta_2`` 0.01 (cubic stiffness), ``delta_1`` 4, ``delta_2`` 4 (clearances), ``omega`` 0.9; dimensionless.

    Returns
    -------
    System
        States ``x1``, ``x2``, ``v1``, ``v2``; modes by what the elements ``upper`` and ``lower`` do (``open`` or
        ``rest``); outputs ``upper_force`` and ``lower_force``. With ``eta_1 = eta_2 = 0`` its flow is still computed
        as a nonlinear one.

    References
    ----------
    Z. Iklodi, Z. Dombovari, PWSDDE-cont, example of a two degree of freedom impact Duffing oscillator.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.impact_duffing(), periods=20)
    >>> bool((abs(run.u.sel(state="x2") - run.u.sel(state="x1")) < 4 + 1e-9).all())
    True
    """
    from nonsmooth.system.system import System

    return System(
        name="impact Duffing",
        states=["x1", "x2", "v1", "v2"],
        modes={"motion": _motion},
        parameters={
            "mu": (0.1, "", r"\mu"),
            "r": 0.8,
            "zeta": (0.05, "", r"\zeta"),
            "xi": (0.05, "", r"\xi"),
            "phi": (1.0, "", r"\varphi"),
            "eta_1": (0.01, "", r"\eta_1"),
            "eta_2": (0.01, "", r"\eta_2"),
            "delta_1": (4.0, "", r"\delta_1"),
            "delta_2": (4.0, "", r"\delta_2"),
            "omega": (0.9, "", r"\omega"),
        },
        elements={
            "upper": Stop(
                gap=lambda t, u, p: p.delta_1 - (u.x2 - u.x1),
                on={"v1": 1.0, "v2": lambda t, u, p: -1 / p.mu},
                restitution="r",
            ),
            "lower": Stop(
                gap=lambda t, u, p: p.delta_2 + (u.x2 - u.x1),
                on={"v1": -1.0, "v2": lambda t, u, p: 1 / p.mu},
                restitution="r",
            ),
        },
    ).with_parameters(parameters)
