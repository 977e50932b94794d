"""Amplitudes over frequency: the linear oscillator's closed form, Parseval's identity, lines at subharmonics."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

SUPPORT = ns.models.discontinuous_support()


def test_a_motion_without_contact_has_one_line_of_the_linear_amplitude() -> None:
    free = SUPPORT.with_parameters(g=1.0)
    found = ns.amplitude_spectrum(free, transient=200)
    p = free.values
    known = p["rho"] / p["m"] / np.hypot(2 * p["k"] / p["m"] - p["omega"] ** 2, p["c"] * p["omega"] / p["m"])
    one = found.amplitude.sel(state="x").values
    at = int(np.flatnonzero(found.order.values == 1.0)[0])
    assert one[at] == pytest.approx(known, rel=1e-10)
    assert found.amplitude.sel(state="v").values[at] == pytest.approx(p["omega"] * known, rel=1e-10)
    assert np.delete(one, at).max() < 1e-11 * known
    assert float(found.frequency[at]) == pytest.approx(p["omega"] / (2 * np.pi), rel=1e-15)


def test_a_motion_of_period_4_has_lines_at_quarters_and_its_power_is_that_of_its_lines() -> None:
    system = SUPPORT.with_parameters(rho=0.26)
    found = ns.amplitude_spectrum(system)
    assert int(found.period_number) == 4
    np.testing.assert_allclose(found.order.values[:9], np.arange(9) / 4, rtol=1e-14)
    assert (found.amplitude.sel(state="x").values[1:5] > 1e-4).all()
    period = 2 * np.pi / system.values["omega"]
    times = 500 * period + 4 * period * np.arange(8000) / 8000
    run = ns.simulate(system, duration=4 * period, transient=500 * period, samples=times)
    values = run.u.values[np.searchsorted(run.time.values, times)]
    for k, state in enumerate(("x", "v")):  # the mean of the square, by the lines and by the rule of trapezia
        lines = found.amplitude.sel(state=state).values
        power = lines[0] ** 2 + 0.5 * (lines[1:-1] ** 2).sum() + lines[-1] ** 2
        assert power == pytest.approx((values[:, k] ** 2).mean(), rel=1e-5)


def test_a_cycle_without_forcing_is_counted_by_its_returns() -> None:
    belt, section, start = ns.models.stick_slip_belt(), ns.Poincare("relative"), [0.1, 0.0]
    found = ns.amplitude_spectrum(belt, start=start, section=section, transient=100)
    times = ns.poincare(belt, start=start, section=section, transient=100, n=2).time.values
    assert int(found.period_number) == 1
    assert float(found.base_frequency) == pytest.approx(1 / (times[1] - times[0]), rel=1e-9)
    even = np.linspace(times[0], times[1], 20001)  # the first Fourier coefficient by the rule of trapezia
    run = ns.simulate(belt, start=start, duration=times[1] - times[0], transient=times[0], samples=even)
    x = run.u.values[np.searchsorted(run.time.values, even).clip(0, run.sizes["time"] - 1), 0]
    first = 2 * abs(np.mean((x * np.exp(-2j * np.pi * np.arange(20001) / 20000))[:-1]))
    assert found.amplitude.sel(state="x").values[1] == pytest.approx(first, rel=1e-6)


def test_the_logistic_map_of_period_2_has_its_mean_and_one_line_at_one_half() -> None:
    r = 3.2
    logistic = ns.Map(states=["x"], parameters={"r": r}, branches=[ns.Branch(lambda u, p: (p.r * u.x * (1 - u.x),))])
    found = ns.amplitude_spectrum(logistic, start={"x": 0.3})
    lines = found.amplitude.sel(state="x").values
    assert (float(found.frequency[-1]), int(found.period_number)) == (0.5, 2)
    assert lines[0] == pytest.approx((r + 1) / (2 * r), rel=1e-12)
    assert lines[-1] == pytest.approx(np.sqrt((r - 3) * (r + 1)) / (2 * r), rel=1e-12)
    assert lines[1:-1].max() < 1e-12


def test_a_motion_that_settles_slowly_is_waited_for_and_what_does_not_close_is_said() -> None:
    slow = SUPPORT.with_parameters(rho=0.43)  # 80 periods leave 1e-3 of the distance to its orbit
    settled = ns.amplitude_spectrum(slow, transient=4000).amplitude.sel(state="x")
    waited = ns.amplitude_spectrum(slow, transient=80).amplitude.sel(state="x")
    assert abs(waited - settled).max() < 1e-7 * settled.max()
    with pytest.warns(UserWarning, match="does not close"):
        ns.amplitude_spectrum(slow, transient=20)


def test_chaos_has_no_sharp_lines() -> None:
    chaos = SUPPORT.with_parameters(rho=0.33, g=0.0018, omega=11.15)
    found = ns.amplitude_spectrum(chaos)
    assert int(found.period_number) == 0
    assert found.sizes["frequency"] == 256 * 512 // 2 + 1


def test_arguments_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match="one start"):
        ns.amplitude_spectrum(SUPPORT, start=[[0.0, 0.0], [0.1, 0.0]])
    with pytest.raises(ValueError, match="samples = 2"):
        ns.amplitude_spectrum(SUPPORT, samples=2)
    with pytest.raises(ValueError, match="no forcing period"):
        ns.amplitude_spectrum(ns.models.relay_feedback())


def test_a_system_without_parameters() -> None:
    """x'' + 0.2 x' + x = cos 2t: one line, of 1 / |1 - 4 + 0.4 i| at the frequency 1 / pi."""
    system = ns.System(
        states=["x", "v"], parameters={}, modes={"all": lambda t, u, p: (u.v, np.cos(2 * t) - 0.2 * u.v - u.x)}
    )
    found = ns.amplitude_spectrum(system)
    lines = found["amplitude"].sel(state="x").values
    assert int(found["period_number"]) == 1 and found["frequency"].values[1] == pytest.approx(1 / np.pi)
    assert lines[1] == pytest.approx(1 / abs(-3 + 0.4j), rel=1e-12) and np.delete(lines, 1).max() < 1e-12
