"""Contacts and impacts against motions whose contacts are known in closed form or from the exact flow."""

from __future__ import annotations

import numpy as np
import pytest
from motions import COUNT, Floats, bounces, decay, rms, sine

import nonsmooth as ns
from nonsmooth.recordings.signals.contacts import contacts, impacts

TABLE_1 = {"k": 8.47, "k_s": 1210.0, "c": 0.87, "c_s": 0.60, "m": 0.838}


def driven(g: float, rho: float, omega: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Times and positions at 100 Hz, begins and ends of contact, of the exact model."""
    system = ns.models.discontinuous_support().with_parameters(**TABLE_1, g=g, rho=rho, omega=omega)
    duration = 40.0
    run = ns.simulate(system, duration=duration, transient=50, samples=int(duration * 100) + 1)
    crossing = run.crossing_time.values
    t = np.linspace(run.time.values[0], run.time.values[0] + duration, int(duration * 100) + 1)
    once = np.concatenate([[True], np.diff(run.time.values) > 0])
    x = np.interp(t, run.time.values[once], run.u.sel(state="x").values[once])
    entries = [k.startswith("free") for k in run.crossing_transition.attrs["flag_meanings"].split()]
    enters = np.array(entries)[run.crossing_transition.values]
    begin, end = crossing[enters], crossing[~enters]
    return t, x, begin, end


@pytest.mark.parametrize(("g", "rho", "omega"), [(-0.0045, 0.45, 3.69), (0.0018, 0.33, 11.15), (0.02, 0.14, 5.0)])
@pytest.mark.parametrize("told", [True, False])
def test_soft_contacts_of_the_exact_model(g: float, rho: float, omega: float, told: bool) -> None:
    t, x, begin, end = driven(g, rho, omega)
    found = contacts(t, np.round(x / COUNT) * COUNT, resolution=COUNT, omega=omega if told else None)
    whole = found.isel(contact=~found.uncertain.values)
    # Every certain contact is one of the model's, within a tenth of a sample; none of a sample or more is missed.
    for at, true in ((whole.begin.values, begin), (whole.end.values, end)):
        assert np.max(np.min(np.abs(at[:, None] - true), axis=1)) < 2e-3
    length = end[: len(begin)] - begin[: len(end)] if begin[0] < end[0] else end[1:] - begin[: len(end) - 1]
    assert abs(len(found.begin) - np.count_nonzero(length > 0.01)) <= 1
    # Told the drive, the gap is found within a count; without, within two.
    assert abs(float(found.gap) - g) < (COUNT if told else 2 * COUNT)
    assert abs(float(found.gap) - g) < 3 * float(found.gap_error)
    assert float(found.stiffness) == pytest.approx(TABLE_1["k_s"] / TABLE_1["m"], rel=0.02)


def test_the_gaps_error_is_neither_too_small_nor_too_large() -> None:
    t, x, _, _ = driven(0.0018, 0.33, 11.15)
    rng, z = np.random.default_rng(0), []
    for _ in range(5):  # where the encoder's counts lie, and where the record begins
        shift, begin = rng.uniform(0, COUNT), int(rng.integers(0, 800))
        counts = np.round((x[begin:] + shift) / COUNT) * COUNT
        found = contacts(t[begin:], counts, resolution=COUNT, omega=11.15)
        z.append((float(found.gap) - shift - 0.0018) / float(found.gap_error))
    assert 0.4 < rms(np.array(z)) < 1.7


def test_a_given_gap_is_taken() -> None:
    t, x, begin, _ = driven(-0.0045, 0.45, 3.69)
    found = contacts(t, np.round(x / COUNT) * COUNT, resolution=COUNT, gap=-0.0045)
    at = found.begin.values[1:]
    nearest = begin[np.argmin(np.abs(at[:, None] - begin), axis=1)]
    assert rms((at - nearest) / found.begin_error.values[1:]) < 1.5
    assert float(found.gap) == -0.0045


@pytest.mark.parametrize("motion", [sine(0.02, 3.0), sine(0.02, 11.0, 0.3), decay(0.02, 4.46, 0.52, 15.0)])
def test_no_contact_is_found_where_there_is_none(motion: object) -> None:
    found = contacts(motion.t, motion.counted, resolution=COUNT)
    assert found.sizes["contact"] == 0 and np.isnan(found.gap)


def test_bounces_of_a_ball() -> None:
    motion, times, speeds = bounces(0.8, 3.0, 7)
    step = 1e-3
    found = impacts(motion.t, np.round(motion.x / step) * step, resolution=step)
    at = found.impact_time.values
    assert len(at) >= 6
    np.testing.assert_allclose(at[:6], times[:6], rtol=0, atol=5e-4)
    assert rms((at[:6] - times[:6]) / found.impact_time_error.values[:6]) < 2.0
    ratio = -found.v_after.values[:6] / found.v_before.values[:6]
    np.testing.assert_allclose(ratio, 0.8, atol=0.01)
    np.testing.assert_allclose(found.v_before[:6], -speeds[:6], atol=0.02)


def test_bounces_in_noise_of_unknown_size() -> None:
    rng = np.random.default_rng(4)
    motion, times, _ = bounces(0.8, 3.0, 7)
    found = impacts(motion.t, motion.x + rng.normal(0, 1e-3, len(motion.t)))
    at = found.impact_time.values
    # The first six are found; whatever else is found lies among the small bounces at the end.
    for true in times[:6]:
        assert np.min(np.abs(at - true)) < 2e-3
    assert all(np.min(np.abs(times - t)) < 5e-3 or t > times[5] for t in at)


SLOW = pytest.param(sine(0.003, 30.0, 0.3, 20.0), marks=pytest.mark.slow)


@pytest.mark.parametrize("motion", [sine(0.02, 3.0), sine(0.003, 30.0, 0.3, 5.0), SLOW, decay(0.02, 4.46, 0.52, 15.0)])
def test_no_impact_is_found_where_there_is_none(motion: object) -> None:
    found = impacts(motion.t, motion.counted, resolution=COUNT)
    assert found.sizes["impact"] == 0


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match="window = .*at least 4"):
        impacts(np.arange(40.0), np.arange(40.0), window=2)
    with pytest.raises(ValueError, match="too short: 20 usable samples, and finding contacts needs 32"):
        contacts(np.arange(20.0), np.arange(20.0), resolution=1.0)
