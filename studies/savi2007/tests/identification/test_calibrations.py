"""Calibrations of the drive from exact laws: the motor's line with its offset, the crank's force with its string."""

import numpy as np
import pytest
from studies.savi2007.tests.identification.made import run

from nonsmooth.identification.finding import Estimate
from nonsmooth_savi2007.identification.calibrations import crank_force, scattered_line, voltage_frequency

SLOPE, OFFSET = 1.25, 0.97


def motor(volts, scatter=0.0, rng=None):
    found = []
    for i, v in enumerate(volts):
        omega = SLOPE * (v - OFFSET) + (0.0 if rng is None else scatter * rng.standard_normal())
        turns = 1e-4 * np.rint(1e4 * (0.3 + 2 * np.pi / omega * np.arange(40)))
        found.append(run("voltage", turns, turns=turns, name=f"Run #{i + 1}", voltage=v))
    return found


def test_the_motors_line_has_its_offset():
    found = voltage_frequency(motor(range(2, 13)))
    assert abs(found.value - SLOPE) < 3.5 * found.uncertainty < 1e-5
    offset = found.others["offset"]
    assert abs(offset.value - OFFSET) < 3.5 * offset.uncertainty < 1e-4
    assert found.others["intercept"].value == pytest.approx(-SLOPE * OFFSET, abs=1e-4)
    assert "0.970 V" in found.notes[0] and found.plot == "calibration"
    d = found.data
    assert np.all((d["fitted_low"] <= d["fitted"]) & (d["fitted"] <= d["fitted_high"]))


def test_the_offsets_uncertainty_is_its_scatter():
    # a motor whose frequency differs by 10 mrad/s from run to run, far more than the gate's times say
    rng = np.random.default_rng(2)
    drawn = [voltage_frequency(motor(range(2, 13), 0.01, rng)) for _ in range(60)]
    for pick in (lambda f: f.estimate, lambda f: f.others["offset"]):
        rows = [pick(found) for found in drawn]
        assert np.std([row.value for row in rows]) == pytest.approx(np.mean([row.uncertainty for row in rows]), rel=0.3)
    assert "scatter" in drawn[0].notes[-1]


def test_too_few_voltages_are_refused():
    with pytest.raises(ValueError, match="three different voltages or more, got 2"):
        voltage_frequency(motor([3, 3, 4]))


def held(lengths, k=8.5, string=0.6, ripple=0.02, beta=0.7, zero=0.0, omega=4.0, seed=0):
    rng, found = np.random.default_rng(seed), []
    for i, a in enumerate(lengths):
        t = np.arange(0, 20, 0.01)
        phi = omega * t + ripple * np.sin(omega * t + beta)
        true = a + zero
        d = true * np.cos(phi) + string - np.sqrt(string**2 - (true * np.sin(phi)) ** 2)
        force = 0.03 * np.rint((k * d + 0.4 + 0.02 * rng.standard_normal(len(t))) / 0.03)
        turns = np.arange(0.01, 20, 2 * np.pi / omega)
        found.append(run("crank", t, force=force, turns=turns, name=f"Run #{i + 1}", crank_length=a))
    return found


LENGTHS = (0.01, 0.02, 0.03, 0.04, 0.05, 0.06)


def test_the_cranks_force_is_k_a_whatever_the_string_adds():
    found = crank_force(held(LENGTHS), k=Estimate(8.5, 0.01, "N/m"))
    alone = found.others["slope_a"]
    assert alone.value == pytest.approx(8.5, abs=3.5 * alone.uncertainty + 1e-3 * 8.5)
    assert abs(found.others["intercept"].value) < 3.5 * found.others["intercept"].uncertainty
    assert found.estimate.half_width == pytest.approx(0.01 * found.value)
    assert any("k = 8.500" in note for note in found.notes)
    assert any("0.14 N is a crank of 16." in note for note in found.notes)


def test_a_crank_read_from_a_wrong_zero_is_an_intercept():
    found = crank_force(held(LENGTHS, zero=1e-3, string=1e3, ripple=0.0))
    intercept = found.others["intercept"]
    assert abs(intercept.value - 8.5e-3) < 3.5 * intercept.uncertainty < 3e-3


def test_a_run_of_less_than_two_turns_is_refused():
    runs = held(LENGTHS[:3])
    short = run(
        "crank",
        runs[0].force["time"].values[:300],
        force=runs[0].force.values[:300],
        turns=[0.0, 1.57, 3.14],
        name="Run #9",
        crank_length=0.01,
    )
    with pytest.raises(ValueError, match=r"crank Run #9: holds 1 whole turns"):
        crank_force([short, *runs])


def test_a_line_through_points_of_unequal_errors_is_the_closed_form():
    x, y, error = np.array([0.0, 1.0, 2.0, 4.0]), np.array([1.0, 0.9, 0.2, 0.0]), np.array([0.5, 1.0, 0.7, 2.0])
    line, covariance, scatter = scattered_line(x, y, error)
    weight = error**-2.0
    middle, height = np.average(x, weights=weight), np.average(y, weights=weight)
    spread = np.sum(weight * (x - middle) ** 2)
    slope = np.sum(weight * (x - middle) * (y - height)) / spread
    assert scatter == 0
    assert line == pytest.approx((slope, height - slope * middle))
    own = [[1 / spread, -middle / spread], [-middle / spread, 1 / weight.sum() + middle**2 / spread]]
    assert covariance == pytest.approx(np.array(own))
