"""The smoothed switch converges to the exact flow like eta^2 on transversal orbits; its grazing is that of g - eta.

Truth on one side: heyoka's discontinuous model; on the other: the smoothed model written a second time
(`smoothed_reference`). The fitted order of that second code alone is 2.000 on every orbit below.
"""

from __future__ import annotations

import heyoka_support as hs
import numpy as np
import pytest
import reference_values as known
import smoothed_reference

import nonsmooth as ns

pytestmark = pytest.mark.physics

SCALE = np.array([1e-3, 1e-2])
ETAS = (3e-5, 1e-5, 3e-6, 1e-6)
N_PERIODS = 4

ORBITS = {
    "figure 9": {"rho": 0.14, "g": 0.02, "omega": 4.8},
    "figure 10": {"rho": 0.16, "g": 0.0145, "omega": 5.2},
    "figure 11, period 1": {"rho": 0.45, "g": -0.0045, "omega": 3.69},
    "figure 11, period 2": {"rho": 0.39, "g": -0.0045, "omega": 3.69},
    "figure 13, period 1": {"rho": 0.33, "g": -0.0012, "omega": 11.15},
    "figure 13, period 2": {"rho": 0.33, "g": 0.0009, "omega": 11.15},
}


def smoothed_end(p: dict[str, float], eta: float, u: np.ndarray, rtol: float) -> np.ndarray:
    system = ns.models.discontinuous_support().with_parameters(p).smoothed(eta=eta)
    run = ns.simulate(system, periods=N_PERIODS, start={"x": u[0], "v": u[1]}, method="rkf45", rtol=rtol)
    assert int(run["status"]) == 0
    return run["u"].transpose("time", "state").values[-1, :2]


@pytest.mark.parametrize("name", ORBITS)
def test_order_two_in_eta_and_the_second_code_agrees(name: str) -> None:
    p = dict(known.TABLE_1, **ORBITS[name])
    u = hs.run(p, 400).states[-1]
    exact = hs.run(p, N_PERIODS, u)
    assert exact.n_contacts >= N_PERIODS
    assert min(abs(c.speed) for c in exact.crossings) > 1e-2  # transversal: no contact slower than 1e-2 m/s
    ends = [smoothed_end(p, eta, u, rtol=1e-11) for eta in ETAS]
    errors = [np.linalg.norm((end - exact.states[-1]) / SCALE) for end in ends]
    order = np.polyfit(np.log(ETAS), np.log(errors), 1)[0]
    paper = np.linalg.norm((smoothed_end(p, 1e-5, u, rtol=1e-6) - exact.states[-1]) / SCALE)
    print(
        f"\n{name}: order {order:.4f}; errors "
        + ", ".join(f"{e:.2e}" for e in errors)
        + f" (in 1 mm, 1 cm/s) at eta {ETAS}; the paper's setting (eta 1e-5, rtol 1e-6): {paper:.2e}"
    )
    assert abs(order - 2) <= 0.1
    reference, _ = smoothed_reference.march(p, 1e-5, u, N_PERIODS)
    assert np.max(np.abs(ends[1] - reference) / SCALE) < 1e-7  # the smoothing itself makes 1e-5 to 1e-4 here


def test_bands_are_crossed_in_the_same_order_as_in_the_second_code() -> None:
    """Regions and times of every border crossing, through a maximum inside the band (S_a to S_b at v = 0) too."""
    eta = 1e-5
    for p in (
        dict(known.TABLE_1, rho=0.29, g=-0.0045, omega=3.69),
        dict(known.TABLE_1, rho=0.14, g=known.amplitude(dict(known.TABLE_1, rho=0.14, omega=5.3)) - 3e-6, omega=5.3),
    ):
        _, crossings = (
            smoothed_reference.march(p, eta, (0.0, 0.0), 3)
            if p["g"] < 0
            else smoothed_reference.march(p, eta, known.steady_state(p), 3)
        )
        start = (0.0, 0.0) if p["g"] < 0 else known.steady_state(p)
        system = ns.models.discontinuous_support().with_parameters(p).smoothed(eta=eta)
        run = ns.simulate(system, periods=3, start={"x": start[0], "v": start[1]}, method="rkf45", rtol=1e-12)
        times = run["crossing_time"].values
        assert len(times) == len(crossings)
        assert np.max(np.abs(times - [t for t, _, _ in crossings])) < 1e-9


@pytest.mark.parametrize("eta", [1e-5, 1e-6])
@pytest.mark.parametrize("method", ["rkf45", "taylor"])
def test_smoothed_grazing_is_that_of_a_gap_reduced_by_eta(eta: float, method: str) -> None:
    """Just above the closed-form grazing frequency of g - eta the band is not entered, just below it is.

    Found by bisection on the smoothed model alone, from the steady motion without contact, to 1e-9 rad/s.
    """
    rho, g = 0.14, 0.02
    expected = known.grazing_frequencies(rho, g - eta)[1]
    model = ns.models.discontinuous_support()

    def enters(omega: float) -> bool:
        p = dict(known.TABLE_1, rho=rho, g=g, omega=omega)
        x, v = known.steady_state(p)
        system = model.with_parameters(p).smoothed(eta=eta)
        run = ns.simulate(system, periods=1, start={"x": x, "v": v}, method=method, rtol=1e-12)
        return run["crossing_time"].size > 0

    low, high = expected - 1e-3, expected + 1e-3
    assert enters(low)
    assert not enters(high)
    while high - low > 1e-9:
        middle = (low + high) / 2
        low, high = (middle, high) if enters(middle) else (low, middle)
    found = (low + high) / 2
    unsmoothed = known.grazing_frequencies(rho, g)[1]
    print(
        f"\n{method}, eta {eta:g}: grazes at {found:.9f}, closed form of g - eta {expected:.9f}, of g {unsmoothed:.9f}"
    )
    assert found == pytest.approx(expected, abs=1e-8)
