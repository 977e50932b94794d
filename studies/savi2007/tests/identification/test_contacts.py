"""Multiple shooting against SciPy's integration of the same equations: contact parameters, gap, one contact alone."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from studies.savi2007.tests.identification.made import (
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
)

from nonsmooth.recordings.session import Quantity
from nonsmooth_savi2007.identification.multiple_shooting import contact_finding, one_contact, shoot_contacts
from nonsmooth_savi2007.identification.referral import counted_gap


@cache
def three_runs():
    return driven(11.15, 0.039, 12.0), driven(8.0, 0.030, 12.0), driven(4.6, 0.0165, 12.0)


@pytest.fixture(scope="module")
def fitted():
    decay = decay_of(W, B, F, PLACE)
    return shoot_contacts(three_runs(), decay, kappa=1.1 * KAPPA, gamma=0.5 * GAMMA)


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
    turned = run(
        "contact",
        runs[0].time,
        runs[0].positions,
        turns=runs[0].turns[:-1] + period * mark / (2 * np.pi),
        crank_length=0.030,
        gap=GAP,
    )
    found = shoot_contacts([turned], decay_of(W, B, F, PLACE), kappa=KAPPA, gamma=GAMMA, mark=mark)
    error = np.sqrt(np.diag(found.covariance))
    assert abs(found.values[7] - 0.030) < 4 * error[7] and abs(found.values[8] - mark) < 4 * error[8] + 1e-3
    assert abs(found.values[3] - KAPPA) < 3.5 * error[3] and not found.left and found.excess < 1.4


def test_one_contact_tells_less_than_all_together(fitted):
    m = 0.84
    many = contact_finding(fitted, Quantity(m))
    single = one_contact(fitted, decay_of(W, B, F, PLACE), m, kappa_error=1e-3 * KAPPA)
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
    assert np.nanmax(np.abs((shown["x"] - shown["fitted"]).values)) < 3 * COUNT


def test_the_fit_is_the_same_from_another_first_guess(fitted):
    decay = decay_of(W, B, F, PLACE)
    other = shoot_contacts(three_runs(), decay, kappa=0.9 * KAPPA, gamma=1.6 * GAMMA)
    error = np.sqrt(np.diag(fitted.covariance))
    # windows are cut where the first guess has no contact: elsewhere
    assert np.all(np.abs(other.values - fitted.values) < 0.4 * error)


def test_a_motor_that_wanders_is_in_the_uncertainty():
    def wandering(omega, size=3e-3):  # within a turn or so: the gate sees it, and not all of it
        rate = omega / 1.2
        return lambda t: omega * t + omega * size / rate * np.sin(rate * t + omega)

    runs = [driven(omega, crank, 10.0, phase=wandering(omega)) for omega, crank in ((11.15, 0.039), (8.0, 0.030))]
    found = shoot_contacts(runs, decay_of(W, B, F, PLACE), kappa=1.1 * KAPPA, gamma=0.5 * GAMMA)
    error = np.sqrt(np.diag(found.covariance))
    assert abs(found.values[3] - KAPPA) < 3 * error[3] and abs(found.values[4] - GAMMA) < 3 * error[4]
    for i in range(2):
        gap = found.place(i, 0)
        assert abs(found.values[gap] - GAP) < 3 * error[gap]
    # how far a line over two turns is off adds to what the residuals show: here it is most of it, and never more
    assert 0.5 < np.max(np.abs(found.by_turns) / error) < 1.0


def told(values, errors, readings):
    """Values that `counted_gap` compares: a gap per run, independent of each other."""
    runs = tuple(SimpleNamespace(name=f"Run #{i + 1}", gap=r) for i, r in enumerate(readings))
    return SimpleNamespace(
        runs=runs, values=np.array(values), covariance=np.diag(np.square(errors)), place=lambda run, which: run
    )


def test_the_gap_of_one_setting_is_the_mean_of_its_runs():
    off = 1e-6 * np.array([1.0, -1.0, 1.0, -1.0, 500.0])
    found = counted_gap(told(1.8e-3 + off, [2e-6] * 5, [0.0018] * 4 + [0.0024]), 0.0018)
    assert found.value == pytest.approx(1.8e-3, abs=1e-12) and found.notes == ()
    assert found.error == pytest.approx(2e-6 / np.sqrt(4))
    assert counted_gap(told([1.8e-3], [1e-6], [0.0018]), 0.0024) is None


def test_a_run_whose_gap_disagrees_is_named_and_left_out():
    values = 1.8e-3 + 1e-6 * np.array([1.0, -1.0, 55.0, 0.0])
    found = counted_gap(told(values, [2e-6] * 4, [0.0018] * 4), 0.0018)
    assert found.places == [0, 1, 3] and found.value == pytest.approx(1.8e-3, abs=1e-12)
    assert "contact Run #3: left out" in found.notes[0] and "+55 µm" in found.notes[0]
    halves = counted_gap(told(1.8e-3 + 1e-5 * np.array([5.0, 5.0, -5.0, -5.0]), [2e-6] * 4, [0.0018] * 4), 0.0018)
    assert halves.error > 5e-5 and "no majority agrees" in halves.notes[0]


def test_records_without_contact_are_refused():
    time = np.arange(0, 10, 0.01)
    free = run(
        "contact",
        time,
        counted(-0.01 + 1e-3 * np.cos(8 * time)),
        turns=np.arange(0.1, 10, np.pi / 4),
        crank_length=0.01,
        gap=0.0018,
    )
    with pytest.raises(ValueError, match="no run shows a contact"):
        shoot_contacts([free], decay_of(W, B, F), kappa=KAPPA, gamma=GAMMA)
