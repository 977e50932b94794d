r"""A mass on a spring that rubs on a moving belt: friction that falls with the relative velocity, and sticks.

Leine et al. (1998), alternate friction model of their example with one degree of freedom. At the default values the
stable limit cycle sticks until the spring force reaches the static friction, x = F, slips for 4.296000 and has the
period 12.001031 and the multipliers 1 and 0. With damping it ends at a discontinuous fold (Leine, van Campen, van de
Vrande 2000): where the belt is so fast that the slip just touches its speed, the cycle that sticks meets the unstable
one that does not, and none is left beyond.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nonsmooth.system.transition import Surface

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _dragged(t: Any, u: Any, p: Any) -> Any:
    x, v = u
    return v, p.F / (1 + p.delta * (p.v_b - v)) - x - p.c * v


def _ahead(t: Any, u: Any, p: Any) -> Any:
    x, v = u
    return v, -p.F / (1 + p.delta * (v - p.v_b)) - x - p.c * v


def stick_slip_belt(**parameters: float) -> System:
    r"""Return the friction oscillator on a belt: self-excited stick-slip vibration.

    :math:`\ddot x + c \dot x + x = F \operatorname{sgn}(v_b - \dot x) / (1 + \delta |v_b - \dot x|)`.

    Parameters
    ----------
    **parameters : float
        ``F`` 1 (static friction), ``delta`` 3 (decrease of friction), ``v_b`` 0.2 (belt), ``c`` 0 (damping);
        dimensionless.

    Returns
    -------
    System
        Modes ``dragged`` (slower than the belt), ``ahead`` and ``stick``, which is derived from the surface
        ``relative`` (v - v_b); output ``friction``.

    References
    ----------
    R. I. Leine, D. H. van Campen, A. de Kraker, L. van den Steen, Stick-slip vibrations induced by alternate
    friction models, *Nonlinear Dynamics* 16 (1998) 41-54; R. I. Leine, D. H. van Campen, B. L. van de Vrande,
    Bifurcations in nonlinear discontinuous systems, *Nonlinear Dynamics* 23 (2000) 105-164.
    """
    from nonsmooth.system.system import System

    return System(
        name="stick-slip oscillator on a belt",
        states={"x": "", "v": ""},
        parameters={"F": 1.0, "delta": 3.0, "v_b": 0.2, "c": 0.0},
        modes={"dragged": _dragged, "ahead": _ahead},
        indicators={"relative": lambda t, u, p: u.v - p.v_b},
        transitions=[Surface("relative", below="dragged", above="ahead", mode="stick")],
        outputs={
            "friction": {
                "dragged": lambda t, u, p: p.F / (1 + p.delta * (p.v_b - u.v)),
                "ahead": lambda t, u, p: -p.F / (1 + p.delta * (u.v - p.v_b)),
            }
        },
    ).with_parameters(parameters)
