"""Records under measured inputs laid over their model: motions in closed form between the samples of the force."""

import numpy as np
import pytest
from tests.identification.driven_mass import driven

import nonsmooth as ns

pytestmark = pytest.mark.physics
C, WALL = 0.2, 0.25
T = np.arange(0.0, 20.0, 0.02)


def mass(e: float = 0.7, k: float = 4.0) -> ns.System:
    return ns.mechanical(
        1.0,
        C,
        "k",
        coordinates=["q"],
        parameters={"e": e, "k": k},
        inputs={"force": "N"},
        forcing={"q": lambda t, p: p.force},
        elements={"wall": ns.elements.Stop(at="q", position=WALL, restitution="e")},
    )


def pushed(seed: int, t: np.ndarray = T) -> np.ndarray:
    return 6 * np.convolve(np.random.default_rng(seed).normal(size=len(t)), np.ones(12) / 12, "same")


STILL = {"q": 0.0, "v_q": 0.0}


@pytest.mark.parametrize("k", [4.0, 4.2])
def test_a_record_lies_over_its_model_as_far_as_closed_forms_do(k: float) -> None:
    force, noise = pushed(4), 0.01 * np.random.default_rng(5).normal(size=len(T))
    true, hits = driven(T, force, C, 4.0, WALL, 0.7)
    model, _ = driven(T, force, C, k, WALL, 0.7)
    assert hits == 8
    found = ns.compare(
        {"q": (T, true[:, 0] + noise)}, mass(k=k), inputs={"force": (T, force)}, start=STILL, noise=[0.01]
    )
    assert found.attrs["comparison"] == "record" and "theory_low" not in found
    np.testing.assert_allclose(found["theory"].values[:, 0], model[:, 0], atol=1e-9)
    left = true[:, 0] + noise - model[:, 0]
    assert found["difference"].values == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)
    assert found["difference_over_noise"].values == pytest.approx(100 * np.sqrt(np.mean(left**2)), rel=1e-6)
    assert found["inside_band"].values == pytest.approx(np.mean(np.abs(left) <= 0.02), abs=2e-3)


def test_a_speed_beside_an_impact_stands_on_the_side_of_its_reading() -> None:
    """A restitution and a spring a little off: impacts come between other readings, and no difference is a jump."""
    force = pushed(4)
    true, _ = driven(T, force, C, 4.0, WALL, 0.7)
    given = {"inputs": {"force": (T, force)}, "start": STILL, "noise": [0.01]}
    found = ns.compare({"v_q": (T, true[:, 1])}, mass(e=0.701, k=4.01), **given)
    model, _ = driven(T, force, C, 4.01, WALL, 0.701)
    assert np.abs(true - model)[:, 1].max() > 0.1 > 5 * np.abs(found["measured"] - found["theory"]).max()


@pytest.mark.parametrize("seeds", [(2, 4), pytest.param(range(6), marks=pytest.mark.slow)])
def test_the_band_of_a_fit_holds_the_motion(seeds: tuple[int, ...] | range) -> None:
    """Its 95 % interval at each reading, with the start that was found: of six records nine tenths and more."""
    t, shares = np.arange(0.0, 12.0, 0.02), []
    for seed in seeds:
        force = pushed(seed, t)
        true, _ = driven(t, force, C, 4.0, WALL, 0.7)
        rng = np.random.default_rng(100 + seed)
        read, given = {"q": (t, true[:, 0] + 0.01 * rng.normal(size=len(t)))}, {"force": (t, force)}
        fitted = ns.fit(mass(e=0.68, k=4.1), read, ["e", "k"], inputs=given, progress=False)
        found = ns.compare(read, mass(), inputs=given, parameters=fitted, draws=80)
        low, high = (found[f"theory_{end}"].values[:, 0] for end in ("low", "high"))
        shares.append(np.mean((true[:, 0] >= low) & (true[:, 0] <= high)))
        assert found["difference_over_noise"].values == pytest.approx(1.0, abs=0.05)
        assert found["band_share"] == 1 and 0.93 < found["inside_band"] <= 1
        assert np.mean(high - low) < 0.006  # of readings with 0.01
    assert np.mean(shares) > 0.8


def test_a_sensor_is_read_as_the_fit_read_it() -> None:
    t = T[:400]
    force = pushed(2, t)
    true, _ = driven(t, force, C, 4.0, WALL, 0.7)
    volts = 3.0 * true[:, 0] + 0.5 + 0.01 * np.random.default_rng(1).normal(size=len(t))
    read, given = {"laser": (t, volts)}, {"force": (t, force)}
    sensor = {"q": ns.Sensor("laser", gain=2.8)}
    asked = {"inputs": given, "measured": sensor, "tries": 1, "progress": False}
    fitted = ns.fit(mass(), read, ["k", "q.gain", "q.offset"], **asked)
    found = ns.compare(read, mass(), inputs=given, channels={"q": "laser"}, parameters=fitted, draws=0)
    np.testing.assert_allclose(found["theory"].values[:, 0], true[:, 0], atol=3e-3)
    assert found["difference_over_noise"].values == pytest.approx(1.0, abs=0.05)


def test_a_motion_begins_where_that_of_a_fit_began_which_found_a_delay() -> None:
    t = T[:400]
    force = pushed(2, t)
    true, _ = driven(t, force, C, 4.0, WALL, 0.7)
    noise = 0.01 * np.random.default_rng(1).normal(size=len(t))
    read, given = {"laser": (t + 0.13, true[:, 0] + noise)}, {"force": (t, force)}
    asked = {"inputs": given, "measured": {"q": "laser"}, "tries": 1, "progress": False}
    fitted = ns.fit(mass(), read, ["k", "q.delay"], **asked)
    found = ns.compare(read, mass(), inputs=given, channels={"q": "laser"}, parameters=fitted, draws=0)
    np.testing.assert_allclose(found["theory"].values[:, 0], true[:, 0], atol=5e-3)
    assert found["difference_over_noise"].values == pytest.approx(1.0, abs=0.05)


def test_what_is_missing_is_said() -> None:
    read, given = {"q": (T, np.sin(T))}, {"force": (T, np.cos(T))}
    with pytest.raises(ValueError, match="nothing says with which q, v_q: give start=, or parameters= as the fit"):
        ns.compare(read, mass(), inputs=given)
    force = pushed(4)
    true, _ = driven(T, force, C, 4.0, WALL, 0.7)
    begun = {"q": (T[:200], true[:200, 0] + 0.01 * np.random.default_rng(5).normal(size=200))}
    fitted = ns.fit(mass(), begun, ["k"], inputs={"force": (T, force)}, progress=False)
    with pytest.raises(ValueError, match="parameters= as the fit of these readings returns them"):
        ns.compare({"q": (T[:400], true[500:900, 0])}, mass(), inputs={"force": (T, force)}, parameters=fitted)
    with pytest.raises(ValueError, match="inputs: 'force' is missing"):
        ns.compare(read, mass(), start=STILL)
    with pytest.raises(ValueError, match="no inputs"):
        ns.compare({"x": read["q"]}, ns.models.impact_oscillator(), inputs=given, start=[0.0, 0.0])
