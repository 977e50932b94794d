r"""An impact oscillator that drifts: Pavlovskaia, Wiercigroch & Grebogi, Phys. Rev. E 64 (2001) 056224.

A mass under a constant and a harmonic force drives a slider forwards through a spring and a damper; dry friction holds
the slider up to the force 1. Positions are taken relative to the slider, so that the motion is bounded (Pavlovskaia &
Wiercigroch, Chaos Solitons Fractals 19 (2004) 151-161). Known: without forcing (a = 0) the mass stops with the
spring pressed by b < 1, and in a periodic motion the slider advances by the mean velocity of the mass.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.transition import Transition

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _drive(t: Any, p: Any) -> Any:
    return p.a * np.cos(p.omega * t) + p.b


def _free(t: Any, u: Any, p: Any) -> Any:
    return u.y, _drive(t, p), -u.q / (2 * p.xi)


def _contact(t: Any, u: Any, p: Any) -> Any:
    return u.y, _drive(t, p) - 2 * p.xi * u.y - u.q, u.y


def _progress(t: Any, u: Any, p: Any) -> Any:
    back = -(u.q - 1) / (2 * p.xi)
    return back, _drive(t, p) - 1, back


def _force(t: Any, u: Any, p: Any) -> Any:
    return 2 * p.xi * u.y + u.q


def _none(t: Any, u: Any, p: Any) -> Any:
    return 0.0


def drifting_impact_oscillator(**parameters: float) -> System:
    r"""Return the impact oscillator with a drift of Pavlovskaia, Wiercigroch and Grebogi (2001).

    .. math::

        \dot x = y - \dot s, \quad \dot y = a \cos \omega t + b - F, \quad F = 0, \quad 2 \xi y + q, \quad 1

    with the mass at x and the top of the slider at q, both relative to the slider, which moves with
    :math:`\dot s = y + (q - 1) / (2 \xi)` where the force has reached 1 and stands still else. Out of contact the
    spring relaxes, :math:`\dot q = -q / (2 \xi)`.

    Parameters
    ----------
    **parameters : float
        ``a`` 0.3 (amplitude), ``b`` 0.1 (constant force), ``xi`` 0.1 (damping), ``omega`` 0.1, ``g`` 0.02 (gap); forces
        over the friction force.

    Returns
    -------
    System
        States ``x``, ``y`` (velocity of the mass) and ``q``; modes ``free``, ``contact`` and ``progress``; outputs
        ``contact_force`` and ``slider_velocity``, whose integral is the progress.

    References
    ----------
    E. Pavlovskaia, M. Wiercigroch, C. Grebogi, Phys. Rev. E 64 (2001) 056224; E. Pavlovskaia, M. Wiercigroch, Chaos
    Solitons Fractals 19 (2004) 151-161, doi:10.1016/S0960-0779(03)00128-0.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.drifting_impact_oscillator(a=0.0), periods=2)  # it stops, pressed by b
    >>> round(float(run.contact_force[-1]), 6)
    0.1
    """
    from nonsmooth.system.system import System

    return System(
        name="drifting impact oscillator",
        states=["x", "y", "q"],
        parameters={"a": 0.3, "b": 0.1, "xi": (0.1, "", r"\xi"), "omega": (0.1, "", r"\omega"), "g": 0.02},
        modes={"free": _free, "contact": _contact, "progress": _progress},
        indicators={
            "gap": lambda t, u, p: u.q + p.g - u.x,
            "force": _force,
            "excess": lambda t, u, p: 2 * p.xi * u.y + u.q - 1,
        },
        transitions=[
            Transition("free", "contact", when="gap < 0 and force > 0"),
            Transition("contact", "free", when="force < 0"),
            Transition("contact", "progress", when="excess > 0"),
            Transition("progress", "contact", when="excess < 0"),
        ],
        outputs={
            "contact_force": {"free": _none, "contact": _force, "progress": lambda t, u, p: 1.0},
            "slider_velocity": {
                "free": _none,
                "contact": _none,
                "progress": lambda t, u, p: u.y + (u.q - 1) / (2 * p.xi),
            },
        },
    ).with_parameters(parameters)
