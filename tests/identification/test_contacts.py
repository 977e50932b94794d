"""Multiple shooting against SciPy's integration of the same equations: contact parameters, gap, one contact alone."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.identification.made import COUNT, counted, decay_of, run

from nonsmooth.experiment.session import Quantity
from nonsmooth.identification.contact_findings import contact_finding, one_contact
from nonsmooth.identification.multiple_shooting import shoot_contacts

W, B, F, KAPPA, GAMMA, GAP, PLACE = 4.5, 1.04, 0.0, 1440.0, 0.70, 0.0018, 3e-5


def driven(omega, crank, duration=16.0):
    """Contact from x = g on, and until k_s (x - g) + c_s v vanishes, by events."""

    def rate(touching):
        def field(t, u):
            push = KAPPA * (u[0] - GAP) + GAMMA * u[1] if touching else 0.0
            return u[1], W**2 * (0.5 * crank * np.cos(omega * t) + PLACE - u[0]) - B * u[1] - push

        return field

    def begins(t, u):
        return u[0] - GAP

    def ends(t, u):
        return KAPPA * (u[0] - GAP) + GAMMA * u[1]

    begins.terminal, begins.direction, ends.terminal, ends.direction = True, 1, True, -1
    rng = np.random.default_rng(round(100 * omega))
    time = np.arange(0, duration, 0.01)
    at, x = time + np.abs(5e-5 * rng.standard_normal(len(time))), np.zeros(len(time))
    t, u, touching, done = 0.0, np.zeros(2), False, 0
    while done < len(at):
        solved = solve_ivp(rate(touching), (t, duration + 0.1), u, "DOP853", events=ends if touching else begins,
                           rtol=1e-10, atol=1e-13, dense_output=True)  # fmt: skip
        t, u = solved.t[-1], solved.y[:, -1]
        inside = (at >= solved.t[0]) & (at <= t)
        x[inside], done = solved.sol(at[inside])[0], done + np.count_nonzero(inside)
        touching = not touching
    keep = time > 4.0
    turns = np.arange(np.ceil(4.0 * omega / (2 * np.pi)) * 2 * np.pi / omega, duration, 2 * np.pi / omega)
    return run("contact", time[keep], counted(x[keep]), turns=turns, name=f"{omega}", crank_length=crank, gap=0.0018)


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
