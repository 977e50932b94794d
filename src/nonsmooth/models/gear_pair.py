r"""A spur gear pair with backlash: Kahraman & Singh, J. Sound Vib. 142 (1990) 49-75.

The transmission error of two gears under a mean load, excited by the meshing frequency. Known in closed form: the
teeth lose contact where the linear motion about the mean deflection reaches it,
F_a omega^2 = F_m sqrt((1 - omega^2)^2 + (2 zeta omega)^2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.system.derived.elements import Backlash

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def gear_pair(**parameters: float) -> System:
    r"""Return the gear pair with backlash of Kahraman and Singh (1990).

    .. math::

        \ddot q + 2 \zeta \dot q + f(q) = F_m + F_a \omega^2 \cos \omega t, \qquad
        f(q) = q - b \quad (q > b), \quad 0 \quad (|q| < b), \quad q + b \quad (q < -b)

    q is the transmission error less the static one along the line of action, b half the backlash.

    Parameters
    ----------
    **parameters : float
        ``zeta`` 0.05, ``F_m`` 0.1 (mean load), ``F_a`` 0.05 (of the static transmission error), ``b`` 1, ``omega`` 0.5
        (meshing frequency over the natural frequency of teeth in contact); dimensionless.

    Returns
    -------
    System
        States ``q`` and ``v_q``; modes ``teeth_free``, ``teeth_above`` (the driving flanks in contact) and
        ``teeth_below``; output ``teeth_force``. Start it near the loaded flank, ``{"q": 1.1}``.

    References
    ----------
    A. Kahraman, R. Singh, J. Sound Vib. 142 (1990) 49-75.

    Examples
    --------
    >>> import numpy as np
    >>> import nonsmooth as ns
    >>> curve = ns.frequency_response(ns.models.gear_pair(), np.linspace(0.4, 1.2, 5), start={"q": 1.1}, progress=False)
    >>> int((curve.contacts_per_period.sel(direction="up") > 0).sum())  # the teeth part near resonance
    2
    """
    from nonsmooth.system.derived.mechanical import mechanical

    return mechanical(
        1.0,
        lambda p: 2 * p.zeta,
        0.0,
        name="gear pair",
        forcing={"q": lambda t, p: p.F_m + p.F_a * p.omega**2 * np.cos(p.omega * t)},
        parameters={
            "zeta": (0.05, "", r"\zeta"),
            "F_m": 0.1,
            "F_a": 0.05,
            "b": 1.0,
            "omega": (0.5, "", r"\omega"),
        },
        elements={"teeth": Backlash(at="q", half_width="b", stiffness=1.0)},
    ).with_parameters(parameters)
