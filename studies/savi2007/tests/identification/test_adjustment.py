"""The adjustment against the closed form of its simplest cases, and the parameter set's own algebra."""

import numpy as np
import pytest

from nonsmooth.errors import SolveError
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth_savi2007.identification.adjustment import Observation, adjust


def one(name, value, error):
    return Observation((name,), np.array([value]), np.array([[error**2]]))


def test_the_gain_is_shared_by_both_stiffnesses():
    found = adjust(
        [one("mass", 0.8, 1e-3), one("spring_slope", 17.0, 1e-4), one("support_slope", 1200.0, 1e-2)], gain_limit=0.01
    )
    i, j = found.names.index("k"), found.names.index("k_s")
    relative = np.sqrt(np.diag(found.covariance)) / np.abs(found.values)
    assert relative[i] == pytest.approx(0.01 / np.sqrt(3), rel=1e-3)
    correlation = found.covariance[i, j] / np.sqrt(found.covariance[i, i] * found.covariance[j, j])
    assert correlation == pytest.approx(1.0, abs=1e-3)


def test_a_motion_and_the_scale_tell_the_gain():
    k, m, gain = 8.5, 0.84, 1.007
    omega = np.sqrt(2 * k / m)
    found = adjust(
        [
            one("mass", m, 1e-3),
            one("omega_0", omega, 1e-6),
            one("spring_slope", 2 * k * gain, 1e-5),
            one("support_slope", 1200 * gain, 1e-3),
        ],
        gain_limit=0.01,
    )
    u_m, u_gain = 1e-3 / m, 0.01 / np.sqrt(3)
    # two sources of one ratio: weights by inverse variance
    shrink = (1 / u_m**2) / (1 / u_m**2 + 1 / u_gain**2)
    assert found["gain"] - 1 == pytest.approx(shrink * (gain - 1), rel=0.02)
    expected = np.hypot(u_m, 0) * np.sqrt(shrink)
    i = found.names.index("k_s")
    assert np.sqrt(found.covariance[i, i]) / 1200 == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("gain", [1.004, 1.02])
def test_the_birge_ratio_of_a_gain_told_twice_is_its_closed_form(gain):
    # one degree of freedom: the gain by S / (m omega_0^2), where only the mass errs, against 1 +- limit / sqrt(3)
    m, u_m, omega, limit = 0.84, 1e-3, 4.5, 0.01
    found = adjust(
        [one("mass", m, u_m), one("omega_0", omega, 1e-8), one("spring_slope", m * omega**2 * gain, 1e-8)],
        gain_limit=limit,
    )
    expected = (gain - 1) / np.hypot(limit / np.sqrt(3), gain * u_m / m)
    assert found.freedom == 1
    assert found.birge == pytest.approx(expected, rel=0.01)


def test_the_birge_ratio_of_a_frequency_told_twice_is_its_closed_form():
    # k_s / M by the drop and by k_s / m of contacts: gain known from nothing, one degree of freedom
    found = adjust(
        [
            one("mass", 0.84, 1e-6),
            one("test_mass", 1.33, 1e-6),
            one("kappa", 1440.0, 2.0),
            Observation(("omega_s", "b_s"), np.array([30.2, 0.45]), np.diag([0.01**2, 0.01**2])),
        ],
        gain_limit=0.01,
    )
    by_drop, by_contact = 1.33 * 30.2**2, 0.84 * 1440.0
    error = np.hypot(1.33 * 2 * 30.2 * 0.01, 0.84 * 2.0)
    assert found.freedom == 1
    assert found.birge == pytest.approx(abs(by_drop - by_contact) / error, rel=1e-3)
    assert "k" not in found.names


def test_without_redundancy_there_is_no_birge_ratio():
    found = adjust([one("mass", 0.84, 1e-3), one("omega_0", 4.5, 1e-6)], gain_limit=0.01)
    assert found.freedom == 0 and np.isnan(found.birge)


def test_an_adjustment_that_does_not_converge_is_refused():
    # k_s / m says 8.4 N/m, the sensor 1200: no gain near 1 brings them together
    given = [
        one("mass", 0.84, 1e-3),
        one("omega_0", 4.5, 1e-6),
        one("kappa", 10.0, 1e-5),
        one("support_slope", 1200.0, 1e-3),
    ]
    with pytest.raises(SolveError, match=r"not converged after 50 rounds: '[a-z_]+' still changes .* look at the mass"):
        adjust(given, gain_limit=0.01)


def test_no_mass_is_an_error():
    with pytest.raises(ValueError, match="weigh it"):
        adjust([one("omega_0", 4.5, 1e-3)], gain_limit=0.01)


def test_a_parameter_set_goes_through_a_file_and_draws_what_it_says(tmp_path):
    from nonsmooth.results.store import load, save

    covariance = np.array([[0.01, 0.004, 0.0], [0.004, 0.04, 0.0], [0.0, 0.0, 1e-4]])
    given = ParameterSet(
        {"k": Estimate(8.0, 0.1, "N/m"), "c_s": Estimate(0.6, 0.2, "N s/m", logarithmic=True)},
        covariance,
        extra={"omega_0": Estimate(4.5, 0.01, "rad/s")},
        identifiability={"c_s": "hardly"},
        synthetic=True,
    )
    back = ParameterSet.from_dataset(load(save(given.to_dataset(), tmp_path / "p.nc")))
    assert dict(back) == dict(given) and back.interval("c_s") == given.interval("c_s")
    assert np.array_equal(back.full_covariance.values, covariance) and back.synthetic
    drawn = given.draw(20_000, seed=1)
    assert np.all(drawn["c_s"] > 0)
    assert drawn["k"].std() == pytest.approx(0.1, rel=0.03)
    assert np.log(drawn["c_s"]).std() == pytest.approx(0.2 / 0.6, rel=0.03)
    assert np.corrcoef(drawn["k"], np.log(drawn["c_s"]))[0, 1] == pytest.approx(0.004 / (0.1 * 0.2), abs=0.03)
    assert list(given.covariance["parameter"].values) == ["k", "c_s"]


def test_findings_are_read_as_files_hold_them_and_as_the_first_files_did():
    import json

    given = Finding("k", Estimate(8.0, np.inf, "N/m", 0.1), "m", 3, ("a",), ("n",), {"c": Estimate(0.6, 0.2)})
    record = json.loads(json.dumps(given.to_record()))
    lists = {"estimate": [8.0, "inf", "N/m", 0.1, False], "others": {"c": [0.6, 0.2, "", 0.0, False]}}
    for one in (record, record | lists):
        assert vars(Finding.from_record(one)) == vars(given)


def test_a_parameter_set_goes_into_a_system():
    from nonsmooth.models import discontinuous_support

    given = ParameterSet({"k": Estimate(8.0, 0.1, "N/m")}, [[0.01]])
    assert discontinuous_support().with_parameters(given).values["k"] == 8.0
