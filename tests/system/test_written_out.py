"""Elements that decide together: modes made when they are visited, and all of them written out where that is needed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.elements import Coulomb, ElasticStop, Stop


def rig(**more: Any) -> ns.System:
    """Two masses, a wall before one, a stop between them."""
    return ns.mechanical(
        [[1.0, 0.0], [0.0, 1.2]],
        [[0.1, 0.0], [0.0, 0.1]],
        [[2.0, -1.0], [-1.0, 2.0]],
        parameters={"w": 1.1, "A": 1.0},
        forcing={"q1": lambda t, p: p.A * np.cos(p.w * t)},
        elements={
            "s": Stop(at="q1", position=0.3, restitution=0.6),
            "r": Stop(at={"q1": 1, "q2": -1}, position=0.25, restitution=0.5),
            **more,
        },
    )


def rubbing() -> ns.System:
    return rig(f=Coulomb(at="q2", friction=0.15))


def test_all_modes_can_be_looked_at() -> None:
    system = rubbing()
    assert system.modes == ("f_stick_r_open_s_open",)
    whole = system.written_out()
    assert len(whole.modes) == 3 * 2 * 2
    assert whole == system
    assert whole.content_hash(values=True) == system.content_hash(values=True)
    assert whole.written_out() is whole
    assert "f_back_r_rest_s_rest" in system.summary(verbose=True)
    assert "f_back" not in str(system)
    assert r"\begin{align*}" in system.to_latex()
    assert system.with_parameters(A=0.8).written_out().values["A"] == 0.8


@pytest.mark.parametrize("options", [{"method": "rkf45", "rtol": 1e-11}, {"ramps": {"A": lambda t: 1.0 + 0.0 * t}}])
def test_a_series_and_a_ramp_write_them_out_by_themselves(options: dict[str, Any]) -> None:
    exact, other = (ns.simulate(rig(), periods=3, samples=40, **given) for given in ({}, options))
    assert len(exact["crossing_time"]) >= 8
    np.testing.assert_allclose(other["crossing_time"], exact["crossing_time"], atol=1e-7)
    np.testing.assert_allclose(other["u"].values[-1], exact["u"].values[-1], atol=1e-7)


def test_a_force_that_was_measured_is_fitted() -> None:
    system = ns.mechanical(
        1.0,
        0.1,
        2.0,
        parameters={"w": 1.1, "A": 1.0, "k": 8.0},
        forcing={"q": lambda t, p: p.A * np.cos(p.w * t)},
        elements={
            "s": Stop(at="q", position=0.3, restitution=0.6),
            "f": Coulomb(at="q", friction=0.05),
            "e": ElasticStop(at="q", position=-0.2, side=-1, stiffness="k"),
        },
    )
    run = ns.simulate(system, periods=1.5, samples=120)
    found = ns.fit(system.with_parameters(k=8.2), run, ["k"], measured=["q", "e_force"], progress=False)
    assert found["k"] == pytest.approx(8.0, abs=1e-9)  # though the force is zero, without noise, in most samples


def test_a_mode_that_no_run_has_visited_is_known_by_its_name() -> None:
    whole, start = rubbing().written_out(), {"q1": 0.3, "q2": 0.1}
    for mode in whole.modes:
        ends = [ns.simulate(one, periods=0.7, mode=mode, start=start)["u"].values[-1] for one in (rubbing(), whole)]
        np.testing.assert_array_equal(*ends)
    with pytest.raises(ValueError, match="`f_back` is not a mode .*f_back_r_rest_s_rest"):
        ns.simulate(rubbing(), periods=1, mode="f_back")


def test_a_run_goes_on_in_a_mode_that_its_system_has_not_visited() -> None:
    run = ns.simulate(rubbing(), periods=1.3)
    ends = [ns.simulate(one, periods=0.7, start=run)["u"].values[-1] for one in (rubbing(), rubbing().written_out())]
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("mode", [None, "f_forward_r_open_s_open", "f_stick_r_open_s_open"])
def test_a_section_lies_in_the_mode_of_its_name(mode: str | None) -> None:
    """Each point numbers its modes by itself."""
    section = ns.Poincare("r_gap", rising=None, mode=mode, t_max=60.0)
    given: dict[str, Any] = {"section": section, "transient": 20, "keep": 12, "direction": None, "progress": False}
    one, other = (ns.sweep(system, "A", [0.9, 1.0, 1.1], **given) for system in (rubbing(), rubbing().written_out()))
    np.testing.assert_array_equal(one["status"], other["status"])
    np.testing.assert_array_equal(one["section"], other["section"])
    assert (mode == "f_stick_r_open_s_open") == bool(np.isnan(one["section"]).all())


def test_a_run_that_stays_at_an_equilibrium_says_so() -> None:
    """Unstable: the spring between the wall and the first mass pushes."""
    system = ns.mechanical(
        np.eye(2),
        0.1 * np.eye(2),
        np.diag([-2.0, 2.0]),
        parameters={},
        elements={
            "wall": Stop(at="q1", position=1.0, restitution=0.5),
            "between": Stop(at={"q1": 1, "q2": -1}, position=3.0, restitution=0.5),
        },
    )
    with pytest.warns(UserWarning, match="unstable equilibrium, eigenvalues 1.3651,"):
        run = ns.simulate(system, duration=3.0)
    assert "the run begins and stays there" in run.attrs["note"]
