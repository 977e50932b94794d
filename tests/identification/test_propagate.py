"""Uncertainty through verbs: what draws and first order give, against closed forms and against each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

QUIET: dict[str, Any] = {"progress": False}


class Known(dict[str, float]):
    """Values by name, with their covariance."""

    covariance: xr.DataArray


def known(system: ns.System, errors: dict[str, float], correlation: float = 0.0) -> Known:
    """Parameters at their values in ``system``, every pair with the same correlation."""
    sizes, names = np.array(list(errors.values())), list(errors)
    matrix = np.outer(sizes, sizes) * (correlation + (1 - correlation) * np.eye(len(sizes)))
    found = Known({name: system.values[name] for name in names})
    found.covariance = xr.DataArray(matrix, {"parameter": names, "other": names}, ("parameter", "other"))
    return found


def support() -> ns.System:
    return ns.models.discontinuous_support().with_parameters(omega=3.69, g=0.02, rho=0.1)


def grazing(p: dict[str, Any]) -> Any:
    """Force at which the motion without contact touches the support."""
    m, c, omega = p["m"], p["c"], p["omega"]
    return p["g"] * m * np.sqrt((2 * p["k"] / m - omega**2) ** 2 + (c * omega / m) ** 2)


def test_the_grazing_point_of_each_draw_is_the_closed_form_and_so_are_its_derivatives() -> None:
    s = support()
    found = known(s, {"k": 0.05, "c": 0.02, "m": 0.004}, correlation=0.4)
    band = ns.propagate(
        found,
        ns.continue_orbit,
        ns.find_orbit(s),
        "rho",
        (0.08, 0.15),
        draws=4,
        seed=3,
        first_order=True,
        settings={"g": (0.02, 1e-4)},
        **QUIET,
    )
    assert band["special_kind"].values[0] == "grazing" and int(band["failed"]) == 0
    drawn = {**s.values, **{name: band[f"drawn_{name}"].values for name in ("k", "c", "m", "g")}}
    np.testing.assert_allclose(band["special_value_draws"].values[:, 0], grazing(drawn), rtol=1e-9)
    np.testing.assert_allclose(
        band["special_value_quantiles"].values[:, 0], np.quantile(grazing(drawn), [0.025, 0.5, 0.975]), rtol=1e-9
    )
    slope = []
    for name in band["source"].values:
        h = 1e-5 * s.values[str(name)]
        ahead, behind = ({**s.values, str(name): s.values[str(name)] + sign * h} for sign in (1, -1))
        slope.append((grazing(ahead) - grazing(behind)) / (2 * h))
    assert band["source"].values.tolist() == ["k", "c", "m", "g"]
    np.testing.assert_allclose(band["special_slope"].values[0], slope, rtol=1e-6)
    covariance = np.zeros((4, 4))
    covariance[:3, :3], covariance[3, 3] = found.covariance.values, 1e-8
    assert float(band["special_first_order"][0]) == pytest.approx(np.sqrt(slope @ covariance @ slope), rel=1e-6)


def test_draws_and_first_order_agree_on_a_flip() -> None:
    """Each draw is the point moved by the slopes, up to what is of second order."""
    s = support().with_parameters(g=-0.0045, rho=0.42)
    errors = {"k": 0.004, "c": 0.002, "m": 0.0002}
    found = known(s, errors)
    band = ns.propagate(
        found, ns.continue_orbit, ns.find_orbit(s), "rho", (0.38, 0.43), draws=8, first_order=True, step=0.5, **QUIET
    )
    assert band["special_kind"].values.tolist() == ["flip"]
    slope, names = band["special_slope"].values[0], band["source"].values.tolist()
    spread = float(np.linalg.norm([one * errors[name] for one, name in zip(slope, names, strict=True)]))
    assert float(band["special_first_order"][0]) == pytest.approx(spread, rel=1e-9)
    linear = sum(one * (band[f"drawn_{name}"].values - s.values[name]) for one, name in zip(slope, names, strict=True))
    moved = band["special_value_draws"].values[:, 0] - float(band["special_value"][0])
    np.testing.assert_allclose(moved, linear, atol=0.02 * spread)


def test_a_hopf_point_to_first_order_is_that_of_its_draws() -> None:
    """By differences; the valve's Hopf point moves by 1 % and less, in proportion."""
    s = ns.models.relief_valve(q=9.0)
    band = ns.propagate(
        known(s, {"k": 1e-3, "beta": 0.01}),
        ns.continue_equilibrium,
        s,
        "q",
        (8.0, 9.5),
        draws=8,
        first_order=True,
        start={"y1": 2.0, "y3": 12.0},
        **QUIET,
    )
    assert band["special_kind"].values.tolist() == ["hopf"] and band["source"].values.tolist() == ["k", "beta"]
    linear = band["special_value"].values[0] + sum(
        band["special_slope"].values[0, i] * (band[f"drawn_{name}"].values - s.values[name])
        for i, name in enumerate(("k", "beta"))
    )
    spread = float(band["special_first_order"][0])
    np.testing.assert_allclose(band["special_value_draws"].values[:, 0], linear, atol=0.02 * spread)


def scaled_stop() -> ns.System:
    """A mass that meets an elastic stop; ``a`` scales force and gap, so that every motion is ``a`` times as large."""
    stop = ns.elements.ElasticStop(at="q", position="a", stiffness=6.0, damping=0.0)
    return ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"a": 1.0, "omega": 1.0},
        elements={"s": stop},
        coordinates=["q"],
        forcing={"q": lambda t, p: 0.5 * p.a * np.cos(p.omega * t)},
    )


def test_the_band_of_a_branch_with_folds_scales_as_its_motions_do() -> None:
    s = scaled_stop().with_parameters(omega=1.2)
    orbit = ns.find_orbit(s)
    found = known(s, {"a": 0.05})
    band = ns.propagate(found, ns.continue_orbit, orbit, "omega", (1.15, 1.4), draws=2, step=0.015, **QUIET)
    assert "fold" in band["special_kind"].values
    amplitude = band["maximum"].sel(state="q").values
    folds = band["special_value"].values[band["special_kind"].values == "fold"]
    near = np.min(np.abs(band["omega"].values[:, None] - folds), axis=1) < 2e-3  # there a cubic says less
    a = np.quantile(band["drawn_a"].values, band["quantile"].values)
    found_band = band["maximum_quantiles"].sel(state="q").values
    assert np.isfinite(found_band[:, ~near]).all()
    np.testing.assert_allclose(found_band[:, ~near], (a[:, None] * amplitude)[:, ~near], rtol=2e-3)
    np.testing.assert_allclose(np.ptp(band["special_value_draws"].values, axis=0), 0.0, atol=1e-8)


def test_a_response_and_its_jumps_scale_too() -> None:
    s = scaled_stop()
    omega = np.linspace(0.9, 1.9, 41)
    band = ns.propagate(
        known(s, {"a": 0.05}), ns.frequency_response, s, omega, draws=6, transient=200, keep=20, **QUIET
    )
    a = np.quantile(band["drawn_a"].values, band["quantile"].values)
    expected = a[:, None, None] * band["amplitude"].sel(state="q").values
    np.testing.assert_allclose(band["amplitude_quantiles"].sel(state="q").values, expected, rtol=1e-5)
    assert band.sizes["jump"] > 0
    np.testing.assert_array_equal(band["jump_value_draws"].values, np.tile(band["jump_value"].values, (6, 1)))


def test_the_probability_of_a_period_is_that_of_the_side_of_a_flip() -> None:
    """Beyond the flip period 1 has become period 2; each draw is on the side that its own flip says."""
    s = support().with_parameters(g=-0.0045, rho=0.41)
    found = known(s, {"k": 0.05})
    rho = np.array([0.34, 0.4])
    plane = ns.propagate(
        found,
        ns.sweep,
        s,
        "rho",
        rho,
        draws=10,
        transient=400,
        keep=20,
        direction=None,
        start={"x": 0.0, "v": 0.0},
        **QUIET,
    )
    flips = ns.propagate(
        found,
        ns.continue_orbit,
        ns.find_orbit(s.with_parameters(rho=0.45)),
        "rho",
        (0.3, 0.5),
        draws=10,
        step=0.1,
        **QUIET,
    )["special_value_draws"].values[:, 0]
    of_one = plane["period_number_probability"].sel(period_value=1).values
    far = np.abs(flips[:, None] - rho) > 2e-3
    for j in np.flatnonzero(far.all(axis=0)):
        assert of_one[j] == pytest.approx(np.mean(rho[j] > flips))
    assert np.all(plane["period_number_probability"].sum("period_value").values == pytest.approx(1.0))


def test_a_draw_without_a_motion_has_no_period_number() -> None:
    """With damping c a linear motion has period 1, and with c < 0 it grows: neither is one without a period."""
    s = ns.mechanical(1.0, "c", 1.0, parameters={"c": 0.3, "w": 2.0}, forcing={"q": lambda t, p: np.cos(p.w * t)})
    band = ns.propagate({}, ns.sweep, s, "w", [1.5, 2.0], settings={"c": (0.3, 0.4)}, draws=11, seed=1, **QUIET)
    c = band["drawn_c"].values
    assert np.abs(c).min() > 0.02 and 0 < np.mean(c < 0) < 1
    assert band["period_value"].values.tolist() == [1]
    for name in ("period_number_probability", "period_number_share", "maximum_share"):
        assert np.unique(band[name]) == pytest.approx([np.mean(c > 0)]), name


def test_probabilities_are_shares_of_all_draws() -> None:
    """With damping c the orbit of a linear oscillator is stable where c > 0; for w < 0 the verb refuses."""
    s = ns.mechanical(1.0, "c", 1.0, parameters={"c": 0.3, "w": 2.0}, forcing={"q": lambda t, p: np.cos(2.0 * t)})

    def orbit(one: ns.System) -> Any:
        if one.values["w"] < 0:
            raise ns.SolveError("refused")
        return ns.find_orbit(one, period_number=1, transient=0, progress=False)

    band = ns.propagate({}, orbit, s, settings={"c": (0.3, 0.4), "w": (1.0, 1.5)}, draws=24, **QUIET)
    there, c = band["drawn_w"].values > 0, band["drawn_c"].values
    assert 0 < int(band["failed"]) == np.sum(~there) and 0 < np.sum(there & (c < 0))
    assert float(band["stable_share"]) == np.mean(there) == float(band["period_number_share"])
    assert float(band["stable_probability"]) == np.mean(there & (c > 0))
    assert band["period_number_probability"].sel(period_value=1) == np.mean(there)


def test_the_crossings_of_a_run_are_matched_where_they_are_the_same_ones() -> None:
    """A steady force drives the mass into the stop on its side: one impact for each draw, there or here."""
    stops = {name: ns.elements.Stop(at="q", position=x, side=x, restitution=0.5) for name, x in (("a", -1), ("b", 1))}
    s = ns.mechanical(
        1.0, 0.0, 0.0, parameters={"s": 0.5}, forcing={"q": lambda t, p: 0.3 * p.s / abs(p.s)}, elements=stops
    )
    band = ns.propagate({}, ns.simulate, s, duration=4.0, settings={"s": (0.5, 0.7)}, draws=20, **QUIET)
    share = np.mean(band["drawn_s"].values > 0)
    assert band.sizes["crossing"] == 1 and 0.2 < share < 1
    assert band["u_before_quantiles"].sel(state="q").values == pytest.approx(np.ones((3, 1)))
    assert band["crossing_time_share"].values == pytest.approx([share])
    assert band["crossing_time_quantiles"].values == pytest.approx(np.full((3, 1), np.sqrt(2 / 0.3)))


def test_of_a_diagram_of_branches_the_special_points_have_distributions() -> None:
    s = support().with_parameters(g=-0.0045, rho=0.42)
    found = known(s, {"k": 0.004})
    band = ns.propagate(found, ns.bifurcation_diagram, s, "rho", (0.38, 0.43), n=3, draws=2, **QUIET)
    alone = ns.propagate(found, ns.continue_orbit, ns.find_orbit(s), "rho", (0.38, 0.43), draws=2, **QUIET)
    at = int(np.flatnonzero(band["special_kind"].values == "flip")[0])
    expected = alone["special_value_draws"].values[:, 0]
    np.testing.assert_allclose(band["special_value_draws"].values[:, at], expected, rtol=1e-7)
    assert "maximum_quantiles" not in band


def test_a_number_of_a_function_and_bounds() -> None:
    s = support()
    found = known(s, {"c": 0.4})
    band = ns.propagate(found, lambda one: one.values["c"] ** 2, s, draws=50, bounds={"c": (0.5, 1.2)}, **QUIET)
    c = band["drawn_c"].values
    assert c.min() > 0.5 and c.max() < 1.2 and c.max() - c.min() > 0.4
    np.testing.assert_allclose(band["value_quantiles"], np.quantile(c**2, [0.025, 0.5, 0.975]), rtol=1e-12)
    array = ns.propagate(
        found, lambda one: xr.DataArray(one.values["c"] ** 2), s, draws=50, bounds={"c": (0.5, 1.2)}, **QUIET
    )
    np.testing.assert_array_equal(array["value_quantiles"], band["value_quantiles"])


def test_the_band_of_a_run_is_that_of_each_instant_whenever_the_draws_have_their_impacts() -> None:
    """A ball that falls from 1/2 and rebounds at 1 / sqrt(g): x = 1/2 - g t^2 / 2 before, and after it with e = 1/2."""
    ball = ns.System(
        states=["x", "v"],
        parameters={"g": 1.0},
        modes={"fly": lambda t, u, p: (u.v, -p.g)},
        elements={"floor": ns.elements.Stop(gap=lambda t, u, p: u.x, on={"v": 1.0}, restitution=0.5)},
    )
    options = {"duration": 1.7, "start": {"x": 0.5}, "samples": [0.0, 0.5, 0.99, 1.01, 1.5, 1.7]}
    band = ns.propagate({}, ns.simulate, ball, settings={"g": (1.0, 0.05)}, draws=60, progress=False, **options)
    g, t = band["drawn_g"].values, band["time"].values[:, None]
    at = 1 / np.sqrt(g)
    exact = np.where(t < at, 0.5 - g * t**2 / 2, 0.5 * (t - at) * g * at - g * (t - at) ** 2 / 2)
    sampled = np.isin(t[:, 0], options["samples"])
    expected = np.quantile(exact, [0.025, 0.5, 0.975], axis=1)[:, sampled]
    assert np.abs(band["u_quantiles"].sel(state="x").values[:, sampled] - expected).max() < 1e-9
    assert np.allclose(band["u_share"].sel(state="x").values, np.where(sampled, 1.0, 0.0))  # its own impact is nobody's


def test_the_share_of_an_attractor_is_its_own_where_another_becomes_the_larger() -> None:
    """Attractors are numbered by their shares: period 3 and period 4 change places within the draws."""
    support = ns.models.discontinuous_support(omega=11.15, rho=0.33, g=0.00145)
    grid = {"x": np.linspace(-0.01, 0.01, 7), "v": np.linspace(-0.1, 0.1, 7)}
    known = {"settings": {"g": (0.00145, 1.5e-5)}, "draws": 8, "progress": False}
    band = ns.propagate({}, ns.basins, support, grid, **known)
    drawn = [ns.basins(support.with_parameters(g=g), grid, progress=False) for g in band["drawn_g"].values]
    firsts = {int(one["period_number"][0]) for one in drawn}
    assert firsts == {3, 4}
    for k, period in enumerate(band["period_number"].values):
        own = [one["fraction"].values[one["period_number"].values == period] for one in drawn]
        shares = np.concatenate(own)
        expected = np.quantile(shares, [0.025, 0.5, 0.975])
        assert np.allclose(band["fraction_quantiles"].values[:, k], expected)


def test_draws_that_fail_are_counted() -> None:
    s = support()

    def verb(one: ns.System) -> float:
        if one.values["c"] > s.values["c"]:
            raise ns.SolveError("too much")
        return one.values["c"]

    band = ns.propagate(known(s, {"c": 0.01}), verb, s, draws=40, **QUIET)
    failed = int(np.sum(band["drawn_c"] > s.values["c"]))
    assert int(band["failed"]) == failed > 0 and band["failed"].attrs["comment"] == "too much"
    assert float(band["value_share"]) == pytest.approx(1 - failed / 40)


def test_an_interruption_keeps_what_was_drawn(tmp_path: Any) -> None:
    s = support()
    calls = []

    def verb(one: ns.System) -> float:
        calls.append(one)
        if len(calls) == 6:  # the first is that of the parameters found
            raise KeyboardInterrupt
        return one.values["c"]

    with pytest.raises(ns.Interrupted, match="after 4 of 20 draws") as stopped:
        ns.propagate(known(s, {"c": 0.01}), verb, s, draws=20, **QUIET)
    assert stopped.value.result.sizes["draw"] == 4


def test_the_result_is_saved_and_loaded(tmp_path: Any) -> None:
    s = support()
    band = ns.propagate(known(s, {"k": 0.05}), ns.sweep, s, "rho", [0.05, 0.06], draws=3, transient=50, keep=5, **QUIET)
    ns.save(band, tmp_path / "band.nc")
    again = ns.load(tmp_path / "band.nc")
    np.testing.assert_array_equal(again["maximum_quantiles"].values, band["maximum_quantiles"].values)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"start": 3}, TypeError, "takes a System or an Orbit"),
        ({"verb": "sweep"}, TypeError, "a function such as ns.sweep"),
        ({"draws": 1}, ValueError, "a band takes two and more"),
        ({"quantiles": (0.9, 0.1)}, ValueError, "probabilities that rise"),
        ({"bounds": {"c": (1.0, 0.0)}}, ValueError, "must be below"),
        ({"bounds": {"cc": (1.0, None)}}, ValueError, "`cc` is not a parameter"),
        ({"first_order": True}, ValueError, "concerns the special points of a branch"),
        ({"verb": lambda s: "words"}, TypeError, "the verb returned str"),
        ({"found": {"c": (0.87, 0.01)}}, TypeError, r"'c' is given as \(0.87, 0.01\): .* it stands in settings="),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], error: type[Exception], message: str) -> None:
    s = support()
    given: dict[str, Any] = {"found": known(s, {"c": 0.01}), "verb": lambda one: one.values["c"], "start": s}
    given |= {"draws": 3, **QUIET, **change}
    with pytest.raises(error, match=message):
        ns.propagate(given.pop("found"), given.pop("verb"), given.pop("start"), **given)


def test_a_response_without_a_jump_has_bands() -> None:
    """The amplitude of a linear oscillator is in proportion to its force."""
    s = ns.models.discontinuous_support(omega=3.69, g=1.0, rho=0.1)
    at = np.linspace(2.0, 3.0, 5)
    band = ns.propagate(known(s, {"rho": 0.01}), ns.frequency_response, s, at, draws=12, **QUIET)
    assert band.sizes["jump"] == 0
    factor = np.quantile(band["drawn_rho"].values / 0.1, band["quantile"].values)
    height = 2.0 * band["maximum"].sel(state="x").values.reshape(-1)
    np.testing.assert_allclose(
        2.0 * band["maximum_quantiles"].sel(state="x").values.reshape(len(factor), -1),
        factor[:, None] * height,
        rtol=1e-6,
    )


def test_a_branch_of_a_system_without_contacts_has_bands() -> None:
    """Of a linear oscillator in closed form; it has no clearances, whose bands there are none of."""
    s = ns.mechanical(
        1.0,
        0.15,
        "k",
        parameters={"k": 9.0, "omega": 2.6},
        coordinates=["q"],
        forcing={"q": lambda t, p: np.cos(p.omega * t)},
    )
    band = ns.propagate(
        known(s, {"k": 0.05}), ns.continue_orbit, ns.find_orbit(s), "omega", (2.5, 2.8), draws=6, **QUIET
    )
    omega, k = band["omega"].values, band["drawn_k"].values[:, None]
    expected = np.quantile(1 / np.hypot(k - omega**2, 0.15 * omega), band["quantile"].values, axis=0)
    np.testing.assert_allclose(band["maximum_quantiles"].sel(state="q").values, expected, rtol=2e-3)


def test_draws_of_a_fit_stay_within_its_bounds(tmp_path: Any) -> None:
    """A swing that grows, and a damping that cannot be negative: half of a normal law, whose mean is known."""
    t = np.linspace(0.0, 20.0, 401)
    s = ns.mechanical(1.0, "c", "k", coordinates=["q"], parameters={"c": 0.01, "k": 9.0})
    y = np.exp(0.0005 * t) * np.cos(3.0 * t) + 0.05 * np.random.default_rng(1).standard_normal(len(t))
    found = ns.fit(s, {"q": (t, y)}, {"c": (0.0, None), "k": None}, measured=["q"], tries=1, **QUIET)
    assert found["c"] == 0.0
    ns.save(found.to_dataset(), tmp_path / "found.nc")
    kept = ns.ParameterSet.from_dataset(ns.load(tmp_path / "found.nc"))
    for one in (found, kept, found.only("c")):
        drawn = one.draw(4000)["c"]
        assert drawn.min() >= 0.0
        assert drawn.mean() == pytest.approx(found.uncertainty["c"] * np.sqrt(2 / np.pi), rel=0.05)
    np.testing.assert_array_equal(found.draw(30)["k"], kept.draw(30)["k"])
    band = ns.propagate(found, ns.simulate, s, duration=2.0, samples=3, start={"q": 1.0}, draws=40, **QUIET)
    assert band["drawn_c"].min() >= 0.0


def test_what_a_fit_found_of_each_run_is_asked_for() -> None:
    """Two swings of other dampings: neither is that of the system, nor its first guess."""
    t, rng = np.arange(0.0, 12.0, 0.05), np.random.default_rng(1)
    s = ns.mechanical(1.0, "c", "k", coordinates=["q"], parameters={"c": 0.2, "k": 8.8})
    swings = [np.exp(-c / 2 * t) * np.cos(np.sqrt(9.0 - c * c / 4) * t) for c in (0.1, 0.3)]
    runs = [{"q": (t, x + 1e-3 * rng.standard_normal(t.size))} for x in swings]
    found = ns.fit(s, runs, ["c", "k"], per_run=["c"], tries=1, **QUIET)
    asked: dict[str, Any] = {"duration": 2.0, "samples": 3, "start": {"q": 1.0}, "draws": 4, **QUIET}
    with pytest.raises(ValueError, match="'c, 0' was found of run 0 alone: say which value holds here, settings="):
        ns.propagate(found, ns.simulate, s, **asked)
    told = found.estimate("c, 1")
    band = ns.propagate(found, ns.simulate, s, settings={"c": (told.value, told.uncertainty)}, **asked)
    assert band["drawn_c"].mean() == pytest.approx(0.3, abs=5e-3)
