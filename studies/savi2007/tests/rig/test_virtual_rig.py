"""The rig as an instrument: seeds, features, sensors, limits."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.recordings import PROCEDURES, RecordingWarning
from nonsmooth_savi2007.rig import FEATURES, UNITS, VirtualRig, sensors
from nonsmooth_savi2007.rig.driven import SteadyRun, records
from nonsmooth_savi2007.rig.figures import RELEASES
from nonsmooth_savi2007.rig.motor import frequency, passages, voltage_for
from nonsmooth_savi2007.rig.physics import crank_angle
from nonsmooth_savi2007.rig.truth import published

PERFECT = dict.fromkeys(FEATURES, False)
SHORT = {
    "springs": {"n": 2},
    "support": {"n": 2},
    "impulse": {"velocities": (0.3, -0.2), "duration": 3.0},
    "drop": {"n": 2, "duration": 3.0},
    "voltage": {"voltages": (4.0, 8.0)},
    "crank": {"lengths": (0.01, 0.03)},
    "response": {"voltages": (4.0, 5.0), "crank_lengths": (0.0165,), "duration": 3.0},
    "grazing": {"half_width": 0.1, "duration": 3.0},
    "contact": {"regimes": ((6.0, 0.0165),), "duration": 3.0},
    "rise": {"duration": 30.0},
    "section": {"figure": 12, "periods": 3},
}


def position(recording: ns.Recording, run: str) -> np.ndarray:
    return recording.channel("Angle", run).values * sensors.DISTANCE_PER_TURN / (2 * np.pi)


def same(one: ns.Recording, other: ns.Recording) -> bool:
    return all(
        one.tree[run][sensor].to_dataset().equals(other.tree[run][sensor].to_dataset())
        for run in one.runs
        for sensor in one.tree[run].children
    )


def test_forty_truths_lie_around_the_published_values() -> None:
    base = published()
    truths = [VirtualRig(seed).truth for seed in range(40)]
    for name in ("m", "k", "k_s", "c", "c_s", "g"):
        ratios = np.array([truth[name] for truth in truths]) / base[name]
        assert ratios.min() >= 0.8 and ratios.max() <= 1.2
        assert np.ptp(ratios) > 0.3  # uniform: 40 of them fill the range
    assert all(0 <= truth["friction"] <= 0.02 for truth in truths)
    assert all(0.5 <= truth["string_length"] <= 2 for truth in truths)
    assert all(0.99 <= truth["force_gain"] <= 1.01 for truth in truths)
    assert set(truths[0]) == set(UNITS)


@pytest.mark.parametrize("procedure", list(PROCEDURES))
def test_records_are_their_seeds(procedure: str) -> None:
    """Equal seeds give equal records, whatever else was recorded; other seeds give others. All is synthetic."""
    one, other = VirtualRig(3), VirtualRig(3)
    other.springs(n=1)
    first, again = (rig.record(procedure, **SHORT[procedure]) for rig in (one, other))
    assert first.synthetic and first.runs[0] == "Run #1"
    assert same(first, again)
    assert not same(first, VirtualRig(4).record(procedure, **SHORT[procedure]))


def test_a_run_does_not_depend_on_how_many_follow() -> None:
    few, many = (VirtualRig(3).impulse(velocities=v, duration=3.0) for v in ((0.3,), (0.3, 0.2, 0.1)))
    assert same(few, many)


@pytest.mark.parametrize("feature", list(FEATURES))
def test_each_feature_goes_alone(feature: str) -> None:
    """Switched off, a feature changes its own part of the truth and no other, and it changes the records."""
    full, without = VirtualRig(6), VirtualRig(6, **{feature: False})
    changed = {name for name in full.truth if full.truth[name] != without.truth[name]}
    assert changed == set(FEATURES[feature])
    if feature == "support_relaxation":
        assert "relaxing" in full.system().modes and "relaxing" not in without.system().modes
        return
    procedure = {"noise": "springs", "gain_error": "springs"}.get(feature, "response")
    options = SHORT[procedure]
    assert not same(full.record(procedure, **options), without.record(procedure, **options))


def test_a_count_is_wrong_by_half_of_itself_at_most() -> None:
    coarse, exact = (VirtualRig(8, jitter=False, quantisation=q) for q in (True, False))
    zero = coarse.truth["encoder_zero"] * sensors.COUNT
    for run in ("Run #1", "Run #2"):
        read, true = (position(rig.impulse(**SHORT["impulse"]), run) for rig in (coarse, exact))
        error = read - true - zero
        assert np.abs(error).max() <= sensors.COUNT / 2 * (1 + 1e-9)
        assert np.abs(error).max() > 0.45 * sensors.COUNT
        counts = read / sensors.COUNT
        np.testing.assert_allclose(counts, np.rint(counts), atol=1e-6)


def test_the_clock_jitters_around_the_times_of_the_file() -> None:
    """A drop at 30 rad/s: the error is velocity times jitter."""
    even, jittered = (VirtualRig(8, quantisation=False, jitter=j) for j in (False, True))
    a, b = (rig.drop(**SHORT["drop"]).channel("Angle", "Run #1") for rig in (even, jittered))
    np.testing.assert_array_equal(a["time"], b["time"])
    np.testing.assert_allclose(np.diff(a["time"]), 0.01, atol=1e-12)
    w = np.sqrt(even.truth["k_s"] / even.truth["test_mass"])
    rms = np.sqrt(np.mean((b.values - a.values)[110:] ** 2))
    moving = slice(110, None)  # it begins within the first second
    expected = 5e-5 * w * np.sqrt(np.mean(a.values[moving] ** 2))
    assert rms == pytest.approx(expected, rel=0.2)


def test_the_force_sensor_has_a_gain_steps_and_a_range() -> None:
    rig = VirtualRig(5, noise=False, truth={"force_gain": 1.01})
    time = np.arange(1001) / 100
    pulled = np.linspace(-40, 40, 1001)
    reading = sensors.force(rig, np.random.default_rng(0), "Run #1", time, pulled)["Force"].values
    assert np.abs(reading - 1.01 * pulled).max() <= 0.015 * (1 + 1e-9)
    np.testing.assert_allclose(reading / 0.03, np.rint(reading / 0.03), atol=1e-9)
    with pytest.warns(RecordingWarning, match=r"'Run #2', channel 'Force': 2 of 3 samples saturate at 50 N"):
        reading = sensors.force(rig, np.random.default_rng(0), "Run #2", time[:3], np.array([60.0, 0.0, -60.0]))
    np.testing.assert_allclose(reading["Force"], [50, 0, -50])


def test_the_force_noise_is_as_stated() -> None:
    rig = VirtualRig(5, quantisation=False, gain_error=False)
    n = 20_000
    reading = sensors.force(rig, np.random.default_rng(1), "Run #1", np.arange(n) / 100, np.zeros(n))["Force"].values
    assert reading.std() == pytest.approx(0.02, rel=0.03)  # 6 standard errors


def test_a_wheel_that_turns_too_fast_is_refused() -> None:
    rig = VirtualRig(5)
    with pytest.raises(ValueError, match="Run #7: the wheel of the rotary sensor would turn 31.7 times per second"):
        sensors.angle(rig, "Run #7", np.arange(3) / 100, np.zeros(3), np.array([0.0, 2.5, 0.0]))


def test_pulls_show_the_stiffness_and_the_friction() -> None:
    """Perfect sensors: the slope is 2k, but for the car's own inertia; the loop is 2 (F_C + c v) wide."""
    rig = VirtualRig(9, **{**PERFECT, "friction": True}, truth={"friction": 0.02})
    recording = rig.springs(n=2)
    for run in recording.runs:
        force, x = recording.channel("Force", run).values, position(recording, run)
        assert np.polyfit(x, force, 1)[0] == pytest.approx(2 * rig.truth["k"], rel=3e-3)
        half = len(x) // 2
        there, back = (np.abs(x[part]) for part in (slice(None, half), slice(half, None)))
        rest = force - 2 * rig.truth["k"] * x
        middle = [(part > 0.03) & (part < 0.09) for part in (there, back)]
        speed = np.abs(np.diff(x[:half]) * 100)[middle[0][1:]].mean()
        width = abs(rest[:half][middle[0]].mean() - rest[half:][middle[1]].mean())
        assert width == pytest.approx(2 * (0.02 + rig.truth["c"] * speed), rel=0.02)


def test_pushes_show_the_support() -> None:
    rig = VirtualRig(9, **PERFECT)
    recording = rig.support(n=1)
    force, x = recording.channel("Force").values, position(recording, "Run #1")
    slope = np.polyfit(x, force, 1)[0]
    assert slope == pytest.approx(rig.truth["k_s"], rel=1e-4)
    assert 25 < force.max() < 40


def test_a_tap_and_a_drop_decay_as_they_should() -> None:
    """Without friction: exp(-xi w t) sin(w_d t); with the test mass the same for the support."""
    rig = VirtualRig(10, **PERFECT)
    p = rig.truth
    for recording, stiffness, mass, damping in (
        (rig.impulse(**SHORT["impulse"]), 2 * p["k"], p["m"], p["c"]),
        (rig.drop(**SHORT["drop"]), p["k_s"], p["test_mass"], p["c_s"]),
    ):
        delta = damping / (2 * mass)
        w = np.sqrt(stiffness / mass - delta**2)
        t = recording.channel("Angle", "Run #1")["time"].values
        x = position(recording, "Run #1")
        moving = slice(110, None)  # it begins within the first second
        basis = np.exp(-delta * t)[:, None] * np.stack([np.cos(w * t), np.sin(w * t)], axis=1)
        coefficients, *_ = np.linalg.lstsq(basis[moving], x[moving], rcond=None)
        np.testing.assert_allclose(basis[moving] @ coefficients, x[moving], atol=1e-9)


def test_the_motor_follows_its_law() -> None:
    rig = VirtualRig(12)
    slope, offset = rig.truth["motor_slope"], rig.truth["motor_offset"]
    recording = rig.voltage(voltages=(3.0, 9.0))
    for run, voltage in zip(recording.runs, (3.0, 9.0), strict=True):
        turn = recording.channel("Turn", run)
        mean = 2 * np.pi * (len(turn) - 1) / float(turn["time"][-1] - turn["time"][0])
        assert mean == pytest.approx(slope * (voltage - offset), rel=1e-5)
        assert recording.tree[run].attrs["voltage"] == voltage
    assert frequency(rig, voltage_for(rig, 5.0)) == pytest.approx(5.0, abs=slope * 5.1e-4)
    with pytest.raises(ValueError, match=r"voltage = 0\.5 V: this motor turns from .* V on, to 12 V"):
        frequency(rig, 0.5)


def test_photogate_times_have_their_resolution() -> None:
    rig, exact = VirtualRig(12), VirtualRig(12, quantisation=False)
    a, b = (r.voltage(voltages=(5.0,)).channel("Turn")["time"].values for r in (rig, exact))
    assert 0 < np.abs(a - b).max() <= 0.5e-4 * (1 + 1e-6)


def test_the_held_car_feels_the_drive() -> None:
    """Perfect sensors: k (a cos phi + L - sqrt(L^2 - a^2 sin^2 phi)), with its phase from the photogate."""
    rig = VirtualRig(13, **{**PERFECT, "string": True}, truth={"string_length": 0.5})
    recording = rig.crank(lengths=(0.05,), voltage=5.0)
    omega = frequency(rig, 5.0)
    turn = recording.channel("Turn")["time"].values
    force = recording.channel("Force")
    phi = omega * (force["time"].values - turn[0])
    expected = 0.05 * np.cos(phi) + 0.5 - np.sqrt(0.25 - (0.05 * np.sin(phi)) ** 2)
    np.testing.assert_allclose(force.values, rig.truth["k"] * expected, atol=1e-10)


def test_the_steady_response_is_that_of_the_linear_model() -> None:
    """Perfect features, no support: the amplitude in closed form, and the phase against the photogate."""
    rig = VirtualRig(14, **PERFECT)
    recording = rig.response(voltages=(4.0, 5.0), crank_lengths=(0.0165,), duration=6.0)
    p = rig.truth
    assert len(recording.runs) == 4
    for run in recording.runs:
        attrs = recording.tree[run].attrs
        omega = frequency(rig, attrs["voltage"])
        z = p["k"] * attrs["crank_length"] / (2 * p["k"] - p["m"] * omega**2 + 1j * omega * p["c"])
        t = recording.channel("Angle", run)["time"].values - recording.channel("Turn", run)["time"].values[0]
        np.testing.assert_allclose(position(recording, run), (z * np.exp(1j * omega * t)).real, atol=2e-6)
    assert [recording.tree[run].attrs["direction"] for run in recording.runs] == ["up", "up", "down", "down"]


@pytest.mark.parametrize("seed", [1, 9])
def test_the_hunt_for_the_graze_finds_it(seed: int) -> None:
    rig = VirtualRig(seed, quantisation=False, jitter=False)
    recording = rig.grazing(duration=8.0)
    beyond = [position(recording, run).max() > rig.truth["g"] + 1e-6 for run in recording.runs]
    assert not any(beyond[:4]) and all(beyond[-4:])


def test_a_slow_rise_is_quasi_static() -> None:
    """Perfect features, support out of reach: the amplitude follows k a(t) with a lag of the order 1 / duration."""
    rig = VirtualRig(14, **PERFECT)
    recording = rig.rise(voltage=4.0, crank_length=(0.01, 0.03), gap=1.0, duration=400.0)
    p, omega = rig.truth, frequency(rig, 4.0)
    z = p["k"] / (2 * p["k"] - p["m"] * omega**2 + 1j * omega * p["c"])
    t = recording.channel("Angle")["time"].values
    phi = omega * (t - recording.channel("Turn")["time"].values[0])
    a = 0.01 + 0.02 * t / 400
    x = position(recording, "Run #1")
    lag = np.abs(x - a * (z * np.exp(1j * phi)).real)[t > 50].max()  # when the beginning of the rise has died away
    # The next order of a slowly modulated response: a' |dz/d(i omega)|.
    slope = abs(z**2 / p["k"] * (p["c"] + 2j * p["m"] * omega))
    assert lag == pytest.approx(0.02 / 400 * slope, rel=0.05)
    assert recording.tree["Run #1"].attrs["crank_length_end"] == 0.03


def test_figures_set_the_published_gap_from_the_mean_position() -> None:
    rig = VirtualRig.published(truth={"string_length": 0.5}, ripple=False)
    recording = rig.figure(14, periods=2)["section"]
    attrs = recording.tree["Run #2"].attrs
    a = attrs["crank_length"]
    assert a == pytest.approx(0.33 / 8.47, abs=1e-5)
    assert rig.true_gap(attrs["gap"]) - a**2 / (8 * 0.5) == pytest.approx(0.0009, abs=1e-6)
    assert attrs["figure"] == 14
    with pytest.raises(ValueError, match="measurements stand behind Figs. 4, 5"):
        rig.figure(3)


def test_strings_that_would_push_at_the_support_are_refused() -> None:
    rig = VirtualRig(1, truth={"pretension": 0.05})
    with pytest.raises(ValueError, match="Run #1: the string of the driven spring would have to push"):
        rig.contact(regimes=((8.0, 0.05),), duration=3.0)
    with pytest.raises(ValueError, match="would slacken a string; stay below"):
        rig.springs()


@pytest.mark.parametrize(
    ("truth", "error", "message"),
    [
        ({"kk": 1.0}, ValueError, "`kk` is not a part of the truth of a virtual rig; nearest: k"),
        ({"k": -1.0}, ValueError, r"truth\['k'\] = -1.0 must be positive"),
        ({"k": "8"}, TypeError, "must be a number"),
        ({"m": np.inf}, ValueError, "must be finite"),
        ({"ripple": 1.0}, ValueError, "the motor would turn back"),
        (3.0, TypeError, "truth must map names to numbers"),
    ],
)
def test_a_truth_that_cannot_be_is_refused(truth: object, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        VirtualRig(0, truth=truth)


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="seed = -1 must be a whole number"):
        VirtualRig(-1)
    with pytest.raises(TypeError, match="a feature is on"):
        VirtualRig(0, noise=0)
    with pytest.raises(ValueError, match="`tap` is not a procedure of a virtual rig"):
        VirtualRig(0).record("tap")


def test_passages_are_counted_in_the_window_only() -> None:
    rig = VirtualRig(0, ripple=False)
    np.testing.assert_allclose(passages(rig, 2 * np.pi, 0.5, 3.5), [1, 2, 3], atol=1e-12)


def test_figure_14_is_recorded_from_several_places() -> None:
    """First all gaps from rest, then all again for each place where the car is let go."""
    rig = VirtualRig.published()
    recording = rig.section(figure=14, periods=2, settle=1.0)
    assert len(recording.runs) == 4 * (1 + len(RELEASES[14]))
    gaps = [recording.tree[run].attrs["gap"] for run in recording.runs]
    assert gaps[:4] == gaps[4:8] == gaps[16:20]
    assert "let go at -10 mm" in recording.tree["Run #5"].attrs["note"]
    assert "let go" not in recording.tree["Run #4"].attrs["note"]
    assert len(rig.section(figure=14, periods=2, settle=1.0, releases=()).runs) == 4


@pytest.mark.parametrize("carry", [False, True])
def test_a_release_begins_where_it_says_and_the_next_run_goes_on_where_motion_is_carried(carry: bool) -> None:
    """No waiting, a motor hardly driving, no support: the car swings freely from where it was let go."""
    rig = VirtualRig.published(friction=False, quantisation=False, jitter=False, ripple=False)
    settings = [SteadyRun(4.0, 0.0, None, 1.0, {}, -0.03), SteadyRun(4.0, 0.0, None, 1.0)]
    made = records(rig, "response", settings, settle=1e-9, carry=carry)
    p, period = rig.truth, 2 * np.pi / frequency(rig, 4.0)
    decay, natural = p["c"] / (2 * p["m"]), np.sqrt(2 * p["k"] / p["m"])
    w = np.sqrt(natural**2 - decay**2)
    # a run begins within the second turn, and ends with the turn in which its last sample lies
    first, second = (1 + float(rig.generator("response", i).uniform()) for i in range(2))
    ended = np.ceil(first + (1.0 + 1 / sensors.RATE) / period)
    for run, turns, size in (("Run #1", first, 0.03), ("Run #2", ended + second, 0.03 if carry else 0.0)):
        x = position(made, run)
        t = turns * period + np.arange(len(x)) / sensors.RATE
        expected = -size * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
        np.testing.assert_allclose(x, expected, atol=1e-7)


@pytest.mark.parametrize("number", [9, 11, 12, 16])
def test_each_figure_with_the_support_has_runs_without_it(number: int) -> None:
    """One for each crank length that is used, far apart enough for a rise."""
    rig = VirtualRig(5)
    few = {"periods": 2, "settle": 1.0}
    short = {9: {"voltages": (4.0,), "duration": 1.0}, 11: {"duration": 20.0}}.get(number, few)
    made = rig.figure(number, **short)
    free = [run for run in made["response"].runs if "gap" not in made["response"].tree[run].attrs]
    lengths = {made["response"].tree[run].attrs["crank_length"] for run in free}
    shown = made["response" if number == 9 else "rise" if number == 11 else "section"]
    used = {shown.tree[run].attrs["crank_length"] for run in shown.runs}
    assert used <= lengths and len(free) == len(lengths) == {9: 1, 11: 3, 12: 4, 16: 1}[number]


# What goes wrong on request


def test_friction_that_holds_keeps_the_car_off_the_place_where_its_springs_balance() -> None:
    """It stops within F_C/2k of rest and stays to a count; a friction that creeps lets it come back."""
    truth = {"friction": 0.015, "encoder_zero": 0.0}
    holding, creeping = (VirtualRig(2, truth=truth, holding=on).impulse(velocities=(0.2, -0.2)) for on in (True, False))
    reach = 0.015 / (2 * VirtualRig(2).truth["k"])
    for run in holding.runs:
        end = position(holding, run)[-500:]
        assert np.ptp(end) <= sensors.COUNT * 1.01 and sensors.COUNT < np.abs(end).max() < reach + sensors.COUNT
        assert np.abs(position(creeping, run)[-1]) <= sensors.COUNT
    assert position(holding, "Run #2")[0] != position(holding, "Run #1")[0]  # tapped where it came to rest


def test_the_sensor_counts_from_where_it_was_zeroed() -> None:
    shifted, plain = (
        VirtualRig(2, quantisation=False, truth={"sensor_zero": zero}).impulse(**SHORT["impulse"]) for zero in (4e-4, 0)
    )
    np.testing.assert_allclose(position(shifted, "Run #1"), position(plain, "Run #1") - 4e-4, atol=1e-12)


@pytest.mark.parametrize(
    ("sign", "channel", "procedure"),
    [
        ("angle_sign", "Angle", "springs"),
        ("force_sign", "Force", "springs"),
        ("turn_sign", "Turn", "voltage"),
    ],
)
def test_a_sensor_counts_the_other_way(sign: str, channel: str, procedure: str) -> None:
    usual, other = (
        VirtualRig(2, quantisation=False, truth={sign: s}).record(procedure, **SHORT[procedure]) for s in (1.0, -1.0)
    )
    np.testing.assert_array_equal(other.channel(channel, "Run #1").values, -usual.channel(channel, "Run #1").values)
    with pytest.raises(ValueError, match="must be 1 or -1"):
        VirtualRig(2, truth={sign: 0.5})


def test_the_motor_on_the_other_side_drives_a_mirrored_car() -> None:
    """Without a support the rig is symmetric but for the motor."""
    options = {"voltages": (5.0,), "crank_lengths": (0.03,), "duration": 3.0}
    exact = {"quantisation": False, "jitter": False}
    here, there = (VirtualRig(2, **exact, truth={"motor_side": side}).response(**options) for side in (1, -1))
    np.testing.assert_allclose(position(there, "Run #1"), -position(here, "Run #1"), atol=1e-8)
    np.testing.assert_array_equal(there.channel("Turn", "Run #1")["time"], here.channel("Turn", "Run #1")["time"])


def test_a_motor_that_wanders_turns_by_its_own_angle() -> None:
    """The gate sees whole turns of the angle that drives the car; its frequency varies by 0.1 % about the mean."""
    rig, omega = VirtualRig(2, truth={"motor_wander": 1e-3}), 6.0
    wander = rig.wander("response", 0, omega)
    at = passages(rig, omega, 3.0, 4000.0, **wander)
    turned = crank_angle(at, rig.named_parameters(omega=omega, **wander), True) / (2 * np.pi)
    np.testing.assert_allclose(turned, np.rint(turned), atol=1e-10)
    assert np.all(np.diff(np.rint(turned)) == 1)
    instants = np.linspace(0, 4000, 400_001)
    rate = np.gradient(crank_angle(instants, rig.named_parameters(omega=omega, ripple=0.0, **wander), True), instants)
    assert np.std(rate) / omega == pytest.approx(1e-3, rel=0.05) and np.mean(rate) == pytest.approx(omega, rel=1e-4)
    assert rig.wander("response", 1, omega) != wander and VirtualRig(2).wander("response", 0, omega) == {}


def test_one_tap_slips_and_the_others_do_not() -> None:
    options = {"velocities": (0.4, -0.4, 0.3), "duration": 4.0}
    plain, slipped = (VirtualRig(2, truth={"slipped_tap": n}).impulse(**options) for n in (0, 2))
    off = [position(slipped, run) - position(plain, run) for run in plain.runs]
    assert not off[0].any() and not off[2].any()
    assert off[1][0] == 0 and abs(off[1][-1]) > 1e-3 and np.ptp(off[1][-50:]) <= sensors.COUNT * 1.01


def test_an_awkward_rig_is_its_seed_and_the_car_of_that_seed() -> None:
    one, again, plain = VirtualRig.awkward(5), VirtualRig.awkward(5), VirtualRig(5)
    assert one.truth == again.truth and one.holding
    beside = (
        "sensor_zero",
        "motor_side",
        "motor_wander",
        "slipped_tap",
        "angle_sign",
        "force_sign",
        "turn_sign",
        "creep_velocity",
    )
    assert all(one.truth[name] == plain.truth[name] for name in UNITS if name not in beside)
    drawn = [VirtualRig.awkward(seed).truth for seed in range(40)]
    for name in ("motor_side", "angle_sign", "force_sign", "turn_sign"):
        assert {truth[name] for truth in drawn} == {1.0, -1.0}
    assert {truth["slipped_tap"] for truth in drawn} == set(range(1, 7))
    assert all(abs(truth["sensor_zero"]) < truth["friction"] / (2 * truth["k"]) for truth in drawn)
