r"""A forced mass on a belt with a Stribeck curve: Hinrichs, Oestreich & Popp, J. Sound Vib. 216 (1998) 435-459.

Known in closed form: without forcing the mass that sticks leaves the belt at x = mu_s, and where it slides steadily,
x = mu(v_b), a falling curve drives it: eigenvalues solve s^2 + (2 D + mu'(v_b)) s + 1 = 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.derived.elements import Coulomb

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _stribeck(v: Any, p: Any) -> Any:
    return (p.mu_s - p.mu_k) / (1 + p.kappa * v) + p.mu_k + p.mu_v * v**2


def stribeck_oscillator(**parameters: float) -> System:
    r"""Return the friction oscillator with a Stribeck curve of Hinrichs, Oestreich and Popp (1998).

    .. math::

        \ddot x + 2 D \dot x + x = u_0 \cos \omega t - \mu(|v|) \operatorname{sgn} v, \qquad v = \dot x - v_b, \qquad
        \mu(v) = \frac{\mu_s - \mu_k}{1 + \kappa v} + \mu_k + \mu_v v^2

    It sticks to the belt while the force that holds it is at most :math:`\mu_s`.

    Parameters
    ----------
    **parameters : float
        ``D`` 0, ``mu_s`` 0.4, ``mu_k`` 0.1, ``kappa`` 1.42, ``mu_v`` 0.01 (friction over the normal force), ``v_b`` 1
        (speed of the belt), ``u_0`` 0.5, ``omega`` 0.6; dimensionless.

    Returns
    -------
    System
        States ``x`` and ``v_x``; modes ``belt_stick``, ``belt_forward`` and ``belt_back``; output ``belt_force``.

    References
    ----------
    N. Hinrichs, M. Oestreich, K. Popp, J. Sound Vib. 216 (1998) 435-459.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> belt = ns.models.stribeck_oscillator()
    >>> run = ns.simulate(belt, periods=5, transient=50)
    >>> "belt_stick" in {belt.modes[i] for i in run.mode.values}
    True
    """
    from nonsmooth.system.derived.mechanical import mechanical

    return mechanical(
        1.0,
        lambda p: 2 * p.D,
        1.0,
        name="Stribeck oscillator",
        coordinates="x",
        forcing={"x": lambda t, p: p.u_0 * np.cos(p.omega * t)},
        parameters={
            "D": 0.0,
            "mu_s": (0.4, "", r"\mu_s"),
            "mu_k": (0.1, "", r"\mu_k"),
            "kappa": (1.42, "", r"\kappa"),
            "mu_v": (0.01, "", r"\mu_v"),
            "v_b": 1.0,
            "u_0": 0.5,
            "omega": (0.6, "", r"\omega"),
        },
        elements={"belt": Coulomb(at="x", belt="v_b", friction=_stribeck)},
    ).with_parameters(parameters)
