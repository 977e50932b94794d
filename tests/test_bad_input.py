"""Mistakes of users: every message names the culprit and the remedy, in Python and on the command line."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.cli import main as cli

VALUES = np.linspace(0.2, 0.3, 3)


@pytest.fixture(scope="module")
def s() -> ns.System:
    return ns.models.discontinuous_support()


@pytest.fixture(scope="module")
def valve() -> ns.System:
    return ns.models.relief_valve()


def define(**changes: object) -> ns.System:
    """A small system with one thing changed."""
    parts: dict = {
        "states": {"x": "m", "v": "m/s"},
        "parameters": {"k": 1.0, "g": 0.1},
        "modes": {"free": lambda t, u, p: (u.v, -p.k * u.x), "contact": lambda t, u, p: (u.v, -10 * p.k * u.x)},
        "indicators": {"gap": lambda t, u, p: u.x - p.g},
        "transitions": [
            ns.Transition("free", "contact", when="gap > 0"),
            ns.Transition("contact", "free", when="gap < 0"),
        ],
    }
    return ns.System(**(parts | changes))


def field(f: Callable) -> dict:
    return {"modes": {"free": f, "contact": f}}


MODELS = {
    "if on a state": (field(lambda t, u, p: (u.v, 1.0 if u.x > 0 else -1.0)), r"mode 'free'.*two modes"),
    "math.cos": (field(lambda t, u, p: (u.v, math.cos(t))), r"mode 'free'.*np\.cos"),
    "abs": (field(lambda t, u, p: (u.v, -abs(u.x))), r"mode 'free'.*`abs` of the state.*two modes"),
    "max": (field(lambda t, u, p: (u.v, -max(u.x, 0.0))), r"mode 'free'.*two modes"),
    "np.maximum": (field(lambda t, u, p: (u.v, -np.maximum(u.x, 0.0))), r"`max` of the state.*two modes"),
    "unknown state": (field(lambda t, u, p: (u.v, -u.y)), r"`y` is not a state of mode 'free'; all: v, x"),
    "unknown parameter": (field(lambda t, u, p: (u.v, -p.kk)), r"`kk` is not a parameter.*nearest: k; all: g, k"),
    "too few components": (field(lambda t, u, p: (u.v,)), r"must return 2 values, one for each of x, v; it returned 1"),
    "another component": (
        field(lambda t, u, p: {"x": u.v, "y": 1}),
        r"one for each of x, v; it returned values of x, y",
    ),
    "nothing returned": (field(lambda t, u, p: None), r"returned NoneType"),
    "unknown target": (
        {"transitions": [ns.Transition("free", "contakt", when="gap > 0")]},
        r"`contakt` is not a mode.*nearest: contact",
    ),
    "unknown indicator": (
        {"transitions": [ns.Transition("free", "contact", when="gapp > 0")]},
        r"`gapp` is not an indicator.*nearest: gap",
    ),
    "a state in a condition": (
        {"transitions": [ns.Transition("free", "contact", when="x > 0")]},
        r"free -> contact: `x` is not an indicator",
    ),
    **{
        f"condition {when!r}": (
            {"transitions": [ns.Transition("free", "contact", when=when)]},
            r"free -> contact.*<indicator> > 0.*and",
        )
        for when in (
            "gap > 0 or gap < 0",
            "gap > 1",
            "gap == 0",
            "gap > 0 and",
            "not gap > 0",
            "",
            "gap > 0 and (gap < 0)",
        )
    },
    "reserved name": ({"states": {"time": "s", "v": ""}}, r"'time' cannot name a state.*results use.*try time_"),
    "keyword": ({"parameters": {"k": 1.0, "g": 1.0, "lambda": 1.0}}, r"'lambda' cannot name a parameter.*try lambda_"),
    "name twice": ({"parameters": {"k": 1.0, "g": 1.0, "x": 1.0}}, r"'x' is given to a state and to a parameter"),
    "indicator without a state": (
        {"indicators": {"gap": lambda t, u, p: np.cos(t) - p.g}},
        r"indicator 'gap'.*never involves the state.*at=",
    ),
    "text as a parameter": ({"parameters": {"k": "1.0", "g": 0.1}}, r"'k'.*'1\.0'"),
    "parameter that is NaN": ({"parameters": {"k": float("nan"), "g": 0.1}}, r"parameter 'k' must be finite"),
    "modes as a list": ({"modes": [lambda t, u, p: (u.v, -u.x)]}, r"mode"),
    "no mode": ({"modes": {}}, r"at least one mode"),
}


@pytest.mark.parametrize("case", MODELS)
def test_a_model_that_does_not_fit_together(case: str) -> None:
    changes, message = MODELS[case]
    with pytest.raises((ValueError, TypeError), match=f"(?s){message}"):
        define(**changes)


PARAMETERS = {
    "unknown": (
        {"gap": 0.1},
        ValueError,
        r"`gap` is not a parameter of 'discontinuous support'; nearest: g \[m\]; all: c,",
    ),
    "mass of zero": ({"m": 0.0}, ValueError, r"m = 0 makes .*divide by zero: give m another value"),
    "k_s of zero": ({"k_s": 0.0}, ValueError, r"k_s = 0 makes indicator 'separation' divide by zero: give k_s"),
    "omega of zero": ({"omega": 0.0}, ValueError, r"omega = 0 makes the forcing period"),
    "NaN": ({"g": math.nan}, ValueError, r"parameter 'g' must be finite"),
    "infinity": ({"g": math.inf}, ValueError, r"parameter 'g' must be finite"),
    "text": ({"g": "0.1"}, TypeError, r"parameter 'g' must be a real number, not '0\.1'"),
    "list": ({"g": [0.1, 0.2]}, TypeError, r"parameter 'g' must be a real number"),
    "eta of a sharp system": ({"eta": 1e-5}, ValueError, r"eta is set by smoothed\(eta\)"),
}


@pytest.mark.parametrize("case", PARAMETERS)
def test_parameters_that_are_not_allowed(case: str, s: ns.System) -> None:
    values, error, message = PARAMETERS[case]
    with pytest.raises(error, match=message):
        s.with_parameters(**values)


SIMULATE = {
    "no length": ({}, ValueError, r"periods=\.\.\. or duration=\.\.\."),
    "both lengths": ({"periods": 1, "duration": 1.0}, ValueError, r"once: periods=\.\.\. or duration"),
    "negative": ({"periods": -1}, ValueError, r"periods = -1.*must be positive"),
    "zero": ({"duration": 0}, ValueError, r"duration = 0.*must be positive"),
    "NaN": ({"periods": math.nan}, ValueError, r"periods must be finite"),
    "text": ({"periods": "3"}, TypeError, r"periods must be a real number, not '3'"),
    "a list": ({"periods": [1, 2]}, TypeError, r"periods must be a real number"),
    "negative transient": ({"periods": 1, "transient": -1}, ValueError, r"transient = -1 must be zero or more"),
    "text transient": ({"periods": 1, "transient": "a"}, TypeError, r"transient must be a real number"),
    "unknown state": ({"periods": 1, "start": {"y": 1}}, ValueError, r"`y` is not a state .*all: v, x"),
    "short start": ({"periods": 1, "start": [1.0]}, ValueError, r"2 numbers \(x, v\), not shape \(1,\).*'x': 0\.0"),
    "long start": ({"periods": 1, "start": [1.0, 2, 3]}, ValueError, r"2 numbers \(x, v\), not shape \(3,\)"),
    "empty start": ({"periods": 1, "start": []}, ValueError, r"2 numbers \(x, v\), not shape \(0,\)"),
    "NaN start": ({"periods": 1, "start": [math.nan, 0]}, ValueError, r"state 'x' must be a finite number: \[nan, 0"),
    "text start": ({"periods": 1, "start": "rest"}, TypeError, r"start must be a state \({'x': 0\.0, 'v': 0\.0}\)"),
    "text in a start": (
        {"periods": 1, "start": {"x": "a"}},
        TypeError,
        r"start of state 'x' must be a real number, not 'a'",
    ),
    "a number as start": ({"periods": 1, "start": 0.1}, TypeError, r"start must be a state"),
    "several starts": (
        {"periods": 1, "start": [[0, 0], [1, 1]]},
        ValueError,
        r"one start; sweep and poincare take several",
    ),
    "unknown mode": ({"periods": 1, "mode": "contakt"}, ValueError, r"`contakt` is not a mode .*nearest: contact"),
    "one sample": ({"periods": 1, "samples": 1}, ValueError, r"samples = 1 must be a whole number, at least 2"),
    "half a sample": ({"periods": 1, "samples": 2.5}, ValueError, r"samples = 2\.5 must be a whole number"),
    "samples NaN": ({"periods": 1, "samples": math.nan}, ValueError, r"samples must be finite"),
    "samples as text": ({"periods": 1, "samples": "many"}, TypeError, r"samples must be a real number, not 'many'"),
    "samples outside": (
        {"periods": 1, "samples": [0, 9.0]},
        ValueError,
        r"samples from 0 to 9 lie outside the recorded time 0 \.\.\. 1\.7",
    ),
    "samples backwards": ({"periods": 1, "samples": [1, 0.5]}, ValueError, r"increasing finite instants"),
    "unknown method": ({"periods": 1, "method": "rk4"}, ValueError, r"method = 'rk4'; allowed: 'auto', 'exact'"),
    "exact with rtol": (
        {"periods": 1, "method": "exact", "rtol": 1e-9},
        ValueError,
        r"no tolerance and no step; leave rtol",
    ),
    "exact with step": ({"periods": 1, "method": "exact", "step": 1e-3}, ValueError, r"no tolerance and no step"),
    "negative rtol": ({"periods": 1, "rtol": -1e-9}, ValueError, r"rtol = -1e-09 must be at least 1e-15"),
    "text rtol": ({"periods": 1, "rtol": "1e-9"}, TypeError, r"rtol must be a real number"),
    "three atol": (
        {"periods": 1, "atol": [1, 2, 3]},
        ValueError,
        r"one number or one for each of x, v, not of shape \(3,\)",
    ),
    "atol of one state": ({"periods": 1, "atol": {"x": 1e-9}}, ValueError, r"atol must name each state.*'v'"),
    "atol of nothing": ({"periods": 1, "atol": 0.0}, ValueError, r"atol = 0\.0 must be positive and finite"),
    "endless atol": ({"periods": 1, "atol": np.inf}, ValueError, r"atol = inf must be positive and finite"),
    "negative step": ({"periods": 1, "step": -1.0}, ValueError, r"step = -1\.0 must be positive"),
    "a step of nothing": ({"periods": 1, "step": 1e-320}, ValueError, r"step = 1e-320: .* more than 1e\+09 steps"),
    "unknown option": (
        {"periods": 1, "tol": 1e-9},
        TypeError,
        r"`tol` is not an option of simulate; nearest: rtol; all: ",
    ),
    "parameter as option": (
        {"periods": 1, "omega": 3.0},
        TypeError,
        r"`omega` is a parameter of 'discontinuous support'.*with_parameters\(omega=\.\.\.\)",
    ),
    "order of rkf45": (
        {"periods": 1, "method": "rkf45", "order": 12},
        ValueError,
        r"order is that of method=\"taylor\"",
    ),
    "unknown ramp": ({"periods": 1, "ramps": {"roh": (0, 1)}}, ValueError, r"`roh` is not a parameter.*nearest: rho"),
    "ramp of three": ({"periods": 1, "ramps": {"rho": (0, 1, 2)}}, TypeError, r"\(first, last\) or a function of time"),
    "ramp as text": ({"periods": 1, "ramps": {"rho": "up"}}, TypeError, r"\(first, last\) or a function of time"),
    "ramp of NaN": ({"periods": 1, "ramps": {"rho": (0, math.nan)}}, ValueError, r"ramps\['rho'\] must be finite"),
    "ramps as a list": ({"periods": 1, "ramps": [("rho", 0, 1)]}, TypeError, r"ramps must be a mapping"),
    "ramp with math": ({"periods": 1, "ramps": {"rho": lambda t: math.cos(t)}}, ValueError, r"ramp of 'rho'.*np\.cos"),
    "ramp with a corner": ({"periods": 1, "ramps": {"rho": lambda t: abs(t - 1)}}, ValueError, r"ramp of 'rho'.*`abs`"),
    "ramp through zero mass": ({"periods": 1, "ramps": {"m": (-1, 1)}}, ValueError, r"m = 0 makes .*divide by zero"),
    "ramps with exact": (
        {"periods": 1, "ramps": {"rho": (0, 1)}, "method": "exact"},
        ValueError,
        r'use "taylor" or "rkf45"',
    ),
}


@pytest.mark.parametrize("case", SIMULATE)
def test_simulate_says_what_is_wrong(case: str, s: ns.System) -> None:
    options, error, message = SIMULATE[case]
    with pytest.raises(error, match=message):
        ns.simulate(s, **options)


SWEEP = {
    "unknown parameter": ("roh", VALUES, {}, ValueError, r"`roh` is not a parameter .*nearest: rho \[N\]; all: "),
    "one number": ("rho", 0.3, {}, ValueError, r"must be a list of numbers.*\[value\]"),
    "empty": ("rho", [], {}, ValueError, r"values of 'rho' must be a list of numbers, not of shape \(0,\)"),
    "text": ("rho", ["a", "b"], {}, TypeError, r"values of 'rho' must be real numbers, not \['a', 'b'\]"),
    "NaN": ("rho", [0.1, math.nan], {}, ValueError, r"values of 'rho' must be finite; number 1 is nan"),
    "twice": ("rho", [0.1, 0.1], {}, ValueError, r"must differ from each other; 0\.1 is there more than once"),
    "a table": ("rho", np.zeros((2, 2)), {}, ValueError, r"a list of numbers, not of shape \(2, 2\)"),
    "mass of zero": ("m", [0.0, 1.0], {}, ValueError, r"m = 0 makes .*divide by zero"),
    "direction": (
        "rho",
        VALUES,
        {"direction": "upwards"},
        ValueError,
        r"'upwards'; allowed: 'up', 'down', 'both', None",
    ),
    "directions": ("rho", VALUES, {"direction": ["up"]}, ValueError, r"allowed: 'up', 'down', 'both', None"),
    "transient": ("rho", VALUES, {"transient": -1}, ValueError, r"transient = -1 must be a whole number, at least 0"),
    "transient NaN": ("rho", VALUES, {"transient": math.nan}, ValueError, r"transient must be finite"),
    "keep": ("rho", VALUES, {"keep": 1}, ValueError, r"keep = 1 must be a whole number, at least 2"),
    "keep as text": ("rho", VALUES, {"keep": "all"}, TypeError, r"keep must be a whole number, not 'all'"),
    "max_period": ("rho", VALUES, {"max_period": 0}, ValueError, r"max_period = 0 .*at least 1"),
    "max_period beyond keep": (
        "rho",
        VALUES,
        {"keep": 10, "max_period": 16},
        ValueError,
        r"max_period = 16: 10 kept .* periods up to 9",
    ),
    "threads": ("rho", VALUES, {"threads": 0}, ValueError, r"threads = 0 .*at least 1"),
    "section as a number": ("rho", VALUES, {"section": 0.5}, TypeError, r"ns\.Stroboscopic\(\.\.\.\) or ns\.Poincare"),
    "start of nothing": ("rho", VALUES, {"start": []}, ValueError, r"2 numbers \(x, v\)"),
    "starts of three": (
        "rho",
        VALUES,
        {"start": np.zeros((2, 3))},
        ValueError,
        r"2 numbers \(x, v\), not shape \(3,\)",
    ),
    "start with a wrong name": ("rho", VALUES, {"start": [{"x": 1}, {"z": 2}]}, ValueError, r"`z` is not a state"),
    "periods": ("rho", VALUES, {"periods": 3}, TypeError, r"`periods` is not an option of sweep; nearest: max_period"),
}


@pytest.mark.parametrize("case", SWEEP)
def test_sweep_says_what_is_wrong(case: str, s: ns.System) -> None:
    parameter, values, options, error, message = SWEEP[case]
    with pytest.raises(error, match=message):
        ns.sweep(s, parameter, values, **options)


OTHERS: dict[str, tuple[Callable, type[Exception], str]] = {
    "no period": (lambda s, v: ns.simulate(v, periods=3), ValueError, r"no forcing period: give duration"),
    "exact of a nonlinear system": (
        lambda s, v: ns.simulate(v, duration=1.0, method="exact"),
        ValueError,
        r"no exact flow.*use method=\"taylor\"",
    ),
    "autonomous sweep": (
        lambda s, v: ns.sweep(v, "q", [8.0]),
        ValueError,
        r'section=ns\.Poincare\("indicator"\), one of: seat, lift_velocity',
    ),
    "autonomous stroboscope": (
        lambda s, v: ns.poincare(v, section=ns.Stroboscopic()),
        ValueError,
        r"no forcing period: use ns\.Poincare",
    ),
    "autonomous poincare": (lambda s, v: ns.poincare(v), ValueError, r"section=ns\.Poincare"),
    "response without omega": (
        lambda s, v: ns.frequency_response(v, [8.0]),
        ValueError,
        r"`omega` is not a parameter of 'relief valve'.*parameter=",
    ),
    "a name as system": (
        lambda s, v: ns.simulate("discontinuous_support", periods=1),
        TypeError,
        r"ns\.models\.discontinuous_support\(\)",
    ),
    "a function as system": (
        lambda s, v: ns.sweep(ns.models.relief_valve, "q", [8.0]),
        TypeError,
        r"call it: relief_valve\(\)",
    ),
    "phase of one": (lambda s, v: ns.Stroboscopic(1.0), ValueError, r"phase = 1\.0.*0 <= phase < 1"),
    "phase as text": (lambda s, v: ns.Stroboscopic("half"), TypeError, r"phase must be a real number"),
    "side": (lambda s, v: ns.Poincare("gap", side="left"), ValueError, r"allowed: 'after', 'before'"),
    "every": (lambda s, v: ns.Poincare("gap", every=0), ValueError, r"every = 0 .*at least 1"),
    "every as text": (lambda s, v: ns.Poincare("gap", every="2"), TypeError, r"every must be a whole number"),
    "rising": (
        lambda s, v: ns.Poincare("gap", rising="up"),
        TypeError,
        r"True \(upwards\), False \(downwards\), None",
    ),
    "t_max": (lambda s, v: ns.Poincare("gap", t_max=-1), ValueError, r"t_max = -1.*positive"),
    "section indicator": (
        lambda s, v: ns.poincare(s, section=ns.Poincare("penetraton")),
        ValueError,
        r"nearest: penetration",
    ),
    "section mode": (
        lambda s, v: ns.poincare(s, section=ns.Poincare("penetration", mode="fre")),
        ValueError,
        r"nearest: free",
    ),
    "n of zero": (lambda s, v: ns.poincare(s, n=0), ValueError, r"n = 0 must be a whole number, at least 1"),
    "n of a half": (lambda s, v: ns.poincare(s, n=2.5), ValueError, r"n = 2\.5 must be a whole number"),
    "no starts": (lambda s, v: ns.random_starts(0, [0], [1], 1), ValueError, r"n = 0.*at least 1.*number of starts"),
    "box turned over": (lambda s, v: ns.random_starts(2, [1], [0], 1), ValueError, r"not above high"),
    "box of NaN": (lambda s, v: ns.random_starts(2, [math.nan], [0], 1), ValueError, r"low must be finite"),
    "box of two shapes": (lambda s, v: ns.random_starts(2, [0], [1, 2], 1), ValueError, r"equal length"),
    "box of two names": (lambda s, v: ns.random_starts(2, {"x": 0}, {"v": 1}, 1), ValueError, r"name the same states"),
    "eta of zero": (lambda s, v: s.smoothed(0), ValueError, r"eta .*positive"),
    "smoothed impact": (lambda s, v: v.smoothed(1e-5), ValueError, r"open -> open.*reset"),
    "save of a number": (lambda s, v: ns.save(3, "a.nc"), TypeError, r"xarray\.Dataset, got int"),
    "load of nothing": (lambda s, v: ns.load("none.nc"), ValueError, r"none\.nc: no such file"),
    "load of a table": (lambda s, v: ns.load("none.csv"), ValueError, r"must end in \.nc .*or \.zarr"),
    "text that is none": (lambda s, v: ns.System.from_text("x = 1"), ValueError, r"not the text of a system"),
    "a changed system": (lambda s, v: setattr(s, "name", "a"), AttributeError, r"use with_parameters"),
}


@pytest.mark.parametrize("case", OTHERS)
def test_the_other_verbs_say_what_is_wrong(case: str, s: ns.System, valve: ns.System) -> None:
    call, error, message = OTHERS[case]
    with pytest.raises(error, match=f"(?s){message}"):
        call(s, valve)


@pytest.mark.parametrize("suffix", [".nc", ".zarr"])
def test_a_truncated_dataset(suffix: str, tmp_path: Path, s: ns.System, capsys: pytest.CaptureFixture[str]) -> None:
    path = ns.save(ns.simulate(s, periods=3), tmp_path / f"run{suffix}")
    if suffix == ".nc":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    else:
        max(
            (f for f in path.rglob("*") if f.is_file() and f.name[0].isdigit()), key=lambda f: f.stat().st_size
        ).unlink()
    with pytest.raises(ns.DataFileError, match=rf"run\{suffix}: .*(damaged or cut short|missing)"):
        ns.load(path)
    assert cli.main(["show", str(path)]) == 2
    err = capsys.readouterr().err
    assert err.startswith("nonsmooth: ") and f"run{suffix}" in err and "Traceback" not in err


STUDY = '[system]\nmodel = "discontinuous_support"\n'

TOML = {
    "unknown key": (STUDY + '[sweep]\nparameter = "rho"\nvalues = [0.2]\nkeeps = 3\n', "`keeps` is not a key", "keep"),
    "unknown parameter": (
        STUDY + "parameters = { rho = 0.3, gap = 1 }\n[simulate]\nperiods = 1\n",
        "`gap`",
        "nearest: g",
    ),
    "unknown model": ('[system]\nmodel = "support"\n[simulate]\nperiods = 1\n', "`support`", "discontinuous_support"),
    "mass of zero": (STUDY + "parameters = { m = 0 }\n[simulate]\nperiods = 1\n", "m = 0", "give m another value"),
    "text as a number": (STUDY + '[simulate]\nperiods = "3"\n', "periods", "real number"),
    "both lengths": (STUDY + "[simulate]\nperiods = 3\nduration = 1.0\n", "once", "periods"),
    "unknown state": (STUDY + "[simulate]\nperiods = 3\nstart = { y = 1.0 }\n", "`y` is not a state", "all: v, x"),
    "swept parameter": (STUDY + '[sweep]\nparameter = "roh"\nvalues = [0.2]\n', "`roh`", "nearest: rho"),
    "values as text": (STUDY + '[sweep]\nparameter = "rho"\nvalues = ["a"]\n', "values", "'a'"),
    "n of values": (
        STUDY + '[sweep]\nparameter = "rho"\nvalues = { from = 0.1, to = 0.2, n = 2.5 }\n',
        "values: n",
        "whole number",
    ),
    "unknown method": (STUDY + '[simulate]\nperiods = 1\nmethod = "rk4"\n', "'rk4'", "'auto', 'exact'"),
    "not TOML": ("[system\n", "TOML", "line 1"),
}


@pytest.mark.parametrize("case", TOML)
def test_a_study_file_that_is_wrong(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, culprit, remedy = TOML[case]
    path = tmp_path / "study.toml"
    path.write_text(text)
    assert cli.main(["run", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert culprit in err and remedy in err


def test_a_study_that_diverges_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "study.toml"
    path.write_text(STUDY + "parameters = { c = -5.0 }\n[simulate]\nperiods = 100\n")
    assert cli.main(["run", str(path)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "grew beyond 1e9" in err and "at t = " in err


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("directions", [("both",), pytest.param(("up", "both", "none"), marks=pytest.mark.slow)])
def test_ctrl_c_in_a_long_sweep(directions: tuple[str, ...], tmp_path: Path) -> None:
    """A sweep of hours, interrupted while it runs: exit code 130, one line, nothing half written.

    One process runs it in one direction after the other, each until it is interrupted."""
    for direction in directions:
        (tmp_path / f"{direction}.toml").write_text(
            STUDY + '[sweep]\nparameter = "rho"\nvalues = { from = 0.2, to = 0.5, n = 20000 }\n'
            f'direction = "{direction}"\ntransient = 2000\nkeep = 20\n[output]\ndata = "out.nc"\n'
        )
    before = sorted(tmp_path.iterdir())
    # tells when the work has begun, so that the signal does not meet the imports
    code = (
        "import signal, nonsmooth.diagrams.sweep as s\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a job in the background inherits "ignore"
        "run = s.over_items\n"
        "def told(*a):\n    print('running', flush=True)\n    return run(*a)\n"
        "s.over_items = told\n"
        "from nonsmooth.cli.main import main\n"
        f"for path in {list(map(str, before))!r}:\n    print(main(['run', path]), flush=True)"
    )
    work = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert work.stdout is not None
    for _ in before:
        assert work.stdout.readline() == "running\n"
        time.sleep(0.2)
        work.send_signal(signal.SIGINT)
        assert work.stdout.readline() == "130\n"
    out, err = work.communicate(timeout=600)
    assert work.returncode == 0, err
    assert err == len(directions) * "nonsmooth: interrupted\n"
    assert out == ""
    assert sorted(tmp_path.iterdir()) == before
