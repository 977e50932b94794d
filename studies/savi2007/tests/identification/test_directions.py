"""Directions of sensors, read off runs whose motion is known: SciPy's contacts, and pulls in closed form."""

import numpy as np
import pytest
import xarray as xr
from studies.savi2007.tests.identification.made import driven, run, swinging

from nonsmooth.recordings.recording import Recording
from nonsmooth_savi2007.identification import gather
from nonsmooth_savi2007.identification.directions import oriented, towards_support

TIME = np.arange(0, 12, 0.01)


@pytest.fixture(scope="module")
def contact():
    return driven(6.0, 0.0165), driven(9.55, 0.027)


def mirrored(one):
    """The same run by a rotary sensor that counts the other way."""
    return run(one.procedure, one.time, -one.positions, turns=one.turns, name=one.name, **one.settings)


def pulled(slope, procedure="springs", name="Run #1", reach=0.1):
    x = reach * np.sin(np.pi * TIME / 12) ** 2
    return run(procedure, TIME, x, force=slope * x + 0.3, name=name)


def test_a_rotary_sensor_that_counts_away_from_the_support_is_turned_and_named(contact):
    there, direction, notes = oriented({"contact": contact})
    assert direction == 1 and notes == () and there["contact"] == contact
    tap = run("impulse", TIME, np.exp(-TIME) * np.cos(4.5 * TIME))
    back, direction, notes = oriented({"contact": tuple(mirrored(one) for one in contact), "impulse": (tap,)})
    assert direction == -1
    for one, other in zip(back["contact"], contact, strict=True):
        np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(back["impulse"][0].positions, -tap.positions)
    assert "counts away from the support: in 2 of 2 runs with contact" in notes[0]


def test_free_runs_tell_no_direction():
    free = swinging(6.0, 0.012, 0.4, 1e-3, crank=0.0165, second=1e-4)
    mounted = run("grazing", free.time, free.positions, turns=free.turns, crank_length=0.0165, gap=0.03)
    assert towards_support([free, mounted]) == (0, "")


def test_runs_that_contradict_each_other_are_refused(contact):
    with pytest.raises(ValueError, match=r"towards falling positions in 1 runs \(contact 6.0\).*turn the sign"):
        oriented({"contact": (contact[0], mirrored(contact[1]))})


@pytest.mark.parametrize("procedure", ["springs", "support"])
def test_a_force_sensor_that_was_pushed_is_turned_and_named(procedure):
    rows = (pulled(-17.0, procedure), pulled(17.0, procedure, "Run #2"), pulled(-17.0, procedure, "Run #3"))
    there, direction, notes = oriented({procedure: rows})
    for one in there[procedure]:
        slope = np.polyfit(one.positions, one.force.values, 1)[0]
        assert slope == pytest.approx(17.0)
    assert direction == 1 and f"{procedure}: the force sensor counts against the displacement in 2 of 3" in notes[0]
    assert "Run #1, Run #3" in notes[0]


def test_springs_and_support_swapped_are_named():
    with pytest.raises(ValueError, match=r"'springs' have a slope of 1.2e\+03 N/m.*of 17 N/m.*swapped: check `file`"):
        oriented({"springs": (pulled(1200.0, reach=0.03),), "support": (pulled(-17.0, "support"),)})


def test_a_photogate_that_counts_backwards_is_named():
    def recording(count):
        sensors = {
            "Angle": (TIME, 1e-3 * np.cos(4 * TIME), "rad"),
            "Turn": (np.arange(8) * 1.4, count * np.arange(8.0), "turns"),
        }
        return Recording.from_runs(
            {
                "Run #1": {
                    name: xr.Dataset({name: ("time", values, {"units": unit})}, {"time": time})
                    for name, (time, values, unit) in sensors.items()
                }
            },
            synthetic=True,
            run_attrs={"Run #1": {"crank_length": 0.0165}},
        )

    known = {"distance_per_turn": 0.0789, "mass": (0.838, 1e-3)}
    ahead, back = (gather({"response": recording(sign)}, apparatus=known) for sign in (1, -1))
    assert ahead.notes == () and "the photogate counts backwards in 1 runs (response Run #1)" in back.notes[0]
    np.testing.assert_array_equal(ahead.runs["response"][0].passages, back.runs["response"][0].passages)
