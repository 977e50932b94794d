"""Natural frequency against closed forms: the grid of a transform, its true peak, and the decay itself."""

import numpy as np
import pytest
from studies.savi2007.tests.identification.made import COUNT, counted, run

from nonsmooth_savi2007.identification.decay_findings import GRID, natural_frequency, spectral_peak
from nonsmooth_savi2007.identification.free_decay import free_decay

#: Table 1 of Savi et al. (2007): omega_0 = sqrt(2k/m) and c/m.
PAPER = np.sqrt(2 * 8.47 / 0.838), 0.87 / 0.838


def decaying(w, b, x_0, v_0, n=2100, begin=0.5, rng=None):
    time = np.arange(n) / 100
    at = time - begin if rng is None else time - begin + 5e-5 * rng.standard_normal(n)
    wd = np.sqrt(w**2 - b**2 / 4)
    x = np.exp(-b / 2 * at) * (x_0 * np.cos(wd * at) + (v_0 + b / 2 * x_0) / wd * np.sin(wd * at))
    return time, np.where(at > 0, x, 0.0)


def test_the_peak_of_a_taps_spectrum_stands_below_the_natural_frequency():
    w, b = PAPER
    peak, error = spectral_peak(*decaying(w, b, 0.0, 0.5), 0.71, 0.05, COUNT / np.sqrt(12))
    assert 2 * np.pi * peak == pytest.approx(np.sqrt(w**2 - b**2 / 2), rel=1e-4)
    assert 0 < error < 1e-3


def test_the_peak_of_a_release_stands_at_its_closed_form():
    # |X|^2 ~ (q + b^2) / ((w^2 - q)^2 + b^2 q), q = omega^2, is largest at q = -b^2 + sqrt(w^4 + 2 b^2 w^2)
    w, b = PAPER
    peak, _ = spectral_peak(*decaying(w, b, 0.08, 0.0), 0.71, 0.05, 0.0)
    assert 2 * np.pi * peak == pytest.approx(np.sqrt(np.sqrt(w**4 + 2 * b**2 * w**2) - b**2), rel=1e-3)
    assert 2 * np.pi * peak == pytest.approx(w, rel=2e-3)


def test_the_noise_of_the_peak_is_what_is_stated():
    w, b = PAPER
    time, x = decaying(w, b, 0.0, 0.5)
    noise, rng = 2e-4, np.random.default_rng(0)
    drawn = [spectral_peak(time, x + noise * rng.standard_normal(len(x)), 0.71, 0.05, noise) for _ in range(60)]
    peaks, errors = np.array(drawn).T
    assert np.std(peaks) == pytest.approx(np.mean(errors), rel=0.3)


def test_the_papers_4_60_is_a_value_of_its_grid():
    """Fig. 5: 0.732 Hz, where 4.50 rad/s follow from stiffness and mass; the grid has 4.295 and 4.602 beside it."""
    w, b = PAPER
    step = 2 * np.pi * 100 / GRID
    assert w == pytest.approx(4.496, abs=1e-3)
    assert (round(15 * step, 2), round(15 * 100 / GRID, 3)) == (4.60, 0.732)
    assert 14 * step < w < 15 * step
    for x_0, v_0, line in ((0.08, 0.0, 15), (0.0, 0.5, 14)):
        _, x = decaying(w, b, x_0, v_0, GRID)
        assert int(np.argmax(np.abs(np.fft.rfft(x)))) == line


def test_the_decay_is_not_bound_to_the_grid():
    rng, (w, b) = np.random.default_rng(0), PAPER
    runs = []
    for i, v in enumerate((0.5, -0.5, 0.3, -0.3)):
        time, x = decaying(w, b, 0.0, v, rng=rng)
        runs.append(run("impulse", time, counted(x), name=f"Run #{i + 1}"))
    decay = free_decay(runs)
    found = natural_frequency(decay)
    assert abs(found.value - w) < 3.5 * found.uncertainty < 0.004
    grid, undamped = found.others["dft_grid"], found.others["dft_undamped"]
    assert grid.half_width == pytest.approx(np.pi * 100 / GRID)
    line = grid.value / (2 * grid.half_width)
    assert line == pytest.approx(round(line), abs=1e-9)
    assert undamped.value == pytest.approx(w, rel=1e-3)
    assert "4.295 or 4.602" in found.notes[0] and "4.60 rad/s" in found.notes[1]
    assert found.data["magnitude"].size == GRID // 2 + 1
