"""Multiple shooting against SciPy's integration of the same equations: contact parameters, gap, one contact alone."""

import numpy as np
import pytest
from tests.identification.made import (
    COUNT,
    GAMMA,
    GAP,
    KAPPA,
    PLACE,
    B,
    F,
    W,
    counted,
    decay_of,
    driven,
    run,
)  # fmt: skip

from nonsmooth.experiment.session import Quantity
from nonsmooth.identification.contact_findings import contact_finding, one_contact
from nonsmooth.identification.multiple_shooting import shoot_contacts


@pytest.fixture(scope="module")
def fitted():
    runs = [driven(11.15, 0.039), driven(8.0, 0.030), driven(4.6, 0.0165)]
    return shoot_contacts(
        runs, decay_of(W, B, F, PLACE), resolution=COUNT, kappa=1.1 * KAPPA, gamma=0.5 * GAMMA, pieces_per_run=12
    )


def test_contact_parameters_and_gap_lie_within_their_uncertainty(fitted):
    error = np.sqrt(np.diag(fitted.covariance))
    assert abs(fitted.values[3] - KAPPA) < 3.5 * error[3] < 0.02 * KAPPA
    assert abs(fitted.values[4] - GAMMA) < 3.5 * error[4] < 0.2 * GAMMA
    for i in range(3):
        gap, place = fitted.place(i, 0), fitted.place(i, 1)
        assert abs(fitted.values[gap] - GAP) < 3.5 * error[gap] < 4e-5
        assert abs(fitted.values[place] - PLACE) < 3.5 * error[place]
    assert fitted.n_contacts > 25


@pytest.mark.parametrize("mark", [np.pi, 1.0])
def test_the_gates_mark_may_be_anywhere(mark):
    # the crank stands at `mark` when the gate sees it: a motor on the other side is a mark at half a turn
    runs = [driven(8.0, 0.030, phase=lambda t: 8.0 * t)]
    period = 2 * np.pi / 8.0
    turned = run("contact", runs[0].time, runs[0].positions, turns=runs[0].turns[:-1] + period * mark / (2 * np.pi),
                 crank_length=0.030, gap=GAP)  # fmt: skip
    found = shoot_contacts(
        [turned], decay_of(W, B, F, PLACE), resolution=COUNT, kappa=KAPPA, gamma=GAMMA, pieces_per_run=12, mark=mark
    )
    error = np.sqrt(np.diag(found.covariance))
    drive = found.values[7:9]
    np.testing.assert_allclose(drive, 0.030 * np.array([np.cos(mark), -np.sin(mark)]), atol=4 * error[7:9].max() + 2e-5)
    assert abs(found.values[3] - KAPPA) < 3.5 * error[3] and found.fit.used.all() and found.fit.reduced < 2


def test_one_contact_tells_less_than_all_together(fitted):
    m = 0.84
    many = contact_finding(fitted, Quantity(m), resolution=COUNT)
    single = one_contact(fitted, m, resolution=COUNT, kappa_error=1e-3 * KAPPA)
    assert many.estimate.logarithmic and single.estimate.factor > many.estimate.factor > 1
    # by the root of their number and more
    ratio = np.log(single.estimate.factor) / np.log(many.estimate.factor)
    assert ratio > 0.5 * np.sqrt(fitted.n_contacts)
    data = single.data
    assert float(data["cost"].min()) == pytest.approx(0, abs=1e-9) and data.attrs["parameter"] == "c_s"
    assert float(data["low"]) < single.value < float(data["high"])
    shown = many.data
    used = shown["segment"].values >= 0
    assert np.all(np.isfinite(shown["fitted"].values) == used) and used.any()
    assert np.nanmax(np.abs(shown["residual"].values)) < 3 * COUNT


def test_records_without_contact_are_refused():
    time = np.arange(0, 10, 0.01)
    free = run("contact", time, counted(-0.01 + 1e-3 * np.cos(8 * time)), turns=np.arange(0.1, 10, np.pi / 4),
               crank_length=0.01, gap=0.0018)  # fmt: skip
    with pytest.raises(ValueError, match="no run shows a contact"):
        shoot_contacts([free], decay_of(W, B, F), resolution=COUNT, kappa=KAPPA, gamma=GAMMA)
