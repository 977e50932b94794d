r"""A harmonically forced mass on a spring with dry friction, on a support that moves at a constant speed or rests.

Den Hartog (1931) gave the amplitude of the forced vibration without stops in closed form. With r the forcing frequency
over the natural one, :math:`V = 1 / (1 - r^2)` and :math:`U = \sin(\pi / r) / (r (1 + \cos(\pi / r)))`, it is
:math:`\sqrt{V^2 - (f_k U / f_0)^2}` times the static deflection (no viscous damping, no belt).

On a support that moves (Andreaus and Casini 2001) without forcing and damping it sticks from :math:`2 f_k - f_s` to
:math:`f_s` and slips back for :math:`\pi + 2 \arctan(v_b / (f_s - f_k))`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.transition import Surface

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _others(t: Any, u: Any, p: Any) -> Any:
    """All forces but friction."""
    return p.f_0 * np.cos(p.omega * t) - u.x - 2 * p.zeta * u.v


def _backward(t: Any, u: Any, p: Any) -> Any:
    return u.v, _others(t, u, p) + p.f_k


def _forward(t: Any, u: Any, p: Any) -> Any:
    return u.v, _others(t, u, p) - p.f_k


def dry_friction_oscillator(**parameters: float) -> System:
    r"""Return the forced oscillator with dry friction.

    :math:`\ddot x + 2 \zeta \dot x + x = f_0 \cos \omega t - f_k \operatorname{sgn}(\dot x - v_b)`; the mass sticks at
    :math:`\dot x = v_b` while the other forces stay within :math:`\pm f_s`.

    Parameters
    ----------
    **parameters : float
        ``f_0`` 1, ``omega`` 0.8, ``f_k`` 0.3 (kinetic friction), ``f_s`` 0.3 (static friction, not below ``f_k``),
        ``zeta`` 0, ``v_b`` 0 (speed of the support); dimensionless.

    Returns
    -------
    System
        Modes ``backward`` (slower than the support), ``forward`` and ``stick``, which is derived from the surface
        ``speed`` (v - v_b); output ``friction``.

    References
    ----------
    J. P. Den Hartog, Forced vibrations with combined Coulomb and viscous friction, *Transactions of the ASME* 53 (1931)
    107-115; U. Andreaus, P. Casini, Dynamics of friction oscillators excited by a moving base and/or driving force,
    *Journal of Sound and Vibration* 245 (2001) 685-699.
    """
    from nonsmooth.system.system import System

    return System(
        name="dry friction oscillator",
        states={"x": "", "v": ""},
        parameters={"f_0": 1.0, "omega": 0.8, "f_k": 0.3, "f_s": 0.3, "zeta": 0.0, "v_b": 0.0},
        modes={"backward": _backward, "forward": _forward},
        indicators={"speed": lambda t, u, p: u.v - p.v_b},
        transitions=[
            Surface("speed", below="backward", above="forward", mode="stick", static=lambda t, u, p: p.f_s / p.f_k)
        ],
        outputs={"friction": {"backward": lambda t, u, p: p.f_k, "forward": lambda t, u, p: -p.f_k}},
    ).with_parameters(parameters)
