"""The drive's phase and section points: on motions in closed form, with orders of interpolation and stated errors."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from motions import COUNT, Floats, bounces, rms, sine

from nonsmooth.recordings import RecordingWarning
from nonsmooth.recordings.signals.phase import DrivePhase, drive_phase
from nonsmooth.recordings.signals.sections import poincare, stroboscopic
from nonsmooth.recordings.signals.smoothing import smooth

TURN = 2 * np.pi


def gate(omega: float, n: int, seed: int, scatter: float = 0.0) -> Floats:
    rng = np.random.default_rng(seed)
    times = 0.31 + rng.uniform(0, 1) + TURN / omega * np.arange(n) + rng.normal(0, scatter, n)
    return np.round(times / 1e-4) * 1e-4


def test_frequency_by_photogate_with_its_error() -> None:
    for scatter in (0.0, 2e-3):
        found = [drive_phase(gate(3.69, 25, seed, scatter)) for seed in range(200)]
        z = rms(np.array([(f.omega - 3.69) / f.omega_error for f in found]))
        # Without scatter the gate's resolution is a floor: rounding of an even sequence averages out better than that.
        assert (0.85 if scatter else 0.4) < z < 1.15
        assert all(f.method == "photogate" and f.period == pytest.approx(TURN / f.omega) for f in found)
        if scatter:
            assert np.mean([f.scatter for f in found]) == pytest.approx(scatter, rel=0.1)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_an_instant_is_known_as_one_turn_is(noise: float) -> None:
    """Of 401 turns rounded to 0.1 ms the line's intercept is known ten times better than any of them."""
    rng, stated, off = np.random.default_rng(3), [], []
    for start in rng.uniform(0.0, 1.0, 100):
        read = start + TURN / 3.69 * np.arange(401) + noise * rng.normal(size=401)
        found = drive_phase(np.round(read / 1e-4) * 1e-4)
        at = found.times(0.0)
        stated.append(found.t_0_error)
        off.append(rms(at - (start + TURN / 3.69 * np.arange(len(at)))))
    assert rms(np.array(off)) == pytest.approx(rms(np.array(stated)), rel=0.05 if noise else 0.3)


def test_an_uneven_motor_makes_instants_between_turns_uncertain() -> None:
    """A speed that is white noise, so that turns' lengths vary by s: half a turn on, the straight line is s / 2 off."""
    rng, s, fine = np.random.default_rng(4), 5e-3, 64
    steps = 1.7 / fine + s / np.sqrt(fine) * rng.normal(size=300 * fine)
    times = np.cumsum(steps)
    found = drive_phase(times[::fine])
    middle = found.times(0.5) - times[fine // 2 :: fine][: len(found.times(0.5))]
    assert rms(middle) == pytest.approx(s / 2, rel=0.1)
    assert 1.0 < found.t_0_error / rms(middle) < 1.3


def test_phase_runs_from_turn_to_turn() -> None:
    # A motor that slows down: phase = 5 t - 0.02 t^2.
    n = np.arange(30)
    times = (5 - np.sqrt(25 - 0.08 * TURN * n)) / 0.04
    found = drive_phase(times)
    t = np.linspace(times[0], times[-1], 500)
    assert np.max(np.abs(found.phase(t) - (5 * t - 0.02 * t**2))) < 1.01 * 0.04 * np.diff(times).max() ** 2 / 8
    np.testing.assert_allclose(found.phase(times), TURN * n, atol=1e-9)
    assert found.phase(times[0] - found.period) == pytest.approx(-TURN)
    at = found.times(0.25)
    np.testing.assert_allclose(np.mod(found.phase(at) / TURN, 1.0), 0.25, atol=1e-9)
    assert len(at) == 29


@pytest.mark.parametrize(("size", "seen"), [(0.0, False), (1e-3, True)])
def test_a_motor_that_wanders_is_seen_in_the_gate(size: float, seen: bool) -> None:
    omega, rate = 9.0, 0.7
    fine = np.linspace(0, 40, 400_001)
    turns = np.interp(2 * np.pi * np.arange(1, 57), omega * fine + omega * size / rate * np.sin(rate * fine), fine)
    drive = drive_phase(np.round(turns, 4))
    found, steady = drive.wander()
    assert steady is not seen
    # omega (1 + size cos): its standard deviation is size / sqrt 2
    assert found == pytest.approx(size / np.sqrt(2), rel=0.1, abs=5e-5)
    # every other turn says where the crank is to the second difference of its times
    between = 2 * np.pi * drive.turns[1:-1:2]
    off = drive.coarser.phase(drive.turn_times[1:-1:2]) - between
    expected = omega * (drive.turn_times[1:-1:2] - 0.5 * (drive.turn_times[:-2:2] + drive.turn_times[2::2]))
    np.testing.assert_allclose(off, expected, atol=0.02 * np.max(np.abs(expected)) + 1e-9)


def test_a_turn_that_the_gate_missed_is_counted_and_said() -> None:
    times = np.delete(gate(5.0, 20, 1), [7, 8])
    given = xr.DataArray(np.ones(18), {"time": times}, ("time",), name="Turn", attrs={"run": "Run #4"})
    with pytest.warns(RecordingWarning, match=r"run 'Run #4', channel 'Turn': the gate missed 2 turns"):
        found = drive_phase(given)
    assert found.omega == pytest.approx(5.0, abs=1e-3) and found.turns[-1] == 19
    with pytest.raises(ValueError, match="two turns only 0.4 s apart"):
        drive_phase(np.append(times, times[-1] + 0.4))
    with pytest.raises(ValueError, match="2 turns are too few"):
        drive_phase(times[:2])


def test_phase_by_fit() -> None:
    z = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        omega, lag = rng.uniform(3, 6), rng.uniform(0, TURN)
        motion = sine(0.02, omega, lag, 30.0)
        found = drive_phase(motion.t, motion.x + rng.normal(0, 1e-4, len(motion.t)))
        z.append([(found.omega - omega) / found.omega_error])
        away = found.phase(motion.t) - (omega * motion.t - lag)
        assert np.max(np.abs(away - np.round(away.mean() / TURN) * TURN)) < 0.005
    assert 0.7 < rms(np.array(z)) < 1.3
    # A motion of twice the drive's period: its largest line is not the drive's, unless that is said.
    t = np.arange(6000) / 100
    x = 0.02 * np.cos(2.0 * t) + 0.005 * np.cos(4.0 * t - 1)
    assert drive_phase(t, x).omega == pytest.approx(2.0, abs=1e-4)
    with pytest.raises(ValueError, match="hold fewer than three turns"):
        drive_phase(t[:400], x[:400], omega=2.0)


def exact_phase(omega: float, lag: float, duration: float) -> DrivePhase:
    n = np.arange(int((omega * duration - lag) / TURN) + 1)
    return DrivePhase(omega, 0.0, lag / omega, 0.0, 0.0, "fit", (lag + TURN * n) / omega, n, (0.0, duration))


@pytest.mark.parametrize(("with_a", "order_x", "order_v"), [(False, 4, 3), (True, 6, 5)])
def test_order_of_interpolation(with_a: bool, order_x: int, order_v: int) -> None:
    errors = []
    for rate in (12.5, 25.0, 50.0):
        motion = sine(1.0, 5.0, 1.0, 40.0, rate)
        a = motion.a if with_a else None
        points = stroboscopic(motion.t, motion.x, motion.v, exact_phase(5.0, 0.3, 39.0), 0.37, a=a)
        t = points.time.values
        x, v = points.section.values.T
        passing = poincare(motion.t, motion.x, motion.v, level=0.3, a=a).time.values
        k = np.round((5 * passing - 1 + np.arccos(0.3)) / TURN)
        true = (1 - np.arccos(0.3) + TURN * k) / 5
        errors.append(
            [
                np.abs(x - np.cos(5 * t - 1)).max(),
                np.abs(v + 5 * np.sin(5 * t - 1)).max(),
                np.abs(passing - true).max(),
            ]
        )
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert (orders[:, 0] > order_x - 0.6).all() and (orders[:, 1] > order_v - 0.6).all()
    assert (orders[:, 2] > order_x - 0.6).all()


@pytest.mark.parametrize("with_a", [False, True])
def test_between_two_samples_stands_the_polynomial_of_scipy(with_a: bool) -> None:
    """On an uneven clock."""
    from scipy.interpolate import BPoly

    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.01, 0.03, 300))
    x, v, a = rng.standard_normal((3, 300))
    polynomial = BPoly.from_derivatives(t, np.column_stack([x, v, a] if with_a else [x, v]))
    points = stroboscopic(t, x, v, exact_phase(40.0, 0.1, t[-1] - 0.1), 0.37, a=a if with_a else None)
    at = points["time"].values
    assert len(at) > 20
    np.testing.assert_allclose(points["section"].sel(state="x"), polynomial(at), atol=1e-12)
    np.testing.assert_allclose(points["section"].sel(state="v"), polynomial(at, 1), atol=1e-9)


def test_errors_of_section_points_of_a_smoothed_record() -> None:
    z_x, z_v, z_t = [], [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        omega, lag = rng.uniform(3, 6), rng.uniform(0, TURN)
        motion = sine(0.01, omega, lag)
        s = smooth(motion.t, motion.counted, resolution=COUNT, contacts=((), ()))
        keys = {"a": s.a, "x_error": s.x_error, "v_error": s.v_error}
        points = stroboscopic(s.time, s.x, s.v, exact_phase(omega, 0.0, 59.0), 0.2, **keys)
        angle = omega * points.time.values - lag
        true = np.column_stack([0.01 * np.cos(angle), -0.01 * omega * np.sin(angle)])
        z = (points.section.values - true) / points.section_error.values
        z_x.append(rms(z[2:-2, 0]))
        z_v.append(rms(z[2:-2, 1]))
        passing = poincare(s.time, s.x, s.v, level=0.002, rising=True, **keys)
        at = (omega * passing.time.values - lag + np.arccos(0.2)) / TURN
        late = (at - np.round(at)) * TURN / omega
        z_t.append(rms((late / passing.time_error.values)[2:-2]))
    assert 0.5 < rms(np.array(z_x)) < 1.2 and 0.5 < rms(np.array(z_v)) < 1.2 and 0.5 < rms(np.array(z_t)) < 1.2


def test_an_impact_between_two_samples_is_not_interpolated_across() -> None:
    motion, times, speeds = bounces(0.8, 3.0, 3, rate=40.0)
    at = np.sort(np.concatenate([times - 0.002, times + 0.002]))
    drive = DrivePhase(1.0, 0.0, 0.0, 0.0, 0.0, "fit", at, np.arange(len(at)), (0.0, float(motion.t[-1])))
    points = stroboscopic(motion.t, motion.x, motion.v, drive, a=motion.a, impacts=times)
    v = points.section.sel(state="v").values
    expected = np.column_stack([-speeds + 9.81 * 0.002, 0.8 * speeds - 9.81 * 0.002]).ravel()
    np.testing.assert_allclose(v, expected, rtol=0, atol=1e-9)
    across = stroboscopic(motion.t, motion.x, motion.v, drive, a=motion.a).section.sel(state="v").values
    assert np.max(np.abs(across - expected)) > 0.5
    # A passage of v = 0 by the jump itself lies at the impact.
    passing = poincare(motion.t, motion.x, motion.v, surface="v", rising=True, a=motion.a, impacts=times)
    np.testing.assert_allclose(passing.time, times, rtol=0, atol=1e-9)


def test_directions_and_surfaces() -> None:
    motion = sine(1.0, 5.0, 1.0, 20.0)
    both = poincare(motion.t, motion.x, motion.v, rising=None)
    up, down = (poincare(motion.t, motion.x, motion.v, rising=r) for r in (True, False))
    assert len(both.time) == len(up.time) + len(down.time)
    assert (up.section.sel(state="v") > 0).all() and (down.section.sel(state="v") < 0).all()
    tops = poincare(motion.t, motion.x, motion.v, surface="v", rising=False)
    np.testing.assert_allclose(tops.section.sel(state="x"), 1.0, atol=1e-6)
    assert poincare(motion.t, motion.x, motion.v, level=2.0).sizes["iterate"] == 0


def test_what_is_refused() -> None:
    motion = sine(1.0, 5.0, 1.0, 3.0)
    drive = exact_phase(5.0, 0.3, 39.0)
    with pytest.raises(ValueError, match="phase = .* must be zero or more and at most 1"):
        stroboscopic(motion.t, motion.x, motion.v, drive, 3.14)
    with pytest.raises(ValueError, match="holds no instant of phase 0.5"):
        stroboscopic(motion.t[:20], motion.x[:20], motion.v[:20], drive, 0.5)
    with pytest.raises(ValueError, match="v must have one value per time"):
        stroboscopic(motion.t, motion.x, motion.v[1:], drive)
    with pytest.raises(ValueError, match="surface = .*; allowed: 'x', 'v'"):
        poincare(motion.t, motion.x, motion.v, surface="a")
