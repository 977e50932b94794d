"""Dims of results, and that no array ends up under another's label."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from nonsmooth.results import schema
from nonsmooth.results.labels import STATUSES, Labels, QuantityLabel, by_code, by_name


def arrays(directions: int, starts: int, points: int, keep: int = 3) -> dict[str, np.ndarray]:
    lead = (directions, starts, points)
    d, s, p = np.meshgrid(*(np.arange(k) for k in lead), indexing="ij")
    base = 1000.0 * d + 100.0 * s + p
    section = base[..., None, None] + np.arange(keep)[:, None] / 10 + np.array([0.0, 0.5])
    return {"section": section, "maximum": section.max(axis=-2), "status": np.zeros(lead)}


def build(labels: Labels, directions: tuple[str, ...], starts: int, squeeze: tuple[str, ...]) -> xr.Dataset:
    return schema.sweep(
        labels,
        {"nonsmooth": "{}"},
        "rho",
        [0.2, 0.3, 0.4, 0.5],
        arrays(len(directions), starts, 4),
        directions=directions,
        starts=np.arange(2.0 * starts).reshape(starts, 2),
        squeeze=squeeze,
    )


def test_a_dim_exists_only_where_the_argument_was_a_sequence(labels: Labels) -> None:
    scalar = build(labels, ("up",), 1, ("direction", "start"))
    assert scalar["section"].dims == ("rho", "iterate", "state")
    assert scalar["direction"].item() == "up"
    assert scalar["start_state"].dims == ("state",)
    both = build(labels, ("up", "down"), 1, ("start",))
    assert both["section"].dims == ("rho", "direction", "iterate", "state")
    one_in_a_list = build(labels, ("none",), 1, ("direction",))
    assert one_in_a_list["section"].dims == ("rho", "start", "iterate", "state")
    assert one_in_a_list["start_state"].dims == ("start", "state")


def test_every_entry_stays_under_its_label(labels: Labels) -> None:
    result = build(labels, ("up", "down"), 3, ())
    entry = result["section"].sel(rho=0.4, direction="down", start=1, state="v").isel(iterate=2)
    assert entry.item() == pytest.approx(1000 + 100 + 2 + 0.2 + 0.5, abs=1e-12)
    np.testing.assert_array_equal(result["start_state"].sel(start=2), [4, 5])


def test_coordinates_carry_units_and_parameters(swept: xr.Dataset) -> None:
    assert swept["rho"].attrs["units"] == "N"
    assert swept["g"].item() == 0.5
    assert swept["g"].attrs["units"] == "m"
    assert swept["state_unit"].values.tolist() == ["m", "m/s"]
    assert swept["clearance"].sel(indicator="separation", direction="down", rho=0.2).item() == -1000
    assert swept["contact_force_maximum"].sel(direction="up", rho=0.25).item() == 1.5


def test_a_sweep_refuses_an_array_it_does_not_know(labels: Labels) -> None:
    with pytest.raises(ValueError, match="no such array in a sweep"):
        schema.sweep(labels, {}, "rho", [1.0], {"colour": np.zeros((1, 1, 1))}, directions=("up",), starts=[[0, 0]])


def test_results_own_their_numbers(labels: Labels) -> None:
    given = arrays(1, 1, 4)
    result = schema.sweep(labels, {}, "rho", np.arange(4.0), given, directions=("up",), starts=np.zeros((1, 2)))
    given["section"][:] = -1
    assert result["section"].min() >= 0


def test_what_is_done_to_one_result_does_not_reach_the_next(labels: Labels) -> None:
    first = build(labels, ("up",), 1, ())
    for state in (first["state"], first.coords["state"], first.variables["state"]):
        state.attrs["note"] = "mine"
        if state.values.flags.writeable:  # a copy, which pandas 3.1 makes of names
            state.values[0] = "y"
    second = build(labels, ("up",), 1, ())
    assert second["state"].attrs == {"long_name": "state"}
    assert list(second["state"].values) == list(labels.states)


def test_the_response_adds_amplitude_and_jumps(responded: xr.Dataset) -> None:
    assert responded["amplitude"].dims == responded["maximum"].dims == ("omega", "direction", "state")
    xr.testing.assert_allclose(responded["amplitude"], responded["maximum"])
    assert responded["jump_value"].attrs["units"] == "rad/s"
    assert responded["jump_direction"].values.tolist() == ["up", "down"]


def test_a_trajectory_has_its_crossings_and_outputs(trajectory: xr.Dataset) -> None:
    assert trajectory["u"].dims == ("time", "state")
    assert trajectory.sizes["touch"] == 0
    assert trajectory["mode"].attrs["flag_meanings"] == "free contact"
    assert trajectory["crossing_transition"].attrs["flag_meanings"] == "free_to_contact contact_to_free"
    assert trajectory["contact_force"].attrs["units"] == "N"
    np.testing.assert_array_equal(np.bincount(trajectory["segment"]) > 0, True)


def test_section_points_from_one_start_have_no_start_dim(labels: Labels) -> None:
    one = schema.section_points(
        labels,
        {},
        section=np.zeros((1, 5, 2)),
        time=np.arange(5.0)[None],
        mode=np.zeros((1, 5)),
        status=[0],
        starts=[[0.0, 1.0]],
        squeeze=("start",),
    )
    assert one["section"].dims == ("iterate", "state")
    assert one["status"].dims == ()
    assert one["start_state"].values.tolist() == [0, 1]


def test_two_transitions_between_the_same_modes_are_told_apart() -> None:
    labels = Labels("s", {"x": QuantityLabel()}, {}, ("a", "b"), ((0, 1), (0, 1), (1, 0)), ("h",))
    assert labels.transition_labels == ("a_to_b_1", "a_to_b_2", "b_to_a")


def test_every_status_says_what_to_do() -> None:
    assert [status.code for status in STATUSES] == list(range(len(STATUSES)))
    for status in STATUSES:
        assert by_code(status.code) is by_name(status.name) is status
        assert status.name == "ok" or (status.happened.endswith(".") and status.remedy.endswith("."))
