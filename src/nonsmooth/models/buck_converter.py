r"""A DC-DC buck converter under voltage-mode control: the classic example of chaos in power electronics.

A switch feeds an LC filter with a load. It is closed while a sawtooth lies above the amplified error of the output
voltage, and the sawtooth falls back at the end of every period. Published: for rising input voltage the period-1 cycle
loses stability in a period doubling near 24.5 V, and period 4 follows near 31 V.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nonsmooth.system.transition import Transition

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def _closed(t: Any, u: Any, p: Any) -> Any:
    return (u.i - u.v / p.R) / p.C, (p.V_in - u.v) / p.L, (p.V_high - p.V_low) / p.T


def _open(t: Any, u: Any, p: Any) -> Any:
    return (u.i - u.v / p.R) / p.C, -u.v / p.L, (p.V_high - p.V_low) / p.T


def _fall(t: Any, u: Any, p: Any) -> Any:
    return u.v, u.i, p.V_low


def buck_converter(**parameters: float) -> System:
    r"""Return the buck converter in continuous conduction, switched by a sawtooth.

    :math:`C \dot v = i - v / R`, :math:`L \dot\imath = V_{in} - v` or :math:`-v`; closed while
    :math:`r > a (v - V_{ref})` with the sawtooth r from V_low to V_high in each period T

    Parameters
    ----------
    **parameters : float
        ``V_in`` 24 V, ``R`` 22 ohm, ``L`` 20e-3 H, ``C`` 47e-6 F, ``T`` 400e-6 s, ``V_ref`` 11.3 V, ``gain`` 8.4,
        ``V_low`` 3.8 V, ``V_high`` 8.2 V.

    Returns
    -------
    System
        Modes ``closed`` and ``open``; states v, i and ``ramp`` (the sawtooth, which gives every cycle a multiplier 0);
        indicator ``sawtooth_above``. It switches as often in a period as the voltages meet.

    References
    ----------
    D.C. Hamill, J.H.B. Deane, D.J. Jefferies, IEEE Trans. Power Electronics 7 (1992) 25-36; E. Fossas, G. Olivar, IEEE
    Trans. Circuits Syst. I 43 (1996) 13-25; M. di Bernardo, F. Garofalo, L. Glielmo, F. Vasca, ibid. 45 (1998) 133-141.
    """
    from nonsmooth.system.system import System

    return System(
        name="buck converter",
        states={"v": "V", "i": "A", "ramp": "V"},
        parameters={
            "V_in": (24.0, "V", r"V_{\mathrm{in}}"),
            "R": (22.0, "ohm"),
            "L": (20e-3, "H"),
            "C": (47e-6, "F"),
            "T": (400e-6, "s"),
            "V_ref": (11.3, "V", r"V_{\mathrm{ref}}"),
            "gain": 8.4,
            "V_low": (3.8, "V", r"V_{\mathrm{low}}"),
            "V_high": (8.2, "V", r"V_{\mathrm{high}}"),
        },
        modes={"open": _open, "closed": _closed},
        indicators={"sawtooth_above": lambda t, u, p: u.ramp - p.gain * (u.v - p.V_ref)},
        transitions=[
            Transition("open", "open", at=0.0, reset=_fall),
            Transition("closed", "open", at=0.0, reset=_fall),
            Transition("open", "closed", when="sawtooth_above > 0"),
            Transition("closed", "open", when="sawtooth_above < 0"),
        ],
        period=lambda p: p.T,
        scale={"v": 10.0, "i": 1.0, "ramp": 10.0},
    ).with_parameters(parameters)
