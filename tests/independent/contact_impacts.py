"""Impact laws of the contact reference, frictionless (Newton, at once or in sequence) and with friction (Stronge)."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from contact_elements import Array


def newton(inverse: Array, W: Array, before: Array, restitution: Array) -> Array:
    """Return the impulses 0 <= L complementary to g'+ + e max(0, -g'-) >= 0; W: rows of the gap rates.

    Of least norm among the active sets that solve it.
    """
    G = W @ inverse @ W.T
    target = -restitution * np.minimum(before, 0.0)
    slack = 1e-12 * np.abs(before).max(initial=0.0)
    best: Array | None = None
    for count in range(len(before) + 1):
        for active in map(list, combinations(range(len(before)), count)):
            impulse = np.zeros(len(before))
            if active:
                impulse[active] = np.linalg.pinv(G[np.ix_(active, active)], rcond=1e-11) @ (target - before)[active]
            after = before + G @ impulse - target
            good = impulse.min(initial=0.0) >= -slack * 10 and after.min(initial=0.0) >= -slack
            good = good and np.abs(after[active]).max(initial=0.0) <= slack
            if good and (best is None or impulse @ impulse < best @ best):
                best = impulse
    if best is None:
        raise ArithmeticError("no impact")
    return np.maximum(best, 0.0)


def simultaneous(inverse: Array, W: Array, before: Array, restitution: Array) -> tuple[Array, Array]:
    """Return the change of velocities and the impulses."""
    impulse = newton(inverse, W, before, restitution)
    return inverse @ W.T @ impulse, impulse


def sequential(
    inverse: Array, W: Array, before: Array, restitution: Array, rest_speed: float, rounds: int = 10_000
) -> tuple[Array, Array]:
    """The fastest approach first, equal ones at once; one plastic impact of all ends it below the rest speed."""
    change, impulse = np.zeros(len(inverse)), np.zeros(len(before))
    for _ in range(rounds):
        rate = before + W @ change
        fastest = -rate.min()
        if fastest <= rest_speed:
            step, extra = simultaneous(inverse, W, rate, np.zeros(len(rate)))
            return change + step, impulse + extra
        first = [i for i, x in enumerate(rate) if -x >= fastest * (1 - 1e-11)]
        step, extra = simultaneous(inverse, W[first], rate[first], restitution[first])
        change, impulse[first] = change + step, impulse[first] + extra
    raise ArithmeticError("more impacts than rounds")


def stronge(G: Array, normal: float, slip: float, restitution: float, friction: float) -> tuple[Array, Array]:
    """Return (v_n, v_t) after and the impulses (normal, tangential) of an impact with Coulomb friction.

    G: rows (w_n, w_t) times columns (D_n, D_t). Along dp of the normal impulse pieces are linear; compression
    ends at v_n = 0 with W = int v_n dp, the impact where the work since then is e^2 |W|.
    """
    v_n, v_t, p, p_t = float(normal), float(slip), 0.0, 0.0
    work, target = 0.0, None  # of compression; of restitution once it is known
    (g_nn, g_nt), (g_tn, g_tt) = np.asarray(G, float)
    while True:
        if v_t:
            k = -friction * np.sign(v_t)
        else:
            k = -g_tn / g_tt if abs(g_tn) <= friction * g_tt else -friction * np.sign(g_tn)
        dn, dt = g_nn + k * g_nt, (g_tn + k * g_tt) if v_t or abs(g_tn) > friction * g_tt else 0.0
        to_stop = -v_t / dt if v_t * dt < 0 else np.inf
        if dn <= 0 and np.isinf(to_stop):
            raise ArithmeticError("the slip does not fall while the contact is not decelerated")
        to_end = np.inf
        if target is None:
            if dn > 0:
                to_end = -v_n / dn  # end of compression
        else:
            root = v_n**2 + 2 * dn * target  # v_n p + dn p^2 / 2 = target
            if root >= 0 and (dn > 0 or v_n > 0):
                to_end = 2 * target / (v_n + np.sqrt(root)) if target else 0.0
        step = min(to_stop, to_end)
        done = v_n * step + dn * step**2 / 2
        v_n, v_t, p, p_t = v_n + dn * step, v_t + dt * step, p + step, p_t + k * step
        if to_stop <= to_end:
            v_t = 0.0
        if target is None:
            work += done
            if to_end <= to_stop:
                v_n, target = 0.0, restitution**2 * abs(work)
        else:
            target -= done
            if to_end <= to_stop:
                return np.array([v_n, v_t]), np.array([p, p_t])
