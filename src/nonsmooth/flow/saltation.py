r"""What a transition does to small changes of the state and of the parameters.

At a transition the motion leaves one field, :math:`f^-`, and goes on from :math:`z^+ = R(t, z^-, p)` along another,
:math:`f^+`. A neighbouring motion meets the surface :math:`h(t, z, p) = 0` earlier or later, by

.. math:: \delta t = -\frac{h_z\,\delta z^- + h_p\,\delta p}{h_t + h_z f^-},

and so, compared at equal times,

.. math:: \delta z^+ = R_z\,\delta z^- + R_p\,\delta p + (R_z f^- + R_t - f^+)\,\delta t
    = S\,\delta z^- + S_p\,\delta p.

Where a transition happens at a phase of the forcing, :math:`\delta t` follows from the period alone. Transitions
taken at the same instant have the :math:`\delta t` of the first: their maps are composed before the formula is used.

References
----------
M.A. Aizerman, F.R. Gantmakher, Prikl. Mat. Mekh. 21 (1957) 658-669; P.C. Mueller, Chaos, Solitons & Fractals 5 (1995)
1671-1681; R.I. Leine, H. Nijmeijer, *Dynamics and Bifurcations of Non-Smooth Mechanical Systems* (2004), ch. 7.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

__all__ = ["Jump", "Touch", "chained"]

FloatArray = NDArray[np.float64]


@dataclass(slots=True)
class Jump:
    """A transition at (t, z): the state after it and all first derivatives.

    ``row`` is the row of the condition whose indicator is zero (-1: at a given phase), ``indicator`` that indicator.
    """

    z_after: FloatArray  # (n,)
    R_z: FloatArray  # (n, n)
    R_t: FloatArray  # (n,)
    R_p: FloatArray  # (n, n_active)
    h: float
    h_z: FloatArray  # (n,)
    h_t: float
    h_p: FloatArray  # (n_active,)
    f_before: FloatArray  # (n,)
    f_after: FloatArray  # (n,)
    saltation: FloatArray  # (n, n)
    parameter_column: FloatArray  # (n, n_active)
    t_z: FloatArray  # (n,) derivatives of the instant
    t_p: FloatArray  # (n_active,)
    row: int
    indicator: int

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


def chained(jumps: list[Jump]) -> Jump:
    """Transitions taken one after the other at the same instant, as one."""
    return reduce(_then, jumps)


def _then(a: Jump, b: Jump) -> Jump:
    r_z = b.R_z @ a.R_z
    r_t, r_p = b.R_z @ a.R_t + b.R_t, b.R_z @ a.R_p + b.R_p
    slip = r_z @ a.f_before + r_t - b.f_after
    return Jump(
        b.z_after, r_z, r_t, r_p, a.h, a.h_z, a.h_t, a.h_p, a.f_before, b.f_after,
        r_z + np.outer(slip, a.t_z), r_p + np.outer(slip, a.t_p), a.t_z, a.t_p, a.row, a.indicator,
    )  # fmt: skip
