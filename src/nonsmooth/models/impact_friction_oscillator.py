r"""An oscillator with dry friction that hits a rigid stop: Virgin & Begley, Physica D 130 (1999) 43-57.

Known in closed form: without damping the motion that slides all the time has Den Hartog's amplitude sqrt(V^2 - (f
U)^2), V = 1 / (1 - omega^2), U = sin(pi / omega) / (omega (1 + cos(pi / omega))), and grazes a stop there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.system.derived.elements import Coulomb, Stop

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def impact_friction_oscillator(**parameters: float) -> System:
    r"""Return the impact-friction oscillator: a forced mass that rubs its support and hits a stop.

    :math:`\ddot x + 2 \zeta \dot x + x + f \operatorname{sgn} \dot x = \cos \omega t`, it sticks while the force that
    holds it is at most f, and :math:`\dot x^+ = -e \dot x^-` at :math:`x = g`.

    Parameters
    ----------
    **parameters : float
        ``zeta`` 0, ``f`` 0.2 (friction over the amplitude of the force), ``g`` 1 (stop), ``e`` 0.7, ``omega`` 0.8;
        dimensionless.

    Returns
    -------
    System
        States ``x`` and ``v_x``; modes by what the elements ``support`` (``stick``, ``forward``, ``back``) and ``stop``
        (``open``, ``rest``) do; outputs ``support_force`` and ``stop_force``.

    References
    ----------
    L.N. Virgin, C.J. Begley, Physica D 130 (1999) 43-57; C.J. Begley, L.N. Virgin, J. Sound Vib. 211 (1998) 801-818;
    J.P. Den Hartog, Trans. ASME 53 (1931) 107-115.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.impact_friction_oscillator(), periods=20)
    >>> bool(run.u.sel(state="x").max() <= 1.0 + 1e-12)
    True
    """
    from nonsmooth.system.derived.mechanical import mechanical

    return mechanical(
        1.0,
        lambda p: 2 * p.zeta,
        1.0,
        name="impact-friction oscillator",
        coordinates="x",
        forcing={"x": lambda t, p: np.cos(p.omega * t)},
        parameters={"zeta": (0.0, "", r"\zeta"), "f": 0.2, "g": 1.0, "e": 0.7, "omega": (0.8, "", r"\omega")},
        elements={
            "support": Coulomb(at="x", friction="f"),
            "stop": Stop(at="x", position="g", restitution="e"),
        },
    ).with_parameters(parameters)
