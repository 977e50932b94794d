"""Ends of segments with their derivatives: a record of the kernels and of Python alike."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Segments(NamedTuple):
    """Ends and derivatives of m segments."""

    z: Any  # (m, n)
    Phi: Any  # (m, n, n)
    P: Any  # (m, n, n_active), at fixed t0 and tau
    f_begin: Any  # (m, n)
    f_end: Any  # (m, n) = dz/dtau
    divergence: Any  # (m,) integral of div f = log det Phi
    status: Any  # (m,) 0, DIVERGED or NO_CONVERGENCE

    @classmethod
    def room(cls, m: int, n: int, n_active: int) -> Segments:
        """Room for so many."""
        sizes = (m, n), (m, n, n), (m, n, n_active), (m, n), (m, n), m
        return cls._make([*(np.empty(size) for size in sizes), np.empty(m, dtype=np.int64)])

    def start_time(self) -> Any:
        """dz/dt0 at fixed tau (m, n): f_end - Phi f_begin."""
        return self.f_end - np.einsum("mij,mj->mi", self.Phi, self.f_begin)
