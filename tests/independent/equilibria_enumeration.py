"""Random piecewise-linear systems and all their equilibria, by enumeration from force balances alone.

Nothing of the package is used but to hand a system over. Unknowns are the coordinates q and the forces of closed stops
and of sticking frictions; a combination of contact states is a polytope in them,

    load + sum_e w_e F_e = K q,   stop closed: gap = 0, N >= 0, open: gap >= 0,   friction at rest: |F| <= mu,
    spring stop: gap >= 0 or F = -k gap,   friction on a belt: F = mu sgn(belt),

and combinations that share states are one component.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

Array = NDArray[np.float64]
TOUCH = 1e-8


@dataclass(frozen=True)
class Part:
    kind: str  # stop, spring, friction
    w: Array
    position: float = 0.0
    side: int = 1
    k: float = 0.0
    mu: float = 0.0
    belt: float = 0.0

    @property
    def states(self) -> tuple[str, ...]:
        if self.kind == "friction":
            return ("slips",) if self.belt else ("sticks",)
        return ("open", "closed")


@dataclass(frozen=True)
class Draw:
    seed: int
    M: Array
    C: Array
    K: Array
    load: Array
    push: Array  # times the parameter P
    parts: tuple[Part, ...]

    def as_nonsmooth(self) -> Any:
        import nonsmooth as ns

        names = ["q"] if len(self.K) == 1 else ["q1", "q2"]
        elements: dict[str, Any] = {}
        for i, part in enumerate(self.parts):
            at = {name: float(x) for name, x in zip(names, part.w, strict=True) if x}
            if part.kind == "friction":
                elements[f"f{i}"] = ns.elements.Coulomb(at=at, friction=part.mu, belt=part.belt)
            elif part.kind == "stop":
                elements[f"s{i}"] = ns.elements.Stop(at=at, position=part.position, side=part.side, restitution=0.5)
            else:
                elements[f"b{i}"] = ns.elements.ElasticStop(
                    at=at, position=part.position, side=part.side, stiffness=part.k, damping=0.05
                )
        forcing = {
            name: (lambda t, p, a=float(a), b=float(b): a + b * p.P)
            for name, a, b in zip(names, self.load, self.push, strict=True)
        }
        return ns.mechanical(
            self.M, self.C, self.K, parameters={"P": 0.0}, forcing=forcing, elements=elements, coordinates=names
        )


def draw(seed: int) -> Draw:
    rng = np.random.default_rng(seed)
    n = 1 + seed % 2
    while True:
        turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
        K = turn @ np.diag(rng.choice([-1.0, 1.0], n, p=[0.25, 0.75]) * rng.uniform(0.4, 2.5, n)) @ turn.T
        ways = [np.eye(n)[i] for i in range(n)] + ([np.array([1.0, -1.0])] if n == 2 else [])
        parts = []
        for _ in range(rng.integers(1, 4)):
            w, kind = ways[rng.integers(len(ways))], rng.choice(["stop", "spring", "friction"], p=[0.3, 0.3, 0.4])
            side = int(rng.choice([-1, 1]))
            if kind == "friction":
                belt = float(rng.choice([0.0, 0.4, -0.4], p=[0.7, 0.15, 0.15]))
                parts.append(Part("friction", w, mu=float(rng.uniform(0.1, 0.8)), belt=belt))
            else:
                position = side * float(rng.uniform(0.05, 1.0))
                parts.append(Part(str(kind), w, position, side, float(rng.uniform(0.5, 5.0))))
        # a friction must not stand on two belts, nor a body between two stops at one place
        rests = [(tuple(p.w), p.side) for p in parts if p.kind == "stop"]
        belts = [tuple(p.w) for p in parts if p.kind == "friction"]
        if len(set(rests)) == len(rests) and len(set(belts)) == len(belts):
            break
    M = np.diag(rng.uniform(0.5, 2.0, n))
    load, push = rng.uniform(-0.5, 0.5, n), rng.uniform(0.3, 1.0, n)
    return Draw(seed, M, 0.3 * np.eye(n), 0.5 * (K + K.T), load, push, tuple(parts))


@dataclass
class Piece:
    """Equalities A x = b and inequalities G x <= h over x = (q, forces)."""

    states: tuple[str, ...]
    A: Array
    b: Array
    G: Array
    h: Array
    lower: Array
    upper: Array


@dataclass
class Component:
    pieces: list[Piece]
    lower: Array
    upper: Array

    def contains(self, q: Array, off: float = 1e-6) -> bool:
        return any(_solve(p, np.zeros(p.A.shape[1]), q, off) is not None for p in self.pieces)


def _solve(piece: Piece, cost: Array, at: Array | None = None, off: float = 0.0) -> Any:
    bounds: list[tuple[float | None, float | None]] = [(None, None)] * piece.A.shape[1]
    if at is not None:
        bounds[: len(at)] = [(x - off, x + off) for x in at]
    found = linprog(cost, piece.G, piece.h, piece.A, piece.b, bounds, method="highs")
    return found if found.status in (0, 3) else None


def pieces(one: Draw, P: float) -> Iterator[Piece]:
    n = len(one.K)
    for states in product(*(part.states for part in one.parts)):
        held = [i for i, s in enumerate(states) if s == "sticks" or (s == "closed" and one.parts[i].kind == "stop")]
        m = n + len(held)
        A, b = np.zeros((n, m)), -(one.load + P * one.push)
        A[:, :n] = -one.K
        G, h, E, e = [], [], [], []
        for i, (part, state) in enumerate(zip(one.parts, states, strict=True)):
            gap = np.zeros(m)  # gap = gap . x + part.side * position
            gap[:n], room = -part.side * part.w, part.side * part.position
            if part.kind == "friction" and state == "slips":
                b = b - part.w * part.mu * np.sign(part.belt)
            elif part.kind == "friction":
                k = n + held.index(i)
                A[:, k] += part.w
                for sign in (1.0, -1.0):
                    G.append(sign * np.eye(m)[k])
                    h.append(part.mu)
            elif state == "open":
                G.append(-gap)
                h.append(room)
            elif part.kind == "stop":
                k = n + held.index(i)
                A[:, k] -= part.side * part.w
                G.append(-np.eye(m)[k])
                h.append(0.0)
                E.append(gap)
                e.append(-room)
            else:  # a pressed spring: its force is -k gap, away from its side
                A[:, :n] += part.side * part.k * np.outer(part.w, gap[:n])
                b = b - part.side * part.k * part.w * room
                G.append(gap)
                h.append(-room)
        piece = Piece(
            states,
            np.vstack([A, *E]) if E else A,
            np.append(b, e),
            np.array(G).reshape(-1, m),
            np.array(h),
            np.zeros(n),
            np.zeros(n),
        )
        if _solve(piece, np.zeros(m)) is None:
            continue
        for k, (side, sign) in product(range(n), ((piece.lower, 1.0), (piece.upper, -1.0))):
            found = _solve(piece, sign * np.eye(m)[k])
            side[k] = found.x[k] if found is not None and found.status == 0 else -sign * np.inf
        yield piece


def _meet(a: Piece, b: Piece) -> bool:
    """Return whether two pieces share a q, each with forces of its own."""
    n, m, o = len(a.lower), a.A.shape[1], b.A.shape[1]
    if (a.lower > b.upper + TOUCH).any() or (b.lower > a.upper + TOUCH).any():
        return False

    def both(one: Array, other: Array) -> Array:
        out = np.zeros((len(one) + len(other), m + o))
        out[: len(one), :m], out[len(one) :, m:] = one, other
        return out

    same = np.hstack([np.eye(n, m), -np.eye(n, o)])
    G = np.vstack([both(a.G, b.G), same, -same])
    h = np.concatenate([a.h, b.h, np.full(2 * n, TOUCH)])
    found = linprog(np.zeros(m + o), G, h, both(a.A, b.A), np.append(a.b, b.b), (None, None), method="highs")
    return bool(found.status == 0)


def components(one: Draw, P: float) -> list[Component]:
    groups: list[list[Piece]] = []
    for piece in pieces(one, P):
        near = [g for g in groups if any(_meet(piece, other) for other in g)]
        groups = [g for g in groups if not any(g is x for x in near)] + [[piece, *(x for g in near for x in g)]]
    return [Component(g, np.min([p.lower for p in g], axis=0), np.max([p.upper for p in g], axis=0)) for g in groups]


def growth(one: Draw, part: Component) -> float | None:
    """The largest real part of the eigenvalues of what is free to move; None where a bound is met, or nothing moves.

    What sticks and what rests against a stop holds its direction, one that is at a bound belongs to two states."""
    if len(part.pieces) != 1:
        return None
    piece = part.pieces[0]
    x = np.linalg.lstsq(piece.A, piece.b, rcond=None)[0]
    if np.allclose(part.lower, part.upper, atol=1e-9) and (piece.h - piece.G @ x < 1e-3).any():
        return None
    K, rows = one.K.copy(), []
    C = one.C.copy()
    for p, state in zip(one.parts, piece.states, strict=True):
        if state in ("sticks",) or (state == "closed" and p.kind == "stop"):
            rows.append(p.w)
        elif state == "closed":
            K += p.k * np.outer(p.w, p.w)
            C += 0.05 * np.outer(p.w, p.w)
    free = np.eye(len(K))
    if rows:
        _, sizes, right = np.linalg.svd(np.array(rows))
        free = right[int((sizes > 1e-9).sum()) :].T
    if not free.shape[1]:
        return None
    M, C, K = (free.T @ X @ free for X in (one.M, C, K))
    zero, eye = np.zeros_like(M), np.eye(len(M))
    A = np.block([[zero, eye], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    return float(np.linalg.eigvals(A).real.max())
