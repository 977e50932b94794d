"""Values of a model and statements about them: the set for a model, required parameters, report, coverage tables."""

from pathlib import Path

import numpy as np
import pytest
from studies.savi2007.tests.identification.coverage import drive_mean
from studies.savi2007.tests.identification.coverage_tables import (
    ASKED,
    BESIDE,
    misses,
    page,
    pooled,
    to_dataset,
    unnamed,
)

import nonsmooth as ns
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.identification.report import report
from nonsmooth_savi2007.identification.referral import mean_of_drive
from nonsmooth_savi2007.identification.statements import for_model, require


def found():
    matrix = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, 0.2], [0.5, 0.2, 16.0]]) * 1e-4
    finding = Finding("k", Estimate(8.0, 0.02, "N/m"), "pulled", 100, ("Run #1",), ("a note",), {"b": Estimate(1, 0.1)})
    return ParameterSet(
        {"k": Estimate(8.0, 0.02, "N/m"), "g": Estimate(2e-3, 0.03, "m")},
        matrix,
        extra={"omega_0": Estimate(4.5, 0.04, "rad/s")},
        findings=[finding],
        identifiability={"k": "rests on springs"},
        notes=["no recordings of: drop, contact"],
        synthetic=True,
    )


def spring(**units):
    return ns.System(
        name="spring",
        states={"q": "m", "w": "m/s"},
        parameters={name: (1.0, unit) for name, unit in units.items()},
        modes={"free": lambda t, u, p: (u.w, -u.q)},
    )


def test_a_model_gets_its_own_parameters_and_nothing_is_lost():
    kept = for_model(found(), spring(k="N/m", rho="N"))
    assert list(kept) == ["k"] and list(kept.extra) == ["g", "omega_0"]
    assert "'spring' has no parameter g" in kept.notes[-1]
    names, matrix = kept.full_covariance["parameter"].values.tolist(), kept.full_covariance.values
    before = found().full_covariance.sel(parameter=names, other=names).values
    assert np.array_equal(matrix, before)
    assert dict(for_model(found(), ns.models.discontinuous_support())) == dict(found())


@pytest.mark.parametrize(
    ("model", "error", "said"),
    [
        (spring(x="m"), ValueError, "'spring' has none of the parameters k, g"),
        (spring(k="N/mm"), ValueError, r"'k' of 'spring' is in N/mm, the one identified in N/m"),
        ("discontinuous_support", TypeError, "model must be a System"),
    ],
)
def test_a_model_that_does_not_fit_is_refused(model, error, said):
    with pytest.raises(error, match=said):
        for_model(found(), model)


def test_what_is_required_must_be_there():
    require(found(), ["k", "g"])
    with pytest.raises(ValueError, match=r"'c_s' was not identified: it needs drop or contact; no recordings of: drop"):
        require(found(), ["c_s"])
    with pytest.raises(ValueError, match="k_s"):
        require(found(), ["ks"])


def test_the_report_has_all_of_it():
    text = report(found())
    for part in (
        "(synthetic recordings)",
        "| k | 8.000 ± 0.020 | 7.9608 to 8.0392 | N/m | rests on springs |",
        "### k = 8.000 ± 0.020 N/m",
        "pulled; from 100 samples of 1 runs",
        "- a note",
        "| k | +1.00 | +0.17 |",
        "no recordings of: drop, contact",
    ):
        assert part in text


def results(bias=0.0, n=40, seed=0):
    rng, rows = np.random.default_rng(seed), []
    for i in range(n):

        def row(truth, error):
            value = truth + error * (rng.standard_normal() + bias)
            return [truth, value, error, value - 1.96 * error, value + 1.96 * error]

        rows.append(
            {
                "seed": i,
                "rows": {name: row(1.0, 1e-6 if name == "g" or "gap" in name else 1e-3) for name in ASKED},
                "beside": {label: row(1.0, 1e-3) for label in BESIDE},
                "truth": {"friction": rng.uniform(0, 0.02)},
            }
        )
    return rows


def test_fair_intervals_pass_and_biased_ones_are_named():
    assert misses(results()) == []
    wrong = misses(results(bias=3.0))
    assert any("k: " in line and "truths lie in their intervals" in line for line in wrong)
    assert any("root mean square of 3." in line for line in wrong)
    far = results()
    far[3]["rows"]["c"][1] = 1.06
    assert any(line.startswith("c: errors of") for line in misses(far))


def test_the_page_counts_what_it_was_given():
    rows = results()
    rows[0]["rows"]["k"][3:] = [2.0, 3.0]
    inside = sum(r["rows"]["k"][3] <= 1.0 <= r["rows"]["k"][4] for r in rows)
    text = page(rows)
    assert f"| k | {inside} of 40 |" in text and "All met." in text and "c by complex response" in text
    data = to_dataset(rows)
    assert data["estimate"].dims == ("rig", "parameter") and data.attrs["synthetic"] == "yes"
    assert float(data["low"].sel(parameter="k", rig=0)) == 2.0


def test_what_no_rig_or_not_every_rig_tells_is_said():
    rows = results(n=4)
    for row in rows:
        del row["rows"]["c_s"]
    del rows[2]["rows"]["c"]
    text = page(rows)
    assert "| c_s | not identified |" in text and "of 3 |" in text and "c_s is known within" not in text
    assert [line for line in misses(rows) if "not identified" in line] == [
        "c: not identified on 1 of 4 rigs",
        "c_s: not identified on 4 of 4 rigs",
    ]
    assert pooled(rows)[1] == 4 * len(ASKED) - 5


def test_an_awkward_rig_has_its_anomalies_counted_in_the_notes():
    truth = {
        "sensor_zero": 4e-4,
        "motor_side": -1.0,
        "motor_wander": 0.0,
        "slipped_tap": 3.0,
        "angle_sign": 1.0,
        "force_sign": 1.0,
        "turn_sign": 1.0,
        "friction": 0.01,
    }
    notes = [
        "impulse: run 'Run #3', channel 'Angle': left out: ...",
        "it rests ..., and not where it was zeroed",
        "the photogate counts backwards in 3 runs",
    ]
    one = {"truth": truth, "notes": notes}
    assert unnamed(one) == {"motor on the other side": True, "photogate reversed": False}
    rows = [row | one for row in results()]
    rows[0]["rows"]["k"][3:] = [2.0, 3.0]
    inside = sum(low <= true <= high for row in rows for true, _, _, low, high in row["rows"].values())
    assert pooled(rows) == (inside, 40 * len(ASKED))
    text = page(rows, awkward=True)
    assert "| motor on the other side | 40 | 0 | 0 |" in text and "| photogate reversed | 0 | 0 | 40 |" in text
    assert f"{inside} of {40 * len(ASKED)} truths" in text and "Anomalies" not in page(rows)


def test_the_campaigns_own_mean_of_the_drive():
    truth = {"ripple": 0.01, "ripple_phase": 0.7, "string_length": 0.8}
    assert drive_mean(truth, 0.039) == pytest.approx(mean_of_drive(0.039, 0.8, 0.01, 0.7), abs=1e-6)


@pytest.mark.parametrize("page_of", ["measured_coverage.md", "measured_coverage_awkward.md"])
def test_the_committed_pages_have_every_row_of_the_program(page_of: str) -> None:
    lines = (Path(__file__).parents[4] / "docs" / page_of).read_text(encoding="utf-8").splitlines()
    named = [line.split("|")[1].strip() for line in lines if line.startswith("| ")]
    assert [name for name in named if name in ASKED] == list(ASKED)
    assert [name for name in named if name in BESIDE] == list(BESIDE)
