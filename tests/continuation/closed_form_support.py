"""The paper's oscillator in closed form at 40 digits (mpmath): orbits, folds and flips without variational equations.

In each mode x is a particular solution plus a damped oscillation, written down directly; the instants of contact are
roots of these expressions. The derivative of the return map is a central difference at 40 digits. Nothing of the
package enters, so what is found here can judge it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import mpmath as mp

mp.mp.dps = 40
TABLE_1 = {"m": 0.838, "k": 8.47, "k_s": 1210.0, "c": 0.87, "c_s": 0.60}
STEP = mp.mpf(10) ** -14
Pair = tuple[mp.mpf, mp.mpf]


def exact(p: Mapping[str, float]) -> dict[str, mp.mpf]:
    """The parameters as the doubles they are."""
    return {key: mp.mpf(float(value)) for key, value in {**TABLE_1, **p}.items()}


def motion(p: Mapping[str, mp.mpf], contact: bool, t0: mp.mpf, u0: Pair) -> Callable[[mp.mpf], Pair]:
    """t -> (x, v) in one mode from (t0, u0)."""
    m, stiffness, damping, offset = p["m"], 2 * p["k"], p["c"], mp.mpf(0)
    if contact:
        stiffness, damping, offset = stiffness + p["k_s"], damping + p["c_s"], p["k_s"] * p["g"]
    response = p["rho"] / mp.mpc(stiffness - m * p["omega"] ** 2, damping * p["omega"])
    a = damping / (2 * m)
    w = mp.sqrt(stiffness / m - a**2)

    def forced(t: mp.mpf) -> Pair:
        z = response * mp.expj(p["omega"] * t)
        return z.real + offset / stiffness, (mp.mpc(0, 1) * p["omega"] * z).real

    x0, v0 = (u0[i] - forced(t0)[i] for i in (0, 1))
    s = (v0 + a * x0) / w

    def at(t: mp.mpf) -> Pair:
        tau = t - t0
        e, cos, sin = mp.exp(-a * tau), mp.cos(w * tau), mp.sin(w * tau)
        x = e * (x0 * cos + s * sin)
        v = e * (-a * (x0 * cos + s * sin) + w * (s * cos - x0 * sin))
        fx, fv = forced(t)
        return x + fx, v + fv

    return at


def return_map(p: Mapping[str, mp.mpf], n: int, u: Pair, times: Sequence[float], contact: bool) -> Pair:
    """The state after n forcing periods; ``times`` are guesses of the instants at which contact begins and ends."""
    t, at = mp.mpf(0), motion(p, contact, mp.mpf(0), u)
    for guess in times:
        if contact:

            def surface(s: mp.mpf, at: Callable[[mp.mpf], Pair] = at) -> mp.mpf:
                x, v = at(s)
                return p["k_s"] * (x - p["g"]) + p["c_s"] * v
        else:

            def surface(s: mp.mpf, at: Callable[[mp.mpf], Pair] = at) -> mp.mpf:
                return at(s)[0] - p["g"]

        t = mp.findroot(surface, mp.mpf(guess), tol=mp.mpf(10) ** -60)
        contact = not contact
        at = motion(p, contact, t, at(t))
    return at(n * 2 * mp.pi / p["omega"])


def derivative(p: Mapping[str, mp.mpf], n: int, u: Pair, times: Sequence[float], contact: bool) -> mp.matrix:
    """Derivative of the return map by central differences, good to 20 digits and more."""
    D = mp.matrix(2, 2)
    for j in (0, 1):
        ends = []
        for sign in (1, -1):
            moved = [u[0], u[1]]
            moved[j] += sign * STEP
            ends.append(return_map(p, n, (moved[0], moved[1]), times, contact))
        for i in (0, 1):
            D[i, j] = (ends[0][i] - ends[1][i]) / (2 * STEP)
    return D


def special(
    kind: str, p: Mapping[str, float], name: str, n: int, u: Sequence[float], times: Sequence[float], contact: bool
) -> float:
    """Value of parameter ``name`` at the fold (det(DP - I) = 0) or flip (det(DP + I) = 0) near a first guess."""
    known = exact(p)
    sign = -1 if kind == "fold" else 1

    def equations(x: mp.mpf, v: mp.mpf, value: mp.mpf) -> list[mp.mpf]:
        q = dict(known, **{name: value})
        end = return_map(q, n, (x, v), times, contact)
        D = derivative(q, n, (x, v), times, contact)
        D[0, 0] += sign
        D[1, 1] += sign
        return [(end[0] - x) * 1000, (end[1] - v) * 100, mp.det(D)]

    first = tuple(mp.mpf(float(z)) for z in (*u, p[name]))
    found = mp.findroot(equations, first, tol=mp.mpf(10) ** -24, maxsteps=12)
    return float(found[2])
