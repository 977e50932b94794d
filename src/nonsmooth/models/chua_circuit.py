r"""Chua's circuit, piecewise linear: Matsumoto, Chua & Komuro, IEEE Trans. Circuits Syst. 32 (1985) 797-818.

Published for the double scroll (alpha 9, beta 100/7, slopes -1/7 and 2/7): Lyapunov exponents 0.23, 0 and -1.78 per
unit of the circuit's time, which is 1 / 0.7 of the dimensionless one, and the dimension 2.13. Known in closed form:
the outer equilibria are at x = +-(b - a) / b = +-1.5 and lose stability at (1 + alpha b) (alpha b - alpha + beta) =
alpha beta b.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nonsmooth.system.derived.elements import Backlash

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _inner(t: Any, u: Any, p: Any) -> Any:
    x, y, z = u
    return p.alpha * (y - p.a * x), x - y + z, -p.beta * y


def chua_circuit(**parameters: float) -> System:
    r"""Return the circuit of Chua with its piecewise-linear diode.

    .. math::

        \dot x = \alpha (y - h(x)), \quad \dot y = x - y + z, \quad \dot z = -\beta y, \qquad
        h(x) = b x + \frac{1}{2} (a - b) (|x + 1| - |x - 1|)

    Parameters
    ----------
    **parameters : float
        ``alpha`` 9, ``beta`` 100/7, ``a`` -1/7 (slope within), ``b`` 2/7 (slope outside): the double scroll;
        dimensionless.

    Returns
    -------
    System
        States ``x``, ``y``, ``z``; modes ``diode_free`` (within), ``diode_above`` and ``diode_below``; output
        ``diode_force``, by what h differs from its inner slope. It is symmetric and without a forcing period: give a
        section.

    References
    ----------
    T. Matsumoto, L.O. Chua, M. Komuro, IEEE Trans. Circuits Syst. 32 (1985) 797-818.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.chua_circuit(), duration=100.0, start={"x": 0.1})
    >>> float(run.u.sel(state="x").max()) > 1.5 and float(run.u.sel(state="x").min()) < -1.5  # both scrolls
    True
    """
    from nonsmooth.system.system import System

    return System(
        name="Chua's circuit",
        states=["x", "y", "z"],
        modes={"inner": _inner},
        parameters={"alpha": (9.0, "", r"\alpha"), "beta": (100 / 7, "", r"\beta"), "a": -1 / 7, "b": 2 / 7},
        elements={
            "diode": Backlash(
                displacement=lambda t, u, p: u.x, on={"x": "alpha"}, half_width=1.0, stiffness=lambda t, u, p: p.b - p.a
            )
        },
        symmetry=(lambda u: (-u.x, -u.y, -u.z), 0.0, {"diode_above": "diode_below", "diode_below": "diode_above"}),
    ).with_parameters(parameters)
