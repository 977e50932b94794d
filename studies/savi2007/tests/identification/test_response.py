"""Damping from steady runs: amplitudes and the complex response against their closed forms."""

import re
from pathlib import Path

import numpy as np
import pytest
from studies.savi2007.tests.identification.made import COUNT, decay_of, run, swinging

from nonsmooth.recordings.session import Quantity
from nonsmooth_savi2007.identification.response_fits import (
    amplitude_fit,
    grazing_amplitude,
    receptance,
    receptance_fit,
    viscous_bias,
)
from nonsmooth_savi2007.identification.steady import steady

W, B, M = 4.5, 1.04, 0.84
STEPS = W * np.array([0.55, 0.7, 0.8, 0.86, 0.9, 0.95, 1.0, 1.03, 1.07, 1.1, 1.14, 1.2, 1.3, 1.45, 1.7])


def responding(f=0.0, cranks=(0.0165, 0.035), scale=1.0, mark=0.0, seed=0):
    """Steady runs by the closed form of the complex response, counted, with a clock that jitters."""
    rng, found = np.random.default_rng(seed), []
    for a in cranks:
        for omega in STEPS:
            size = grazing_amplitude(omega, scale * a, W, B, f)
            lag = np.arctan2(B * omega * size + 4 * f / np.pi, (W**2 - omega**2) * size)
            # the gate sees the crank at the angle mark: at the time mark / omega
            found.append(swinging(omega, size, lag, 3e-4, crank=a, mark=mark / omega, rng=rng))
    return steady(found)


def test_without_friction_the_response_is_the_linear_one():
    omega = np.array([2.0, W, 8.0])
    exact = 0.5 * W**2 * 0.02 / (W**2 - omega**2 + 1j * B * omega)
    assert np.allclose(receptance(omega, 0.02, W, B), exact, rtol=1e-12)


def test_the_complex_response_tells_all_five():
    f, scale, mark = 0.012, 1.01, 0.02
    seen = responding(f, scale=scale, mark=mark)
    found = receptance_fit(seen, decay_of(W, B, f), Quantity(M))
    rows = [found.estimate, *(found.others[n] for n in ("omega_0", "friction", "drive_scale", "mark"))]
    for row, truth in zip(rows, (M * B, W, M * f, scale, mark), strict=True):
        assert abs(row.value - truth) < 3.5 * row.uncertainty
        assert row.uncertainty < 0.01 * max(abs(truth), 0.1)
    assert found.covariance.shape == (5, 5) and found.plot == "nyquist"


def test_at_one_frequency_the_viscous_bias_is_what_friction_takes_per_cycle():
    # b' omega A = b omega A + 4 f / pi
    omega, a, f = 5.0, 0.0165, 0.01
    size = grazing_amplitude(omega, a, W, B, f)
    expected = 4 * f / (np.pi * B * omega * size)
    assert viscous_bias(W, B, f, a, [omega, omega]) == pytest.approx(expected, rel=1e-6)


def test_the_bias_of_fig_6_for_5_mn():
    """Table 1, 5 mN: about in inverse proportion to the crank, from 10 % at 10 mm to 2.6 % at 35 mm."""
    m = 0.838
    bias = [viscous_bias(np.sqrt(2 * 8.47 / m), 0.87 / m, 0.005 / m, a) for a in (0.010, 0.0165, 0.035)]
    assert np.all(np.diff(bias) < 0)
    assert bias[0] / bias[2] == pytest.approx(3.5, rel=0.25)
    assert 0.02 < bias[2] < 0.03 and 0.05 < bias[1] < 0.065 and 0.085 < bias[0] < 0.11
    with pytest.raises(ValueError, match="holds the car"):
        viscous_bias(W, B, 1.0, 0.01)


def test_the_table_of_the_theory_page_is_what_its_code_prints(capsys):
    page = (Path(__file__).parents[4] / "docs" / "theory" / "uncertainty.md").read_text(encoding="utf-8")
    code, expected = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", page, re.DOTALL).groups()
    exec(code, {})
    assert capsys.readouterr().out == expected


def test_amplitudes_with_and_without_friction_in_the_law():
    f = 0.012
    viscous, both = amplitude_fit(responding(f), decay_of(W, B, f), Quantity(M))
    assert abs(both.value - M * B) < 3.5 * both.uncertainty
    assert viscous.value > 1.04 * M * B and "an equivalent" in viscous.notes[0]
    assert viscous.data["joint_amplitude"].size == 300
    with pytest.raises(ValueError, match="5 are needed"):
        amplitude_fit(responding(f).only([0, 1]), decay_of(W, B, f), Quantity(M))


def test_stated_uncertainties_are_neither_too_small_nor_too_large():
    f, rows = 0.012, {}
    for seed in range(6):
        seen, decay = responding(f, seed=seed), decay_of(W, B, f)
        both, whole = amplitude_fit(seen, decay, Quantity(M))[1], receptance_fit(seen, decay, Quantity(M))
        told = [
            ("c_response", both.estimate, M * B),
            ("its friction", both.others["friction"], M * f),
            ("c", whole.estimate, M * B),
            ("omega_0", whole.others["omega_0"], W),
            ("friction", whole.others["friction"], M * f),
            ("scale", whole.others["drive_scale"], 1.0),
            ("mark", whole.others["mark"], 0.0),
        ]
        for name, one, truth in told:
            rows.setdefault(name, []).append((one.value - truth) / one.uncertainty)
    spread = {name: np.sqrt(np.mean(np.square(z))) for name, z in rows.items()}
    assert all(0.2 < size < 2.0 for size in spread.values()), spread


def test_a_steady_run_is_its_closed_form():
    one = steady([swinging(5.0, 0.02, 0.7, 1e-3, crank=0.0165, mark=0.4, second=1e-4)])
    assert one.omega[0] == pytest.approx(5.0, rel=1e-5)
    assert one.amplitude[0] == pytest.approx(0.02, abs=COUNT / 20)
    # phase against the gate: cos(omega (t - mark) + omega mark - lag)
    assert np.angle(one.response[0]) == pytest.approx(5.0 * 0.4 - 0.7, abs=2e-3)
    assert one.mean[0] == pytest.approx(1e-3, abs=COUNT / 20)
    t = np.linspace(0, 2 * np.pi, 100_001)
    assert one.highest[0] == pytest.approx(1e-3 + np.max(0.02 * np.cos(t - 0.7) + 1e-4 * np.cos(2 * t)), abs=COUNT / 10)
    time = np.arange(0, 2, 0.01)
    short = run("response", time, np.cos(5 * time), turns=[0, 1.257, 2.513], crank_length=0.01)
    with pytest.raises(ValueError, match="holds 1 whole turns"):
        steady([short])
