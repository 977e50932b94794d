"""The fits' own motion against closed forms: viscous decay, Coulomb's decrement, steady amplitude, a contact."""

import numpy as np
import pytest

from nonsmooth.studies.savi2007.identification.gap import grazing_amplitude
from nonsmooth.studies.savi2007.identification.motion import march

NONE, FAR = np.zeros(4), np.array([0.0, 0.0, np.inf])


def run(time, start, oscillator, drive=NONE, contact=FAR, omega=0.0):
    out = np.empty((len(time), 2))
    march(time, omega * time, *start, False, np.array(oscillator, float), np.asarray(drive, float), contact, out)
    return out


def test_viscous_decay_is_the_closed_form():
    time, w, b = np.arange(0, 8, 0.01), 4.5, 1.04
    wd = np.sqrt(w**2 - b**2 / 4)
    exact = 0.1 * np.exp(-b / 2 * time) * (np.cos(wd * time) + b / (2 * wd) * np.sin(wd * time))
    assert np.allclose(run(time, (0.1, 0.0), (w, b, 0.0, 0.0))[:, 0], exact, atol=1e-9)


def test_dry_friction_takes_the_same_length_off_every_cycle():
    w, f = 4.5, 0.02
    time = np.linspace(0, 3 * 2 * np.pi / w, 400)
    end = run(time, (0.1, 0.0), (w, 0.0, f, 0.0))[-1]
    assert end[0] == pytest.approx(0.1 - 3 * 4 * f / w**2, abs=1e-9)  # Den Hartog (1931)
    assert end[1] == pytest.approx(0.0, abs=1e-6)


def test_a_car_within_the_friction_band_stays():
    out = run(np.arange(0, 2, 0.01), (0.5e-3, 0.0), (4.5, 1.0, 0.02, 0.0))
    assert np.all(out[:, 0] == 0.5e-3)


def test_an_undamped_contact_lasts_half_a_period_of_the_two_springs():
    # thrown at a support at its rest: x'' = -(w^2 + kappa) x for x > 0
    w, kappa, v = 4.5, 1400.0, 0.1
    both = np.sqrt(w**2 + kappa)
    time = np.linspace(0, 0.9 * np.pi / both, 50)
    out = run(time, (-1e-9, v), (w, 0.0, 0.0, 0.0), contact=np.array([kappa, 0.0, 0.0]))
    assert np.allclose(out[:, 0], v / both * np.sin(both * time), atol=1e-7)


@pytest.mark.parametrize("ratio", [0.7, 1.0, 1.3])
def test_harmonic_balance_of_friction_gives_the_simulated_amplitude(ratio):
    w, b, f, a = 4.5, 1.04, 0.012, 0.0165
    omega = ratio * w
    time = np.arange(0, 60, 0.01)
    out = run(time, (0.0, 0.0), (w, b, f, 0.0), drive=(a, 0, 0, 0), omega=omega)
    late = time > 40
    columns = np.column_stack([g(n * omega * time[late]) for n in (1, 3) for g in (np.cos, np.sin)])
    c, s, *_ = np.linalg.lstsq(columns, out[late, 0], rcond=None)[0]
    # below resonance the third harmonic of friction, not in the balance, takes 0.25 % (10 mN)
    assert grazing_amplitude(omega, w, b, f, a) == pytest.approx(np.hypot(c, s), rel=3e-3)
