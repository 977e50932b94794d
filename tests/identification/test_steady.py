"""Fits to readings of steady states: responses and sections, alone and beside records over time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import nonsmooth as ns

pytestmark = pytest.mark.physics
OMEGA = np.linspace(1.0, 3.0, 21)
ERROR = 3e-3


def linear(**values: float) -> ns.System:
    """q'' + c q' + k q = F cos(omega t)."""
    given = {"c": 0.2, "k": 4.0, "F": 0.3, "omega": 2.0, **values}
    return ns.mechanical(
        1.0,
        "c",
        "k",
        parameters=given,
        coordinates=["q"],
        forcing={"q": lambda t, p: p.F * np.cos(p.omega * t)},
        period=lambda p: 2 * np.pi / p.omega,
    )


def amplitude(c: float = 0.2, k: float = 4.0, F: float = 0.3) -> Any:
    return F / np.sqrt((k - OMEGA**2) ** 2 + (c * OMEGA) ** 2)


def response(values: Any, error: float | None = ERROR, name: str = "omega", at: Any = OMEGA) -> xr.Dataset:
    held = {"amplitude": ("run", values), name: ("run", at)}
    return xr.Dataset(held if error is None else {**held, "amplitude_error": ("run", np.full(len(values), error))})


def fisher(rows: Any, values: dict[str, float], error: float) -> Any:
    """Information of readings ``rows(**values)`` with this error, by central differences."""
    columns = []
    for name, value in values.items():
        h = 1e-5 * abs(value)
        one, other = (rows(**{**values, name: value + sign * h}) for sign in (1.0, -1.0))
        columns.append((one - other) / (2.0 * h * error))
    J = np.stack(columns, axis=1)
    return J.T @ J


def test_a_resonance_has_the_information_of_its_formula() -> None:
    """Without noise in the readings the covariance is the inverse of Fisher's information by F / |k - w^2 + i c w|."""
    found = ns.fit(linear(c=0.3, k=3.5), response(amplitude()), ["c", "k"], progress=False)
    assert [found["c"], found["k"]] == pytest.approx([0.2, 4.0], rel=1e-7)
    expected = np.linalg.inv(fisher(amplitude, {"c": 0.2, "k": 4.0}, ERROR))
    assert found.full_covariance.values == pytest.approx(expected, rel=2e-3)
    assert found.steady["fitted"].values == pytest.approx(amplitude(), rel=1e-7)
    assert found.steady["omega"].attrs["units"] == linear().parameters["omega"].unit


def test_intervals_hold_the_truth() -> None:
    """Standard scores of ten noisy responses are of mean 0 and deviation 1, the noise known or found."""
    rng, scores, system, at = np.random.default_rng(1), {None: [], ERROR: []}, linear(), OMEGA[::2]
    for _ in range(10):
        y = amplitude()[::2] + ERROR * rng.standard_normal(len(at))
        for error, held in scores.items():
            found = ns.fit(system, response(y, error, at=at), ["c", "k"], tries=1, progress=False)
            held.append(
                [(found[name] - true) / found.estimate(name).uncertainty for name, true in (("c", 0.2), ("k", 4.0))]
            )
    for held in scores.values():
        assert np.abs(np.mean(held, axis=0)).max() < 0.7
        assert np.std(held, axis=0) == pytest.approx([1.0, 1.0], abs=0.45)


def test_records_and_a_response_add_their_information() -> None:
    """A decay knows nothing of the force, which is set to zero there; a response of F / |...| does not know it well."""
    decay = ns.simulate(linear(F=0.0), start={"q": 0.5}, duration=20.0, samples=400)
    noise = 0.01 * np.random.default_rng(3).standard_normal(decay.sizes["time"])
    record = {"q": (decay["time"].values, decay["u"].sel(state="q").values + noise)}
    options: Any = {"measured": {"q": ns.Sensor(noise=0.01)}, "progress": False}
    alone = ns.fit(linear(F=0.0), record, ["c", "k"], **options)
    curve = ns.fit(linear(), response(amplitude()), ["c", "k", "F"], progress=False)
    both = [record, response(amplitude())]
    found = ns.fit(linear(c=0.25, F=0.2), both, ["c", "k", "F"], settings={"0": {"F": 0.0}}, **options)
    scores = [
        (found[name] - true) / found.estimate(name).uncertainty for name, true in (("c", 0.2), ("k", 4.0), ("F", 0.3))
    ]
    assert np.abs(scores).max() < 2.5
    added = np.linalg.inv(curve.covariance.values)
    added[:2, :2] += np.linalg.inv(alone.covariance.values)
    assert np.diag(found.covariance.values) == pytest.approx(np.diag(np.linalg.inv(added)), rel=0.3)
    assert found.estimate("F").uncertainty < 0.85 * curve.estimate("F").uncertainty
    assert len(found.residuals["sample"]) == 400 and len(found.steady["sample"]) == len(OMEGA)
    assert found.steady["measured"].long_name == "amplitude"


def swept(system: ns.System, at: Any, state: str = "x") -> xr.Dataset:
    both = ns.frequency_response(system, at, direction="both", progress=False)
    return both[["amplitude", "period_number"]].sel(state=[state])


def test_extremes_at_an_impact_move_with_it() -> None:
    """Amplitudes of an impact oscillator, largest at a corner: information by differences of ``frequency_response``."""
    at, values = np.linspace(1.2, 2.1, 8), {"k": 1.0, "d": 0.2, "e": 0.6}
    system = ns.models.impact_oscillator(**values)

    def rows(**given: float) -> Any:
        return swept(system.with_parameters(**given), at)["amplitude"].values.ravel()

    data = swept(system, at)
    data["amplitude_error"] = data["amplitude"] * 0.0 + ERROR
    near = system.with_parameters(k=1.02, d=0.21, e=0.58)
    found = ns.fit(near, data, list(values), progress=False)
    assert [found[name] for name in values] == pytest.approx(list(values.values()), rel=1e-6)
    assert found.full_covariance.values == pytest.approx(np.linalg.inv(fisher(rows, values, ERROR)), rel=0.02)


def test_sections_of_doubled_motions() -> None:
    """Section points of periods 1, 2 and 4, from whichever of them a recording begins, with their signs."""
    system, at = (
        ns.models.discontinuous_support(g=-0.0045, rho=0.45, omega=3.69),
        np.array([0.248, 0.25, 0.28, 0.32, 0.36, 0.41, 0.44]),
    )
    sweep = ns.sweep(system, "rho", at, transient=600, keep=32, progress=False)
    assert {1, 2, 4} <= set(sweep["period_number"].values.tolist())
    for first in (1, 4):
        data = sweep[["section", "period_number"]].isel(iterate=slice(first, None))
        data["section_error"] = ("state", [2e-5, 2e-4])
        found = ns.fit(system.with_parameters(k=8.5, k_s=1150.0), data, ["k", "k_s"], progress=False)
        assert [found["k"], found["k_s"]] == pytest.approx([8.47, 1210.0], rel=1e-6)
    steady = found.steady
    assert steady["measured"].long_name == "section"
    assert set(steady["iterate"].values.tolist()) == {0, 1, 2, 3}
    means = data.sizes["iterate"] / sweep["period_number"].sel(rho=steady["rho"].values).values
    error = np.where(steady["quantity"].values == 0, 2e-5, 2e-4) / np.sqrt(means)
    assert steady["measured_error"].values == pytest.approx(error)


def test_amplitudes_by_scipy() -> None:
    """q'' + 0.2 q' + q + 5 max(q - 0.4, 0) = 0.3 cos w t, integrated by SciPy until its steady state."""

    def height(w: float) -> float:
        def rate(t: float, u: Any) -> Any:
            return u[1], 0.3 * np.cos(w * t) - 0.2 * u[1] - u[0] - 5.0 * max(u[0] - 0.4, 0.0)

        begin, end = 2 * np.pi / w * np.array([29.0, 30.0])
        run = solve_ivp(rate, (0.0, end), [0.0, 0.0], "DOP853", rtol=1e-10, atol=1e-12, dense_output=True)
        grid, ends = np.linspace(begin, end, 400), 0.0
        for sign in (1.0, -1.0):
            at = grid[np.argmin(sign * run.sol(grid)[0])]
            q = lambda t, sign: sign * run.sol(t)[0]
            ends -= minimize_scalar(q, (at - 0.1, at, at + 0.1), args=(sign,), tol=1e-9).fun
        return 0.5 * ends

    at = np.linspace(0.7, 1.6, 8)
    stop = ns.elements.ElasticStop(at="q", position="g", stiffness="k_s", damping=0.0)
    system = ns.mechanical(
        1.0,
        "c",
        1.0,
        parameters={"c": 0.25, "g": 0.45, "k_s": 4.0, "omega": 1.0},
        coordinates=["q"],
        forcing={"q": lambda t, p: 0.3 * np.cos(p.omega * t)},
        elements={"stop": stop},
    )
    readings = response([height(w) for w in at], 1e-5, at=at)
    found = ns.fit(system, readings, ["c", "g", "k_s"], tries=1, progress=False)
    assert [found[name] for name in ("c", "g", "k_s")] == pytest.approx([0.2, 0.4, 5.0], rel=1e-6)


def test_a_run_that_jumped_early_is_of_the_other_branch() -> None:
    """Each reading is of one of the steady states that exist, whichever way it was come to."""
    system = ns.models.discontinuous_support(g=0.02, rho=0.14)
    at = np.linspace(4.6, 6.2, 17)
    both = swept(system, at)["amplitude"]
    jumped = both.sel(direction="up").values[:, 0].copy()
    apart = np.flatnonzero(np.abs(both.sel(direction="down").values[:, 0] / jumped - 1.0) > 0.2)
    assert len(apart) >= 2
    jumped[apart[-2:]] = both.sel(direction="down").values[apart[-2:], 0]
    found = ns.fit(system.with_parameters(k=8.3, g=0.0205), response(jumped, 2e-4, at=at), ["k", "g"], progress=False)
    assert [found["k"], found["g"]] == pytest.approx([system.values["k"], 0.02], rel=1e-6)
    assert not found.anomalies


def test_a_reading_of_chaos_is_not_used_and_that_is_said() -> None:
    system, at = ns.models.discontinuous_support(rho=0.2, omega=3.69), [0.2, 0.3, 0.35, 0.4, 0.45, 0.5]
    sweep = ns.sweep(system, "rho", at, progress=False)
    numbers = sweep["period_number"].values
    assert numbers[0] == 0 and (numbers[1:] > 0).any()
    heights = 0.5 * (sweep["maximum"] - sweep["minimum"]).sel(state="x").values * np.where(numbers == 0, 1.5, 1.0)
    heights += 1e-6 * np.random.default_rng(0).standard_normal(len(at))  # ten times the error that is given
    found = ns.fit(system.with_parameters(k=8.6), response(heights, 1e-7, "rho", at), "k", tries=1, progress=False)
    assert found["k"] == pytest.approx(8.47, rel=1e-4)
    assert any("the model's motion there has no period" in note for note in found.notes)
    assert found.steady["used"].values.tolist() == (numbers > 0).tolist()
    known = response(heights, 1e-7, "rho", at).assign(period_number=("run", numbers))
    again = ns.fit(system.with_parameters(k=8.6), known, ["k"], tries=1, progress=False)
    said = f"{int((numbers == 0).sum())} settings are not used, which have no period number"
    assert any(said in note for note in again.notes)
    assert len(again.steady["sample"]) == int((numbers > 0).sum())
    assert again.estimate("k").uncertainty == pytest.approx(found.estimate("k").uncertainty, rel=1e-3)


def test_sensors_and_settings_of_responses() -> None:
    """Two responses to known forces by a sensor of unknown gain; a third set by two parameters at once, as a table."""
    gain = 250.0
    runs = [response(gain * amplitude(F=F), gain * ERROR) for F in (0.3, 0.6)]
    options: Any = {
        "settings": [{"F": 0.3}, {"F": 0.6}],
        "measured": {"q": ns.Sensor(gain=200.0)},
        "tries": 1,
        "progress": False,
    }
    found = ns.fit(linear(c=0.25), runs, ["c", "k", "q.gain"], **options)
    assert [found["c"], found["k"], found.extra["q.gain"].value] == pytest.approx([0.2, 4.0, gain], rel=1e-6)
    own = ns.fit(linear(c=0.25), runs, ["c", "k", "q.gain"], per_run=["q.gain"], **options)
    assert [own.extra[f"q.gain, {i}"].value for i in (0, 1)] == pytest.approx([gain] * 2, rel=1e-6)
    table = pd.DataFrame({"omega": OMEGA, "F": np.where(OMEGA < 2, 0.3, 0.6)})
    table["amplitude"] = amplitude(F=table["F"].values)
    for data in (table, table.set_index("omega"), {name: table[name].tolist() for name in table}):
        assert ns.fit(linear(c=0.25), data, "c", tries=1, progress=False)["c"] == pytest.approx(0.2, rel=1e-6)


def test_a_parameter_that_was_set_in_every_run_is_not_told() -> None:
    found = ns.fit(linear(), response(amplitude()), ["c", "omega"], progress=False)
    assert found["c"] == pytest.approx(0.2, rel=1e-6)
    assert found.identifiability["omega"].startswith("not identifiable")


def test_an_outlier_hardly_counts_where_that_is_asked() -> None:
    far = amplitude() + np.where(np.arange(len(OMEGA)) == 7, 80 * ERROR, 0.0)
    plain = ns.fit(linear(), response(far), ["c", "k"], tries=1, progress=False)
    huber = ns.fit(linear(), response(far), ["c", "k"], tries=1, loss="huber", progress=False)
    away = [abs(found["k"] - 4.0) / 0.0025 for found in (plain, huber)]
    assert away[1] < 0.2 * away[0]


def test_noise_that_is_found_is_that_of_the_residuals() -> None:
    y = amplitude() + ERROR * np.random.default_rng(5).standard_normal(len(OMEGA))
    found = ns.fit(linear(), response(y, None), ["c", "k", "F"], progress=False).steady
    left = found["measured"] - found["fitted"]
    expected = np.sqrt(float((left**2).sum()) / (len(OMEGA) - 3))
    assert found["measured_error"].values == pytest.approx(np.full(len(OMEGA), expected), rel=0.02)


def test_a_model_that_is_wrong_says_so() -> None:
    found = ns.fit(linear(), response(amplitude() + 0.02 * np.sin(5 * OMEGA)), ["c", "k"], tries=1, progress=False)
    assert any("times their errors away from the steady states" in one for one in found.anomalies)
    millimetres = ns.fit(linear(), response(1e3 * amplitude(), None), ["c", "k"], tries=1, progress=False)
    assert any("times their own variation away" in one for one in millimetres.anomalies)


def free() -> ns.System:
    return ns.mechanical(1.0, 0.1, "k", parameters={"k": 4.0}, coordinates=["q"])


def driven() -> ns.System:
    return ns.mechanical(
        1.0,
        0.1,
        "k",
        parameters={"k": 4.0, "omega": 2.0},
        coordinates=["q"],
        inputs={"f": ""},
        forcing={"q": lambda t, p: p.f},
        period=lambda p: 2 * np.pi / p.omega,
    )


def test_quantities_that_are_no_states_are_of_the_records() -> None:
    system = ns.models.discontinuous_support(g=0.02, rho=0.14)
    output = next(iter(system.outputs))
    data = response(swept(system, OMEGA + 3.5)["amplitude"].sel(direction="up").values[:, 0], 1e-4, at=OMEGA + 3.5)
    found = ns.fit(system.with_parameters(k=8.4), data, "k", measured=[output, "x"], progress=False)
    assert found["k"] == pytest.approx(8.47, rel=1e-6)


@pytest.mark.parametrize(
    ("system", "data", "parameters", "options", "words"),
    [
        (free(), response(amplitude()), "k", {}, "no forcing period"),
        (driven(), response(amplitude()), "k", {}, "has inputs"),
        (linear(), {"omega": OMEGA[:5], "amplitude": amplitude()}, "k", {}, "amplitude of 21, omega of 5"),
        (linear(), response(amplitude(), -1.0), "k", {}, "amplitude_error has the negative number -1"),
        (linear(), {"omega": 2.0, "amplitude": 0.3}, "k", {}, "one number of each kind for every reading"),
        (linear(), {"omega": OMEGA, "amplitude": ["high"] * 21}, "k", {}, "amplitude"),
        (linear(), response(amplitude(), name="frequency"), "k", {}, "at which values of a parameter its amplitude"),
        (linear(), response(amplitude()), "k", {"measured": "omega"}, "not a measured state"),
        (linear(), response(np.full(21, np.nan)), "k", {}, "no amplitude that can be used"),
        (linear(), response(amplitude()), ["k", "phase"], {}, "readings of steady states have none"),
        (linear(), response(amplitude()), "k", {"settings": {"steady": {"z": 1.0}}}, "not a parameter"),
        (linear(), response(amplitude()), "k", {"settings": {"k": 1.0}}, "in settings, as known"),
        (linear(), response(amplitude()), "k", {"runs": ["one"]}, "runs= chooses runs of a Recording"),
        (linear(), response(amplitude()), "k", {"leave_out": True}, "leaves out parts of records over time"),
        (linear(), response(amplitude()).rename(amplitude="section"), "k", {}, "period_number"),
    ],
)
def test_what_cannot_be_read_is_refused(system: Any, data: Any, parameters: Any, options: Any, words: str) -> None:
    with pytest.raises((ValueError, TypeError), match=words):
        ns.fit(system, data, parameters, progress=False, **options)


def test_a_channel_called_amplitude_is_no_response() -> None:
    t = np.linspace(0.0, 20.0, 200)
    run = ns.simulate(linear(), duration=20.0, samples=t)
    record = {"q": (run["time"].values, run["u"].sel(state="q").values)}
    alone, beside = (
        ns.fit(linear(), {**record, **more}, "c", measured=["q"], progress=False)
        for more in ({}, {"amplitude": record["q"]})
    )
    assert beside["c"] == alone["c"]


def test_models_are_chosen_by_settings_that_were_held_out() -> None:
    """Every third setting is held out in turn: the error there is that of a fit to the others, by the formula."""
    y = amplitude() + ERROR * np.random.default_rng(3).standard_normal(len(OMEGA))
    models = {"damped": (linear(), ["c", "k"]), "too soft": (linear(k=3.8), "c")}
    ranked = ns.select_model(models, response(y), folds=3, tries=1, progress=False)
    assert ranked.attrs["best"] == "damped" and float(ranked["rms"].sel(model="too soft")) > 3.0
    for fold in range(3):
        out = np.arange(len(OMEGA)) % 3 == fold
        found = ns.fit(linear(), response(y[~out], at=OMEGA[~out]), ["c", "k"], tries=1, progress=False)
        left = (y - amplitude(found["c"], found["k"]))[out] / ERROR
        assert float(ranked["squared_error"][0, fold]) == pytest.approx(np.mean(left**2), rel=1e-4)
    with pytest.raises(ValueError, match="too short for folds = 22: .* settings of steady states"):
        ns.select_model(models, response(y), folds=22, progress=False)


def test_a_fit_to_steady_states_alone_has_no_residuals_over_time() -> None:
    with pytest.raises(ValueError, match=r"steady states are in \.steady"):
        _ = ns.fit(linear(), response(amplitude()), "k", progress=False).residuals


def test_a_force_that_only_the_response_tells_stays_where_it_is_until_then() -> None:
    """A decay without the drive, in mm with an offset, and amplitudes in mm under it; both in closed form."""
    rng, t, k, c, F = np.random.default_rng(0), np.arange(0, 20, 0.05), 9.0, 0.3, 1.0
    system = ns.mechanical(
        1.0,
        "c",
        "k",
        parameters={"k": 8.5, "c": 0.25, "F": 1.2, "omega": 2.0},
        coordinates=["q"],
        forcing={"q": lambda t, p: p.F * np.cos(p.omega * t)},
    )
    rate, omega = np.sqrt(k - c**2 / 4), np.linspace(1.5, 4.5, 25)
    decay = 0.1 * np.exp(-c / 2 * t) * (np.cos(rate * t) + c / (2 * rate) * np.sin(rate * t))
    amplitude = F / np.hypot(k - omega**2, c * omega)
    readings = [
        {"laser": (t, 1e3 * decay + 5.0 + 0.2 * rng.standard_normal(t.size))},
        {
            "omega": omega,
            "amplitude": 1e3 * amplitude + 2.0 * rng.standard_normal(25),
            "amplitude_error": np.full(25, 2.0),
        },
    ]
    found = ns.fit(
        system,
        readings,
        ["k", "c", "F", "q.offset", "q.gain"],
        measured={"q": ns.Sensor("laser", gain=1e3)},
        settings={"0": {"F": 0.0}},
        priors={"q.gain": (1000.0, 10.0)},
        tries=1,
        progress=False,
    )
    for name, value in {"k": k, "c": c, "F": F, "q.offset": 5.0, "q.gain": 1000.0}.items():
        estimate = found.estimate(name)
        assert abs(estimate.value - value) < 4 * estimate.uncertainty, name
    assert found.uncertainty["F"] == pytest.approx(0.01, rel=0.15) and not found.anomalies  # that of the gain


def test_what_records_say_against_a_model_is_said_beside_readings_of_steady_states() -> None:
    """A second force that the model lacks: short windows fit better, whatever amplitudes are fitted with the record."""
    t, forces = np.arange(0.0, 30.0, 0.05), ((2.0, 1.0), (5.3, 0.05))
    q = sum((f * np.exp(1j * w * t) / (9.0 - w**2 + 0.2j * w)).real for w, f in forces)
    record = {"q": (t, q + 2e-3 * np.random.default_rng(0).standard_normal(len(t)))}
    for readings in ([record], [record, response(amplitude(k=9.0, F=1.0))]):
        found = ns.fit(linear(k=9.0, F=1.0), readings, ["k", "c"], measured=["q"], tries=1, progress=False)
        assert any("short windows with starts of their own fit better" in one for one in found.anomalies)
