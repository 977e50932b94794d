r"""Effects of a transition to small changes of the state and of the parameters.

At a transition the motion leaves one field, :math:`f^-`, and goes on from :math:`z^+ = R(t, z^-, p)` along another,
:math:`f^+`. A neighbouring motion meets the surface :math:`h(t, z, p) = 0` earlier or later, by

.. math:: \delta t = -\frac{h_z\,\delta z^- + h_p\,\delta p}{h_t + h_z f^-},

and so, compared at equal times,

.. math:: \delta z^+ = R_z\,\delta z^- + R_p\,\delta p + (R_z f^- + R_t - f^+)\,\delta t
    = S\,\delta z^- + S_p\,\delta p.

Where a transition happens at a phase of the forcing, :math:`\delta t` follows from the period alone. Transitions
that lead to each other at one instant have the :math:`\delta t` of the first: their maps are composed before the
formula is used.

References
----------
M.A. Aizerman, F.R. Gantmakher, Prikl. Mat. Mekh. 21 (1957) 658-669; P.C. Mueller, Chaos, Solitons & Fractals 5 (1995)
1671-1681; R.I. Leine, H. Nijmeijer, *Dynamics and Bifurcations of Non-Smooth Mechanical Systems* (2004), ch. 7.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import reduce

import numpy as np

from nonsmooth.arrays import FloatArray

BEHIND = 1e-9  # of an indicator's size: nearer to a boundary than this is on it


@dataclass(slots=True)
class Jump:
    """A transition at (t, z): the state after it and all first derivatives.

    ``R``, ``fields``, ``S`` and ``instant`` count the active parameters behind the n numbers of z: N in all. ``row`` is
    the row of the condition whose indicator is zero (-1: at a given phase), ``indicator`` that indicator.
    """

    z_after: FloatArray  # (n,)
    R: FloatArray  # (N, N) derivative of the map
    fields: FloatArray  # (3, N) f-, f+, and the map's derivative in time
    h: float
    h_z: FloatArray  # (n,)
    h_t: float
    h_p: FloatArray  # (n_active,)
    S: FloatArray  # (N, N)
    instant: FloatArray  # (N,) derivatives of the instant
    row: int
    indicator: int

    @property
    def n(self) -> int:
        return len(self.z_after)

    @property
    def R_z(self) -> FloatArray:
        """(n, n)"""
        return self.R[: self.n, : self.n]

    @property
    def R_t(self) -> FloatArray:
        """(n,)"""
        return self.fields[2, : self.n]

    @property
    def f_before(self) -> FloatArray:
        """(n,)"""
        return self.fields[0, : self.n]

    @property
    def saltation(self) -> FloatArray:
        """(n, n)"""
        return self.S[: self.n, : self.n]

    @property
    def rate(self) -> float:
        """h' = h_t + h_z f-: zero where the motion grazes."""
        return float(self.h_t + self.h_z @ self.f_before)

    @property
    def transversality(self) -> float:
        """\\|h'\\| / (\\|h_z\\| \\|f-\\|), 0 at grazing; 1 at a given phase."""
        if self.row < 0:
            return 1.0
        size = np.linalg.norm(self.h_z) * np.linalg.norm(self.f_before)
        return float(abs(self.rate) / size) if size > 0.0 else np.inf

    def is_met(self, field: FloatArray, scale: FloatArray) -> bool:
        """Return whether motion along a field meets the surface as well, here and from the same side."""
        size = float(np.abs(self.h_z) @ scale)
        return abs(self.h) <= BEHIND * size and float(self.h_t + self.h_z @ field) * self.rate > 0.0

    @property
    def log_determinant(self) -> float:
        """log\\|det S\\|, minus infinity where S has not full rank."""
        return float(np.linalg.slogdet(self.saltation)[1])


@dataclass(slots=True)
class Touch:
    """An indicator at (t, z) and along the flow of a mode: h, L_f h, L_f^2 h and gradients."""

    h: float
    h_z: FloatArray
    h_t: float
    h_p: FloatArray
    L: float  # L_f h = h_t + h_u f
    L_z: FloatArray
    L_t: float
    L_p: FloatArray
    L2: float  # L_f^2 h
    L2_z: FloatArray
    L2_t: float
    L2_p: FloatArray


def chained(jumps: list[Jump]) -> Jump:
    """Transitions of which each leads to the next at the same instant, as one."""
    return reduce(_then, jumps)


def of_one_instant(jumps: list[Jump], scale: FloatArray) -> Jump:
    """Transitions taken one after the other at the same instant, as one.

    One that the motion would have met there by itself has an instant of its own: two balls side by side. The effects of
    such transitions are one after the other, and those of one order where both are not the same, which is said."""
    groups = [[jumps[0]]]
    for jump in jumps[1:]:
        if jump.is_met(jumps[0].f_before, scale):
            groups.append([jump])
        else:
            groups[-1].append(jump)
    return reduce(_beside, map(chained, groups))


class OneOrderOnly(RuntimeWarning):
    """Derivatives are those of one order of two transitions at one instant, and the other order's differ."""


def _beside(a: Jump, b: Jump) -> Jump:
    one, other = b.saltation @ a.saltation, a.saltation @ b.saltation
    if not np.allclose(one, other, rtol=1e-6, atol=1e-6 * np.abs(one).max()):
        warnings.warn(
            "two transitions happen at one instant, each by itself, and which of them a neighbouring motion meets "
            "first matters: derivatives, and multipliers of an orbit, are those of one order, and do not hold for the "
            "other.",
            OneOrderOnly,
            stacklevel=2,
        )
    return _joined(a, b, b.S @ a.S)


def _then(a: Jump, b: Jump) -> Jump:
    from nonsmooth.kernels.tangent.legs import Crossing, follow

    both = Crossing(a.S.copy(), b.R, np.empty_like(a.S), b.fields, a.instant)
    follow(both)
    return _joined(a, b, both.step)


def _joined(a: Jump, b: Jump, S: FloatArray) -> Jump:
    """One and the other at one instant, that of the first."""
    fields = np.array([a.fields[0], b.fields[1], b.R @ a.fields[2] + b.fields[2]])
    return Jump(b.z_after, b.R @ a.R, fields, a.h, a.h_z, a.h_t, a.h_p, S, a.instant, a.row, a.indicator)
