r"""The impact of a rigid contact that rubs: Coulomb's law along the normal impulse, Stronge's energetic restitution.

Along the normal impulse p the rates v of the contact (n), of its slip (t) and of other closed contacts (o) change by

    dv / dp = G_n + k G_t + G_o y,      k = -mu sgn v_t,    or |k| <= mu with v_t = 0,    0 <= y complementary to v_o.

Compression ends where v_n = 0, with the work W = int v_n dp; the impact ends where the work since then is e^2 |W|
(Stronge 1990). k and y do not change along a piece, which ends where a rate becomes zero: all roots are closed forms.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nonsmooth.arrays import FloatArray

Least = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
TURNS = 1000  # pieces of one impact, at most
TINY = 1e-40  # of the rates: steps of derivatives, in the imaginary part


def stronge(
    G: FloatArray, rates: FloatArray, restitution: float, friction: float, least: Least
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return the impulses, their derivatives in the rates and the rates behind an impact; None where the slip does not
    fall while the contact is not slowed down.

    Places 0 and 1 of ``G`` and ``rates`` are those of the contact and its slip, the others of closed contacts. Rates
    that the impact ends are exactly zero. ``least`` solves for impulses between bounds."""
    size, scale = len(rates), float(np.abs(rates).max())
    impulses, after = np.zeros(size), rates
    slopes = np.zeros((size, size))
    for j in range(size):  # impulses are functions of the rates that are analytic along the pieces
        disturbed = rates / scale + 1j * TINY * np.eye(size)[j]
        found = _followed(G, disturbed, restitution, friction, least)
        if found is None:
            return None
        impulses, after = found[0].real * scale, found[1].real * scale
        slopes[:, j] = found[0].imag / TINY
    return impulses, slopes, after


def _followed(
    G: FloatArray, v: FloatArray, restitution: float, friction: float, least: Least
) -> tuple[FloatArray, FloatArray] | None:
    """Impulses and rates behind the impact, of complex rates whose real parts say what happens."""
    size = len(v)
    v, total = v.copy(), np.zeros(size, dtype=complex)
    work, left = 0.0 + 0.0j, None  # of compression; what is left of restitution
    for _ in range(TURNS):
        ways, dv = _piece(G, v.real, friction, least)
        step, first = np.inf + 0j, -1
        for i in range(1, size):  # the slip, or an open contact, comes to its end
            if v[i].real * dv[i] < 0.0 and (-v[i] / dv[i]).real < step.real:
                step, first = -v[i] / dv[i], i
        if left is None:
            done = -v[0] / dv[0] if dv[0] > 0.0 else np.inf + 0j
        elif left.real <= 0.0:
            done = 0j
        else:
            square = v[0] ** 2 + 2.0 * dv[0] * left
            done = 2.0 * left / (v[0] + np.sqrt(square)) if square.real >= 0.0 else np.inf + 0j
        ended = done.real <= step.real
        step = done if ended else step
        if np.isinf(step.real):
            return None
        gained = v[0] * step + dv[0] * step**2 / 2.0
        v, total = v + dv * step, total + ways * step
        if first > 0 and not ended:
            v[first] = 0.0
        if left is None:
            work += gained
            if ended:
                v[0], left = 0.0, -(restitution**2) * work
        else:
            left = left - gained
            if ended:
                return total, v
    return None


def _piece(G: FloatArray, v: FloatArray, friction: float, least: Least) -> tuple[FloatArray, FloatArray]:
    """Impulses for a unit of the normal one, and the changes of the rates by them."""
    ways = np.zeros(len(v))
    ways[0] = 1.0
    some = [i for i in range(1, len(v)) if v[i] == 0.0]
    if v[1]:
        ways[1] = -friction * np.sign(v[1])
    if some:
        low = np.array([-friction if i == 1 else 0.0 for i in some])
        high = np.array([friction if i == 1 else np.inf for i in some])
        ways[some] = least(G[np.ix_(some, some)], (G @ ways)[some], low, high)
    dv = G @ ways
    terms = np.abs(G) @ np.abs(ways)
    return ways, np.where(np.abs(dv) <= 1e-13 * terms, 0.0, dv)
