"""A session in which much goes wrong at once: what is identified and what ``compare`` takes is the injected truth."""

import shutil

import numpy as np
import pytest
from studies.savi2007.tests.identification.coverage_tables import unnamed

import nonsmooth as ns
from nonsmooth.recordings import load_session
from nonsmooth.recordings.recording import RecordingWarning
from nonsmooth_savi2007.comparison import gap_offset, gap_reference, session_measurement
from nonsmooth_savi2007.rig import VirtualRig, sensors
from nonsmooth_savi2007.rig.motor import mean_position

pytestmark = pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning")
OPTIONS = {
    "springs": {"n": 3},
    "support": {"n": 3},
    "drop": {"n": 3, "duration": 12.0},
    "impulse": {"velocities": (0.5, -0.5, 0.35, -0.35, 0.2, -0.2), "duration": 8.0},
    "response": {"voltages": (4.0, 5.0, 7.0, 8.5), "duration": 8.0},
    "contact": {"regimes": ((11.15, 0.039), (9.55, 0.027), (6.0, 0.0165)), "duration": 9.0},
}


@pytest.fixture(scope="module")
def rig():
    # motor on the other side, displacement and force sensor reversed, zeroed 0.3 mm or more off rest
    return VirtualRig.awkward(33)


@pytest.fixture(scope="module")
def session(rig, tmp_path_factory):
    return load_session(rig.write_session(tmp_path_factory.mktemp("awkward") / "s", list(OPTIONS), options=OPTIONS))


@pytest.fixture(scope="module")
def found(session):
    return ns.identify(session)


@pytest.mark.slow
def test_the_parameters_are_the_injected_ones(rig, found):
    for name in ("m", "k", "k_s", "c", "c_s"):
        assert abs(found[name] - rig.truth[name]) < 4 * found.uncertainty[name] < 0.02 * rig.truth[name]
    assert abs(found.estimate("gap_at_rest").value - rig.truth["g"]) < 4 * found.estimate("gap_at_rest").uncertainty
    assert abs(found["g"] - (rig.truth["g"] - mean_position(rig, 0.039))) < 4 * found.uncertainty["g"] < 4e-5
    rest = found.estimate("rest_position")  # of a sensor that is turned round, as its counts are
    true = -rig.truth["sensor_zero"] + rig.truth["angle_sign"] * rig.truth["encoder_zero"] * sensors.COUNT
    assert abs(rest.value - true) < 4 * rest.uncertainty < 2e-5 and abs(true) > 2e-4


@pytest.mark.slow
def test_each_anomaly_is_named(rig, found):
    said = unnamed({"truth": rig.truth, "notes": found.notes})
    assert said == {}


@pytest.mark.slow
def test_compare_counts_the_gap_from_where_the_car_swings(rig, session, found):
    reference = gap_reference(session, offset=gap_offset(found, session))
    for item in session.recordings("contact"):
        measured, settings = session_measurement(session, "contact", item.run, k=found["k"], reference=reference)
        crank = float(item.settings["crank_length"])
        value, error = settings["g"]
        assert abs(value - (rig.true_gap(item.settings["gap"]) - mean_position(rig, crank))) < 4 * error < 4e-5
        if crank == 0.039:  # to which identify refers the gap
            assert settings["g"] == pytest.approx((found["g"], found.uncertainty["g"]), rel=1e-6)
        # and the motion is turned towards the support: it goes about as far as the gap, and farther the other way
        x = measured["u"].sel(state="x").values
        assert value < x.max() < value + 2e-3 and x.min() < -2 * x.max()


@pytest.mark.slow
def test_without_taps_the_sensors_zero_is_as_uncertain_as_friction_holds_the_car(rig, session, found, tmp_path):
    folder = shutil.copytree(session.folder, tmp_path / "s")
    text = (folder / "session.toml").read_text()
    parts = text.split("[[recording]]")
    kept = [part for part in parts if "impulse" not in part and "response" not in part]
    (folder / "session.toml").write_text("[[recording]]".join(kept))
    offset = gap_offset(found, session)
    with pytest.warns(RecordingWarning, match=r"no taps of the car \(impulse\)"):
        reference = gap_reference(load_session(folder), offset=offset)
    held = rig.truth["friction"] / (2 * rig.truth["k"])
    assert offset.held == pytest.approx(held, rel=0.05)
    value, error = reference.mean(0.0)
    assert error == pytest.approx(np.hypot(held / np.sqrt(3), sensors.COUNT / np.sqrt(12)), rel=0.05)
    assert abs(value - found.estimate("rest_position").value) < 2 * error


def test_springs_and_support_swapped_are_refused(rig, tmp_path):
    folder = rig.write_session(tmp_path / "s", ["springs", "support"])
    (folder / "springs.csv").rename(folder / "x")
    (folder / "support.csv").rename(folder / "springs.csv")
    (folder / "x").rename(folder / "support.csv")
    with pytest.raises(ValueError, match="look swapped: check `file` and `procedure`"):
        ns.identify(folder)
