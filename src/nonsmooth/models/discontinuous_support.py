r"""An oscillator with a discontinuous support: Savi, Divenyi, Franca & Weber, J. Sound Vib. 301 (2007) 59-73.

A mass between two springs (2k, Eq. 2) with a damper meets, at a gap g, a massless support with a spring
and a damper. The support can push, not pull: contact is lost where its force vanishes (h_b = 0), and it
is at rest again before the next contact.

Published: parameters of Table 1, identified on the paper's rig; natural frequency 4.50 rad/s from m and
k (the paper's formula sqrt(k/m) misses the factor 2), 4.60 rad/s measured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.transition import Band, Transition

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _motion(support: Any) -> Any:
    """Newton's law with a force of the support."""

    def field(t: Any, u: Any, p: Any) -> Any:
        x, v = u
        return v, (p.rho * np.cos(p.omega * t) - 2 * p.k * x - p.c * v + support(t, u, p)) / p.m

    return field


def _penetration(t: Any, u: Any, p: Any) -> Any:  # h_a of Eq. 3
    return u.x - p.g


def _separation(t: Any, u: Any, p: Any) -> Any:  # h_b of Eq. 3: the support's force over k_s
    return -(u.x - p.g) - p.c_s / p.k_s * u.v


def _no_force(t: Any, u: Any, p: Any) -> Any:
    return 0


def _force(t: Any, u: Any, p: Any) -> Any:  # f_s below Eq. 2
    return -(p.k_s * (u.x - p.g) + p.c_s * u.v)


def _entering_force(t: Any, u: Any, p: Any) -> Any:
    """Last two terms of Eq. 8a, and its c_s v: the force grows linearly from 0 to that of contact."""
    q = (u.x - p.g + p.eta) / (2 * p.eta)
    return -p.k_s / 2 * (u.x - p.g + p.eta) - p.c_s * u.v + p.c_s * p.v_a * (1 - q)


def _leaving_force(t: Any, u: Any, p: Any) -> Any:
    return -p.k_s / 2 * (u.x - p.g + p.eta) - p.c_s / 2 * u.v


def discontinuous_support(**parameters: float) -> System:
    r"""Return the oscillator with a discontinuous support of Savi et al. (2007).

    .. math::

        m \ddot x + 2 k x + c \dot x = \rho \cos \omega t \quad \text{(free)}

        m \ddot x + 2 k x + k_s (x - g) + (c + c_s) \dot x = \rho \cos \omega t \quad \text{(contact)}

    Contact begins where :math:`h_a = x - g > 0` and :math:`h_b = -(x - g) - (c_s / k_s) \dot x < 0`, and ends
    where :math:`h_b > 0`.

    Parameters
    ----------
    **parameters : float
        ``m`` 0.838 kg, ``k`` 8.47 N/m, ``k_s`` 1210 N/m, ``c`` 0.87 N s/m, ``c_s`` 0.60 N s/m (Table 1);
        ``g`` -0.0045 m, ``rho`` 0.45 N, ``omega`` 3.69 rad/s (within Fig. 11).

    Returns
    -------
    System
        Modes ``free`` and ``contact``; indicators ``penetration`` (m) and ``separation`` (m); output
        ``contact_force`` (N), the force of the support on the mass: 0 when free, negative in contact.
        ``smoothed(eta)`` is the paper's switch model, Eqs. 6-10, with the velocity ``v_a`` at the entry into
        the band as memory.

    References
    ----------
    M.A. Savi, S. Divenyi, L.F.P. Franca, H.I. Weber, J. Sound Vib. 301 (2007) 59-73,
    doi:10.1016/j.jsv.2006.09.014, Eqs. 1-10, Table 1.
    """
    from nonsmooth.system.system import System

    return System(
        name="discontinuous support",
        states={"x": "m", "v": "m/s"},
        parameters={
            "m": (0.838, "kg"),
            "k": (8.47, "N/m"),
            "k_s": (1210.0, "N/m"),
            "c": (0.87, "N s/m"),
            "c_s": (0.60, "N s/m"),
            "g": (-0.0045, "m"),
            "rho": (0.45, "N"),
            "omega": (3.69, "rad/s"),
        },
        modes={"free": _motion(_no_force), "contact": _motion(_force)},  # Eq. 7
        indicators={"penetration": _penetration, "separation": _separation},
        transitions=[
            Transition("free", "contact", when="penetration > 0 and separation < 0"),
            Transition("contact", "free", when="separation > 0"),
        ],
        outputs={"contact_force": ({"free": _no_force, "contact": _force}, "N")},
        scale={"x": 1e-3, "v": 1e-2},
        bands={  # Eq. 8
            "penetration": Band(
                _motion(_entering_force),
                write={"v_a": (lambda t, u, p: u.v, "m/s")},
                outputs={"contact_force": _entering_force},
            ),
            "separation": Band(_motion(_leaving_force), outputs={"contact_force": _leaving_force}),
        },
    ).with_parameters(parameters)
