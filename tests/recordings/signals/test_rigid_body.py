"""A cube that falls, spins and bounces on a corner, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nonsmooth.recordings.signals.restitution import flights, restitution
from nonsmooth.recordings.signals.rigid_body import _Flight, corner_heights, corner_restitution, cube

G, E, RATE = 187.0, 0.3, 148.0
G_SI = 9.81


def tossed(seed: int, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Centre, quaternions (w first) of a cube with one impact at its lowest corner, frictionless, restitution E."""
    rng = np.random.default_rng(seed)
    corners = cube()
    at_impact = Rotation.random(random_state=seed)
    arms = at_impact.apply(corners)
    k = int(np.argmin(arms[:, 2]))
    spin, v = 4 * rng.standard_normal(3), -18 + rng.standard_normal()
    n = np.array([0, 0, 1.0])
    arm = arms[k]
    before = v + np.cross(spin, arm)[2]
    # Impulse J n at the arm: mass 1, moment of inertia 2/3 of a cube of half-width 1.
    inertia = 2.0 / 3.0
    J = -(1 + E) * before / (1 + np.cross(np.cross(arm, n), arm)[2] / inertia)
    v_after, spin_after = v + J, spin + np.cross(arm, n) * J / inertia
    when = (12 + rng.random()) / RATE
    t = np.arange(26) / RATE
    s = t - when
    centre = np.where(s < 0, v, v_after) * s - G / 2 * s**2 - arm[2]
    turns = [Rotation.from_rotvec((spin if u < 0 else spin_after) * u) * at_impact for u in s]
    q = np.roll([r.as_quat() for r in turns], 1, axis=1)
    place = np.column_stack([3 * t, -2 * t, centre + noise * rng.standard_normal(len(t))])
    return t, place, q, when, before


def test_the_corner_and_its_restitution() -> None:
    used = 0
    for seed in range(12):
        t, place, q, when, before = tossed(seed, 0.0)
        free = flights(t, place[:, 2])
        if free.sizes["flight"] != 2:
            continue
        assert float(free.acceleration) == pytest.approx(-G, rel=1e-6)
        found = corner_restitution(t, place, q, cube(), free)
        assert found.sizes["impact"] == 1
        used += 1
        one = found.isel(impact=0)
        assert float(one.impact_time) == pytest.approx(when, abs=2e-4)
        assert float(one.v_before) == pytest.approx(before, abs=0.1)
        assert float(one.restitution) == pytest.approx(E, abs=5e-3)
        assert abs(float(one.height)) < 0.02
    assert used >= 8


def test_errors_cover_noise() -> None:
    z = []
    for seed in range(30):
        t, place, q, _, _ = tossed(seed % 10, 0.0)
        rng = np.random.default_rng(100 + seed)
        place[:, 2] += 5e-4 * rng.standard_normal(len(t))
        free = flights(t, place[:, 2])
        if free.sizes["flight"] != 2:
            continue
        found = corner_restitution(t, place, q, cube(), free)
        for one in (found.isel(impact=k) for k in range(found.sizes["impact"])):
            z.append((float(one.restitution) - E) / np.hypot(one.restitution_error, one.half_sample / 7))
    assert len(z) > 20 and np.sqrt(np.mean(np.square(z))) < 2


def test_a_ball_needs_its_height_only() -> None:
    t = np.arange(170) / RATE  # the bounces end at 1.43 s
    times, speeds = [0.0], [40.0]
    while times[-1] < t[-1]:
        times.append(times[-1] + 2 * speeds[-1] / G)
        speeds.append(0.7 * speeds[-1])
    k = np.searchsorted(times, t, side="right") - 1
    s, u = t - np.array(times)[k], np.array(speeds)[k]
    z = u * s - G / 2 * s**2
    found = restitution(t, z, flights(t, z))
    assert found.sizes["impact"] >= 3
    np.testing.assert_allclose(found.restitution, 0.7, atol=1e-6)
    np.testing.assert_allclose(found.impact_time, times[1 : 1 + found.sizes["impact"]], atol=1e-7)


def test_every_number_of_a_bounce() -> None:
    """Speeds of 40, 28, 19.6, ... at the ground, each impact between two samples."""
    t = np.arange(160) / RATE
    speeds = 40.0 * 0.7 ** np.arange(9)
    times = np.concatenate([[0.0], np.cumsum(2 * speeds / G)])
    k = np.searchsorted(times, t, side="right") - 1
    s = t - times[k]
    z = speeds[k] * s - G / 2 * s**2
    free = flights(t, z)
    found = restitution(t, z, free)
    n = found.sizes["impact"]
    assert n >= 3 and found.flight.values.tolist() == list(range(n))
    between = free["first"].values[1 : n + 1] - free["last"].values[:n]  # samples
    np.testing.assert_allclose(found.duration, between / RATE, rtol=1e-9)
    np.testing.assert_allclose(found.impact_height, 0.0, atol=1e-6)
    np.testing.assert_allclose(found.v_before, -speeds[:n], rtol=1e-6)
    np.testing.assert_allclose(found.v_after, speeds[1 : n + 1], rtol=1e-6)
    assert (found.restitution_error < 1e-6).all() and float(found.attrs["noise"]) < 1e-9
    t, place, q, *_ = tossed(0, 0.0)
    free = flights(t, place[:, 2])
    one = corner_restitution(t, place, q, cube(), free).isel(impact=0)
    between = int(free["first"][1]) - int(free["last"][0])
    assert float(one.duration) == pytest.approx(between / RATE) and int(one.flight) == 0


def test_errors_of_a_balls_restitution_are_as_stated() -> None:
    z, z_speed, z_fall, rng = [], [], [], np.random.default_rng(0)
    for _ in range(120):
        v, e, g = rng.uniform(2.5, 3.5), rng.uniform(0.4, 0.9), 9.81
        when = 0.2 + rng.uniform(0, 0.01)
        t = np.arange(45) / 100
        s = t - when
        z0 = np.where(s < 0, -v * s, e * v * s) - g / 2 * s**2 + rng.normal(0, 3e-5, len(t))
        free = flights(t, z0)
        if free.sizes["flight"] != 2:
            continue
        z_fall.append((float(free.acceleration) + g) / float(free.acceleration_error))
        one = restitution(t, z0, free).isel(impact=0)
        z.append((float(one.restitution) - e) / float(one.restitution_error))
        # before and after are those at the instant of the impact, which is a sample long
        z_speed.append((float(one.v_after) - e * v) / float(one.v_after_error))
    assert len(z) > 80
    for values in (z, z_speed, z_fall):
        assert 0.7 < np.sqrt(np.mean(np.square(values))) < 1.4


def test_doors() -> None:
    t, place, q, _, _ = tossed(1, 0.0)
    with pytest.raises(ValueError, match="no interval of at least 4 samples falls freely"):
        flights(t, np.ones(len(t)))
    with pytest.raises(ValueError, match="unit quaternions"):
        corner_heights(place, 2 * q, cube())
    free = flights(t, place[:, 2])
    with pytest.raises(ValueError, match="needs time"):
        corner_restitution(t, place[:, :2], q, cube(), free)
    place[3, 0] = np.nan
    with pytest.raises(ValueError, match="values are missing"):
        corner_restitution(t, place, q, cube(), free)


def test_the_error_of_a_spin_is_as_stated() -> None:
    """Orientations of a body that turns at 5 rad/s, each off by turns of 1e-3 rad about the room's axes."""
    rng, t, spin = np.random.default_rng(3), np.arange(60) / 148.0, np.array([5.0, 0.0, 0.0])
    z = []
    for _ in range(200):
        off = Rotation.from_rotvec(1e-3 * rng.standard_normal((60, 3)))
        flight = _Flight(t, np.zeros((60, 3)), off * Rotation.from_rotvec(np.outer(t, spin)), slice(None), -9.81)
        z.append((flight.spin - spin) / flight.spin_error)
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.1)


def test_a_flight_that_noise_has_parted_has_no_restitution() -> None:
    """A body in free fall all the time: its velocity does not jump, wherever the record seems to leave the fall."""
    t = np.arange(0, 0.6, 1 / 240)
    rng = np.random.default_rng(0)
    for cut in (40, 60, 80, 100):
        z = 2.0 - 4.905 * t**2 + 3e-5 * rng.standard_normal(t.size)
        whole = flights(t, z)
        assert whole.sizes["flight"] == 1
        parted = whole.isel(flight=[0, 0]).assign(first=("flight", [0, cut + 2]), last=("flight", [cut, len(t) - 1]))
        found = restitution(t, z, parted)
        assert found.sizes["impact"] == 1 and np.isnan(found["restitution"]).all()


@pytest.mark.parametrize(("rate", "noise"), [(200, 1e-4), (200, 5e-4), (1000, 2e-4), (60, 1e-3)])
def test_noise_above_the_fall_of_a_sample_hides_no_flight(rate: float, noise: float) -> None:
    """A ball from half a metre, by a camera: it falls 0.05 to 3 mm from sample to sample, its second differences are
    noise. Of nine bounces those longer than a few samples are seen, with errors as stated."""
    t, far, seen = np.arange(0, 2.2, 1 / rate), [], []
    for seed in range(5):
        z, when, v = np.where(t < np.sqrt(1 / G_SI), 0.5 - G_SI * t**2 / 2, 0.0), np.sqrt(1 / G_SI), np.sqrt(G_SI)
        for _ in range(12):
            v *= 0.75
            s = t - when
            z = np.where((s >= 0) & (s < 2 * v / G_SI), v * s - G_SI / 2 * s**2, z)
            when += 2 * v / G_SI
        y = z + noise * np.random.default_rng(seed).standard_normal(len(t))
        found = flights(t, y)
        assert float(found.noise) == pytest.approx(noise, rel=0.2)
        assert abs(float(found.acceleration) + G_SI) < 4 * float(found.acceleration_error)
        one = restitution(t, y, found)
        seen.append(int(np.isfinite(one.restitution).sum()))
        far += ((one.restitution - 0.75) / one.restitution_error).values[np.isfinite(one.restitution)].tolist()
    assert min(seen) >= 4 and 0.6 < np.sqrt(np.mean(np.square(far))) < 1.5


def test_heights_of_corners_of_a_turned_body() -> None:
    """A cube of half-width 1 about (5, -7, 3), and turned by 45 degrees about x: then edges lie sqrt(2) up and down."""
    eighth = np.pi / 8
    place = np.tile([5.0, -7.0, 3.0], (2, 1))
    found = corner_heights(place, [[1, 0, 0, 0], [np.cos(eighth), np.sin(eighth), 0, 0]], cube())
    assert np.sort(found[0]) == pytest.approx([2.0] * 4 + [4.0] * 4)
    assert np.sort(found[1]) == pytest.approx([3 - np.sqrt(2)] * 2 + [3.0] * 4 + [3 + np.sqrt(2)] * 2)
    # about x by a quarter turn what was along y stands along z, not what was along x
    (quarter,) = corner_heights(place[:1], [[np.cos(2 * eighth), np.sin(2 * eighth), 0, 0]], [[1, 0, 0], [0, 1, 0]])
    assert quarter == pytest.approx([3.0, 4.0])
