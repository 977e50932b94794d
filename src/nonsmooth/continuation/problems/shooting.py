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

from dataclasses import dataclass
from typing import Any

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.problems.multipliers import multipliers_of
from nonsmooth.continuation.problems.signature import AT_ONCE, Round, Signature
from nonsmooth.continuation.problems.surfaces import coincide, mean_along, one_surface
from nonsmooth.flow.saltation import chained
from nonsmooth.flow.variational import Jump, Segments, VariationalFlow
from nonsmooth.system.system import System

ROUNDING = 1e-16  # of the period
SHORT = (0.0, 1e-6, 1e-2)  # of the period, by order: of a shorter visit the mean is taken in place of the quotient
ON = 1e-6  # of an indicator's size: a state as near to a surface is on it
FAMILY = 1e-12  # least singular value of I - M: beside it no orbit stands alone


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
    forced: bool

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

    @property
    def multipliers(self) -> ComplexArray:
        """Floquet multipliers."""
        return self.multipliers_of(self.monodromy)

    def multipliers_of(self, M: FloatArray) -> ComplexArray:
        """Those of its monodromy matrix M; the determinant is that of the pieces: their product loses digits."""
        if self.free or len(M) != 2 or not np.isfinite(M).all() or any(self.at_once):
            return multipliers_of(M)
        det = float(np.exp(self.segments.divergence.sum()))
        for (a, b), (c, d) in (jump.S[:2, :2].tolist() for jump in self.jumps):
            det *= a * d - b * c
        return multipliers_of(M, det, forced=self.forced)


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
        self.flow = VariationalFlow.of(system, active)
        self.flow.look_at([v.mode for v in signature.visits], system.parameter_vector())
        traced = system.traced
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
        self.alone = [False] * m  # crossings whose other rows vanish together with the one that fires
        self.divided = [0] * m  # the power of the visit's length by which the equations of exits are divided

    @classmethod
    def of(
        cls, system: System, once: Round, active: tuple[str, ...] = (), values: Any = ()
    ) -> tuple[Shooting, FloatArray]:
        """The equations of once round, and its unknowns; ``values`` are those of the active parameters."""
        shooting = cls(system, once.signature, once.period_number, active)
        return shooting, shooting.join(once.times, once.states, once.period, values)

    def once(self, X: FloatArray) -> Round:
        """Once round the orbit with these unknowns."""
        return Round(self.period_number, self.period(X), self.signature, *self.split(X))

    def _constants(self) -> list[int]:
        """Components of z that no visit moves and no transition sets."""
        traced, crossings = self.system.traced, self.signature.crossings
        taken, n_u = [traced.transitions[v.transition] for v in crossings], len(traced.u)
        written = {index for jump in taken for index, _ in jump.writes}

        def changes(j: int) -> bool:
            if j >= n_u:
                return j - n_u in written
            lacks = [traced.lacking[mode][j] for mode in self.modes]
            moved = any(traced.fields[mode][j] != 0 for mode in self.modes)
            resets = any(jump.reset is not None and jump.reset[j] != traced.u[j] for jump in taken)
            return not all(lacks) and (moved or resets or any(lacks))

        return [j for j in range(self.n) if not changes(j)]

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
        times, z = self.split(X)
        values = self.parameters(X)
        traced = self.system.traced
        for i, (k, row, at, _) in enumerate(self.jumps):
            rows = traced.transitions[k].rows
            if at is None and len(rows) > 1 and not self.at_once[i]:
                jumps = [self.flow.jump(values, k, float(times[i]), z[i + 1], r) for r in range(len(rows))]
                signed = [(one.sign * jump.h_z, one.sign * jump.h) for one, jump in zip(rows, jumps, strict=True)]
                self.alone[i] = all(coincide(*signed[row], *one, z[i + 1]) for one in signed)
        for i in range(0 if self.forced and self.m > 1 else 1, self.m):
            if self.jumps[i][2] is self.jumps[i - 1][2] is None and not (self.at_once[i] or self.at_once[i - 1]):
                self.divided[i] = self._order(i, values, float(times[i - 1]), z[i or -1])

    def _order(self, i: int, values: FloatArray, t: float, z: FloatArray) -> int:
        """The order to which the equation of exit i vanishes by itself where the visit before it has no length.

        1: exit and entry lie in one surface. 2: the visit leaves a mode that holds the surface (a slip from sticking),
        and begins where the surface's rate vanishes: h and L_f h are zero there by the equations before."""
        k, row, _, _ = self.jumps[i]
        k0, row0, _, _ = self.jumps[i - 1]  # of the first exit it is the last of the round
        n, indicator = self.n, self.system.traced.transitions[k].rows[row].indicator
        entry = self.flow.jump(values, k0, t, z, row0)
        touch = self.flow.indicator(values, indicator, int(self.modes[i]), t, z)
        held = self.flow.indicator(values, indicator, int(self.modes[i - 1]), t, z)
        x = np.concatenate([z, [t], values[self.places]])
        enters, leaves = (np.concatenate([one.h_z, [one.h_t], one.h_p]) for one in (entry, touch))
        rate, keeps = (np.concatenate([one.L_z, [one.L_t], one.L_p]) for one in (touch, held))
        signs = [self.system.traced.transitions[j].rows[r].sign for j, r in ((k0, entry.row), (k, row))]
        # In and out by the two sides of a surface, or from impact to impact on one of them
        side = signs[0] * signs[1] * (1.0 if self.modes[i - 1] == self.modes[i] else -1.0)
        if (
            i
            and coincide(entry.h_z, entry.h, entry.h_z @ entry.R[:n, :n], entry.h, z)
            and coincide(enters, entry.h, side * leaves, side * touch.h, x)
        ):
            return 1
        size = float(np.abs(touch.h_z) @ self.flow.scale)
        holds = not keeps.any() or one_surface(leaves, touch.h, keeps, held.L, x)
        if abs(touch.h) > ON * size or (entry.R[:n, :n] != self._one).any() or not holds:
            return 0
        across = np.eye(len(x)) - np.outer(leaves, leaves) / float(leaves @ leaves)
        return 2 if one_surface(across @ enters, entry.h, across @ rate, touch.L, x) else 0

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

    def evaluate(self, X: FloatArray, equations: bool = True) -> Solved:
        """Residual and Jacobian at X; without ``equations`` only what the motion is."""
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
        if not equations:
            return Solved(
                X, times[:0], segments.P[0, :0], times, segments, [], values, self.free, self.at_once, self.forced
            )
        # The states before the transitions, differentiated in t_(i-1), z_i, t_i (neighbours in X) and the parameters
        pull = np.matmul(segments.Phi, segments.f_begin[:, :, None])
        D = np.empty((m + 1, n, n + 2 + self.n_active))
        np.negative(pull[:, :, 0], out=D[:, :, 0])
        D[:, :, 1 : n + 1], D[:, :, n + 1], D[:, :, n + 2 :] = segments.Phi, segments.f_end, segments.P
        F, J = np.zeros(size), np.zeros((size, len(X)))
        instants = t.tolist()
        jumps = [
            self.flow.jump(values, self.jumps[i][0], instants[i], segments.z[i], self.jumps[i][1]) for i in range(m)
        ]
        blocks = self._transitions(jumps, D[:m]) if m else D
        for i, (k, _, at, turn) in enumerate(self.jumps):
            r, first, jump = self.t_at[i], self.z_at[i] - 1, jumps[i]
            J[r : r + n + 1, max(first, 0) : r + 1] = blocks[i][:, max(-first, 0) : n + 2]
            J[r : r + n + 1, size:] = blocks[i][:, n + 2 :]
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
        return Solved(X, F, J, times, segments, jumps, values, self.free, self.at_once, self.forced)

    def _transitions(self, jumps: list[Jump], D: FloatArray) -> FloatArray:
        """Derivatives of the conditions and of -R at the transitions, by those of the states before them."""
        n = self.n
        rows = np.array([[*jump.h_z, jump.h_t, *jump.h_p] for jump in jumps])
        R, fields = np.array([jump.R for jump in jumps]), np.array([jump.fields[2] for jump in jumps])
        maps = np.concatenate([rows[:, None, :n], -R[:, :n, :n]], axis=1)
        found = maps @ D
        found[:, 0, n + 1 :] += rows[:, n:]
        found[:, 1:, n + 1] -= fields[:, :n]
        found[:, 1:, n + 2 :] -= R[:, :n, n:]
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
    ) -> None:
        """Divide row r, the equation of the exit i, by the power of the visit's length to which it vanishes by itself.

        With the terms that are zero by the equations before taken out, (h(end) - h) / tau or (h(end) - h - tau L_f h) /
        tau^2, the root tau = 0, where the visit has not begun, is gone. For a short visit both are means of derivatives
        along it, without cancellation: of L_f h, and of (1 - s) L_f^2 h.
        """
        n, order, entry = self.n, self.divided[i], i or self.m  # the first visit begins before the section
        tau = float(times[i + 1] - times[entry]) + (0.0 if i else float(times[-1]))
        k, row, _, _ = self.jumps[i]
        visit = int(self.modes[i]), self.system.traced.transitions[k].rows[row].indicator, order
        zb, size = self.z_at[entry], self.size
        begin, inner = slice(zb - 1, zb + n), np.zeros(J.shape[1])  # of its unknowns; slope of its length
        inner[self.t_at[i]], inner[zb - 1] = 1.0, -1.0
        if not i:
            inner[size:] = self.period_number * self.flow.period(values)[1]
        if abs(tau) < SHORT[order] * (times[-1] or 1.0):
            x = np.concatenate([times[entry : entry + 1], z[entry], [tau], values[self.places]])
            F[r], slopes = mean_along(self.flow, x, values, *visit)
            J[r] = slopes[n + 1] * inner
            J[r, begin] += slopes[: n + 1]
            J[r, size:] += slopes[n + 2 :]
            return
        at = self.flow.indicator(values, visit[1], visit[0], float(times[entry]), z[entry])
        for h, h_t, h_z, h_p in ((at.h, at.h_t, at.h_z, at.h_p), (at.L, at.L_t, at.L_z, at.L_p))[:order]:
            F[r] = (F[r] - h) / tau
            J[r, begin] -= np.concatenate([[h_t], h_z])
            J[r, size:] -= h_p
            J[r] = (J[r] - F[r] * inner) / tau

    @property
    def at_section(self) -> int:
        """The mode at the section."""
        return self.signature.visits[0].mode


def plane_across(z: FloatArray, field: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(z_ref, f_ref) of the plane f_ref . (u - z_ref) = 0 through z across the flow, in states divided by ``size``."""
    weighted = field / size**2
    return z.copy(), weighted / max(float(np.abs(weighted * size).max()), 1e-300)


def in_a_family(shooting: Shooting, solved: Solved) -> bool:
    """Return whether a forced orbit does not stand alone: a multiplier is 1 to rounding, and any guess solved it."""
    M = solved.monodromy
    if not shooting.forced or not np.isfinite(M).all():
        return False
    return bool(np.linalg.svd(np.eye(len(M)) - M, compute_uv=False)[-1] <= FAMILY)
