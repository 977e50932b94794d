"""Refusals of ``gather``: each message names the run and the channel, and says what to do."""

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.recordings.recording import Recording
from nonsmooth_savi2007.identification import gather

KNOWN = {"distance_per_turn": 0.0789, "mass": (0.838, 1e-3)}


def recording(unit="rad", n=200, channels=("Angle",), turns=5, **attrs):
    sensors = {}
    for name in channels:
        if name == "Turn":
            time, values, own = np.arange(turns) * 1.4, np.arange(turns), "turns"
        else:
            time, values, own = np.arange(n) / 100, np.zeros(n), unit if name == "Angle" else "N"
        dataset = xr.Dataset(
            {name: ("time", values.astype(float), {"units": own, "long_name": name})},
            {"time": ("time", time, {"units": "s"})},
            {"rate": 100.0, "sampling": "regular"},
        )
        sensors[name] = dataset
    return Recording.from_runs({"Run #1": sensors}, synthetic=True, source={}, run_attrs={"Run #1": attrs})


def test_a_mapping_in_memory_is_taken_with_its_settings():
    found = gather(
        {"response": recording(channels=("Angle", "Turn"), crank_length=0.0165), "impulse": [recording()]},
        apparatus=KNOWN,
    )
    run = found.runs["response"][0]
    assert run.settings == {"crank_length": 0.0165} and len(run.passages) == 5 and run.synthetic
    assert found.resolution == pytest.approx(0.0789 / 1440) and found.runs["springs"] == ()
    assert found.quantity("mass").uncertainty == 1e-3


@pytest.mark.parametrize(
    ("given", "error", "said"),
    [
        ({"response": recording(channels=("Angle", "Turn"))}, ValueError, r"'Run #1' must state crank_length"),
        ({"response": recording(crank_length=0.01)}, ValueError, r"Turn"),
        ({"springs": recording()}, ValueError, r"Force"),
        ({"impulse": recording(unit="furlong")}, ValueError, r"run 'Run #1', channel 'Angle': its unit is 'furlong'"),
        ({"impulse": recording(n=5)}, ValueError, r"run 'Run #1', channel 'Angle': 5 samples are too short"),
        ({"voltage": recording(channels=("Turn",), turns=2, voltage=3.0)}, ValueError, r"channel 'Turn': 2 samples"),
        ({"impuls": recording()}, ValueError, r"impulse"),
        ({"impulse": []}, ValueError, r"no recordings of 'impulse'; leave the procedure out"),
        (3, TypeError, r"a session folder, a Session, or a mapping"),
    ],
)
def test_what_lacks_something_is_refused(given, error, said):
    with pytest.raises(error, match=said):
        gather(given, apparatus=KNOWN)


def test_what_the_apparatus_must_state():
    with pytest.raises(ValueError, match="must state `distance_per_turn`"):
        gather({"impulse": recording()})
    with pytest.raises(ValueError, match="does not state `mass`"):
        gather({"impulse": recording()}, apparatus={"distance_per_turn": 0.0789}).quantity("mass")


def test_identify_refuses_what_has_no_mass_or_no_uncertainty():
    with pytest.raises(ValueError, match="does not state `mass`"):
        ns.identify({"impulse": recording()}, apparatus={"distance_per_turn": 0.0789})
    with pytest.raises(ValueError, match="no uncertainty of `mass`"):
        ns.identify({"impulse": recording()}, apparatus={"distance_per_turn": 0.0789, "mass": 0.838})
    with pytest.raises(ValueError, match="crank_length = -1"):
        ns.identify({"impulse": recording()}, apparatus=KNOWN, crank_length=-1)
    with pytest.raises(ValueError, match="channel 'Angle' does not change in 1 of 1 runs"):
        ns.identify({"impulse": recording()}, apparatus=KNOWN)


def pulls(slope, name="Run #1"):
    """A pull of springs in closed form, as a file of its own."""
    x = 0.1 * np.sin(np.pi * np.arange(200) / 199) ** 2
    sensors = {
        channel: xr.Dataset(
            {channel: ("time", values, {"units": unit, "long_name": channel})}, {"time": np.arange(200) / 100}
        )
        for channel, values, unit in (("Angle", 2 * np.pi * x / 0.0789, "rad"), ("Force", slope * x, "N"))
    }
    return Recording.from_runs({name: sensors}, synthetic=True, source={}, run_attrs={name: {}})


def test_runs_of_one_name_in_two_recordings_are_told_apart():
    found = gather({"springs": [pulls(17.0), pulls(-19.0), pulls(18.0, "Run #2")]}, apparatus=KNOWN)
    one, other, third = found.runs["springs"]
    assert (one.name, other.name, third.name) == ("Run #1 of recording 1", "Run #1 of recording 2", "Run #2")
    for run, slope in (one, 17.0), (other, 19.0), (third, 18.0):  # the second was pushed, and no other
        assert np.polyfit(run.positions, run.force.values, 1)[0] == pytest.approx(slope, rel=1e-2)
    assert "1 of 3 runs (Run #1 of recording 2)" in found.notes[0]


def test_a_run_that_is_given_twice_is_refused():
    once = pulls(17.0)
    with pytest.raises(ValueError, match="springs Run #1 is given twice"):
        gather({"springs": [once, pulls(18.0), once]}, apparatus=KNOWN)
