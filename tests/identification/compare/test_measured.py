"""From records to what compare takes: closed forms of the free motion, and a session of a rig that is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.identification.compare import (
    compare,
    measured_motion,
    measured_response,
    measured_rise,
    measured_sections,
    motion_of,
)
from nonsmooth.identification.compare import measured as module
from nonsmooth.recordings import Recording, load_session
from nonsmooth_savi2007.comparison import GapReference, gap_reference, session_measurement
from nonsmooth_savi2007.rig import VirtualRig
from nonsmooth_savi2007.rig.driven import SteadyRun, records
from nonsmooth_savi2007.rig.figures import TAPS, without_support
from nonsmooth_savi2007.rig.motor import frequency, mean_position, voltage_for
from nonsmooth_savi2007.rig.notebook import write_session

pytestmark = pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning")
TRAVEL = 0.0789
COUNT = TRAVEL / 1440
OMEGA = 5.3


def recorded(x: object, seconds: float = 30.0, omega: float = OMEGA, seed: int = 0) -> Recording:
    """A motion x(t) as the rotary sensor counts it, with the photogate of a drive of this frequency."""
    time = np.arange(int(seconds * 100)) / 100
    counts = np.rint(x(time) / COUNT)
    turns = 2 * np.pi / omega * np.arange(1, int(seconds * omega / (2 * np.pi)))
    angle = xr.Dataset({"Angle": ("time", counts * 2 * np.pi / 1440, {"units": "rad"})}, {"time": time})
    gate = xr.Dataset({"Turn": ("time", np.arange(1.0, len(turns) + 1), {"units": "turns"})}, {"time": turns})
    return Recording.from_runs({"Run #1": {"Angle": angle, "Turn": gate}}, synthetic=True)


def test_a_motion_is_what_was_put_in() -> None:
    """x = 0.3 mm + 12 mm cos(w t - 0.4): position, velocity and phase of the drive, within the stated errors."""
    found = measured_motion(
        recorded(lambda t: 3e-4 + 0.012 * np.cos(OMEGA * t - 0.4)), distance_per_turn=TRAVEL, zero=3e-4, support=False
    )
    t = found["time"].values
    x, v = 0.012 * np.cos(OMEGA * t - 0.4), -0.012 * OMEGA * np.sin(OMEGA * t - 0.4)
    error = (found["u"].values - np.column_stack([x, v])) / found["u_error"].values
    inner = slice(20, -20)
    assert 0.5 < np.sqrt(np.mean(error[inner, 0] ** 2)) < 1.6
    assert 0.5 < np.sqrt(np.mean(error[inner, 1] ** 2)) < 1.6
    np.testing.assert_allclose(
        found["phase"].values - found["phase"].values[0], (t - t[0]) * OMEGA / (2 * np.pi), atol=1e-9
    )
    assert float(found["phase"].values[0]) % 1 == pytest.approx(t[0] * OMEGA / (2 * np.pi) % 1, abs=1e-9)
    assert float(found["omega"]) == pytest.approx(OMEGA, rel=1e-9)
    assert found.attrs["synthetic"] == "yes" and found.attrs["run"] == "Run #1"


def test_a_missing_channel_is_named() -> None:
    whole = recorded(np.cos)
    lone = Recording.from_runs({"Run #1": {"Angle": whole.tree["Run #1"]["Angle"].to_dataset()}}, synthetic=True)
    with pytest.raises(ValueError, match="Turn"):
        measured_motion(lone, distance_per_turn=TRAVEL)


def test_a_response_has_amplitudes_and_periods() -> None:
    """Amplitudes put in; a subharmonic of order 2 is seen as period 2; a few turns say nothing."""
    motions = [
        measured_motion(recorded(x, seconds), distance_per_turn=TRAVEL, support=False)
        for x, seconds in (
            (lambda t: 0.010 * np.cos(OMEGA * t), 30.0),
            (lambda t: 0.010 * np.cos(OMEGA * t) + 0.002 * np.cos(OMEGA * t / 2 + 1), 30.0),
            (lambda t: 0.004 * np.cos(OMEGA * t), 6.0),
        )
    ]
    found = measured_response(motions, ["up", "up", "down"])
    assert found["period_number"].values.tolist() == [1, 2, -1]
    error = found["amplitude"].values - [0.010, np.nan, 0.004]
    assert (np.abs(error[[0, 2]]) < 4 * found["amplitude_error"].values[[0, 2]] + 5e-6).all()
    time = np.linspace(0, 4 * np.pi / OMEGA, 20001)
    two = 0.010 * np.cos(OMEGA * time) + 0.002 * np.cos(OMEGA * time / 2 + 1)
    assert float(found["amplitude"][1]) == pytest.approx(np.ptp(two) / 2, abs=2e-5)
    with pytest.raises(ValueError, match="each run needs its own"):
        measured_response(motions, ["up"])


def test_a_rise_knows_its_parameter() -> None:
    """The amplitude grows with the parameter: section points at phase 0 lie on a straight line over it."""
    motion = measured_motion(
        recorded(lambda t: (0.004 + 1e-4 * t) * np.cos(OMEGA * t), 60.0), distance_per_turn=TRAVEL, support=False
    )
    first, last = float(motion["time"][0]), float(motion["time"][-1])
    found = measured_rise(motion, "rho", 0.004 + 1e-4 * first, 0.004 + 1e-4 * last, unit="N")
    np.testing.assert_allclose(found["section"].sel(state="x"), found["rho"], atol=3e-5)
    assert found["rho"].attrs["units"] == "N"
    alone = measured_rise(motion.isel(state=[0]), "rho", 0.004 + 1e-4 * first, 0.004 + 1e-4 * last, unit="N")
    assert alone.identical(found.isel(state=[0]))


def test_sections_lie_over_their_parameter_in_order() -> None:
    motions = [
        measured_motion(recorded(lambda t, a=a: a * np.cos(OMEGA * t), s), distance_per_turn=TRAVEL, support=False)
        for a, s in ((0.008, 20.0), (0.005, 30.0))
    ]
    found = measured_sections(motions, "rho", [0.2, 0.1])
    assert found["rho"].values.tolist() == [0.1, 0.2]
    np.testing.assert_allclose(found["section"].sel(state="x").mean("iterate"), [0.005, 0.008], atol=2e-5)
    assert np.isnan(found["section"].values[1, -1]).all()  # the shorter run


@pytest.fixture(scope="module")
def rig() -> VirtualRig:
    return VirtualRig.published(truth={"ripple": 0.02, "ripple_phase": 0.3})


@pytest.fixture(scope="module")
def session(rig: VirtualRig, tmp_path_factory: pytest.TempPathFactory) -> object:
    """Fig. 14's settings with the period-1 and period-2 gaps, and the run without the support."""
    length, knob = 0.03896, voltage_for(rig, 11.15)
    shift = mean_position(rig, length)
    mounted = [SteadyRun(knob, length, gap + shift, 40.0) for gap in (-0.0012, 0.0006)]
    made = {
        "section": records(rig, "section", mounted, settle=40.0),
        "response": records(rig, "response", without_support(rig, 14)),
        "impulse": rig.impulse(velocities=TAPS),
    }
    return load_session(write_session(rig, tmp_path_factory.mktemp("lab") / "s", made, title="a test"))


@pytest.fixture(scope="module")
def reference(session: object) -> GapReference:
    return gap_reference(session)


def test_the_gap_is_referred_by_string_and_ripple(rig: VirtualRig, session: object, reference: GapReference) -> None:
    """a^2/(8 L) - a eps cos(beta)/4: with this ripple most of the string's shift is taken back."""
    a = 0.03896
    string, ripple = a**2 / 8, -a * 0.02 * np.cos(0.3) / 4
    assert mean_position(rig, a) == pytest.approx(string + ripple, abs=3e-7)
    value, error = reference.mean(a)
    assert abs(value - (string + ripple)) < 3 * error < 5e-6
    gap, gap_error = reference.gap(0.001, a)
    assert abs(gap - (0.001 - string - ripple)) < 3 * gap_error < 1e-5
    with_offset = gap_reference(session, offset=(2e-4, 3e-5)).gap(0.001, a)
    assert with_offset == pytest.approx((gap + 2e-4, np.hypot(gap_error, 3e-5)), rel=1e-9)
    assert gap_reference(session, referred=False).mean(a) == (0.0, 0.0)


def test_a_session_is_compared_with_the_model(rig: VirtualRig, session: object, reference: GapReference) -> None:
    model = ns.models.discontinuous_support()
    for run, gap, number in (("Run #1", -0.0012, 1), ("Run #2", 0.0006, 2)):
        measured, settings = session_measurement(session, "section", run, k=8.47, reference=reference)
        assert settings["g"][0] == pytest.approx(gap, abs=5e-6) and settings["g"][1] > 5e-7
        assert settings["omega"][0] == pytest.approx(frequency(rig, voltage_for(rig, 11.15)), rel=1e-6)
        assert settings["rho"]({"k": 8.0}) == pytest.approx(8.0 * 0.03896)
        found = compare(measured, model, settings=settings, draws=8)
        assert int(found["measured_period_number"]) == number == int(found["theory_period_number"])
        assert float(found["orbit_distance"]) < 0.1
        # The gap's uncertainty enters the band.
        assert np.std(found["drawn_g"].values) == pytest.approx(settings["g"][1], rel=0.6)


def test_runs_at_several_gaps_are_a_diagram(session: object) -> None:
    measured, settings = session_measurement(session, "section", ["Run #1", "Run #2"], k=8.47)
    np.testing.assert_allclose(measured["g"], [-0.0012, 0.0006], atol=5e-6)
    assert set(settings) == {"rho", "omega"}
    found = compare(measured, ns.models.discontinuous_support(), settings=settings, values=[-0.0012, 0.0, 0.0006])
    assert found["theory_period_number"].values[[0, 2], 0].tolist() == [1, 2]
    assert set(found["measured_period_number"].values.tolist()) == {1, 2}
    assert "rise_per_return" not in found


def test_what_a_session_lacks_is_named(session: object) -> None:
    for procedure, runs, message in (
        ("sections", None, "`sections` is not a procedure of compare.*nearest"),
        ("rise", None, "has no run of 'rise'; it has: section, response"),
        ("section", None, "2 runs of 'section'; a motion is one: run = ... one of Run #1, Run #2"),
        ("section", "Run #9", "`Run #9` is not a run"),
    ):
        with pytest.raises(ValueError, match=message):
            session_measurement(session, procedure, runs, k=8.47)


def test_a_long_record_is_smoothed_as_a_short_one(session: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """The middle of the record serves the whole: the motion stays within a fraction of its own errors."""
    item = session.recordings("section")[1]
    whole = measured_motion(item.recording, item.run, distance_per_turn=TRAVEL)
    monkeypatch.setattr(module, "LONG", 10.0)
    monkeypatch.setattr(module, "PIECE", 20.0)
    quick = measured_motion(item.recording, item.run, distance_per_turn=TRAVEL)
    away = (quick["u"] - whole["u"]) / whole["u_error"]
    assert float(np.sqrt((away**2).mean())) < 0.2
    np.testing.assert_allclose(quick["u_error"].median("time"), whole["u_error"].median("time"), rtol=0.2)


def test_a_sampled_position_of_another_rig_is_compared() -> None:
    """The forced oscillator in closed form, sampled with noise; a damper of another size moves it by what that says."""
    m, k, F, w, noise = 2.0, 50.0, 3.0, 4.0, 1e-4
    t = np.arange(0, 30, 1 / 60)

    def amplitude(c: float) -> complex:
        return F / (k - m * w**2 + 1j * c * w)

    q = np.real(amplitude(1.5) * np.exp(1j * w * t)) + noise * np.random.default_rng(0).normal(size=len(t))
    measured = motion_of(t, xr.DataArray(q, attrs={"units": "m"}), w * t / (2 * np.pi), states=("q", "r"))
    assert measured["state_unit"].values.tolist() == ["m", "m/s"]
    system = ns.System(
        name="forced oscillator",
        states={"q": "m", "r": "m/s"},
        parameters={"c": 1.5},
        modes={"free": lambda t, u, p: (u.r, (F * np.cos(w * t) - k * u.q - p.c * u.r) / m)},
    )
    found = ns.compare(measured, system)
    assert int(found["period_agrees"]) == 1 and float(found["orbit_distance"]) < 2e-3
    other = ns.compare(measured, system, settings={"c": 4.5})
    orbit = other["measured_orbit"].values[:, 0] + 1j * other["measured_orbit"].values[:, 1] / w
    apart = other["theory_orbit"].values[:, 0] + 1j * other["theory_orbit"].values[:, 1] / w - orbit
    true = abs(amplitude(4.5) - amplitude(1.5)) / abs(amplitude(1.5))
    assert np.mean(np.abs(apart)) / np.mean(np.abs(orbit)) == pytest.approx(true, rel=2e-3)
    with pytest.raises(ValueError, match="one finite number for each of 1800 samples"):
        motion_of(t, q, [0.0, 1.0])


def test_a_recording_is_compared_in_the_states_that_it_shows() -> None:
    """Of a chain of two masses in closed form one position was read, through a sensor, on a clock that began late."""
    k, c, F, w, noise = 50.0, 0.6, 3.0, 4.0, 1e-4
    t = np.arange(3.1, 30, 1 / 60)

    def amplitudes(k: float) -> np.ndarray:
        """Of (-w^2 + i c w + K) q = (F, 0): masses of 1, springs k to the ground and between them."""
        stiff = (1j * c * w - w**2) * np.eye(2) + k * np.array([[2.0, -1.0], [-1.0, 1.0]])
        return np.linalg.solve(stiff, [F, 0.0])

    q = np.real(amplitudes(k)[1] * np.exp(1j * w * (t + 0.3))) + noise * np.random.default_rng(0).normal(size=len(t))
    system = ns.System(
        name="two masses",
        states=["a", "b", "v_a", "v_b"],
        parameters={"k": k},
        modes={
            "free": lambda t, u, p: (
                u.v_a,
                u.v_b,
                F * np.cos(w * t) - p.k * (2 * u.a - u.b) - c * u.v_a,
                p.k * (u.a - u.b) - c * u.v_b,
            )
        },
    )
    record = {"sensor": (t, 100.0 * q + 7.0)}
    channels = {"b": ns.Sensor("sensor", gain=100.0, offset=7.0, delay=-0.3)}
    found = ns.compare(record, system, channels=channels)
    assert found["state"].values.tolist() == ["b"] and int(found["period_agrees"]) == 1
    assert float(found["orbit_distance"]) < 2e-3 and abs(float(found["phase_shift"])) < 1e-3
    other = ns.compare(record, system, channels=channels, settings={"k": 1.1 * k})
    size = np.sqrt(0.5 * (abs(amplitudes(k)[1]) ** 2 + abs(amplitudes(1.1 * k)[1]) ** 2))
    apart = abs(amplitudes(1.1 * k)[1] - amplitudes(k)[1]) / size
    assert float(other["orbit_distance"]) == pytest.approx(apart, rel=5e-3)
    banded = ns.compare(
        record, system, channels=channels, parameters=ns.fit(system, record, ["k"], measured=channels), draws=5
    )
    assert banded["theory_low"].shape == (128, 1)
    with pytest.raises(ValueError, match="run = ... one of 0, 1"):
        ns.compare([record, record], system, channels=channels)
    with pytest.raises(ValueError, match="`nothing` is not a state or an output"):
        ns.compare(record, system, channels={"nothing": "sensor"})


@pytest.mark.parametrize("lost", [slice(3000, 3001), slice(3000, 3400)])
def test_readings_that_are_missing_leave_the_period_number(lost: slice) -> None:
    """A motion of two periods of the drive in closed form, less a reading, or those of two and a half periods."""
    t, w = np.arange(0, 120, 0.02), 2.0
    q = np.cos(w * t) + 0.5 * np.cos(w * t / 2 + 0.3) + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    system = ns.mechanical(1.0, 0.15, 9.0, coordinates=["q"], forcing={"q": lambda t, p: np.cos(w * t)})
    held = np.ones(t.size, dtype=bool)
    held[lost] = False
    for record in ({"q": (t, np.where(held, q, np.nan))}, {"q": (t[held], q[held])}):
        assert int(ns.compare(record, system)["measured_period_number"]) == 2


def test_each_run_is_laid_at_the_phase_that_the_fit_found_of_it() -> None:
    """Two records of a resonance in closed form that began at other phases of the drive."""
    t, leads = np.arange(0, 60, 0.05), {"a": 0.7, "b": 2.0}
    system = ns.mechanical(
        1.0, 0.15, "k", parameters={"k": 9.0}, coordinates=["q"], forcing={"q": lambda t, p: np.cos(2.0 * t)}
    )
    runs = {}
    for run, lead in leads.items():
        q = np.real(np.exp(1j * (2.0 * t + lead)) / (5 + 0.3j)) + 1e-3 * np.random.default_rng(1).normal(size=t.size)
        runs[run] = {"laser": xr.Dataset({"q": ("time", q, {"units": ""})}, {"time": t})}
    recording = ns.Recording.from_runs(runs, synthetic=False)
    found = ns.fit(system, recording, ["k", "phase"], tries=1, progress=False)
    for run in leads:
        laid = ns.compare(recording, system, run=run, parameters=found, draws=0)
        assert float(laid["orbit_distance"]) < 0.01 and abs(float(laid["phase_shift"])) < 1e-3
    with pytest.warns(UserWarning, match="none of run 'run': it is taken as 0") as told:
        other = ns.compare({"q": (t, q)}, system, parameters=found, draws=0)
    assert told[0].filename == __file__
    assert float(other["phase_shift"]) == pytest.approx(-leads["b"] / (2 * np.pi), abs=1e-3)


def test_a_channel_is_read_by_the_sensor_and_the_clock_that_the_fit_found() -> None:
    """Two records of a resonance in closed form: of gains of their own, one offset, a delay and a slow clock."""
    t, gains, noise = np.arange(0, 20, 0.2), {"a": 100.0, "b": -60.0}, 0.02
    system = ns.mechanical(
        1.0, "c", 9.0, parameters={"c": 0.15}, coordinates=["q"], forcing={"q": lambda t, p: np.cos(2.0 * t)}
    )
    q = np.real(np.exp(2j * (1.01 * t - 0.2)) / (5 + 0.3j))
    runs = {}
    for run, gain in gains.items():
        y = gain * q + 7.0 + noise * np.random.default_rng(int(gain**2)).normal(size=t.size)
        runs[run] = {"laser": xr.Dataset({"volts": ("time", y, {"units": ""})}, {"time": t})}
    recording = ns.Recording.from_runs(runs, synthetic=False)
    found = ns.fit(
        system,
        recording,
        ["c", "q.gain", "q.offset", "q.delay", "clock"],
        measured={"q": ns.Sensor("volts", gain=80.0)},
        per_run=["q.gain"],
        priors={"c": (0.15, 1e-3)},
        tries=3,
        progress=False,
    )
    assert found.extra["q.gain, b"].value == pytest.approx(-60.0, rel=1e-3)
    for run in gains:
        laid = ns.compare(recording, system, run=run, channels={"q": "volts"}, parameters=found, draws=0)
        assert float(laid["orbit_distance"]) < 0.01 and abs(float(laid["phase_shift"])) < 1e-3
    own = {"q": ns.Sensor("volts", gain=120.0, offset=7.0, delay=0.2)}
    with pytest.warns(UserWarning, match=r"gain=120\.0, .* stands; the fit found .*gain=(99\.9|100\.0)") as told:
        other = ns.compare(recording, system, run="a", channels=own, parameters=found, draws=0)
    assert [one.filename for one in told] == [__file__]
    size = np.sqrt(0.5 * (1 + (100 / 120) ** 2))
    assert float(other["orbit_distance"]) == pytest.approx((1 - 100 / 120) / size, rel=0.02)
