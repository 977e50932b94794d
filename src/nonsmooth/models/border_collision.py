r"""The normal form of border collision: two linear maps that agree on the border x = 0.

The fixed point of the side with trace :math:`\tau` and determinant :math:`\delta` is
:math:`x = \mu / (1 - \tau + \delta)`, :math:`y = -\delta x`; it exists where x lies on its side, and its multipliers
are the roots of :math:`z^2 - \tau z + \delta`. With both determinants zero x follows the skew tent map with the slopes
a = tau_l and b = tau_r. For 0 < a < 1 and mu > 0 the orbit with one point to the right among n exists for
:math:`b < -(1 + a + \dots + a^{n-2}) / a^{n-2}` and is stable for :math:`a^{n-1} b > -1`: as mu passes through 0 a
stable fixed point becomes an orbit of period 2, of period 3, or chaos.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonsmooth.system.derived.maps import Map


def _left(u: Any, p: Any) -> Any:
    return p.tau_l * u.x + u.y + p.mu, -p.delta_l * u.x


def _right(u: Any, p: Any) -> Any:
    return p.tau_r * u.x + u.y + p.mu, -p.delta_r * u.x


def border_collision(**parameters: float) -> Map:
    r"""Return the normal form of border collision in two dimensions.

    :math:`(x, y) \to (\tau x + y + \mu,\; -\delta x)` with :math:`\tau_l, \delta_l` for x < 0 and
    :math:`\tau_r, \delta_r` for x > 0

    Parameters
    ----------
    **parameters : float
        ``tau_l`` 0.5, ``delta_l`` 0, ``tau_r`` -1.5, ``delta_r`` 0 (trace and determinant of either side: from period
        1 to period 2), ``mu`` 0.1 (the border is hit at 0).

    Returns
    -------
    Map
        The branches left (x < 0) and right (x > 0).

    References
    ----------
    H.E. Nusse, J.A. Yorke, Physica D 57 (1992) 39-57; H.E. Nusse, E. Ott, J.A. Yorke, Phys. Rev. E 49 (1994) 1073-1076.
    """
    from nonsmooth.system.derived.maps import Branch, Map

    return Map(
        name="border-collision normal form",
        states={"x": "", "y": ""},
        parameters={
            "tau_l": (0.5, "", r"\tau_L"),
            "delta_l": (0.0, "", r"\delta_L"),
            "tau_r": (-1.5, "", r"\tau_R"),
            "delta_r": (0.0, "", r"\delta_R"),
            "mu": (0.1, "", r"\mu"),
        },
        branches=[Branch(_left, when="x < 0"), Branch(_right, when="x > 0")],
    ).with_parameters(parameters)
