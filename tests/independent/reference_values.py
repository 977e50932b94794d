"""Numbers found once by codes that share nothing with `nonsmooth`; each says where it comes from.

[exact] closed form; [heyoka] shooting on heyoka 7.13 at tolerance 1e-14 with central differences (recomputed by
`heyoka_shooting`, see `test_heyoka_references.py`); two step sizes of the differences agreed to the printed digits.
"""

from __future__ import annotations

import numpy as np

TABLE_1 = {"m": 0.838, "k": 8.47, "k_s": 1210.0, "c": 0.87, "c_s": 0.60}

# [heyoka] Fig. 11 (omega 3.69, g -0.0045), rho falling: where the period-n orbit doubles, {n: rho}.
# The paper prints 0.406, 0.28 and 0.26 for the first three: 1.1 %, 3.7 % and 6.1 % above its own model.
FLIPS_FIGURE_11 = {1: 0.401469575, 2: 0.270021822, 4: 0.245022499, 8: 0.240449854}

# [heyoka] Folds in omega of the period-1 orbit in contact. "upper": where the orbit that grazes at the upper
# grazing frequency ends, and the amplitude jumps when omega falls; "small": the small jump of Fig. 10;
# "rising": where the orbit with contact ends, and the amplitude jumps when omega rises.
FOLDS = {
    "figure 9 upper": 5.159840174520,
    "figure 9 rising": 5.810368928517,  # the paper prints 5.88
    "figure 10 upper": 5.656816116465,
    "figure 10 small": 2.711711692945,
    "figure 10 rising": 6.531200022649,
}

# [heyoka] Flips of the period-1 orbit just beyond its grazing (omega).
FLIPS_NEAR_GRAZING = {"figure 9 lower": 3.56788983154, "figure 17": 9.7862456388}

# [computed: test problem E] Relief valve at q = 8: the cycle that does not reach the seat.
VALVE_CYCLE = {"minimum": 0.668282564, "maximum": 6.009885866, "period": 2.392389442}
VALVE_HOPF = 8.4911176352  # [exact] Routh-Hurwitz


def grazing_frequencies(rho: float, g: float, table: dict[str, float] = TABLE_1) -> list[float]:
    """[exact] Frequencies at which the motion without contact just reaches the gap, rising order (rad/s).

    g = rho / sqrt((2k - m omega^2)^2 + (c omega)^2), a quadratic in omega^2.
    """
    m, k, c = table["m"], table["k"], table["c"]
    squares = np.roots([m * m, c * c - 4 * k * m, 4 * k * k - (rho / g) ** 2])
    return sorted(float(np.sqrt(s.real)) for s in squares if abs(s.imag) < 1e-12 and s.real > 0)


def steady_state(p: dict[str, float]) -> np.ndarray:
    """[exact] Section point at phase 0 of the steady motion without contact, (x, v)."""
    response = p["rho"] / (2 * p["k"] - p["m"] * p["omega"] ** 2 + 1j * p["c"] * p["omega"])
    return np.array([response.real, (1j * p["omega"] * response).real])


def amplitude(p: dict[str, float]) -> float:
    """[exact] Amplitude of the steady motion without contact."""
    return float(p["rho"] / np.hypot(2 * p["k"] - p["m"] * p["omega"] ** 2, p["c"] * p["omega"]))
