r"""Multiple shooting: one segment per visit of a mode, one Newton system for the whole orbit.

The unknowns are the state at the section, the instant of every transition and the state after it (an autonomous
orbit: the period too), and the active parameters:

.. math::

    X = (z_0;\ t_1, z_1;\ \dots;\ t_m, z_m;\ [T];\ p)

    h_i(t_i, z_i^-) = 0 \text{ (at once: } t_i = t_{i-1}), \quad z_i = R_i(t_i, z_i^-), \quad
    z_i^- = \varphi(t_i - t_{i-1}; t_{i-1}, z_{i-1}),
    \quad z_0 = \varphi(T - t_m; t_m, z_m)

An autonomous orbit is anchored so that its section lies in the middle of a visit, t_1 = T - t_m (no transitions: by
f_ref (z_0 - z_ref) = 0).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.anchor import plane_across
from nonsmooth.continuation.problems.signature import AT_ONCE, Signature
from nonsmooth.continuation.problems.solve import solve
from nonsmooth.flow.saltation import chained
from nonsmooth.flow.variational import Jump, Segments, VariationalFlow
from nonsmooth.system.system import System

__all__ = ["Shooting", "Solved"]

ROUNDING = 1e-16  # of the period
SHORT = 1e-6  # of the period: a visit shorter than this is divided by its series
SAME = 1e-12  # of their sizes: gradients and values of one surface


@dataclass
class Solved:
    """The equations at one X: residual, Jacobian, and what it was made of."""

    X: FloatArray
    residual: FloatArray
    jacobian: FloatArray  # (N, N + n_active)
    times: FloatArray  # (m + 2,): 0, the instants, the end
    segments: Segments
    jumps: list[Jump]
    values: FloatArray
    free: list[int]
    at_once: list[bool]  # (m,) transitions at the instant of the one before

    @property
    def monodromy(self) -> FloatArray:
        """Derivative of the return map (autonomous: with the trivial multiplier 1; zero for what is constant)."""
        M = self.segments.Phi[0]
        for i in range(len(self.jumps)):
            if i + 1 < len(self.jumps) and self.at_once[i + 1]:
                continue  # its instant is that of the first of them
            first = i
            while self.at_once[first]:
                first -= 1
            M = self.segments.Phi[i + 1] @ (chained(self.jumps[first : i + 1]).saltation @ M)
        if self.free:
            M = M.copy()
            M[self.free], M[:, self.free] = 0.0, 0.0
        return np.asarray(M)


class Shooting:
    """The equations of orbits with one signature.

    Parameters
    ----------
    system : System
        Its parameters' values are those that are not active.
    signature : Signature
    period_number : int
        Forcing periods (0: the system is autonomous).
    active : tuple of str
        Parameters that are unknowns.
    """

    def __init__(self, system: System, signature: Signature, period_number: int, active: tuple[str, ...] = ()) -> None:
        self.system, self.signature, self.period_number, self.active = system, signature, period_number, active
        traced = system.traced
        self.flow = VariationalFlow.of(system, active)
        n, m, a = self.flow.n, len(signature.crossings), len(active)
        self.n, self.m, self.n_active = n, m, a
        self.forced = period_number > 0
        self.modes = np.array([v.mode for v in signature.visits], dtype=np.int64)
        self.values = system.parameter_vector()
        names = list(system.values)
        self.places = np.array([names.index(name) for name in active], dtype=np.int64)
        self.size = n + m * (n + 1) + (0 if self.forced else 1)
        self.t_at = n + np.arange(m) * (n + 1)  # places of t_1 ... t_m in X
        self.z_at = np.concatenate([[0], self.t_at + 1])  # of z_0 ... z_m
        self.jumps = [(v.transition, v.row, traced.transitions[v.transition].at, v.turn) for v in signature.crossings]
        # A state or a memory that nothing on the orbit ever sets is a free constant, not an unknown.
        self.free = self._constants()
        self.at_once = [v.row == AT_ONCE for v in signature.crossings]
        self._one = np.eye(n)
        self._columns = self.z_at[:, None] + np.arange(n)
        after = self._columns[1:].ravel()  # the states after the transitions, in their own equations
        self._after = after * (self.size + a) + after
        self.reference: tuple[FloatArray, FloatArray] | None = None  # autonomous, no crossings: (z_ref, f_ref)
        self.tried: Solved | None = None
        self.alone = [False] * m  # crossings whose other rows vanish together with the one that fires
        self.divided = [False] * m  # exits whose equation is divided by the length of the visit

    def _constants(self) -> list[int]:
        """Components of z that no visit moves and no transition sets."""
        traced, signature = self.system.traced, self.signature
        n_u = len(traced.u)
        kept = []
        for j in range(self.n):
            if j < n_u:
                moved = any(traced.fields[v.mode][j] != 0 for v in signature.visits)
                jumps = [traced.transitions[v.transition] for v in signature.crossings]
                resets = any(t.reset is not None and t.reset[j] != traced.u[j] for t in jumps)
                dropped = any(traced.lacking[v.mode][j] for v in signature.visits)
                never = all(traced.lacking[v.mode][j] for v in signature.visits)
                if never or not (moved or resets or dropped):
                    kept.append(j)
            elif not any(
                index == j - n_u for v in signature.crossings for index, _ in traced.transitions[v.transition].writes
            ):
                kept.append(j)
        return kept

    def prepare(self, X: FloatArray, size: FloatArray) -> None:
        """Anchor the orbit at X, and look at the surfaces there."""
        self.anchor(X[: self.n], self.parameters(X), size)
        self._look_at_surfaces(X)

    def anchor(self, z: FloatArray, values: FloatArray, size: FloatArray) -> None:
        """Put the phase condition of an orbit without forcing and transitions through z; others need none."""
        if not self.forced and not self.m:
            field = self.flow.segments(values, [self.at_section], [0.0], [0.0], z[None, :]).f_begin[0]
            self.reference = plane_across(z, field, size)

    def _look_at_surfaces(self, X: FloatArray) -> None:
        """Find surfaces that coincide at X.

        Exits through the surface of the entry are ``divided``: a visit of no length solves their equations too. Rows
        of one condition that vanish together leave the crossing ``alone``: they are no corner of it.
        """
        visits = self.signature.visits
        times, z = self.split(X)
        values = self.parameters(X)
        traced = self.system.traced
        for i, (k, row, at, _) in enumerate(self.jumps):
            n_rows = len(traced.transitions[k].rows)
            if at is None and n_rows > 1 and not self.at_once[i]:
                found = [self.flow.jump(values, k, float(times[i]), z[i + 1], r) for r in range(n_rows)]
                signs = [r.sign for r in traced.transitions[k].rows]
                self.alone[i] = all(
                    _coincide(signs[row] * found[row].h_z, signs[row] * found[row].h, signs[r] * one.h_z,
                              signs[r] * one.h, z[i + 1])
                    for r, one in enumerate(found) if r != row
                )  # fmt: skip
        for i in range(1, self.m):
            k, row, at, _ = self.jumps[i]
            k0, row0, at0, _ = self.jumps[i - 1]
            if at is not None or at0 is not None or self.at_once[i]:
                continue
            entry = self.flow.jump(values, k0, float(times[i - 1]), z[i], row0)
            leave = self.flow.jump(values, k, float(times[i - 1]), z[i], row)
            side = 1.0 if visits[i].mode == visits[i - 1].mode else -1.0  # from impact to impact, or in and out
            kept = _coincide(entry.h_z, entry.h, entry.h_z @ entry.R[: self.n, : self.n], entry.h, z[i])
            self.divided[i] = kept and _coincide(entry.h_z, entry.h, side * leave.h_z, side * leave.h, z[i])

    def split(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(instants t_1 ... t_m, states z_0 ... z_m)."""
        return X[self.t_at], X[self._columns]

    def join(self, times: Any, states: Any, period: float | None, parameters: Any = ()) -> FloatArray:
        """X from instants, states after them, the period (autonomous) and the active parameters."""
        X = np.empty(self.size + self.n_active)
        X[self.t_at] = times
        X[self._columns] = states
        if not self.forced:
            X[self.size - 1] = period
        X[self.size :] = parameters
        return X

    def parameters(self, X: FloatArray) -> FloatArray:
        """All parameters' values at X."""
        if not self.n_active:
            return self.values
        values = self.values.copy()
        values[self.places] = X[self.size :]
        return values

    def period(self, X: FloatArray) -> float:
        """The time once round."""
        if not self.forced:
            return float(X[self.size - 1])
        return self.period_number * self.flow.period(self.parameters(X))[0]

    def instants(self, X: FloatArray) -> FloatArray:
        """0, the instants of the transitions, and the end of the round (m + 2,)."""
        return np.concatenate([[0.0], X[self.t_at], [self.period(X)]])

    def moved(self, solved: Solved, X: FloatArray) -> Solved:
        """A solved orbit after a last step so small that its derivatives stay."""
        solved.X, solved.times, solved.values = X, self.instants(X), self.parameters(X)
        return solved

    def evaluate(self, X: FloatArray) -> Solved:
        """Residual and Jacobian at X."""
        n, m, size = self.n, self.m, self.size
        values = self.parameters(X)
        t, z = self.split(X)
        T, dT = self.flow.period(values) if self.forced else (float(X[size - 1]), np.zeros(self.n_active))
        end = self.period_number * T if self.forced else T
        times = np.empty(m + 2)
        times[0], times[1:-1], times[-1] = 0.0, t, end
        lengths = times[1:] - times[:-1]
        lengths[np.abs(lengths) < ROUNDING * abs(end)] = 0.0  # the step of the next visit is not begun from rounding
        segments = self.flow.segments(values, self.modes, times[:-1], lengths, z)
        # The states before the transitions, differentiated in t_(i-1), z_i, t_i (neighbours in X) and the parameters
        pull = np.matmul(segments.Phi, segments.f_begin[:, :, None])
        D = np.empty((m + 1, n, n + 2 + self.n_active))
        np.negative(pull[:, :, 0], out=D[:, :, 0])
        D[:, :, 1 : n + 1], D[:, :, n + 1], D[:, :, n + 2 :] = segments.Phi, segments.f_end, segments.P
        F, J = np.zeros(size), np.zeros((size, len(X)))
        jumps = []
        for i, (k, row, at, turn) in enumerate(self.jumps):
            jump = self.flow.jump(values, k, float(t[i]), segments.z[i], row)
            jumps.append(jump)
            r, first = self.t_at[i], self.z_at[i] - 1
            block = self._transition(jump, D[i])
            J[r : r + n + 1, max(first, 0) : r + 1] = block[:, max(-first, 0) : n + 2]
            J[r : r + n + 1, size:] = block[:, n + 2 :]
            F[r], F[r + 1 : r + 1 + n] = jump.h, z[i + 1] - jump.z_after
            if self.at_once[i]:
                J[r] = 0.0
                F[r] = t[i] - t[i - 1]
                J[r, r], J[r, self.t_at[i - 1]] = 1.0, -1.0
            elif at is not None:
                phase, slopes = self.flow.phase(values, k)
                J[r] = 0.0
                F[r] = t[i] - (turn + phase) * T
                J[r, r] = 1.0
                J[r, size:] = -(turn + phase) * dT - T * slopes
            elif self.divided[i]:
                self._divide(i, F, J, r, values, times, z)
        J.ravel()[self._after] = 1.0
        # Closure
        F[:n] = segments.z[m] - z[0]
        if segments.status.any():  # a segment that was not followed to its end
            F[:] = np.nan
        first = self.z_at[m] - 1
        J[:n, max(first, 0) : first + 1 + n] = D[m, :, max(-first, 0) : n + 1]
        J[:n, :n] -= self._one
        J[:n, size:] = segments.P[m]
        if self.forced:
            J[:n, size:] += segments.f_end[m][:, None] * (self.period_number * dT)
        for j in self.free:
            F[j] = 0.0
            J[j] = 0.0
            J[j, j] = 1.0
        if not self.forced:
            J[:n, size - 1] += segments.f_end[m]
            self._anchor(F, J, X, t, z[0])
        return Solved(X, F, J, times, segments, jumps, values, self.free, self.at_once)

    def _transition(self, jump: Jump, D: FloatArray) -> FloatArray:
        """Derivatives of the condition and of -R at a transition, by those of the state before it."""
        n = self.n
        found = np.empty((n + 1, D.shape[1]))
        found[0] = jump.h_z @ D
        np.matmul(jump.R[:n, :n], D, out=found[1:])
        found[1:, n + 1] += jump.fields[2, :n]
        found[1:, n + 2 :] += jump.R[:n, n:]
        np.negative(found[1:], out=found[1:])
        found[0, n + 1] += jump.h_t
        found[0, n + 2 :] += jump.h_p
        return found

    def _anchor(self, F: FloatArray, J: FloatArray, X: FloatArray, t: FloatArray, z0: FloatArray) -> None:
        """The phase condition of an autonomous orbit."""
        last = self.size - 1
        if self.m:
            F[last] = t[0] + t[-1] - X[last]
            J[last, self.t_at[0]] += 1.0
            J[last, self.t_at[-1]] += 1.0
            J[last, last] = -1.0
            return
        assert self.reference is not None
        z_ref, f_ref = self.reference
        F[last] = f_ref @ (z0 - z_ref)
        J[last, : self.n] = f_ref

    def _divide(
        self, i: int, F: FloatArray, J: FloatArray, r: int, values: FloatArray, times: FloatArray, z: FloatArray
    ) -> None:  # fmt: skip
        """Divide row r, the equation of the exit i through the surface of the entry, by the length of the visit.

        h(end) / tau = (h(end) - h(begin)) / tau, with h(begin) = 0 by the entry's own equation: the root tau = 0, where
        the visit has not begun, is taken out. For a short visit it is the series L_f h + tau L_f^2 h / 2.
        """
        n, size = self.n, self.size
        k, row, _, _ = self.jumps[i]
        indicator = self.system.traced.transitions[k].rows[row].indicator
        mode, t0, tau = int(self.modes[i]), float(times[i]), float(times[i + 1] - times[i])
        touch = self.flow.indicator(values, indicator, mode, t0, z[i])
        ti, tb, zb = self.t_at[i], self.t_at[i - 1], self.z_at[i]
        if abs(tau) < SHORT * (times[-1] or 1.0):
            F[r] = touch.L + 0.5 * tau * touch.L2
            J[r] = 0.0
            J[r, zb : zb + n] = touch.L_z
            J[r, tb] = touch.L_t - 0.5 * touch.L2
            J[r, ti] = 0.5 * touch.L2
            J[r, size:] = touch.L_p
            return
        F[r] = (F[r] - touch.h) / tau
        J[r, zb : zb + n] -= touch.h_z
        J[r, tb] -= touch.h_t
        J[r, size:] -= touch.h_p
        J[r] /= tau
        J[r, ti] -= F[r] / tau
        J[r, tb] += F[r] / tau

    def newton(
        self, X: FloatArray, scale: FloatArray, *, tolerance: float = 1e-12, most: int = 30,
        look: Callable[[], Any] | None = None,
    ) -> Solved | None:  # fmt: skip
        """Solve at fixed parameters; None where it does not converge. ``look`` is called before each iteration.

        The last iterate stays in ``tried``: what it was that did not converge."""
        X = X.copy()
        size = self.size
        last = np.inf
        for i in range(most):
            if look is not None:
                look()
            solved = self.tried = self.evaluate(X)
            if not np.isfinite(solved.residual).all():
                return None
            try:
                step = solve(solved.jacobian[:, :size] * scale[:size], -solved.residual)
            except np.linalg.LinAlgError:
                return None
            length = float(np.abs(step).max())
            if not np.isfinite(length):
                return None
            if length < tolerance or (i > 3 and length < 1e-9 and length > 0.5 * last):
                return solved
            if length > 0.5:
                step *= 0.5 / length
            X[:size] += scale[:size] * step
            last = length
        return None

    @property
    def at_section(self) -> int:
        """The mode at the section."""
        return self.signature.visits[0].mode


def _coincide(a: FloatArray, h: float, b: FloatArray, g: float, z: FloatArray) -> bool:
    """Return whether two indicators with gradients a, b and values h, g near z are one, but for a positive factor."""
    size = float(np.sqrt((a @ a) * (b @ b)))
    if size == 0.0 or float(a @ b) < (1.0 - SAME) * size:
        return False
    ratio = float(np.sqrt((b @ b) / (a @ a)))
    return bool(abs(g - ratio * h) <= SAME * (np.abs(b * z).max() + abs(g)))
