"""Options that exclude each other or lack their other half: each is refused by a sentence of its own, before work.

Where a limit is told, what lies at the limit itself is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

SUPPORT = ns.models.discontinuous_support()
VALVE = ns.models.relief_valve()
LINE = ns.mechanical(
    [[1.0]], [[0.2]], [[4.0]], coordinates={"x": "m"}, parameters={"k": 4.0, "c": 0.2}, inputs={"push": "N"}
)
PLANE = {"omega": [9.0, 10.0], "rho": [0.2, 0.3]}
TIME = np.linspace(0.0, 10.0, 101)
RECORD = {"time": TIME, "x": np.cos(2 * TIME)}
PUSHED = {"push": (TIME, np.sin(TIME))}
TWO = [{"x": 0.0, "v": 0.0}, {"x": 0.001, "v": 0.0}]
REST = {"u": [0.0, 0.0]}


def swing(**more: Any) -> ns.System:
    """A linear oscillator, with one thing added."""
    parts: dict[str, Any] = {
        "name": "swing",
        "states": {"x": "m", "v": "m/s"},
        "parameters": {"k": 4.0},
        "modes": {"one": lambda t, u, p: (u.v, -p.k * u.x)},
    }
    return ns.System(**{**parts, **more})


def fitted(**options: Any) -> Any:
    return ns.fit(swing(), options.pop("recording", RECORD), ["k"], measured="x", progress=False, **options)


def clock() -> ns.System:
    """A kick at a phase of the forcing."""
    return swing(
        parameters={"k": 4.0, "w": 1.0, "a": 0.1},
        modes={"one": lambda t, u, p: (u.v, p.a * np.cos(p.w * t) - p.k * u.x)},
        transitions=[ns.Transition("one", "one", at=0.25, reset=lambda t, u, p: (u.x, u.v + 0.1))],
    )


def element(**given: Any) -> Any:
    return ns.elements.Stop(at="x", **{"restitution": 0.5, **given})


CALLS: dict[str, tuple[Callable[[], Any], str]] = {
    # a sweep that judges nothing
    "no judge, and counted": (
        lambda: ns.sweep(SUPPORT, "rho", [0.2], judge=False, density=True),
        "judge=False records section points on the processor: leave out density",
    ),
    "a judge without sizes": (lambda: ns.sweep(SUPPORT, "rho", [0.2], extremes=False), "give judge=False with"),
    # one trajectory
    "exponents of two starts": (lambda: ns.lyapunov(SUPPORT, periods=3, start=TWO), "lyapunov follows one trajectory"),
    "spectrum of two starts": (
        lambda: ns.amplitude_spectrum(SUPPORT, start=TWO),
        "amplitude_spectrum follows one trajectory: give one start",
    ),
    "a parameter without values": (
        lambda: ns.lyapunov(SUPPORT, parameter="rho", periods=3),
        "parameter and values belong together",
    ),
    # charts
    "a chart of one parameter": (
        lambda: ns.chart(SUPPORT, {"rho": [0.2, 0.3]}),
        r"grid must name two parameters, .*; given: \['rho'\]",
    ),
    "a chart of three": (lambda: ns.chart(SUPPORT, {**PLANE, "g": [0.1]}), "grid must name two parameters"),
    "a refined chart in a store": (
        lambda: ns.chart(SUPPORT, PLANE, refine=True, store="never.zarr"),
        "refine decides from its results what to compute next: it takes no store",
    ),
    # inputs
    "inputs of a system without": (
        lambda: ns.simulate(swing(), duration=1.0, inputs=PUSHED),
        "'swing' has no inputs; declare them",
    ),
    "no inputs": (lambda: ns.simulate(LINE, duration=1.0), "has the inputs 'push': give inputs="),
    "another input": (
        lambda: ns.simulate(LINE, duration=1.0, inputs={"pull": PUSHED["push"]}),
        "inputs: `pull` is not an input",
    ),
    "an input of one array": (
        lambda: ns.simulate(LINE, duration=1.0, inputs={"push": TIME}),
        r"(?s)inputs\['push'\] = .*: give \(time, values\) or ns.Input",
    ),
    "a table without the input": (
        lambda: ns.simulate(LINE, duration=1.0, inputs={"time": TIME, "pull": TIME}),
        "inputs: the table has no column 'push'",
    ),
    "ramps with kicks": (
        lambda: ns.simulate(clock(), periods=2, ramps={"k": lambda t: 4 + 0.01 * t}),
        "ramps cannot be combined with time-triggered transitions",
    ),
    # recordings of a fit
    "no recordings": (lambda: fitted(recording=[]), "the list of recordings is empty; give"),
    "a channel of another length": (
        lambda: fitted(recording={"time": TIME, "x": TIME[1:]}),
        r"channel 'x' must be as many numbers as its time, in one row; got shapes \(100,\) and \(101,\)",
    ),
    "a channel of nothing": (
        lambda: ns.fit(swing(), {**RECORD, "v": np.full(101, np.nan)}, ["k"], measured=["x", "v"], progress=False),
        r"measured\['v'\]: channel 'v' holds no number; leave it out",
    ),
    "nothing measured": (
        lambda: ns.fit(swing(), RECORD, ["k"], measured=[], progress=False),
        "measured names nothing; allowed: x, v",
    ),
    "settings of other runs": (
        lambda: fitted(settings=[{"k": 1.0}, {"k": 2.0}]),
        "settings lists 2 runs, the recording has 1",
    ),
    "settings of no parameter": (lambda: fitted(settings={"m": 1.0}), "settings: `m` is not a parameter of 'swing'"),
    "a range turned round": (
        lambda: ns.Sensor("x", range=(1.0, -1.0)),
        r"range = \(1, -1\): the lower limit comes first",
    ),
    "an empty range": (lambda: ns.Sensor("x", range=(1.0, 1.0)), "the lower limit comes first"),
    "a range of one number": (lambda: ns.Sensor("x", range=3.0), r"range = 3.0: give \(low, high\)"),
    "a sensor that shows nothing": (lambda: ns.Sensor("x", gain=0.0), "gain = 0: a sensor with this gain"),
    "two first guesses": (lambda: fitted(start=TWO), "fit takes one first guess of the start"),
    "a known start that is not given": (lambda: fitted(free_start=False), "free_start=False says that the start is"),
    "left out from known starts": (
        lambda: fitted(free_start=False, start=TWO[0], leave_out=True),
        "it needs free starts, free_start=True",
    ),
    "priors in a list": (
        lambda: fitted(priors=[1.0]),
        r"priors = \[1.0\]: allowed are \{name: \(value, standard uncertainty\)\} and a ParameterSet",
    ),
    "one model to choose from": (lambda: ns.select_model({"a": (swing(), ["k"])}, RECORD), "at least two systems"),
    "a model to choose from without its parameters": (
        lambda: ns.select_model({"a": swing(), "b": (swing(), ["k"])}, RECORD),
        r"models\['a'\] must be a pair \(system, parameters\), not System",
    ),
    "three things of a model to choose from": (
        lambda: ns.select_model({"a": (swing(), ["k"]), "b": (swing(), "k", "m")}, RECORD),
        r"models\['b'\] must be a pair \(system, parameters\), not 3 things",
    ),
    "a plan without runs": (lambda: ns.plan_experiment(swing(), {}, ["k"], measured="x"), "give the candidates"),
    "a plan without noise": (
        lambda: ns.plan_experiment(swing(), {"one": {"duration": 9.0, "samples": 99}}, ["k"], measured="x"),
        r"measured\['x'\] says no noise: give ns.Sensor\(noise=...\) or resolution=",
    ),
    "a covariance of one": (
        lambda: ns.ParameterSet({}, [[1.0]]),
        r"covariance must be \(0, 0\): parameters, then extra; got \(1, 1\)",
    ),
    "a number for an estimate": (
        lambda: ns.ParameterSet({"k": 4.5}, [[0.01]]),
        r"k = 4.5 is no estimate; give nonsmooth.identification.Estimate\(value, uncertainty, unit\)",
    ),
    "no posterior": (lambda: ns.ParameterSet({}, np.zeros((0, 0))).posterior, "this set holds no posterior"),
    # systems
    "a side between": (lambda: element(gap=None, side=0), r"Stop: side is 1 .* or -1 .*, not 0"),
    "restitution above one": (lambda: element(restitution=1.01), "it lies between 0 and 1"),
    "no creep": (lambda: element(creep=0.0), "Stop: creep is a positive speed, not 0.0"),
    "friction without a tangent": (lambda: element(friction=0.3), r"friction= \(a coefficient\) and tangent="),
    "a tangent without friction": (lambda: element(tangent="y"), r"friction= \(a coefficient\) and tangent="),
    "friction that does not rest": (
        lambda: element(friction=0.3, tangent="y", rest=False),
        "a contact with friction rests; leave out rest=False",
    ),
    "at a coordinate and on states": (
        lambda: ns.elements.Stop(at="x", on={"v": 1.0}, restitution=0.5),
        r"at= \(of ns.mechanical\) and on= exclude each other",
    ),
    "on a number": (
        lambda: ns.elements.Stop(gap=lambda t, u, p: u.x, on=1.0, restitution=0.5),
        r"on= maps states to numbers or functions, .*; not 1.0",
    ),
    "smoothed without transitions": (
        lambda: swing().smoothed(0.1),
        "'swing' has no transitions: there is nothing to smooth",
    ),
    "a smoothed kick": (lambda: clock().smoothed(0.1), "has a reset, and a jump has no band"),
    "a map in place of a symmetry": (
        lambda: swing(symmetry=lambda u: (-u.x, -u.v)),
        r"`symmetry` is \(map, shift\) or \(map, shift, modes\), not",
    ),
    "a symmetry of another mode": (
        lambda: swing(symmetry=(lambda u: (-u.x, -u.v), 0.0, {"on": "one"})),
        "symmetry: `on` is not a mode of this system",
    ),
    "a phase shift without forcing": (
        lambda: swing(symmetry=(lambda u: (-u.x, -u.v), 0.5)),
        "the system has no forcing period",
    ),
    "both signs at once": (
        lambda: swing(
            indicators={"gap": lambda t, u, p: u.x},
            transitions=[ns.Transition("one", "one", when="gap > 0 and gap < 0", reset=lambda t, u, p: (u.x, -u.v))],
        ),
        "asks for both signs of 'gap' at once",
    ),
    "an input without a unit": (lambda: swing(inputs={"push": 3}), "the input 'push' is given as its unit, or as"),
    "a parameter that is set": (lambda: setattr(swing(), "k", 3.0), r"a System does not change: use with_parameters"),
    "values of unequal length": (
        lambda: SUPPORT.parameter_points({"rho": [0.2, 0.3], "g": [0.1]}),
        "columns of parameters must be one-dimensional and of equal length",
    ),
    # continuation
    "a table of special points": (
        lambda: ns.continue_orbit(xr.Dataset({"kind": ("special", ["fold"] * 2), "unknowns": ("special", [1, 2])})),
        r"continue_orbit takes one special point, not 2: choose it, special_points\(branch\).isel\(special=0\)",
    ),
    "a curve of a list": (
        lambda: ns.continue_curve([1.0], {"rho": (0.1, 0.2), "g": (0.0, 0.1)}),
        "continue_curve takes one row of special_points, not list",
    ),
    "a system for a rig": (
        lambda: ns.control_based_continuation(swing(), "frequency", (0.9, 1.1), frequency=1.0, amplitude=0.1),
        r"has no set_drive and no apply_force and no read; a system becomes a rig by ns.SimulatedRig\(system\)",
    ),
    "a rig that is not live": (
        lambda: ns.control_based_continuation(
            SimpleNamespace(live=swing), "frequency", (0.9, 1.1), frequency=1.0, amplitude=0.1
        ),
        "has no set_drive and no apply_force and no read; a VirtualRig becomes one by its method live",
    ),
    # numbers at their limits
    "99 observations": (
        lambda: ns.zero_one_test(np.arange(99.0)),
        "the 0-1 test needs 100 observations or more, better 1000; there are 99",
    ),
    "a picture of nothing": (
        lambda: ns.plot.identification.free_decay(type("Finding", (), {"data": None})()),
        "this finding kept no data to draw",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_it_is_refused_by_its_own_sentence(name: str) -> None:
    call, words = CALLS[name]
    with pytest.raises((ValueError, TypeError, AttributeError, ns.SystemDefinitionError), match=words):
        call()


def test_what_lies_at_a_limit_is_taken() -> None:
    assert float(ns.zero_one_test(np.ones(100))) == 0.0
    for restitution in (0.0, 1.0):
        assert element(restitution=restitution).restitution == restitution
    assert [element(side=side).side for side in (1, -1)] == [1, -1]
    assert ns.Sensor("x", range=(-1.0, 1)).range == (-1.0, 1.0)
    assert SUPPORT.parameter_points({"rho": [0.2, 0.3], "g": 0.1 * np.ones(2)}).shape == (2, len(SUPPORT.values))
