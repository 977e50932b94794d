"""Jumps in steps, found without the prediction, and paired in order."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr

from nonsmooth.identification.compare import measured_response, measured_sections
from nonsmooth.identification.compare.response import AmplitudeJump, jumps_in_steps, match_jumps

ZERO = np.zeros


def amplitudes(w: float) -> np.ndarray:
    """Of x'' + 0.05 x' + x + x^3 = 0.1 cos(w t) by one harmonic."""
    # (1 - w^2 + 3/4 s)^2 s + (0.05 w)^2 s = 0.01 for s = A^2
    roots = np.roots([9 / 16, 1.5 * (1 - w**2), (1 - w**2) ** 2 + (0.05 * w) ** 2, -0.01])
    return np.sqrt(np.sort(roots[np.abs(roots.imag) < 1e-9].real))


@cache
def folds() -> tuple[float, float]:
    """The ends of the frequencies with three amplitudes."""
    fine = np.arange(0.6, 2.4, 1e-4)
    three = fine[[len(amplitudes(w)) == 3 for w in fine]]
    return float(three.min()), float(three.max())


def duffing(direction: str, step: float) -> tuple[np.ndarray, np.ndarray, float]:
    """The amplitude, carried; and where the branch ends."""
    values = np.arange(0.6, 2.4, step)
    order = values if direction == "up" else values[::-1]
    pick = -1 if direction == "up" else 0
    heights = np.array([amplitudes(w)[pick] for w in order])
    return order, heights, folds()[direction == "up"]


@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("step", [0.05, 0.02])
def test_the_fold_is_found_whatever_the_step(direction: str, step: float) -> None:
    """Towards a fold the steps grow; the jump lies in the step that holds the fold."""
    order, heights, fold = duffing(direction, step)
    (jump,) = jumps_in_steps(order, heights, ZERO(len(order)))
    assert abs(jump.value - fold) <= 0.5 * jump.step * (1 + 1e-9)
    assert (jump.after > jump.before) == (direction == "down")


@pytest.mark.parametrize("step", [0.1, 0.05, 0.02])
def test_a_resonance_peak_has_no_jump(step: float) -> None:
    w = np.arange(0.5, 2.0, step)
    heights = 1 / np.sqrt((1 - w**2) ** 2 + (0.1 * w) ** 2)
    assert jumps_in_steps(w, heights, ZERO(len(w))) == []
    bend = np.where(w < 1.2, 0.5 + w, 1.7 + 0.2 * (w - 1.2))  # a corner, as at the first contact
    assert jumps_in_steps(w, bend, ZERO(len(w))) == []


def test_noise_is_no_jump() -> None:
    w = np.arange(40.0)
    heights = 1 + 0.1 * np.random.default_rng(0).standard_normal(40)
    assert jumps_in_steps(w, heights, np.full(40, 0.1)) == []


def test_pairs_keep_order_and_direction() -> None:
    """A rise is never paired with a fall, near as it may be; of two falls the first belongs to the first."""
    fall, rise = (2.0, 1.0), (1.0, 2.0)
    measured = {
        "up": [AmplitudeJump(4.0, 0.1, *fall), AmplitudeJump(5.7, 0.1, *fall)],
        "down": [AmplitudeJump(5.1, 0.1, *rise)],
    }
    theory = {
        "up": [AmplitudeJump(5.6, 0.0, *fall), AmplitudeJump(5.9, 0.0, *fall)],
        "down": [AmplitudeJump(5.0, 0.0, *fall)],
    }
    found = match_jumps(measured, theory, [], "rad/s", 0.95)
    rows = list(zip(found["jump_direction"][1], found["measured_jump"][1], found["theory_jump"][1], strict=True))
    assert rows[:2] == [("up", 4.0, 5.6), ("up", 5.7, 5.9)]
    assert rows[2][:2] == ("down", 5.1) and np.isnan(rows[2][2])
    assert np.isnan(rows[3][1]) and rows[3][2] == 5.0


def test_what_is_too_many_has_no_partner() -> None:
    fall = (2.0, 1.0)
    measured = {"up": [AmplitudeJump(5.7, 0.1, *fall)]}
    theory = {"up": [AmplitudeJump(4.1, 0.0, *fall), AmplitudeJump(5.8, 0.0, *fall)]}
    found = match_jumps(measured, theory, [], "rad/s", 0.95)
    np.testing.assert_array_equal(found["theory_jump"][1], [5.8, 4.1])
    np.testing.assert_array_equal(found["measured_jump"][1], [5.7, np.nan])


def _motion(amplitude: float, omega: float, turns: int = 12) -> xr.Dataset:
    """A harmonic motion, sampled 50 times in each turn of the drive."""
    phase = np.arange(0.0, turns, 0.02)
    u = amplitude * np.column_stack([np.cos(2 * np.pi * phase), -omega * np.sin(2 * np.pi * phase)])
    columns = {"u": (("time", "state"), u), "u_error": (("time", "state"), np.full(u.shape, 1e-5))}
    named = {"state": ["x", "v"], "state_unit": ("state", ["m", "m/s"]), "time": phase * 2 * np.pi / omega}
    return xr.Dataset({**columns, "phase": ("time", phase), "omega": omega}, named)


def test_a_measured_response_states_its_jumps() -> None:
    """Even steps of 1 mm, and one of 20 mm: up between 4.2 and 4.3, down between 4.0 and 4.1."""
    omegas = np.round(np.arange(3.5, 5.0, 0.1), 6)
    motions, words = [], []
    for word, place in (("up", 4.25), ("down", 4.05)):
        for k, omega in enumerate(omegas):
            motions.append(_motion(0.05 - 1e-3 * k - 0.02 * (omega > place), omega))
            words.append(word)
    found = measured_response(motions, words)
    assert found["jump_direction"].values.tolist() == ["up", "down"]
    np.testing.assert_allclose(found["jump_value"], [4.25, 4.05], rtol=1e-12)
    np.testing.assert_allclose(found["jump_step"], 0.1, rtol=1e-9)
    np.testing.assert_allclose(found["jump_before"], [0.043, 0.024], atol=1e-4)
    np.testing.assert_allclose(found["jump_after"], [0.022, 0.045], atol=1e-4)


def test_measured_sections_say_where_turns_are_too_few() -> None:
    """In rising order of the parameter."""
    found = measured_sections([_motion(0.01, 2.0, 12), _motion(0.01, 2.0, 4)], "g", [0.2, 0.1])
    assert found["g"].values.tolist() == [0.1, 0.2]
    assert found["period_number"].values.tolist() == [-1, 1]


@pytest.mark.parametrize(("number", "of_sections", "of_a_response"), [(8, 8, 8), (9, 9, 0), (16, 16, 0), (17, 0, 0)])
def test_the_longest_period_of_runs(number: int, of_sections: int, of_a_response: int) -> None:
    """Steady runs are looked at for periods of up to 16 turns of the drive, those of a response for 8."""
    run = _motion(0.01, 2.0, 4 * number)
    slow = np.cos(2 * np.pi * run["phase"].values / number)[:, None]
    motion = run.assign(u=run["u"] + 0.004 * slow)
    assert measured_sections([motion], "g", [0.1])["period_number"].values.tolist() == [of_sections]
    assert measured_response([motion], ["up"])["period_number"].values.tolist() == [of_a_response]
