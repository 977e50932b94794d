"""Stiffness from pulls whose law is known: the slope without inertia, friction and gain."""

from dataclasses import replace

import numpy as np
import pytest
from studies.savi2007.tests.identification.made import counted, run

from nonsmooth_savi2007.identification.calibrations import stiffness

S, M, DRY, C = 17.0, 0.84, 0.010, 0.9


def pulls(gain=1.0, n=4, duration=30.0, reach=0.1, seed=0):
    """There and back like sin^2, with a tremor; the sensor feels S x + F_C sign v + c v + m a, in steps of 0.03 N."""
    rng, found = np.random.default_rng(seed), []
    for i in range(n):
        t = np.arange(0, duration, 0.01)
        w, q, size = np.pi / duration, 2 * np.pi * 1.3, 1e-4
        far = reach * (-1) ** i
        x = far * np.sin(w * t) ** 2 + size * np.sin(q * t)
        v = far * w * np.sin(2 * w * t) + size * q * np.cos(q * t)
        a = 2 * far * w**2 * np.cos(2 * w * t) - size * q**2 * np.sin(q * t)
        force = gain * (S * x + DRY * np.sign(v) + C * v + M * a) + 0.02 * rng.standard_normal(len(t))
        found.append(run("springs", t, counted(x), force=0.03 * np.rint(force / 0.03), name=f"Run #{i + 1}"))
    return found


def test_the_slope_is_that_of_the_spring_and_friction_that_of_the_loop():
    found = stiffness(pulls(), mass=M, gain_limit=0.01)
    alone = found.others["slope_a"]
    assert abs(alone.value - S) < 3.5 * alone.uncertainty < 0.003 * S
    dry = found.others["friction_force"]
    assert abs(dry.value - DRY) < 3.5 * dry.uncertainty
    assert found.data["slope"].values[0] == found.value and 9000 < found.samples_used <= 12_000


def test_inertia_left_in_takes_m_w_squared_off():
    # sin^2(pi t/T): a = -(2 pi/T)^2 (x - far/2)
    bare = stiffness(pulls(), mass=0.0, gain_limit=0.01).others["slope_a"]
    assert bare.value == pytest.approx(S - M * (2 * np.pi / 30) ** 2, abs=4 * bare.uncertainty)


def test_a_gain_is_stated_as_type_b_and_shows_in_no_scatter():
    high = stiffness(pulls(gain=1.009), mass=M, gain_limit=0.01)
    alone = high.others["slope_a"]
    assert alone.value == pytest.approx(1.009 * S, abs=4 * alone.uncertainty)
    assert high.estimate.half_width == pytest.approx(0.01 * high.value)
    assert high.uncertainty == pytest.approx(np.hypot(alone.uncertainty, 0.01 * high.value / np.sqrt(3)))
    low, up = high.interval()
    assert low < S < up


def test_what_cannot_be_used_is_refused_with_the_run_and_what_to_do():
    good = pulls(n=1)[0]
    other = run("springs", good.time, good.positions, force=np.zeros(len(good.time)))
    shifted = replace(good, name="Run #7", force=other.force.assign_coords(time=good.time + 0.5))
    with pytest.raises(ValueError, match=r"springs Run #7: .*not over the same times; record both at one rate"):
        stiffness([shifted], mass=M)
    with pytest.raises(ValueError, match="less than 50 counts in all runs; pull farther"):
        stiffness(pulls(reach=0.001, n=2), friction=False)
    creeping = run("springs", good.time, counted(1e-4 * good.time), force=np.zeros(len(good.time)))
    with pytest.raises(ValueError, match=r"springs Run #1, channel 'Angle': the hand moves faster than 3 mm/s in"):
        stiffness([creeping], mass=M)
