r"""A linear plant under relay feedback: a limit cycle with several sliding segments.

Piiroinen and Kuznetsov (2008). Where the relay's input vanishes the relay keeps it there as long as :math:`|x_2| < 1`;
meanwhile :math:`\dot x_2 = 2 \sigma x_2 + x_3, \dot x_3 = -x_2`, an unstable motion in closed form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nonsmooth.system.transition import Surface

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _plant(sign: int) -> Any:
    def field(t: Any, u: Any, p: Any) -> Any:
        x1, x2, x3 = u
        return (
            -(2 * p.xi * p.omega + 1) * x1 + x2 + sign,
            -(2 * p.xi * p.omega + p.omega**2) * x1 + x3 - 2 * p.sigma * sign,
            -(p.omega**2) * x1 + sign,
        )

    return field


def relay_feedback(**parameters: float) -> System:
    r"""Return the relay feedback system: a linear plant whose input switches with the sign of its output.

    :math:`\dot x = A x - b \operatorname{sgn} x_1` with the A and b of Piiroinen and Kuznetsov.

    Parameters
    ----------
    **parameters : float
        ``xi`` 0.05, ``omega`` 25, ``sigma`` 1; dimensionless.

    Returns
    -------
    System
        Modes ``plus`` (x1 < 0, the relay gives +1), ``minus`` and ``sliding``, which is derived from the surface
        ``level`` (x1); output ``relay``.

    References
    ----------
    P. T. Piiroinen, Yu. A. Kuznetsov, An event-driven method to simulate Filippov systems with accurate computing of
    sliding motions, *ACM Transactions on Mathematical Software* 34 (2008) 13.
    """
    from nonsmooth.system.system import System

    return System(
        name="relay feedback",
        states=["x1", "x2", "x3"],
        parameters={"xi": 0.05, "omega": 25.0, "sigma": 1.0},
        modes={"plus": _plant(1), "minus": _plant(-1)},
        indicators={"level": lambda t, u, p: u.x1},
        transitions=[Surface("level", below="plus", above="minus", mode="sliding")],
        outputs={"relay": {"plus": lambda t, u, p: 1.0, "minus": lambda t, u, p: -1.0}},
    ).with_parameters(parameters)
