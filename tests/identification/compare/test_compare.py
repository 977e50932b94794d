"""compare() on records made from known systems: what is measured is what was put in."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.identification.compare import compare

NOISE = np.array([1e-5, 3e-4])
MODEL = ns.models.discontinuous_support()
RUN = {"rho": 0.33, "omega": 11.15}


def record(system: ns.System, seconds: float = 120.0, seed: int = 0) -> xr.Dataset:
    """A motion sampled at 100 Hz with noise, as a smoother would hand it on."""
    begin = 200 * system.period()
    time = begin + 0.0037 + np.arange(int(seconds * 100)) / 100
    run = ns.simulate(system, duration=time[-1] + 0.1, samples=time)
    at = np.searchsorted(run["time"].values, time)
    u = run["u"].values[at] + NOISE * np.random.default_rng(seed).normal(size=(len(time), 2))
    omega = system.values["omega"]
    return xr.Dataset(
        {
            "u": (("time", "state"), u),
            "u_error": (("time", "state"), np.tile(NOISE, (len(time), 1))),
            "phase": ("time", time * omega / (2 * np.pi)),
        },
        {"time": time, "state": ["x", "v"], "state_unit": ("state", ["m", "m/s"])},
        {"synthetic": "yes", "title": "a test"},
    )


class Known(dict):
    """Values with a covariance, as a ParameterSet has them."""

    def __init__(self, **sizes: tuple[float, float]) -> None:
        super().__init__({name: value for name, (value, _) in sizes.items()})
        matrix = np.diag([error**2 for _, error in sizes.values()])
        self.covariance = xr.DataArray(matrix, dims=["parameter", "parameter_"], coords={"parameter": list(sizes)})


@pytest.mark.parametrize(("g", "number"), [(-0.0012, 1), (0.0009, 2), (0.0014, 3)])
def test_the_same_system_is_found_again(g: float, number: int) -> None:
    """Periods of Fig. 14 of Savi et al. (2007); the distance of the mean orbit is that of its noise."""
    found = compare(record(MODEL.with_parameters(RUN, g=g)), MODEL, settings={**RUN, "g": g})
    assert int(found["measured_period_number"]) == number
    assert int(found["period_agrees"]) == 1 == int(found["period_coexists"])
    assert float(found["orbit_distance"]) < 5e-3
    assert abs(float(found["phase_shift"])) < 1e-3
    assert found.sizes["phase"] == 128 * number


def test_a_free_motion_has_its_closed_form() -> None:
    """The amplitude is (rho/m) / (w0^2 - w^2 + i c w/m): another c moves the orbit by a known distance."""
    free = {"rho": 0.14, "omega": 4.0, "g": 1.0}
    c = 0.95

    def amplitude(c: float) -> complex:
        return (0.14 / 0.838) / (2 * 8.47 / 0.838 - 4.0**2 + 1j * c * 4.0 / 0.838)

    found = compare(record(MODEL.with_parameters(free), 60.0), MODEL.with_parameters(c=c), settings=free)
    a, b = amplitude(0.87), amplitude(c)
    size = np.sqrt((abs(a) ** 2 + abs(b) ** 2) / 2)
    assert float(found["orbit_distance"]) == pytest.approx(abs(a - b) / size, abs=1e-3)
    assert float(found["orbit_distance_any_phase"]) == pytest.approx(abs(abs(a) - abs(b)) / size, abs=1e-3)
    lead = (np.angle(b) - np.angle(a)) / (2 * np.pi)
    assert float(found["phase_shift"]) == pytest.approx(lead, abs=2e-4)


def test_chaos_of_the_same_system_is_within_its_own_halves() -> None:
    settings = {**RUN, "g": 0.0018}
    motion = record(MODEL.with_parameters(settings), 170.0)
    found = compare(motion, MODEL, settings=settings, section_phase=[0.0, 0.25])
    assert found["energy_ratio"].dims == ("section_phase",)
    assert int(found["measured_period_number"]) == 0 == int(found["theory_period_number"])
    assert (found["energy_ratio"] < 1.5).all()
    assert np.isnan(float(found["orbit_distance"]))
    # Where the motion is shown it begins with the measurement.
    first = [found[f"{side}_orbit"].values[0] for side in ("measured", "theory")]
    np.testing.assert_allclose(first[0], first[1], atol=1e-12)
    other = compare(motion, MODEL, settings={**settings, "g": 0.0014})
    assert float(other["energy_ratio"]) > 2 * float(found["energy_ratio"].max())


def test_the_band_is_the_spread_of_the_prediction() -> None:
    """For a free motion x depends on the draw through a closed form; its band is that of the drawn amplitudes."""
    free = {"rho": 0.14, "omega": 6.5, "g": 1.0}
    known = Known(k=(8.47, 0.08))
    found = compare(record(MODEL.with_parameters(free), 30.0), MODEL, parameters=known, settings=free, draws=40, seed=3)
    drawn = found["drawn_k"].values
    response = (0.14 / 0.838) / (2 * drawn / 0.838 - 6.5**2 + 1j * 0.87 * 6.5 / 0.838)
    x = (response[:, None] * np.exp(2j * np.pi * found["phase"].values)).real
    low, high = np.quantile(x, [0.025, 0.975], axis=0)
    np.testing.assert_allclose(found["theory_low"].sel(state="x").values, low, atol=1e-9)
    np.testing.assert_allclose(found["theory_high"].sel(state="x").values, high, atol=1e-9)
    assert float(found["band_share"]) == 1.0
    again = compare(record(MODEL.with_parameters(free), 30.0), MODEL, parameters=known, settings=free, draws=40, seed=3)
    xr.testing.assert_identical(found, again)


def test_noise_of_the_recording_leaves_the_true_motion_inside_the_band() -> None:
    """The band of parameters that are known well has no width; two standard errors of the mean hold 95 % of it."""
    free = {"rho": 0.14, "omega": 6.5, "g": 1.0}
    motion = record(MODEL.with_parameters(free), 30.0)
    for k, least, most in ((8.47, 0.9, 1.0), (8.8, 0.0, 0.5)):
        found = compare(motion, MODEL, settings={**free, "k": (k, 1e-9)}, draws=5, grid=64)
        assert ((least <= found["inside_band"]) & (found["inside_band"] <= most)).all()


def test_a_setting_that_follows_from_a_parameter_is_uncertain_with_it() -> None:
    settings = {"rho": lambda p: p["k"] * 0.0165, "omega": 4.0, "g": 1.0}
    motion = record(MODEL.with_parameters(rho=8.47 * 0.0165, omega=4.0, g=1.0), 30.0)
    found = compare(motion, MODEL, parameters=Known(k=(8.47, 0.05)), settings=settings, draws=10)
    np.testing.assert_allclose(found["drawn_rho"], 0.0165 * found["drawn_k"], rtol=1e-12)


def test_a_result_at_hand_is_a_theory_too() -> None:
    settings = {**RUN, "g": 0.0009}
    system = MODEL.with_parameters(settings)
    run = ns.simulate(system, periods=60, transient=300)
    found = compare(record(system), run)
    assert int(found["theory_period_number"]) == 2 and float(found["orbit_distance"]) < 5e-3
    points = ns.poincare(system, n=100, transient=300)
    assert int(compare(record(system), points)["period_agrees"]) == 1
    with pytest.raises(ValueError, match="change a System"):
        compare(record(system), run, settings={"g": 0.0})


def test_a_motion_without_a_period_is_shown_over_its_last_periods() -> None:
    """x'' + 2 x = cos t from (3/2, 0) is x = cos(sqrt(2) t) / 2 + cos t; of 60 periods the last 16 are kept."""
    modes = {"free": lambda t, u, p: (u.v, -2.0 * u.x + np.cos(p.omega * t))}
    system = ns.System(states=["x", "v"], parameters={"omega": 1.0}, modes=modes)
    run = ns.simulate(system, periods=60, start={"x": 1.5}, samples=60 * 64 + 1)
    measured = run.assign(phase=("time", run["time"].values / (2 * np.pi)))
    found = compare(measured, run, noise={"x": 1e-6, "v": 1e-6})
    assert int(found["theory_period_number"]) == int(found["measured_period_number"]) == 0
    for name in ("theory", "measured"):
        t = 2 * np.pi * (44 + found[f"{name}_phase"].values)
        x, v = 0.5 * np.cos(np.sqrt(2) * t) + np.cos(t), -np.sqrt(0.5) * np.sin(np.sqrt(2) * t) - np.sin(t)
        assert found[f"{name}_orbit"].values == pytest.approx(np.stack([x, v], axis=-1), abs=1e-5)


def test_a_response_with_its_jumps(tmp_path: Path) -> None:
    """Fig. 9: jumps of the model at 5.8 (rising) and 5.16 (falling), from steps as coarse as an experiment's."""
    settings = {"rho": 0.14, "g": 0.02}
    system = MODEL.with_parameters(settings)
    swept = ns.frequency_response(system, np.arange(4.5, 6.5, 0.05), transient=200, keep=17, progress=False)
    runs = swept["amplitude"].sel(state="x").stack(run=("direction", "omega")).reset_index("run")
    measured = xr.Dataset(
        {"amplitude": ("run", runs.values), "amplitude_error": ("run", np.full(runs.size, 1e-5))},
        {"omega": ("run", runs["omega"].values, {"units": "rad/s"}), "direction": ("run", runs["direction"].values)},
    )
    found = compare(measured, MODEL, settings=settings, transient=200)
    assert np.abs(found["relative_difference"]).max() < 1e-6
    amplitudes = ("measured_amplitude", "measured_amplitude_error", "theory_amplitude", "theory_at_run")
    assert [found[name].attrs["units"] for name in amplitudes] == ["m"] * 4
    assert found["jump_direction"].values.tolist() == ["up", "down"]
    assert (np.abs(found["jump_difference"]) <= found["jump_tolerance"]).all()
    ns.save(found, tmp_path / "response.nc")
    xr.testing.assert_identical(ns.load(tmp_path / "response.nc"), found)
    double = measured.assign(amplitude=2.0 * measured["amplitude"])
    assert compare(double, swept)["relative_difference"].values == pytest.approx(-0.5, abs=1e-12)  # it is given


@pytest.mark.parametrize("frequency", [6.5, 5.4])
def test_a_periodic_motion_that_is_exact_is_compared_in_units_of_the_noise(frequency: float) -> None:
    """Its section points part by rounding only. Of a motion beside it the distance is that of the points."""
    system = MODEL.with_parameters(rho=0.14, g=0.02, omega=frequency)
    run = ns.simulate(system, periods=60, transient=300, samples=60 * 64 + 1)
    run = run.assign(phase=("time", run["time"].values * frequency / (2.0 * np.pi)))
    noise = {"x": 1e-6, "v": 2e-6}
    same, other = (compare(run, one, noise=noise) for one in (system, system.with_parameters(rho=0.15)))
    assert same["section_scale"].values == pytest.approx([1e-6, 2e-6], rel=1e-12)
    assert float(same["wasserstein_distance_joint"].max()) < 3.0  # of points without noise and points with it
    apart = other["theory_section"].values[0] - run["u"].values[0]
    far = float(other["wasserstein_distance_joint"].max())
    assert far == pytest.approx(np.linalg.norm(apart / [1e-6, 2e-6]), rel=1e-3) and far > 100.0


def test_a_diagram_with_its_flips(tmp_path: Path) -> None:
    """Steady runs around the first flip of Fig. 11: measured and predicted flips are one within a step."""
    settings = {"omega": 3.69, "g": -0.0045}
    system = MODEL.with_parameters(settings)
    values = np.linspace(0.38, 0.43, 21)
    swept = ns.sweep(system, "rho", values, direction="down", keep=40, progress=False)
    section = swept["section"].values
    noise = NOISE * np.random.default_rng(0).normal(size=section.shape)
    measured = xr.Dataset(
        {"section": (("rho", "iterate", "state"), section + noise)},
        {"rho": ("rho", values, {"units": "N"}), "state": ["x", "v"]},
    )
    found = compare(measured, MODEL, settings=settings, noise={"x": NOISE[0], "v": NOISE[1]}, values=values)
    assert found["flip"].values.tolist() == ["1-2"]
    assert abs(float(found["flip_relative_difference"][0])) < 0.01
    ns.save(found, tmp_path / "diagram.zarr")
    xr.testing.assert_identical(ns.load(tmp_path / "diagram.zarr"), found)


def test_a_comparison_is_kept_whole(tmp_path: Path) -> None:
    settings = {**RUN, "g": 0.0009}
    found = compare(record(MODEL.with_parameters(settings), 40.0), MODEL, settings=settings, draws=3)
    assert found.attrs["synthetic"] == "yes"
    ns.save(found, tmp_path / "motion.nc")
    xr.testing.assert_identical(ns.load(tmp_path / "motion.nc"), found)


def test_what_cannot_be_compared_is_refused() -> None:
    motion = record(MODEL.with_parameters(RUN, g=0.0009), 20.0)
    with pytest.raises(TypeError, match="a recording is a Recording, .* not 'recording.csv'"):
        compare("recording.csv", MODEL)
    with pytest.raises(TypeError, match="a recording is laid over a System.*motion_of.*measured_motion"):
        compare({"x": ([0.0], [0.0])}, motion)
    with pytest.raises(TypeError, match="theory must be ns.System.* or xarray.Dataset.*, not 3"):
        compare(motion, 3)
    with pytest.raises(ValueError, match="standard error of the measured states is not known"):
        compare(motion.drop_vars("u_error"), MODEL)
    with pytest.raises(ValueError, match="needs `phase`"):
        compare(motion.drop_vars("phase"), MODEL)
    with pytest.raises(ValueError, match="nothing here can be compared.*channels="):
        compare(motion.drop_vars("u"), MODEL)
    with pytest.raises(ValueError, match="`y` is not a state.*nearest|`y` is not a state"):
        compare(motion, MODEL, noise={"y": 1.0})
    with pytest.raises(ValueError, match="level = 95"):
        compare(motion, MODEL, level=95)
    with pytest.raises(ValueError, match="states are a, b"):
        compare(motion.assign_coords(state=["a", "b"]), MODEL)
    valve = ns.models.relief_valve()
    states = list(valve.states)
    u = np.tile(motion["u"].values[:, :1], (1, len(states)))
    unforced = xr.Dataset({"u": (("time", "state"), u), "phase": motion["phase"]}, {"state": states})
    with pytest.raises(ValueError, match="no forcing period"):
        compare(unforced, valve, noise=np.ones(len(states)))


@pytest.mark.parametrize(
    ("rig", "theory", "words"),
    [
        (3.56, 3.6, "on either side of a flip: the predicted motion is doubled"),
        (3.6, 3.56, "on either side of a flip: the measured motion is doubled"),
        (3.6, 3.6, "the same"),
        (3.6, 2.0, "others"),
    ],
)
def test_a_rig_and_a_theory_on_either_side_of_a_flip(rig: float, theory: float, words: str) -> None:
    """The motion of period 1 doubles between 3.56 and 3.58 rad/s; at 2 rad/s the mass does not reach the support."""
    settings = {"rho": 0.14, "g": 0.02}
    measured = record(MODEL.with_parameters(settings, omega=rig))
    found = compare(measured, MODEL, settings={**settings, "omega": theory})
    assert str(found["period_relation"].values).startswith(words)


@pytest.mark.parametrize(
    ("rig", "theory", "words"),
    [
        (0.5, 0.5, "none found in either"),
        (0.5, 0.02, "found in the predicted motion alone"),
        (0.02, 0.5, "found in the measured motion alone"),
    ],
)
def test_motions_without_a_period_are_not_of_the_same_one(rig: float, theory: float, words: str) -> None:
    """The forced mass is chaotic at its stop; with 0.02 it does not reach it."""
    hammer = ns.models.impact_oscillator(omega=2.6, e=0.9, d=0.1)
    cloud = ns.poincare(hammer.with_parameters(A=rig), n=60, transient=500).isel(start=0, missing_dims="ignore")
    measured = cloud[["section"]].assign_coords(state=["x", "v"])
    found = compare(measured, hammer, settings={"A": theory}, noise=[1e-4, 1e-4])
    assert str(found["period_relation"].values) == words


def test_a_table_of_amplitudes_is_a_response() -> None:
    """As ``fit`` takes it: a mapping, or a DataFrame; of a linear oscillator in closed form."""
    import pandas as pd

    system = ns.mechanical(
        1.0, 0.15, 9.0, parameters={"omega": 2.0}, coordinates=["q"], forcing={"q": lambda t, p: np.cos(p.omega * t)}
    )
    omega = np.array([2.0, 3.1, 2.6, 4.0])
    table = {"omega": omega, "amplitude": 1.1 / np.hypot(9 - omega**2, 0.15 * omega), "direction": ["up", "down"] * 2}
    for measured in (table, pd.DataFrame(table), pd.DataFrame(table).set_index("omega")):
        found = compare(measured, system)
        np.testing.assert_allclose(found["relative_difference"], 1 / 1.1 - 1, atol=1e-9)
        assert found["measured_omega"].values.tolist() == [3.1, 4.0, 2.0, 2.6]
    with pytest.raises(ValueError, match="one number of each kind"):
        compare({**table, "amplitude": [1.0]}, system)


@pytest.mark.parametrize("well", [1.0, -1.0])
def test_of_two_motions_the_one_nearest_to_the_measurement_is_taken(well: float) -> None:
    """x'' + 0.2 x' + x -+ 1 = 0.1 cos 2t: about +-1 swings the real part of 0.1 exp(2it) / (1 - 4 + 0.4 i)."""

    def about(place: float) -> Any:
        return lambda t, u, p: (u.v, 0.1 * np.cos(2.0 * t) - (u.x - place) - p.c * u.v)

    system = ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={"c": 0.2},
        modes={"left": about(-1.0), "right": about(1.0)},
        indicators={"side": lambda t, u, p: u.x},
        transitions=[ns.Transition("left", "right", when="side > 0"), ns.Transition("right", "left", when="side < 0")],
    )
    t, size = 0.01 + np.arange(0, 160.0, 0.05), np.array([1e-3, 1e-3])
    swing = 0.1 / (1 - 4 + 0.4j) * np.exp(2j * t)
    noise = size * np.random.default_rng(1).normal(size=(len(t), 2))
    u = np.column_stack([well + swing.real, (2j * swing).real]) + noise
    measured = xr.Dataset(
        {"u": (("time", "state"), u), "u_error": (("time", "state"), u * 0 + size), "phase": ("time", t / np.pi)},
        {"time": t, "state": ["x", "v"], "state_unit": ("state", ["m", "m/s"])},
    )
    known = Known(c=(0.2, 1e-9))
    found = compare(measured, system, parameters=known, start=[[1.0, 0.0], [-1.0, 0.0]], transient=100, draws=3)
    assert found["theory_orbit"].sel(state="x").mean().item() == pytest.approx(well, abs=1e-6)
    assert float(found["orbit_distance"]) < 5e-3
    # A drawn point without the noise of the measured ones would be at 0.86 of their spread (a normal law in the plane).
    assert float(found["draw_energy_distance"].max()) < 0.4


@pytest.mark.parametrize(("what", "theirs", "ours"), [("x", "mm", "m"), ("w", "Hz", "rad/s")])
def test_a_unit_that_differs_is_said(what: str, theirs: str, ours: str) -> None:
    """Nothing is converted: an amplitude in mm, or a frequency in Hz, is compared and fitted as it stands, and a
    warning says so; of a response in the model's own units there is none. The response is that in closed form."""
    system = ns.mechanical(
        1.0,
        lambda p: p.c,
        9.0,
        parameters={"c": (0.15, "kg/s"), "w": (2.0, "rad/s")},
        coordinates={"x": "m"},
        forcing={"x": lambda t, p: np.cos(p.w * t)},
    )
    w = np.array([2.0, 2.6, 3.1, 4.0])
    runs = {"amplitude": ("run", 1 / np.hypot(9 - w**2, 0.15 * w)), "w": ("run", w, {"units": "rad/s"})}
    measured = xr.Dataset(runs, {"state": ["x"]})
    measured = measured.assign(amplitude=measured["amplitude"].expand_dims("state", -1).assign_attrs(units="m"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        assert np.abs(compare(measured, system, parameter="w")["relative_difference"]).max() < 1e-9
    measured["amplitude" if what == "x" else what].attrs["units"] = theirs
    said = f"measured '{what}' is in {theirs}, the model in {ours}, and numbers are compared as they are"
    with pytest.warns(UserWarning, match=said):
        compare(measured, system, parameter="w")
    with pytest.warns(UserWarning, match=said):
        assert ns.fit(system, measured, ["c"], measured="x")["c"] == pytest.approx(0.15, rel=1e-6)


def test_a_mass_that_stands_still_adds_its_noise() -> None:
    """Friction holds the second mass; of N passes its mean is off by 1 / sqrt(N) of its noise, in two of four states:
    the distance is sqrt(2 / (4 N)). In units of the noise's own mean it was 1 for any N."""
    rig = ns.mechanical(
        np.eye(2),
        0.2 * np.eye(2),
        np.eye(2) + 0.1 * np.array([[1.0, -1.0], [-1.0, 1.0]]),
        parameters={"w": 1.4},
        forcing={"q1": lambda t, p: np.cos(p.w * t)},
        elements={"held": ns.elements.Coulomb(at="q2", friction=1.0)},
    )
    passes, period = 49, rig.period()
    time = np.arange(60 * 128, (60 + passes) * 128 + 1) * period / 128
    run = ns.simulate(rig, duration=time[-1], samples=time)
    u = run["u"].values[np.searchsorted(run["time"].values, time)]
    assert (u[:, [1, 3]] == 0.0).all() and np.ptp(u[:, 0]) > 1.0
    u = u + 1e-6 * np.random.default_rng(3).normal(size=u.shape)
    noisy = xr.Dataset(
        {
            "u": (("time", "state"), u),
            "u_error": (("time", "state"), np.full(u.shape, 1e-6)),
            "phase": ("time", time / period),
        },
        {"time": time, "state": list(rig.states)},
    )
    found = compare(noisy, rig)
    assert float(found["orbit_distance"]) == pytest.approx(np.sqrt(2 / (4 * passes)), rel=0.15)


SLOW = (pytest.param(rate, marks=pytest.mark.slow) for rate in (20.2, 50.0))


@pytest.mark.parametrize("rate", [20.0, 37.3, *SLOW])
def test_samples_beside_impacts_keep_no_distance_from_the_same_motion(rate: float) -> None:
    """Between two samples about an impact interpolation is off by up to the jump of the speed: in both orbits alike."""
    system = ns.models.impact_oscillator(A=1.0, e=0.8, c=0.1)
    turns = 200 + np.arange(int(100 * rate)) / rate
    run = ns.simulate(system, duration=2 * np.pi * turns[-1] + 0.1, samples=2 * np.pi * turns)
    measured = xr.Dataset(
        {
            "u": (("time", "state"), run["u"].values[np.searchsorted(run["time"].values, 2 * np.pi * turns)]),
            "phase": ("time", turns),
        },
        {"time": 2 * np.pi * turns, "state": ["x", "v"], "state_unit": ("state", ["1", "1"])},
    )
    options: dict[str, Any] = {"noise": {"x": 1e-6, "v": 1e-6}, "grid": 64}
    found = ns.compare(measured, system, settings={"c": (0.1, 1e-9)}, draws=2, **options)
    assert float(found["orbit_distance"]) < 1e-6 and (found["draw_orbit_distance"] < 1e-6).all()
    other = ns.compare(measured, system.with_parameters(e=0.75), **options)
    assert 0.01 < float(other["orbit_distance"]) < 0.2
