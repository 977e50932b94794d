"""Modes of the contact reference: the flow of a combination of contact states, and which combination holds.

A state of contact is, by kind: stop "open" "closed"; elastic "off" "on"; friction and preload "stick" "+" "-".
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations, product

import numpy as np
from contact_elements import Array, Part, System, kinematics, parts
from scipy.linalg import null_space, qr

ZERO = 1e-11  # of the absolute terms
CLEAN = 64 * np.finfo(float).eps
HELD = ("closed", "stick")


class NoAnswerError(Exception):
    """The rules give no motion, or the run was stopped."""


def cleaned(value: Array, terms: Array) -> Array:
    return np.where(np.abs(value) < CLEAN * terms, 0.0, value)


def facets(generators: Array, bounds: list[float]) -> list[tuple[Array, float]]:
    """Return (y, h), y . c <= h, for all c = sum f_i g_i with |f_i| <= b_i, or f_i >= 0 where b_i is infinite."""
    rank = generators.shape[1]
    out: list[tuple[Array, float]] = []
    for chosen in combinations(range(len(generators)), rank - 1):
        normal = null_space(generators[list(chosen)], rcond=1e-9) if chosen else np.ones((1, 1))
        if normal.shape[1] != 1:
            continue
        for y in (normal[:, 0], -normal[:, 0]):
            along = cleaned(generators @ y, 16 * np.abs(generators).sum(axis=1))  # y is of length one
            limit = 0.0
            for a, b in zip(along, bounds, strict=True):
                limit = max(limit, np.inf) if np.isinf(b) and a > 0 else limit + (0.0 if np.isinf(b) else b * abs(a))
            if np.isfinite(limit) and not any(np.allclose(y, other, rtol=0, atol=1e-12) for other, _ in out):
                out.append((y, limit))
    return out


@dataclass
class Mode:
    """z' = A z with the held rates at zero, and the rows that must stay positive for its forces."""

    states: tuple[str, ...]
    A: Array
    feasible: Array
    held: list[int]
    generators: Array  # forces of the held parts in those of an independent subset
    needed: Array  # those of the subset, rows over z
    bounds: list[float]
    powers: list[Array] = field(default_factory=list)

    def force_terms(self, k: int) -> Array:
        """|A|^k."""
        if not self.powers:
            self.powers.append(np.eye(len(self.A)))
        while len(self.powers) <= k:
            self.powers.append(np.abs(self.A) @ self.powers[-1])
        return self.powers[k]

    def orders(self, rows: Array, z: Array, size: Array) -> list[tuple[int, int]]:
        """Return, for each row, sign and order of the first derivative along this flow that is not zero (rule 5)."""
        out = [(0, len(self.A))] * len(rows)
        left, derivative = list(range(len(rows))), z
        for k in range(len(self.A)):
            value, terms = rows[left] @ derivative, np.abs(rows[left]) @ (self.force_terms(k) @ size)
            still = []
            for i, x, bound in zip(left, value, ZERO * terms, strict=True):
                if abs(x) > bound:
                    out[i] = (1 if x > 0 else -1, k)
                else:
                    still.append(i)
            if not still:
                break
            left, derivative = still, self.A @ derivative
        return out

    def signs(self, rows: Array, z: Array, size: Array) -> list[int]:
        return [sign for sign, _ in self.orders(rows, z, size)]

    def forces(self, z: Array) -> dict[int, float]:
        """Forces of the held parts: of least norm within the bounds where they are not unique (rule 3)."""
        c, m = self.needed @ z, len(self.held)
        best: Array | None = None
        lower = [0.0 if np.isinf(b) else -b for b in self.bounds]
        for fixed in product((None, 0, 1), repeat=m):
            if any(f == 1 and np.isinf(b) for f, b in zip(fixed, self.bounds, strict=True)):
                continue
            f = np.array(
                [0.0 if s is None else (low, b)[s] for s, low, b in zip(fixed, lower, self.bounds, strict=True)]
            )
            free = [i for i, s in enumerate(fixed) if s is None]
            if free:
                f[free] = np.linalg.pinv(self.generators[free].T) @ (c - self.generators.T @ f)
            slack = 1e-9 * (1 + np.abs(c).max(initial=0.0))
            if np.abs(self.generators.T @ f - c).max(initial=0.0) > slack:
                continue
            inside = (f >= np.array(lower) - slack) & (f <= np.array(self.bounds) + slack)
            if inside.all() and (best is None or f @ f < best @ best - slack):
                best = f
        if best is None:
            raise NoAnswerError("no forces within the bounds")
        return dict(zip(self.held, map(float, best), strict=True))


class Rules:
    """Section 2 for one system: candidates, looks, combinations."""

    def __init__(self, system: System) -> None:
        self.parts: tuple[Part, ...] = parts(system)
        self.n = n = len(system.mass)
        self.kinematics = kinematics(n, system.frequency)
        self.inverse = np.linalg.inv(system.mass)
        self.smooth = np.hstack((-system.stiffness, -system.damping, system.loads))
        self.one = np.eye(2 * n + 3)[2 * n]
        self.modes: dict[tuple[tuple[str, ...], tuple[str, ...]], Mode | None] = {}

    def of(self, kind: str) -> list[int]:
        return [i for i, part in enumerate(self.parts) if part.kind == kind]

    def elastic_force(self, i: int) -> Array:
        part = self.parts[i]
        return -part.numbers["k"] * part.zero - part.numbers["c"] * part.rate

    def mode(self, states: tuple[str, ...], bounds: tuple[str, ...]) -> Mode | None:
        """Return the mode, None where the held rates contradict each other; bounds: static or kinetic, by part."""
        if (states, bounds) not in self.modes:
            self.modes[states, bounds] = self.built(states, bounds)
        return self.modes[states, bounds]

    def built(self, states: tuple[str, ...], bounds: tuple[str, ...]) -> Mode | None:
        n = self.n
        force = self.smooth.copy()
        for part, state, bound in zip(self.parts, states, bounds, strict=True):
            if state == "on":
                force += np.outer(part.direction, -part.numbers["k"] * part.zero - part.numbers["c"] * part.rate)
            elif state in "+-":
                force -= np.outer(part.direction, (1 if state == "+" else -1) * part.numbers[bound] * self.one)
            if part.kind == "preload":
                force -= np.outer(part.direction, part.numbers["k"] * part.zero)
        held = [i for i, state in enumerate(states) if state in HELD]
        needed, generators = np.zeros((0, 2 * n + 3)), np.zeros((len(held), 0))
        if held:
            rates = np.array([self.parts[i].rate for i in held])
            w = rates[:, n : 2 * n]
            r, order = qr((w / np.linalg.norm(w, axis=1)[:, None]).T, mode="r", pivoting=True)
            diagonal = np.abs(np.diag(r))
            if np.any((diagonal > 1e-13) & (diagonal < 1e-7)):
                raise NoAnswerError("rank undecided")
            basis = sorted(order[: int((diagonal > 1e-7).sum())])
            generators = np.linalg.lstsq(w[basis].T, w.T, rcond=None)[0].T
            generators = cleaned(generators, np.ones_like(generators))
            generators[basis] = np.eye(len(basis))
            surplus = rates - generators @ rates[basis]
            if np.any(np.abs(surplus) > 1e-12 * (np.abs(rates) + np.abs(generators) @ np.abs(rates[basis]))):
                return None
            w = w[basis]
            inverse = np.linalg.inv(w @ self.inverse @ w.T)
            free = w @ self.inverse @ force + rates[basis] @ self.kinematics
            terms = np.abs(w) @ np.abs(self.inverse) @ np.abs(force) + np.abs(rates[basis]) @ np.abs(self.kinematics)
            needed = cleaned(-inverse @ free, np.abs(inverse) @ terms)
            total, terms = force + w.T @ needed, np.abs(force) + np.abs(w.T) @ np.abs(needed)
        else:
            total, terms = force, np.abs(force)
        A = self.kinematics.copy()
        A[n : 2 * n] = cleaned(self.inverse @ total, np.abs(self.inverse) @ terms)
        limits = [np.inf if states[i] == "closed" else self.parts[i].numbers[bounds[i]] for i in held]
        rows = [h * self.one - y @ needed for y, h in facets(generators, limits)] if held else []
        return Mode(states, A, np.array(rows).reshape(-1, 2 * n + 3), held, generators, needed, limits)

    def conditions(self, mode: Mode, candidates: list[int]) -> Array:
        """Rows that must be positive behind this instant: forces, gaps and slips of the candidates."""
        rows = list(mode.feasible)
        for i in candidates:
            part, state = self.parts[i], mode.states[i]
            if state == "open":
                rows.append(part.zero)
            elif state in "+-":
                rows.append(part.rate if state == "+" else -part.rate)
        return np.array(rows).reshape(-1, 2 * self.n + 3)

    def combination(self, states: list[str], candidates: list[int], bounds: list[str], z: Array, size: Array) -> Mode:
        """Return the combination of most held candidates whose conditions hold along its own flow."""
        choices = [("closed", "open") if self.parts[i].kind == "stop" else ("stick", "+", "-") for i in candidates]
        for chosen in sorted(product(*choices), key=lambda c: -sum(s in HELD for s in c)):
            trial = list(states)
            for i, state in zip(candidates, chosen, strict=True):
                trial[i] = state
            mode = self.mode(tuple(trial), tuple(bounds))
            if mode is not None and min(mode.signs(self.conditions(mode, candidates), z, size), default=1) >= 0:
                return mode
        raise NoAnswerError("no_motion")

    def looks(self, states: list[str], candidates: list[int], z: Array, size: Array) -> Mode:
        """Rule 2: static bounds first; what moves gets its kinetic bound, until no further one moves."""
        bounds = ["static" if i in candidates else "kinetic" for i in range(len(self.parts))]
        while True:
            mode = self.combination(states, candidates, bounds, z, size)
            slips = [i for i in candidates if mode.states[i] in "+-" and bounds[i] == "static"]
            moved = [i for i in slips if mode.signs(self.parts[i].rate[None], z, size)[0]]
            if not moved:
                break
            for i in moved:
                bounds[i] = "kinetic"
        # bounds of the looks are of this instant only
        final = tuple("static" if state == "stick" else "kinetic" for state in mode.states)
        out = self.mode(mode.states, final)
        assert out is not None
        return out
