"""Pictures of measured recordings, drawn from motions of known constants: what is written and where points stand."""

from __future__ import annotations

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pytest
import xarray as xr

from nonsmooth.identification.amplitude_dependent import ResponseCurve, amplitude_dependent
from nonsmooth.plot import identification as pictures
from nonsmooth.recordings.signals.steady import steady_response

W0, C, MASS = 2 * np.pi * 20.0, 2.0, 1.7  # a linear mode: rad/s, 1/s, kg


@pytest.fixture(scope="module")
def mode():
    """A linear mode under two forces: natural frequency 20 Hz, damping ratio c/(2 w0) = 0.796 %."""
    f = np.linspace(18.0, 22.0, 60)
    stiffness = MASS * (W0**2 - (2 * np.pi * f) ** 2 + 2j * np.pi * f * C)
    curves = [
        ResponseCurve(f"{force:g} N", f, force / np.abs(stiffness), np.full(60, force), -np.angle(stiffness))
        for force in (0.3, 0.8)
    ]
    return amplitude_dependent(curves, knots=4)


def line(ax, label: str):
    return next(one for one in ax.get_lines() if one.get_label() == label)


def test_backbone_and_damping_of_a_linear_mode_are_level(mode) -> None:
    finding, _ = mode
    backbone = line(pictures.backbone(finding), "mode").get_ydata()
    np.testing.assert_allclose(backbone, 20.0, rtol=1e-6)
    damping = line(pictures.modal_damping(finding), "mode").get_ydata()
    np.testing.assert_allclose(damping, 100 * C / (2 * W0), rtol=1e-4)


@pytest.mark.usefixtures("window")
def test_a_computed_response_peaks_at_its_closed_form(mode) -> None:
    finding, found = mode
    ax = pictures.forced_responses(finding, responses=[found.response(0.5, low=1e-5)])
    curve = line(ax, "mode, constant force")
    top = 0.5 / (MASS * C * np.sqrt(W0**2 - C**2 / 4))
    assert np.nanmax(curve.get_ydata()) == pytest.approx(top, rel=1e-4)
    assert "0.5 N" in [text.get_text() for text in ax.texts]


def test_steady_pictures_write_the_frequency() -> None:
    t = np.arange(2000) / 500
    x = np.cos(2 * np.pi * 20.123 * t) + 0.01 * np.random.default_rng(3).standard_normal(2000)
    found = steady_response(t, x)
    words = [text.get_text() for text in pictures.steady_phase(found).get_legend().get_texts()]
    written = [float(word.split(": ")[1].split(" ")[0]) for word in words if word.startswith("fit")]
    assert written == [pytest.approx(20.123, abs=5 * found.frequency_error)]
    ax = pictures.steady_amplitude(found)
    assert any("fastest free decay" in text.get_text() for text in ax.get_legend().get_texts())
    bars = [np.ptp(bar, axis=0)[1] for bar in ax.collections[0].get_segments()]  # 1/1000 of the amplitude, either side
    blocks = found.blocks["amplitude_error"] / found.blocks["amplitude"]
    assert bars == pytest.approx(2e3 * blocks.values, rel=0.05)
    smaller = pictures.steady_amplitude(steady_response(t, 1e-3 * x))
    assert [np.ptp(bar, axis=0)[1] for bar in smaller.collections[0].get_segments()] == pytest.approx(bars)


def impacts(single: list[bool]) -> xr.Dataset:
    n = len(single)
    return xr.Dataset(
        {
            "single": ("impact", single),
            "restitution": ("impact", np.linspace(0.3, 0.5, n)),
            "v_before": ("impact", -np.linspace(1.0, 2.0, n)),
            "half_sample": ("impact", np.full(n, 0.01)),
            "impact_time": ("impact", np.linspace(0.2, 0.8, n)),
        }
    )


def test_restitution_draws_impacts_of_one_corner_only() -> None:
    ax = pictures.restitution(impacts([True, False, True]))
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "2 impacts of one corner" in words and "median 0.40" in words
    assert pictures.restitution(impacts([False])).get_ylim() == (0, 1)  # nothing to draw is no error


def test_a_toss_marks_its_impacts() -> None:
    t = np.linspace(0, 1, 100)
    ax = pictures.toss(t, 1 + t, t, impacts([True, False, True]))
    at = [one.get_xdata()[0] for one in ax.get_lines() if len(one.get_xdata()) == 2]
    assert sorted(at) == pytest.approx([0.2, 0.5, 0.8])
