"""Amplitude-dependent frequency and damping, from responses that are exact by construction.

A Duffing mode in one-term harmonic balance: omega_n^2(a) = w0^2 + 3/4 alpha a^2, D = c. Forced curves are made from
their closed form, parametrised by the amplitude, so that they hang over and hold their unstable middle part.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.identification.amplitude_dependent import ResponseCurve, amplitude_dependent, response_curves
from nonsmooth.identification.nonlinear_mode import NonlinearMode

W0, C, BETA, MASS = 2 * np.pi * 20.0, 2.0, 3e8, 1.7  # rad/s, 1/s, 3/4 alpha, kg


def square(a: np.ndarray) -> np.ndarray:
    return W0**2 + BETA * a**2


def curve(force: float, n: int = 60, low: float = 2e-4, *, shift: float = 0.0, name: str = "") -> ResponseCurve:
    """Both sides of the resonance under one force, by the closed form of the frequencies at each amplitude."""
    # the top: F = m a c sqrt(omega_n^2 - c^2/4), a cubic in a^2
    q = (force / (MASS * C)) ** 2
    roots = np.roots([BETA * np.exp(shift), W0**2 * np.exp(shift) - C**2 / 4, -q])
    top = np.sqrt(roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real.max())
    a = np.linspace(low, top * (1 - 1e-9), n)
    G = square(a) * np.exp(shift)
    root = np.sqrt((force / (MASS * a)) ** 2 - C**2 * G + C**4 / 4)
    a, G = np.concatenate([a, a[::-1]]), np.concatenate([G, G[::-1]])
    w = np.sqrt(np.concatenate([G[:n] - C**2 / 2 - root, (G[n:] - C**2 / 2 + root[::-1])]))
    z = MASS * (G - w**2 + 1j * C * w)
    return ResponseCurve(name or f"{force:g} N", w / (2 * np.pi), a, np.full(2 * n, force), -np.angle(z))


def dropped(c: ResponseCurve, *, force: bool, phase: bool) -> ResponseCurve:
    return ResponseCurve(c.name, c.frequency, c.amplitude, c.force if force else None, c.phase if phase else None)


FORCES = (0.3, 0.8, 1.6)


def overhang(c: ResponseCurve) -> np.ndarray:
    """d ln F / d ln a at constant frequency, in closed form."""
    a, w2 = c.amplitude, (2 * np.pi * c.frequency) ** 2
    u = square(a) - w2
    return 1 + a * u * 2 * BETA * a / (u**2 + C**2 * w2)


@pytest.mark.parametrize("force", [True, False], ids=["forces", "no forces"])
@pytest.mark.parametrize("phase", [True, False], ids=["phases", "no phases"])
def test_the_backbone_is_found_where_curves_hang_over(force: bool, phase: bool) -> None:
    whole = [curve(f) for f in FORCES]
    slope = np.concatenate([overhang(c) for c in whole])
    assert np.count_nonzero(slope < 0) > 30  # there is an unstable middle part, and it is used
    finding, mode = amplitude_dependent([dropped(c, force=force, phase=phase) for c in whole], knots=4)
    a = finding.data.amplitude.values
    np.testing.assert_allclose(finding.data.f_n, np.sqrt(square(a)) / (2 * np.pi), rtol=1e-7)
    np.testing.assert_allclose(2 * finding.data.zeta * np.sqrt(square(a)), C, rtol=1e-5)
    np.testing.assert_array_equal(finding.data.unstable, slope < 0)
    np.testing.assert_allclose(finding.data.slope, slope, atol=1e-3)
    if force:
        assert mode.mass == pytest.approx(MASS, rel=1e-6)


def test_points_of_the_middle_part_alone_are_enough() -> None:
    """Points that no sweep at constant force reaches tell the mode: nothing in the fit asks for stability."""
    parts = []
    for f in (0.6, 0.8, 1.1, 1.6):
        c = curve(f, 400)
        here = overhang(c) < 0
        parts.append(ResponseCurve(c.name, c.frequency[here], c.amplitude[here], c.force[here], c.phase[here]))
        assert np.count_nonzero(here) > 20
    finding, _ = amplitude_dependent(parts, knots=4)
    a = finding.data.amplitude.values
    np.testing.assert_allclose(finding.data.f_n, np.sqrt(square(a)) / (2 * np.pi), rtol=1e-7)
    assert finding.data.unstable.all()


def test_the_curve_of_a_force_comes_back_with_its_middle_part() -> None:
    knots = np.linspace(1e-4, 3e-3, 5)
    mode = NonlinearMode(knots, square(knots), np.full(5, np.log(C)), MASS)
    back = mode.response(0.8, low=2e-4)
    a, w = back.modal_amplitude.values, 2 * np.pi * back.frequency.values
    np.testing.assert_allclose(np.abs(mode.stiffness(a, w)) * a, 0.8, rtol=1e-6)
    assert np.count_nonzero(~back.stable) > 20
    # At a frequency between the folds there are three amplitudes, the middle one unstable.
    f = back.frequency.values
    middle = f[~back.stable.values].mean()
    crossings = np.flatnonzero(np.diff(np.sign(f - middle)))
    assert len(crossings) == 3
    stable = back.stable.values[crossings][np.argsort(a[crossings])]
    assert stable.tolist() == [True, False, True]
    # The folds are where the frequency turns back along the curve.
    turns = np.flatnonzero(np.diff(np.sign(np.diff(f))))
    changes = np.flatnonzero(np.diff(back.stable.values.astype(int)))
    assert len(turns) == 2 and np.max(np.abs(turns - changes)) <= 1


def test_what_other_modes_add_is_told_apart() -> None:
    residual = -2e-5 - 5e-6j
    seen = []
    for f in FORCES:
        c = curve(f)
        x = c.amplitude * np.exp(1j * c.phase) + residual * c.force
        seen.append(ResponseCurve(c.name, c.frequency, np.abs(x), c.force, np.angle(x)))
    finding, mode = amplitude_dependent(seen, knots=4, residual=True)
    a = finding.data.amplitude.values
    inside = (a > 2e-4) & (a < max(curve(f).amplitude.max() for f in FORCES))
    np.testing.assert_allclose(finding.data.f_n[inside], np.sqrt(square(a[inside])) / (2 * np.pi), rtol=1e-6)
    assert mode.residual == pytest.approx(residual, rel=1e-3)
    # Taken for nothing, it bends damping by much more than that.
    without, _ = amplitude_dependent(seen, knots=4)
    assert np.max(np.abs(2 * without.data.zeta * np.sqrt(square(a)) / C - 1)) > 0.02


@pytest.mark.parametrize("count", [8, pytest.param(12, marks=pytest.mark.slow)])
def test_stated_errors_cover_noise_and_curves_that_differ(count: int) -> None:
    """Twelve experiments of eight curves: 1 % of noise, 1e-3 of shift from curve to curve."""
    rng = np.random.default_rng(3)
    z, spreads = [], []
    for _ in range(count):
        seen = []
        for k, f in enumerate(np.geomspace(0.3, 1.6, 8)):
            c = curve(f, 12, shift=2e-3 * rng.standard_normal(), name=str(k))
            n = len(c.amplitude)
            force = c.force * np.exp(0.01 * rng.standard_normal(n))
            seen.append(ResponseCurve(c.name, c.frequency, c.amplitude, force, c.phase + 0.01 * rng.standard_normal(n)))
        finding, _ = amplitude_dependent(seen, knots=4)
        d = finding.data.isel(amplitude=[10, 40, 70, 95])
        true = np.sqrt(square(d.amplitude.values)) / (2 * np.pi)
        zeta = C / (4 * np.pi * true)
        z.append(np.concatenate([(d.f_n - true) / d.f_n_error, (d.zeta - zeta) / d.zeta_error]))
        spreads.append(finding.others["f_n from curve to curve"].value)
    by_quantity = np.sqrt(np.mean(np.square(z).reshape(count, 2, 4), axis=(0, 2)))
    assert np.all((0.5 < by_quantity) & (by_quantity < 1.6)), by_quantity
    assert np.mean(spreads) == pytest.approx(1e-3 * 22, rel=0.4)  # half of 2e-3, of the mean frequency


@pytest.mark.parametrize("count", [1, 2, 5])
def test_as_many_knots_as_asked_for(count: int) -> None:
    """Evenly from the least to the largest amplitude; one alone at the median."""
    seen = [curve(f) for f in FORCES]
    size = np.concatenate([c.amplitude for c in seen])
    _, mode = amplitude_dependent(seen, knots=count)
    even = np.linspace(size.min(), size.max(), count) if count != 1 else [np.median(size)]
    np.testing.assert_allclose(mode.knots, even, rtol=1e-12)


@pytest.mark.parametrize(("unit", "power"), [("m", 0), ("m/s", 1), ("m/s^2", 2)])
def test_curves_of_a_recording_are_displacements(unit: str, power: int, tmp_path: Path) -> None:
    """Over (2 pi f)^n where the n-th rate was measured; force and phase where they are there."""
    f, size = np.array([1.0, 2.0, 4.0]), np.array([0.2, 0.7, 0.3])
    path = tmp_path / "shaker.csv"
    rows = [f"{a},{b},0.5,{-c}" for a, b, c in zip(f, size, (0.1, 1.5, 3.0), strict=True)]
    path.write_text("\n".join([f"frequency (Hz),amplitude ({unit}),force (N),phase (rad)", *rows]))
    recording = ns.load_recording(path, axis="frequency")
    (one,) = response_curves(recording)
    assert (one.name, one.force.tolist(), one.phase.tolist()) == (recording.runs[0], [0.5] * 3, [-0.1, -1.5, -3.0])
    np.testing.assert_allclose(one.amplitude * (2 * np.pi * f) ** power, size, rtol=1e-14)
    assert one.frequency.tolist() == f.tolist()
    (bare,) = response_curves(recording, force=None, phase=None)
    assert bare.force is None and bare.phase is None


def test_curves_of_a_recording_stand_over_frequency(tmp_path: Path) -> None:
    path = tmp_path / "shaker.csv"
    path.write_text("time (s),amplitude (m)\n0,1\n1,2\n2,1\n3,2")
    with pytest.raises(ValueError, match="stands over 'time'; read it with load_recording"):
        response_curves(ns.load_recording(path), force=None, phase=None)


def test_doors() -> None:
    c = curve(0.8)
    with pytest.raises(ValueError, match="some curves have a force and 'b' have none; fit them apart"):
        amplitude_dependent([c, ResponseCurve("b", c.frequency, c.amplitude, None, c.phase)])
    with pytest.raises(ValueError, match="only with forces and phases"):
        amplitude_dependent([dropped(c, force=True, phase=False)], residual=True)
    with pytest.raises(ValueError, match="3 measured values cannot tell 11 unknowns"):
        amplitude_dependent([ResponseCurve("b", np.arange(1, 4), np.arange(1.0, 4), np.arange(1.0, 4))])
    with pytest.raises(ValueError, match="curve 'b': 1 values of amplitude are not finite; leave those points out"):
        ResponseCurve("b", np.arange(1, 4), np.array([1, np.nan, 2]))
    with pytest.raises(ValueError, match="arrays of one length"):
        ResponseCurve("b", np.arange(1, 4), np.arange(1.0, 5))
    with pytest.raises(ValueError, match="positive, increasing amplitudes"):
        amplitude_dependent([c], knots=[2.0, 1.0])
