"""Settings with their uncertainty, drawn together with the parameters."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.identification.compare.draws import draw_systems, nominal, read_settings, settled

MODEL = ns.models.discontinuous_support()


def test_settings_are_numbers_pairs_tables_or_rules() -> None:
    gap = {"value": 0.01, "uncertainty": 1e-3}
    read = read_settings({"rho": lambda p: 0.01 * p["k"], "omega": 4.0, "g": gap, "c": (0.9, 0.1)}, MODEL)
    assert read["rho"].follows and not read["omega"].follows
    assert read["g"] == (0.01, 1e-3) and read["c"].uncertainty == 0.1
    assert settled(read, {"k": 8.0}) == {"rho": 0.08, "omega": 4.0, "g": 0.01, "c": 0.9}
    assert nominal(MODEL, {"k": 7.0}, read).values["rho"] == pytest.approx(0.07)


def test_a_rule_has_an_uncertainty_of_its_own() -> None:
    """g = 1 mm + rho / 100 with a standard uncertainty of 0.1 mm, rho exact: the drawn g has that mean and spread."""
    settings = read_settings({"rho": 0.2, "g": (lambda p: 1e-3 + p["rho"] / 100, 1e-4)}, MODEL)
    systems, drawn = draw_systems(MODEL, None, settings, 2000, seed=0)
    assert np.mean(drawn["g"]) == pytest.approx(3e-3, abs=4 * 1e-4 / np.sqrt(2000))
    assert np.std(drawn["g"]) == pytest.approx(1e-4, rel=0.07)
    assert systems[7].values["g"] == drawn["g"][7]


def test_along_a_diagram_the_error_of_a_rule_stays() -> None:
    """g follows rho; a drawn system is off its rule by the same error at every point of the diagram."""
    from nonsmooth.identification.compare.draws import Model
    from nonsmooth.identification.compare.predict import carried

    rule = read_settings({"g": (lambda p: p["rho"] / 10, 1e-3)}, MODEL)
    base = nominal(MODEL, None, rule).with_parameters(omega=9.0, rho=0.1)
    drawn = base.with_parameters(g=0.01 + 2e-3)
    grid = np.array([0.05, 0.1])
    options = {"grid": 128, "transient": 300, "max_period": 4, "draws": 0, "level": 0.95, "splits": 400, "seed": 0}
    model = Model(MODEL, ["x", "v"], None, rule, np.zeros(2), {}, **options)
    (slot,) = carried(drawn, model, "rho", grid, ["up"])
    for i, rho in enumerate(grid):
        alone = ns.poincare(base.with_parameters(rho=rho, g=rho / 10 + 2e-3), n=1, transient=600)["section"].values
        np.testing.assert_allclose(slot.kept.section[i, -1], alone[0], atol=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rhoo": 1.0}, "`rhoo` is not a parameter"),
        ({"rho": (1.0, -0.1)}, "the uncertainty of setting 'rho' is -0.1"),
        ({"rho": {"value": 1.0, "error": 0.1}}, "write {value = ..., uncertainty = ...}"),
    ],
)
def test_wrong_settings_are_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_settings(given, MODEL)
