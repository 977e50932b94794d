"""The gap: the drive's mean by quadrature, its fit, and the bracket of the graze from runs in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest
from studies.savi2007.tests.identification import made
from studies.savi2007.tests.identification.made import COUNT, counted, decay_of, driven, run, swinging

from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.identification.grazing import _sensor_error, _unseen, grazing_gap
from nonsmooth_savi2007.identification.referral import mean_of_drive, mean_shift
from nonsmooth_savi2007.identification.response_fits import grazing_amplitude
from nonsmooth_savi2007.identification.steady import steady

W, B, F, KAPPA = 4.5, 1.04, 0.01, 1400.0


@pytest.mark.parametrize(
    ("a", "length", "ripple", "beta"), [(0.039, 0.5, 0.0, 0.0), (0.06, 0.5, 0.02, 0.7), (0.0165, 2.0, 0.02, 3.0)]
)
def test_the_mean_of_the_drive(a, length, ripple, beta):
    theta = np.arange(4096) * 2 * np.pi / 4096
    phi = theta + ripple * np.sin(theta + beta)
    d = a * np.cos(phi) + length - np.sqrt(length**2 - (a * np.sin(phi)) ** 2)
    # left out: ripple times string, of the second order together
    assert mean_of_drive(a, length, ripple, beta) == pytest.approx(d.mean(), abs=1e-8 + ripple**2 * a**2 / length)


def test_fig_13_with_half_a_metre_of_string_is_off_by_0_4_mm():
    # rho = 0.33 N on 8.47 N/m; the car moves by half of what its driven end does
    assert mean_of_drive(0.33 / 8.47, 0.5) / 2 == pytest.approx(0.38e-3, abs=1e-5)


def moved(length, ripple_part, zero, n=6, seed=0, cranks=(0.0165, 0.035)):
    """Steady runs whose mean is moved by a string of this length; a negative one: the motor is on the other side."""
    rng = np.random.default_rng(seed)
    return steady(
        [
            swinging(omega, 0.01, 0.3, zero + a**2 / (8 * length) + ripple_part * a, crank=a, rng=rng)
            for a in cranks
            for omega in np.linspace(3, 7, n)
        ]
    )


def test_the_shift_is_that_of_string_and_ripple():
    found = mean_shift(moved(0.7, 2e-3, 1e-4), 1e-4, 1e-7, string=Quantity(0.705, 0.005))
    value, error = found.at(0.039)
    assert abs(value - (0.039**2 / (8 * 0.7) + 2e-3 * 0.039)) < 3.5 * error < 2e-5
    assert found.alpha > 0 and found.notes == ()


@pytest.mark.parametrize("side", [1, -1])
def test_the_motors_side_is_read_off_the_runs_and_not_off_the_string(side):
    found = mean_shift(moved(side * 0.7, 2e-3, 1e-4), 1e-4, 1e-6, string=Quantity(0.705, 0.005))
    true = side * 0.039**2 / (8 * 0.7) + 2e-3 * 0.039
    value, error = found.at(0.039)
    assert np.sign(found.alpha) == side and abs(value - true) < 3.5 * error < 2e-5
    assert ["away from the support" in note for note in found.notes] == ([True] if side < 0 else [])


@pytest.mark.parametrize("side", [1, -1])
def test_where_no_run_tells_the_side_the_shift_is_uncertain_by_it_and_that_is_said(side):
    for seen, words in (
        (moved(0.7, 0, 0).only(False), "no run without the support tells"),
        (moved(side * 0.7, 1e-3, 0, cranks=(0.02,)), "the 6 runs without the support do not tell"),
    ):
        found = mean_shift(seen, 0.0, 1e-6, string=Quantity(0.7, 0.005))
        assert found.alpha == pytest.approx(0.0, abs=0.5 / (8 * 0.7)) and words in found.notes[0]
        value, error = found.at(0.039)
        assert abs(value - side * mean_of_drive(0.039, 0.7) / 2) < 2 * error
    value, error = found.at(0.02)  # where there are runs, they tell the shift whatever the side is
    assert abs(value - side * 0.02**2 / 5.6 - 2e-5) < 3.5 * error < 1e-5


def test_a_string_that_the_runs_contradict_is_not_used_and_named():
    found = mean_shift(moved(0.7, 0, 0), 0.0, 1e-6, string=Quantity(1.4, 0.005))
    value, error = found.at(0.039)
    assert abs(value - mean_of_drive(0.039, 0.7) / 2) < 3.5 * error < 1e-5
    assert "the notebook 1.4 m" in found.notes[0] and "string_length is not used" in found.notes[0]


def test_rest_sensor_zero_and_mean_position_are_three_things():
    # zeroed 0.4 mm beside rest: the mean position in the sensor's count moves with it, the shift from rest does not
    one, other = (mean_shift(moved(0.7, 2e-3, rest), rest, 1e-6, string=Quantity(0.7, 0.005)) for rest in (0.0, -4e-4))
    assert other.rest == pytest.approx(-4e-4, abs=3e-6)
    assert other.at(0.039)[0] == pytest.approx(one.at(0.039)[0], abs=3 * one.at(0.039)[1])
    assert other.place(0.039)[0] - one.place(0.039)[0] == pytest.approx(-4e-4, abs=3e-6)
    # runs at two cranks and the string tell the place of rest too, where no tap does
    without = mean_shift(moved(0.7, 2e-3, -4e-4), 0.0, 1e-3, string=Quantity(0.7, 0.005))
    assert abs(without.rest + 4e-4) < 3 * np.sqrt(without.covariance[0, 0]) < 3e-4


def test_friction_moves_the_place_of_a_car_that_goes_longer_one_way():
    # x = A cos t + A_2 sin 2t: v = -A sin t + 2 A_2 cos 2t turns near 0 and pi, both later by 2 A_2/A and earlier by it
    seen = steady([swinging(5.0, 0.02, 0.0, 0.0, crank=0.0165, second=0.0)])
    assert seen.lean[0] == pytest.approx(0, abs=2e-4)
    time = np.arange(0, 12, 0.01)
    a, a2 = 0.02, 2e-4
    x = counted(a * np.cos(5 * time) + a2 * np.sin(10 * time))
    turned = steady([run("response", time, x, turns=np.arange(0, 12, 2 * np.pi / 5), crank_length=0.0165)])
    assert turned.lean[0] == pytest.approx(4 * a2 / (np.pi * a), rel=0.02)
    dry = 1e-3
    still, held = (mean_shift(turned, 0.0, 1e-7, string=Quantity(0.7, 0.05), dry=d) for d in (0.0, dry))
    assert held.at(0.0165)[0] - still.at(0.0165)[0] == pytest.approx(dry * turned.lean[0], rel=0.05)


def stepping(gap, place=2e-5, crank=0.010, scale=1.0, order=-1, seed=1, mixed=False):
    """Frequency steps towards resonance; where the free motion would pass the gap, the mean is pushed back."""
    rng, found = np.random.default_rng(seed), []
    for i, omega in enumerate(np.arange(9.0, 7.99, -0.05)[::-order]):
        size = scale * grazing_amplitude(omega, crank, W, B, F)
        beyond = max(size - gap, 0.0)
        name = f"Run #{i + 1}"
        a = crank if not mixed or i else 2 * crank
        found.append(swinging(omega, size, 0.3, place - 1.5 * beyond, crank=a, rng=rng, name=name))
    return found


def test_the_graze_brackets_the_gap():
    gap = grazing_amplitude(8.43, 0.010, W, B, F)
    found = grazing_gap(stepping(gap), decay_of(W, B, F, 1e-6), kappa=KAPPA)
    low, high = found.interval(0.999)
    assert low < gap < high and high - low < 8e-5
    frequency = found.others["grazing_frequency"]
    assert abs(frequency.value - 8.43) <= frequency.half_width + 1e-4
    assert found.others["at_rest"].value == pytest.approx(found.value + 2e-5 - 1e-6, abs=2e-6)
    assert found.data["contact"].values.sum() == 9


def test_a_push_too_light_to_be_seen_widens_the_bracket():
    gap, crank = grazing_amplitude(8.43, 0.010, W, B, F), 0.010
    found = grazing_gap(stepping(gap), decay_of(W, B, F, 1e-6), kappa=KAPPA)
    a = [grazing_amplitude(w, crank, W, B, F) for w in (8.45, 8.40)]
    # the mean of a run is seen to 0.06 counts at best: by as much a car that goes p beyond the gap is pushed
    least = _unseen(0.06 * COUNT, a[0], KAPPA / W**2)
    assert least > 3e-6
    assert found.estimate.half_width > 0.5 * (a[1] - a[0] + least)
    assert found.estimate.half_width < 0.5 * (a[1] - a[0] + 4 * least)


@pytest.mark.parametrize("depth", [2e-6, 2e-5])
def test_the_push_of_a_light_contact_by_quadrature(depth):
    amplitude, stiff = 2e-3, KAPPA / W**2
    theta = np.linspace(-np.pi, np.pi, 2_000_001)
    x = amplitude * np.cos(theta)
    # the mean of the support's force over 2k, k_s / 2k = kappa / omega_0^2
    moved = stiff * float(np.mean(np.maximum(x - (amplitude - depth), 0.0)))
    assert _unseen(moved, amplitude, stiff) == pytest.approx(depth, rel=0.01)


def test_the_sensors_error_is_that_of_a_mean_of_four():
    off = 1e-5 * np.array([1.0, -1.0, 2.0, -2.0, 1.0, -1.0])  # standard deviation sqrt(12/5) x 10 um
    seen = SimpleNamespace(highest=2e-3 + off, mean=np.zeros(6), omega=np.full(6, 8.0), resolution=COUNT)
    error = _sensor_error(seen, np.ones(6, dtype=bool), lambda omega: np.full(len(omega), 2e-3))
    assert error == pytest.approx(1e-5 * np.sqrt(12 / 5) / np.sqrt(4))


@pytest.mark.parametrize("sessions", [7, pytest.param(12, marks=pytest.mark.slow)])
def test_a_gap_by_graze_is_neither_too_sure_nor_too_vague(sessions):
    z = []
    for seed in range(sessions):
        gap = grazing_amplitude(8.43 - 0.01 * (seed % 5), 0.010, W, B, F)
        found = grazing_gap(stepping(gap, seed=seed), decay_of(W, B, F, 1e-6), kappa=KAPPA)
        z.append((found.value - gap) / found.uncertainty)
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.6


def test_the_cranks_length_need_not_be_right():
    gap = 1.004 * grazing_amplitude(8.43, 0.010, W, B, F)
    found = grazing_gap(stepping(gap, scale=1.004), decay_of(W, B, F), kappa=KAPPA)
    low, high = found.interval(0.999)
    assert low < gap < high


@pytest.mark.parametrize(
    ("runs", "said"),
    [
        (lambda g: stepping(1.0), "none of the 21 runs touches: step on from free motion into contact"),
        (lambda g: stepping(1e-4), "the mean position moves among the first 4 runs: they touch already"),
        (lambda g: stepping(g)[:4], "4 runs are too few"),
        (lambda g: [*stepping(g)[:9], *stepping(g)[5:]], "does not go one way"),
        (lambda g: stepping(g, mixed=True), "at one crank length"),
    ],
)
def test_what_does_not_show_a_graze_is_refused(runs, said):
    gap = grazing_amplitude(8.43, 0.010, W, B, F)
    with pytest.raises(ValueError, match=said):
        grazing_gap(runs(gap), decay_of(W, B, F), kappa=KAPPA)


def early(omega, crank=0.006):
    """Steps down to a frequency at which a transient has led to contact before the free motion reaches the gap."""
    rng = np.random.default_rng(4)
    free = [
        swinging(w, grazing_amplitude(w, crank, made.W, made.B, made.F), 0.3, made.PLACE, crank=crank, rng=rng)
        for w in np.arange(omega + 0.5, omega + 0.01, -0.05)
    ]
    return [*free, *(driven(w, crank, duration=32.0, transient=20.0) for w in (omega, omega - 0.05))]


@pytest.mark.parametrize("omega", [7.6, 7.4])
def test_contact_that_a_transient_begins_early_is_in_the_uncertainty(omega):
    decay = decay_of(made.W, made.B, made.F, made.PLACE)
    found = grazing_gap(early(omega), decay, kappa=made.KAPPA)
    true = made.GAP - made.PLACE
    free = grazing_amplitude(omega, 0.006, made.W, made.B, made.F)
    assert true - free > 4e-5  # the free motion does not reach the support
    low, high = found.interval()
    assert low < true < high and high - low < 2e-4
    assert "a transient may have begun contact" in found.notes[0]


def test_steps_at_two_settings_of_the_screw_are_refused():
    runs = [*early(7.4)[:-1], driven(7.35, 0.006, duration=32.0, transient=20.0, gap=0.0019)]
    with pytest.raises(ValueError, match=r"readings of \[0.0018, 0.0019\] m at the screw: give one of them at a time"):
        grazing_gap(runs, decay_of(made.W, made.B, made.F), kappa=made.KAPPA)
