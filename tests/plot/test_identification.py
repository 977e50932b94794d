"""Pictures of identification and comparison: they draw what they are given, and say what is synthetic."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.identification.compare import compare
from nonsmooth.plot import identification
from nonsmooth.plot.comparison import (
    comparison_diagram,
    comparison_distances,
    comparison_phase_portrait,
    comparison_response,
    comparison_section,
    comparison_time,
)

SYNTHETIC = {"synthetic": "yes"}


def words(ax: Any) -> str:
    """All that is written on the figure of these axes."""
    ax.figure.canvas.draw()
    return " ".join(text.get_text() for text in ax.figure.findobj(mpl.text.Text))


def spring() -> xr.Dataset:
    x = np.concatenate([np.linspace(-0.08, 0.08, 50), np.linspace(0.08, -0.08, 50)])
    pull = np.repeat([1, -1], 50)
    return xr.Dataset(
        {
            "displacement": ("sample", x),
            "force": ("sample", 16.94 * x + 0.01 * pull),
            "pull": ("sample", pull),
            "slope": ("line", [16.94]),
            "intercept": ("line", [0.0]),
            "slope_error": ("line", [0.02]),
            "friction_force": 0.01,
            "friction_force_error": 0.001,
        },
        attrs=SYNTHETIC,
    )


def decay() -> xr.Dataset:
    t = np.arange(2048) / 100
    x = 0.08 * np.exp(-0.52 * t) * np.cos(4.466 * t)
    magnitude, frequency = np.abs(np.fft.rfft(x)) / 1024, np.fft.rfftfreq(2048, 0.01)
    return xr.Dataset(
        {
            "x": ("time", x),
            "fitted": ("time", x),
            "magnitude": ("frequency", magnitude),
            "peak_frequency": 0.711,
            "grid_step": frequency[1],
            "grid_peak": frequency[np.argmax(magnitude)],
            "decay_frequency": 0.7155,
        },
        {"time": t, "frequency": frequency},
        SYNTHETIC,
    )


def amplitudes() -> xr.Dataset:
    omega = np.linspace(3, 6, 12)
    return xr.Dataset(
        {
            "omega": ("run", omega),
            "amplitude": ("run", 0.02 / omega),
            "amplitude_error": ("run", 1e-4 + 0 * omega),
            "joint_amplitude": ("omega_fine", 0.02 / omega),
            "viscous_amplitude": ("omega_fine", 0.021 / omega),
            "c_joint": 0.87,
            "c_joint_error": 0.004,
            "c_viscous": 0.95,
            "c_viscous_error": 0.002,
        },
        {"omega_fine": omega},
        SYNTHETIC,
    )


def circle() -> xr.Dataset:
    omega = np.linspace(3, 6, 40)
    response = 10 / (20.25 - omega**2 + 1.04j * omega)
    over = ("crank_length", "omega_fine")
    return xr.Dataset(
        {
            "omega": ("run", omega),
            "crank": ("run", np.full(40, 0.0165)),
            "real": ("run", response.real),
            "imaginary": ("run", response.imag),
            "fitted_real": (over, response.real[None]),
            "fitted_imaginary": (over, response.imag[None]),
            "omega_0": 4.5,
            "omega_0_error": 0.001,
            "c": 0.87,
            "c_error": 0.01,
        },
        {"omega_fine": omega, "crank_length": [0.0165]},
        SYNTHETIC,
    )


def peaks() -> xr.Dataset:
    t = np.arange(1, 14) * 0.7
    height = 0.08 * np.exp(-0.52 * t)
    return xr.Dataset(
        {
            "peak_time": ("peak", t),
            "peak_height": ("peak", height),
            "log_height": ("peak", np.log(height)),
            "used": ("peak", (t < 7).astype(int)),
            "slope": -0.52,
            "intercept": np.log(0.08),
            "damping_ratio": 0.0075,
            "damping_ratio_error": 0.0001,
            "c": 0.87,
            "c_error": 0.01,
        },
        attrs=SYNTHETIC,
    )


def line() -> xr.Dataset:
    v = np.arange(2.0, 12.0)
    return xr.Dataset(
        {
            "setting": ("run", v, {"units": "V", "long_name": "voltage"}),
            "fitted": ("setting_fine", 1.2 * v - 0.9),
            "reading": ("run", 1.2 * v - 0.9 + 0.01 * np.sin(v), {"units": "rad/s", "long_name": "frequency"}),
            "reading_error": ("run", np.full(10, 0.02)),
            "slope": 1.2,
            "slope_error": 0.004,
        },
        {"setting_fine": v},
        SYNTHETIC,
    )


def touch() -> xr.Dataset:
    s = np.linspace(4.8, 5.5, 15)
    return xr.Dataset(
        {
            "setting": ("run", s, {"units": "rad/s", "long_name": "frequency"}),
            "amplitude": ("run", 0.1 / s),
            "contact": ("run", (s < 5.1).astype(int)),
            "grazing_low": 5.1,
            "grazing_high": 5.15,
            "gap": 0.0195,
            "gap_error": 3e-5,
        },
        attrs=SYNTHETIC,
    )


def shots() -> xr.Dataset:
    t = np.arange(400) / 100
    x = 0.01 * np.cos(11.15 * t)
    return xr.Dataset(
        {
            "x": ("time", x + 1e-5 * np.sin(99 * t)),
            "fitted": ("time", x),
            "segment": ("time", (t / 0.4).astype(int)),
            "in_contact": ("time", (x > 0.009).astype(int)),
            "gap": 0.009,
            "gap_error": 2e-5,
        },
        {"time": t},
        SYNTHETIC,
    )


def flat() -> xr.Dataset:
    value = np.geomspace(0.06, 6, 30)
    return xr.Dataset(
        {"cost": ("value", 3 * np.log(value / 0.6) ** 2), "best": 0.6, "low": 0.2, "high": 1.9},
        {"value": value},
        {**SYNTHETIC, "parameter": "c_s", "units": "N s/m"},
    )


def many() -> xr.Dataset:
    off = np.random.default_rng(0).normal(size=(40, 3))
    over = ("rig", "parameter")
    return xr.Dataset(
        {"truth": (over, 3 + 0 * off), "estimate": (over, 3 + 2 * off), "uncertainty": (over, 2 + 0 * off)},
        {"parameter": ["k", "c", "c_s"]},
        SYNTHETIC,
    )


def fitted_motion() -> xr.Dataset:
    t, column = np.linspace(0, 10, 200), np.zeros(200, dtype=int)
    hit = np.abs(t - 4) < 0.1
    data = xr.Dataset(
        {
            "measured": ("sample", np.sin(t), {"units": "m"}),
            "fitted": ("sample", np.sin(t)),
            "residual": ("sample", np.cos(40 * t)),
            "window": ("sample", column),
            "run": ("sample", column),
            "quantity": ("sample", column),
            "mode": ("sample", (t > 4).astype(int)),
            "place": ("sample", np.where(hit, 2, t > 4)),
        },
        {"time": ("sample", t)},
        SYNTHETIC,
    )
    for name, flags in {
        "run": "run",
        "quantity": "v_x",
        "mode": "free in_contact",
        "place": "free contact hit",
    }.items():
        data[name].attrs["flag_meanings"] = flags
    data["time"].attrs["units"] = "s"
    return data


def test_a_fit_is_drawn_over_time_and_by_place() -> None:
    ax = identification.fit_residuals(fitted_motion())
    assert "fit: in contact" in words(ax) and "at a transition or graze" in words(ax)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time (s)", "$v_{x}$ (m)")
    bars = identification.fit_residuals(fitted_motion(), show="places")
    assert [label.get_text() for label in bars.get_yticklabels()] == ["free", "contact", "hit"]
    assert bars.patches[0].get_width() == pytest.approx(np.sqrt(0.5), rel=0.1)  # rms of a cosine
    assert [list(line.get_xdata()) for line in bars.lines if len(line.get_xdata()) == 2] == [[1.0, 1.0]]  # one sigma
    with pytest.raises(ValueError, match="allowed: 'time', 'places'"):
        identification.fit_residuals(fitted_motion(), show="phase")


def read_amplitudes() -> xr.Dataset:
    at, none = np.linspace(2.0, 3.0, 20), np.zeros(20, dtype=int)
    data = xr.Dataset(
        {
            "measured": ("sample", np.cos(at), {"units": "m", "long_name": "amplitude"}),
            "measured_error": ("sample", np.full(20, 0.1)),
            "fitted": ("sample", np.cos(at)),
            "residual": ("sample", np.cos(9 * at)),
            "used": ("sample", at > 2.2),
            "iterate": ("sample", none),
            "run": ("sample", none),
            "quantity": ("sample", none),
            "omega": ("sample", at, {"units": "rad/s"}),
            "rho": ("sample", np.full(20, 0.3)),
        },
        attrs=SYNTHETIC,
    )
    for name, flags in {"run": "run", "quantity": "x"}.items():
        data[name].attrs["flag_meanings"] = flags
    return data


def test_readings_of_steady_states_are_drawn_over_what_was_changed() -> None:
    axes = identification.steady_readings(read_amplitudes())
    assert axes.get_xlabel() == r"$\omega$ (rad/s)" and axes.get_ylabel().startswith("amplitude of $x$")
    fit = next(line for line in axes.lines if line.get_label() == "fit")
    assert len(fit.get_xdata()) == 16  # those that are not used have none
    assert identification.steady_readings(read_amplitudes(), over="rho").get_xlabel() == r"$\rho$"
    with pytest.raises(ValueError, match="`k` is not a parameter that was set"):
        identification.steady_readings(read_amplitudes(), over="k")


PICTURES = {
    "fit_residuals": fitted_motion,
    "steady_readings": read_amplitudes,
    "force_displacement": spring,
    "impulse_response": decay,
    "impulse_history": decay,
    "amplitude_fit": amplitudes,
    "free_decay": peaks,
    "drop_decay": peaks,
    "calibration": line,
    "grazing": touch,
    "multiple_shooting": shots,
    "profile": flat,
    "coverage": many,
    "nyquist": circle,
}


# Pictures of what was found in measured recordings: tests/plot/test_recorded.py.
RECORDED = {"backbone", "forced_responses", "modal_damping", "restitution", "steady_amplitude", "steady_phase", "toss"}


def test_every_picture_is_tested() -> None:
    assert set(PICTURES) | RECORDED == set(identification.__all__)


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_says_that_it_is_synthetic(name: str) -> None:
    assert "synthetic" in words(getattr(identification, name)(PICTURES[name]()))


@pytest.mark.parametrize("name", PICTURES)
def test_data_of_another_procedure_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"this picture needs .*hold nothing_of_use"):
        getattr(identification, name)(xr.Dataset({"nothing_of_use": 1.0}))


def test_measured_data_are_not_called_synthetic() -> None:
    assert "synthetic" not in words(identification.force_displacement(spring().assign_attrs(synthetic="no")))


def test_numbers_are_written_with_their_errors() -> None:
    written = words(identification.force_displacement(spring()))
    assert "16.940 ± 0.020 N/m" in written and "10.0 ± 1.0 mN" in written


def test_the_grid_of_the_transform_is_shown() -> None:
    """A record of 20.48 s has lines 0.0488 Hz apart: 0.7324 Hz is the paper's 4.60 rad/s."""
    assert "largest line 0.7324 Hz, half a step to each side" in words(identification.impulse_response(decay()))


def test_errors_of_rigs_are_drawn_in_units_of_their_uncertainties() -> None:
    off, ax = np.random.default_rng(0).normal(size=(40, 3)), identification.coverage(many())
    heights = np.concatenate([line.get_ydata() for line in ax.lines if line.get_marker() == "."])
    assert np.sort(heights) == pytest.approx(np.sort(off.ravel()))


def test_a_calibration_says_where_its_line_begins() -> None:
    written = words(identification.calibration(line().assign(intercept=-0.9, intercept_error=0.01)))
    assert "from 0.75 V on" in written and "1.2000 ± 0.0040 rad/s per V" in written


@pytest.mark.usefixtures("window")
@pytest.mark.parametrize("top", [1.0, 10.0, 1000.0])
def test_a_profile_is_shown_up_to_five_times_its_bound(top: float) -> None:
    data = flat()
    data["cost"] *= top / data["cost"].max()
    high = identification.profile(data).get_ylim()[1]
    assert max(3.84, min(top, 5 * 3.84)) < high < 10 * 3.84


def test_lengths_are_drawn_in_millimetres() -> None:
    length = {"units": "m", "long_name": "crank length"}
    data = line().assign(setting=("run", np.arange(2.0, 12.0) / 1e3, length))
    ax = identification.calibration(data.assign_coords(setting_fine=data["setting"].values))
    assert ax.get_xlabel() == "crank length (mm)" and ax.lines[0].get_xdata()[0] == pytest.approx(2e-3)


def test_one_slope_of_many_pulls_is_one_number() -> None:
    lines = xr.Dataset(
        {"slope": ("line", [16.94] * 12), "intercept": ("line", [0.0] * 12), "slope_error": ("line", [0.02] * 12)}
    )
    data = spring().drop_vars(["slope", "intercept", "slope_error"]).merge(lines, combine_attrs="no_conflicts")
    written = words(identification.force_displacement(data))
    assert "slope 16.940 ± 0.020 N/m" in written and "12 lines" not in written


def motion() -> xr.Dataset:
    system = ns.models.discontinuous_support(g=0.0009, rho=0.33, omega=11.15)
    run = ns.simulate(system, periods=60, transient=200, samples=60 * 50 + 1)
    measured = xr.Dataset({"u": run["u"], "phase": ("time", run["time"].values * 11.15 / (2 * np.pi))}, attrs=SYNTHETIC)
    return compare(measured, system, noise=[1e-5, 1e-4], draws=0)


def test_pictures_of_a_motion() -> None:
    result = motion()
    for draw in (comparison_time, comparison_phase_portrait, comparison_section, comparison_distances):
        ax = draw(result)
        assert "synthetic" in words(ax)
        check_legend(ax)
    with pytest.raises(ValueError, match="needs a comparison of a response; this is a comparison of a motion"):
        comparison_response(result)
    with pytest.raises(ValueError, match="no result of compare"):
        comparison_diagram(xr.Dataset())


def check_legend(ax: Any) -> None:
    """However long its words, it stays in the figure and leaves the axes three quarters of its breadth."""
    ax.figure.draw_without_rendering()
    if (legend := ax.get_legend()) is not None:
        box, whole = legend.get_window_extent(), ax.figure.bbox
        assert whole.x0 <= box.x0 and box.x1 <= whole.x1
        assert ax.get_window_extent().width > 0.75 * whole.width


def entries(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def strip_of(ax: Any) -> Any:
    """The axes of the residuals at the foot of a picture."""
    (strip,) = [one for one in ax.figure.axes if one is not ax]
    return strip


def test_the_colours_of_residuals_stand_in_the_legend() -> None:
    """They are those of the way the car moved: forces 10 mN above the mean line where it moved away, below it back."""
    ax = identification.force_displacement(spring())
    shown = dict(zip(entries(ax), ax.get_legend().legend_handles, strict=True))
    clouds = {line.get_color(): line.get_ydata() for line in strip_of(ax).lines if len(line.get_xdata()) > 2}
    np.testing.assert_allclose(clouds[shown["residual, displacement growing"].get_color()], 0.01, atol=1e-12)
    np.testing.assert_allclose(clouds[shown["residual, displacement falling"].get_color()], -0.01, atol=1e-12)
    assert strip_of(ax).get_ylabel() == "residual (mN)"


def test_two_fits_of_one_curve_are_told_apart_by_what_they_leave() -> None:
    ax = identification.amplitude_fit(amplitudes())
    omega = amplitudes()["omega"].values
    left = {line.get_color(): line.get_ydata() for line in strip_of(ax).lines if len(line.get_xdata()) > 2}
    shown = dict(zip(entries(ax), ax.get_legend().legend_handles, strict=True))
    np.testing.assert_allclose(left[shown["residual, $c$ beside dry friction"].get_color()], 0.0, atol=1e-15)
    np.testing.assert_allclose(left[shown["residual, $c$ alone"].get_color()], -0.001 / omega, rtol=1e-9)


def test_a_calibration_ends_at_zero_and_shows_its_band() -> None:
    """omega = 1.2 V - 0.9 is zero at 0.75 V: a motor does not turn backwards. The band shows where residuals do."""
    fine = np.linspace(0, 12, 49)
    fit = 1.2 * fine - 0.9
    data = (
        line()
        .drop_vars(["fitted", "setting_fine"])
        .assign(
            fitted=("setting_fine", fit),
            fitted_low=("setting_fine", fit - 0.02),
            fitted_high=("setting_fine", fit + 0.02),
        )
    )
    ax = identification.calibration(data.assign_coords(setting_fine=fine))
    assert ax.lines[0].get_ydata().min() >= 0 and ax.lines[0].get_xdata()[0] == pytest.approx(0.75, abs=0.26)
    (band,) = strip_of(ax).collections[:1]
    heights = band.get_paths()[0].vertices[:, 1]
    low, high = strip_of(ax).get_ylim()
    assert np.ptp(heights) == pytest.approx(0.04) and np.ptp(heights) > 0.05 * (high - low)
    assert any("95 % band" in one for one in entries(ax))


def test_a_decay_is_joined() -> None:
    """Unjoined samples of a fast oscillation make patterns that are not there."""
    shown = identification.impulse_history(decay()).lines[0]
    assert shown.get_linestyle() == "-" and shown.get_marker() in ("None", None, "")


def test_a_spectrum_fills_its_axes() -> None:
    ax = identification.impulse_response(decay())
    heights = np.concatenate([line.get_ydata() for line in ax.lines if line.get_marker() == "o"])
    assert heights.max() > 0.9 * ax.get_ylim()[1]


def diagram() -> xr.Dataset:
    """Two values, and a flip: theory at 0.42, the record at 0.46 and with its delay taken out at 0.40."""
    rho = np.array([0.3, 0.5])
    return xr.Dataset(
        {
            "theory_section": (("rho", "direction", "iterate", "state"), np.zeros((2, 1, 2, 2))),
            "measured_rho": ("sample", rho),
            "measured_section": (("sample", "state"), np.zeros((2, 2))),
            "theory_flip": ("flip", [0.42]),
            "measured_flip": ("flip", [0.40]),
            "measured_flip_read": ("flip", [0.46]),
            "measured_flip_error": ("flip", [0.01]),
        },
        {
            "rho": ("rho", rho, {"units": "N"}),
            "state": ["x", "v"],
            "state_unit": ("state", ["m", "m/s"]),
            "direction": ["up"],
            "flip": ["1-2"],
        },
        SYNTHETIC | {"comparison": "diagram"},
    )


def test_a_delayed_flip_shows_as_read_and_as_corrected() -> None:
    ax = comparison_diagram(diagram(), y="v")
    by_name = {one.get_label(): one for one in ax.lines}
    assert by_name["flip, theory"].get_xdata()[0] == 0.42
    assert by_name["flip, virtual rig (synthetic)"].get_xdata()[0] == 0.46
    (arrow,) = [text for text in ax.texts if text.arrow_patch]
    assert (arrow.xyann[0], arrow.xy[0]) == (0.46, 0.40)
    assert {"theory", "virtual rig (synthetic)", "flip, virtual rig (synthetic), delay taken out"} <= set(entries(ax))
    assert max(np.abs(ax.get_ylim())) < 0.1  # that of the sections: marks at the top stretch no axis
    check_legend(ax)


def test_jumps_and_their_differences_stand_in_the_legend() -> None:
    omega = np.array([3.0, 4.0, 5.0])
    result = xr.Dataset(
        {
            "theory_amplitude": (("omega", "direction"), np.full((3, 1), 0.01)),
            "measured_omega": ("run", omega),
            "measured_direction": ("run", ["up"] * 3),
            "measured_amplitude": ("run", np.full(3, 0.01)),
            "measured_amplitude_error": ("run", np.full(3, 1e-4)),
            "jump_direction": ("jump", ["up"] * 2),
            "measured_jump": ("jump", [4.1] * 2),
            "theory_jump": ("jump", [4.05] * 2),
        },
        {
            "omega": ("omega", omega, {"units": "rad/s"}),
            "direction": ["up"],
            "state": ["x"],
            "state_unit": ("state", ["m"]),
        },
        SYNTHETIC | {"comparison": "response"},
    )
    ax = comparison_response(result)
    ax.figure.draw_without_rendering()
    first, second = [text.get_window_extent() for text in ax.texts if text.get_text() == "\N{MINUS SIGN}0.050"]
    assert not first.overlaps(second)  # of two jumps at one place
    assert {
        "jump, theory",
        "jump, virtual rig (synthetic)",
        "numbers: theory less measured (rad/s)",
    } <= set(entries(ax))
    assert ax.get_ylabel().endswith("(mm)")
    check_legend(ax)
