"""Typical mistakes as they are typed: each message says what was given, what is allowed and what to do.

But for the last group each is refused before anything is compiled.
"""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.cli import main as cli
from nonsmooth.flow.engines.linear import PlanarEngine
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.identification import Estimate
from nonsmooth.kernels.compile import cache

IMPACT = "system(transitions=[ns.Transition('free', 'free', when='{}', reset=lambda t, u, p: (u.x, -p.e * u.v))])"
FIELD = "system(modes={{'free': lambda t, u, p: {}}})"

#: What is typed; then what was given, what is allowed and what to do, in the words of the message.
MISTAKES = {
    # the functions of a system
    "arguments in another order": (
        "def swing(u, t, p):\n    return u.v, -p.k * u.x\n\nsystem(modes={'free': swing})",
        "function `swing`): its arguments are (u, t, p)",
        "f(t, u, p): time, states, parameters",
        "write them so",
    ),
    "arguments as in SciPy": (
        "def swing(t, y):\n    return [y[1], -y[0]]\n\nsystem(modes={'free': swing})",
        "mode 'free' (function `swing`): its arguments are (t, y)",
        "called as f(t, u, p)",
        "write them so",
    ),
    "names that hide another order": (
        "system(modes={'free': lambda state, time, par: (state.v, -par.k * state.x)})",
        "its arguments are (state, time, par)",
        "called as f(t, u, p): time, states, parameters",
        "mode 'free'",
    ),
    "an indicator without the time": (
        "system(indicators={'gap': lambda u, p: u.x - p.g})",
        "indicator 'gap': its arguments are (u, p)",
        "called as f(t, u, p)",
        "write them so",
    ),
    "a reset of the state alone": (
        "system(transitions=[ns.Transition('free', 'free', when='gap > 0', reset=lambda u: (u.x, -u.v))])",
        "the reset of transition free -> free: its arguments are (u)",
        "called as f(t, u, p)",
        "write them so",
    ),
    "a power as in MATLAB": (FIELD.format("(u.v, -u.x^3)"), "mode 'free'", "`^` is not a power", "write x**3"),
    "a force without its coordinate": (
        "ns.mechanical(1.0, 0.1, 1.0, forcing=lambda t, p: np.cos(t))",
        "not <function",
        "`forcing` must be a mapping",
        'such as {"q": lambda t, p:',
    ),
    "an output without a name": (
        "system(outputs=lambda t, u, p: u.v**2)",
        "not <function",
        "`outputs` must be a mapping",
        'such as {"energy": lambda t, u, p:',
    ),
    "a table in a force": (
        "ns.mechanical(1.0, 0.1, 1.0, forcing={'q': lambda t, p: np.interp(t, [0, 1], [0, 2])})",
        "the number was `t`",
        "a table over time (np.interp)",
        "is an input, inputs=",
    ),
    "two walls in one indicator": (
        "system(indicators={'gap': lambda t, u, p: abs(u.x) - p.g})",
        "indicator 'gap' contains `abs`",
        "one indicator for each side",
        "with a transition each",
    ),
    "a system saved as a result": (
        "ns.save(system(), 'rig.nc')",
        "got System",
        "of an orbit or a fit give .to_dataset()",
        "system.to_text()",
    ),
    "a force that pulls a stop shut": (
        "ball = ns.System(states=['x', 'v'], parameters={}, modes={'fly': lambda t, u, p: (u.v, -9.81)},\n"
        "    elements={'floor': ns.elements.Stop(gap=lambda t, u, p: u.x, on={'v': -1.0})})",
        "element 'floor'",
        "a positive force opens its gap, and on= does the opposite",
        "turn the sign of on=",
    ),
    "a friction that drives": (
        "ns.mechanical(1.0, 0.0, 1.0, parameters={'mu': -0.3}, elements={'pad': ns.elements.Coulomb(at='q',"
        " friction='mu')})",
        "element 'pad'",
        "must not be negative",
        "the friction of",
    ),
    "a static friction below the kinetic one": (
        "ns.mechanical(1.0, 0.0, 1.0, elements={'pad': ns.elements.Coulomb(at='q', friction=0.3, static=0.1)})",
        "element 'pad'",
        "must not be less than its kinetic friction",
        "the static friction",
    ),
    "a normal force that pulls": (
        "ns.mechanical(np.eye(2), 0.0 * np.eye(2), np.eye(2), elements={'pad': ns.elements.Coulomb(at='q2',\n"
        "    friction=0.3, normal='wall'), 'wall': ns.elements.ElasticStop(at='q1', stiffness=9.0, damping=0.5,"
        " pulls=True)})",
        "element 'pad': the damper of 'wall' pulls",
        "no normal force",
        "leave pulls out",
    ),
    "an elastic stop without stiffness": (
        "ns.elements.ElasticStop(at='q', position=1.0)",
        "without which nothing stops",
        "give stiffness=",
        "a rigid stop is Stop",
    ),
    "a play of negative width": (
        "ns.mechanical(1.0, 0.0, 1.0, elements={'gear': ns.elements.Backlash(at='q', half_width=-0.1, stiffness=1.0)})",
        "element 'gear'",
        "must not be negative",
        "the half width",
    ),
    "a negative mass": (
        "ns.mechanical('m', 0.1, 1.0, parameters={'m': 1.0}).with_parameters(m=-1.0)",
        "m = -1.0",
        "must be positive",
        "the mass of coordinate 'q'",
    ),
    "masses that are coupled too much": (
        "M = lambda p: [[p.m, p.d], [p.d, p.m]]\n"
        "rig = ns.mechanical(M, np.eye(2), np.eye(2), parameters={'m': 1.0, 'd': 0.0})\n"
        "rig.with_parameters(d=2.0)",
        "d = 2.0",
        "must be positive definite",
        "the mass matrix",
    ),
    "a force of time alone": (
        "ns.mechanical(1.0, 0.1, 1.0, forcing={'q': lambda t: np.cos(t)})",
        "forcing of 'q': its arguments are (t)",
        "called as f(t, p): time, parameters",
        "write them so",
    ),
    "a belt of time and parameters": (
        "ns.mechanical(1.0, 0.1, 1.0, parameters={'w': 1.0}, elements={'rub': ns.elements.Coulomb(at='q', friction=1, "
        "belt=lambda t, p: -p.w)})",
        "speed of element 'rub'",
        "its arguments are (t, p), but it is called as f(t, u, p)",
        "write them so",
    ),
    "a mass of time": (
        "ns.mechanical(M=lambda t, p: 1.0, C=0.1, K=1.0)",
        "M: its arguments are (t, p)",
        "called as f(p): parameters",
        "write them so",
    ),
    "a stiffness of time": (
        "ns.mechanical(1.0, 0.1, lambda t, p: 1.0)",
        "K: its arguments are (t, p)",
        "called as f(p): parameters",
        "write them so",
    ),
    "the rest of a division of time": (FIELD.format("(u.v, -(t % 1.0))"), "mode 'free'", "`floor` of", "with `at=`"),
    "the rest by NumPy": (FIELD.format("(u.v, -np.mod(u.x, 1.0))"), "mode 'free'", "`floor` of", "two modes"),
    "an expression for the name of a parameter": (
        "ns.mechanical(1.0, 0.1, 1.0, parameters={'d': 0.1}, elements=[ns.elements.Stop(at='q', position='-d')])",
        "'-d'",
        "is not the name of a parameter",
        "what is computed is a function",
    ),
    "an option of another program": (
        "ns.simulate(system(), x0=[0, 1], periods=1)",
        "`x0` is not an option of simulate",
        "nearest: start",
        "samples",
    ),
    "a file for a recording": (
        "ns.fit(system(), 'disp.csv', ['g'])",
        "not 'disp.csv'",
        "a recording is a Recording",
        "read a file with ns.load_recording",
    ),
    "math.cos": (
        FIELD.format("(u.v, math.cos(p.omega * t))"),
        "the number was `p.omega*t`",
        "NumPy's functions",
        "np.cos",
    ),
    "an if on a state": (
        "def swing(t, u, p):\n    if u.x > p.g:\n        return u.v, -10 * u.x\n    return u.v, -u.x\n\n"
        "system(modes={'free': swing})",
        "mode 'free': `u.x > p.g` cannot be decided",
        "ns.where(condition, a, b)",
        "Make it two modes",
    ),
    "np.sign": (
        FIELD.format("(u.v, -np.sign(u.v))"),
        "contains `sign` of the state",
        "an indicator that changes sign",
        "Make it two modes",
    ),
    "an array of floats": (
        FIELD.format("np.array([u.v, -u.x], dtype=float)"),
        "the number was `u.v`",
        "symbolic number",
        "without dtype",
    ),
    "one derivative of two": (
        FIELD.format("-p.k * u.x"),
        "it returned 1 values",
        "must return 2 values",
        "one for each of x, v",
    ),
    "derivatives in braces": (
        FIELD.format("{u.v, -u.x}"),
        "it returned a set, { }",
        "one for each of x, v",
        "write ( ) or [ ]",
    ),
    "a state that is set": (
        "def swing(t, u, p):\n    u.x = u.x - p.g\n    return u.v, -u.x\n\nsystem(modes={'free': swing})",
        "mode 'free': x",
        "cannot be set",
        "a function returns",
    ),
    "a parameter in capitals": (
        FIELD.format("(u.v, -p.K * u.x)"),
        "`K` is not a parameter",
        "all: e, g, k, omega",
        "nearest: k",
    ),
    "a parameter among the states": (
        FIELD.format("(u.v, -u.k * u.x)"),
        "`k` is not a state",
        "all: v, x",
        "of mode 'free'",
    ),
    "a condition as an indicator": (
        "system(indicators={'gap': lambda t, u, p: u.x > p.g})",
        "`u.x > p.g` is a condition, not a number",
        "ns.where(condition, a, b)",
        "write the difference of both sides",
    ),
    # the parts of a system
    "== in a condition": (IMPACT.format("gap == 0"), "cannot read 'gap == 0'", "<indicator> > 0", "new indicator"),
    "or in a condition": (
        IMPACT.format("gap > 0 or gap < 0"),
        "'gap > 0 or gap < 0'",
        "joined by 'and'",
        "'or' is a second transition",
    ),
    "states in a condition": (IMPACT.format("x > g"), "cannot read 'x > g'", "<indicator> > 0", 'write "gap > 0"'),
    "a misspelt mode": (
        "system(transitions=[ns.Transition('free', 'fre', when='gap > 0')])",
        "`fre` is not a mode",
        "all: free",
        "nearest: free;",
    ),
    "a tuple as a transition": (
        "system(transitions=[('free', 'free', 'gap > 0')])",
        "not ('free', 'free', 'gap > 0')",
        "a list of ns.Transition",
        "write ns.Transition(",
    ),
    "one transition without its list": (
        "system(transitions=ns.Transition('free', 'free', when='gap > 0', reset=lambda t, u, p: (u.x, -u.v)))",
        "not free -> free alone",
        "a list of ns.Transition",
        "put it into [ ]",
    ),
    "a unit in the value": (
        "system(parameters={'k': '8.47 N/m'})",
        "not '8.47 N/m'",
        "a real number",
        '{"k": (8.47, "N/m")}',
    ),
    "a unit before the value": (
        "system(parameters={'k': ('N/m', 8.47)})",
        "parameter 'k' is ('N/m', 8.47)",
        "(number, unit)",
        "give a number",
    ),
    "states as one string": ("system(states='x v')", "not 'x v'", "or be a list of names", '{"x": "m"}'),
    "a state twice": (
        "system(states=['x', 'v', 'x'])",
        "`states` = ['x', 'v', 'x']",
        "one name is given twice",
        "system",
    ),
    "parts by position": (
        "ns.System({'x': 'm'}, {'k': 1.0}, {'free': lambda t, u, p: -u.x})",
        "not 3",
        "no arguments by position",
        "System(states=, parameters=, modes=",
    ),
    "a reserved name": (
        "system(parameters={'period': 1.0})",
        "'period' cannot name a parameter",
        "Reserved: ",
        "try period_",
    ),
    "a blank in the name of an element": (
        "ns.mechanical(1.0, 0.1, 1.0, elements={'left stop': ns.elements.Stop(at='q', position=0.1, restitution=0.5)})",
        "'left stop' cannot name an element",
        "must be a Python identifier",
        "(left_stop_open)",
    ),
    "a mass of zero": ("osc.with_parameters(m=0)", "m = 0", "divide by zero", "give m another value"),
    "an unknown parameter": (
        "osc.with_parameters(gap=0.001)",
        "`gap` is not a parameter",
        "all: c, c_s, g, k,",
        "nearest: g [m]",
    ),
    "a parameter by position": (
        "osc.with_parameters('rho', 0.3)",
        "not 2: give 0.3",
        "takes 1 argument by position",
        "by its name",
    ),
    "a parameter as an attribute": ("osc.rho", "no 'rho'", "system.values['rho']", "with_parameters(rho=...)"),
    "text as a band": ("osc.smoothed('1e-5')", "not '1e-5'", "a real number", "eta must be"),
    # names of the package
    "a misspelt verb": (
        "ns.simulte(osc)",
        "no attribute 'simulte'",
        "dir(nonsmooth) lists all",
        "nearest: ns.simulate",
    ),
    "a figure among the verbs": (
        "ns.bifurcation(osc)",
        "no attribute 'bifurcation'",
        "dir(nonsmooth) lists all",
        "nearest: ns.plot.bifurcation",
    ),
    "a misspelt figure": (
        "ns.plot.bifurcaton(osc)",
        "`bifurcaton` is not a figure",
        "all: COLORS",
        "nearest: bifurcation;",
    ),
    "a misspelt model": (
        "ns.models.discontinous_support()",
        "`discontinous_support`",
        "chua_circuit, discontinuous_support,",
        "nearest: discontinuous_support;",
    ),
    # verbs and their arguments
    "the length by position": (
        "ns.simulate(osc, 20)",
        "not 2: give 20",
        "takes 1 argument by position",
        "simulate(system, periods=, duration=",
    ),
    "a parameter as an option": (
        "ns.simulate(osc, periods=3, omega=3.0)",
        "`omega` is a parameter",
        "not an option",
        "with_parameters(omega=...)",
    ),
    "an option of SciPy": (
        "ns.simulate(osc, t_span=(0, 10))",
        "`t_span` is not an option of simulate",
        "all: atol, duration",
        "nearest: ",
    ),
    "a model that is not called": (
        "ns.simulate(ns.models.discontinuous_support, periods=3)",
        "not <function discontinuous_support",
        "takes an ns.System",
        "call it: discontinuous_support()",
    ),
    "no length": ("ns.simulate(osc)", "once", "periods=... or duration=...", "give the length"),
    "a negative length": ("ns.simulate(osc, periods=-5)", "periods = -5", "must be positive", "the length of a run"),
    "periods without forcing": (
        "ns.simulate(valve, periods=5)",
        "no forcing period",
        "in place of periods",
        "give duration=...",
    ),
    "a billion periods": (
        "ns.simulate(osc, periods=1e9)",
        "a run with 2.56e+11 samples",
        "GiB are free",
        "give samples=",
    ),
    "a method of SciPy": (
        "ns.simulate(osc, periods=1, method='RK45')",
        "'RK45'",
        "'exact', 'taylor', 'rkf45'",
        "method =",
    ),
    "a tolerance for the exact flow": (
        "ns.simulate(osc, periods=1, method='exact', rtol=1e-9)",
        'method="exact"',
        "no tolerance",
        "leave rtol, atol",
    ),
    "a start that is too short": (
        "ns.simulate(osc, periods=1, start=[0.1])",
        "not shape (1,)",
        "2 numbers (x, v)",
        "or name them: {'x': 0.0",
    ),
    "a start with a unit": (
        "ns.simulate(osc, periods=1, start={'x': '1 mm'})",
        "not '1 mm'",
        "a real number",
        "the start of state 'x'",
    ),
    "a start that is NaN": (
        "ns.simulate(osc, periods=1, start={'x': float('nan')})",
        "[nan, 0.0]",
        "a finite number",
        "state 'x'",
    ),
    "an unknown mode": (
        "ns.simulate(osc, periods=1, mode='fre')",
        "`fre` is not a mode",
        "all: contact",
        "nearest: free",
    ),
    "values before their name": (
        "ns.sweep(osc, [0.2, 0.3], 'rho')",
        "not [0.2, 0.3]",
        "by its name in quotes",
        "before its values",
    ),
    "a name as a keyword": (
        "ns.sweep(osc, rho=[0.2, 0.3])",
        "sweep needs parameter and values",
        "direction=",
        "sweep(system, parameter, values",
    ),
    "no values": ("ns.sweep(osc, 'rho', [])", "shape (0,)", "a list of numbers", "give at least one"),
    "one value": ("ns.sweep(osc, 'rho', 0.3)", "shape ()", "a list of numbers", "write [value]"),
    "values with NaN": ("ns.sweep(osc, 'rho', [0.2, float('nan')])", "number 1 is nan", "must be finite", "'rho'"),
    "values as text": ("ns.sweep(osc, 'rho', '0.1, 0.2')", "not '0.1, 0.2'", "real numbers", "values of 'rho'"),
    "more periods than are kept": (
        "ns.sweep(osc, 'rho', [0.2], keep=10, max_period=16)",
        "max_period = 16",
        "periods up to 9",
        "raise keep",
    ),
    "another direction": ("ns.sweep(osc, 'rho', [0.2], direction='forward')", "'forward'", "'up', 'down'", "allowed: "),
    "an indicator as a section": (
        "ns.poincare(osc, section='penetration')",
        "not 'penetration'",
        "ns.Poincare(...)",
        "section must be",
    ),
    "a section of an unknown indicator": (
        "ns.poincare(osc, section=ns.Poincare('penetraton'))",
        "`penetraton`",
        "all: penetration",
        "nearest: penetration;",
    ),
    "a phase in degrees": ("ns.Stroboscopic(90)", "phase = 90", "0 <= phase < 1", "in forcing periods"),
    "more points than memory": (
        "ns.poincare(osc, n=1e10)",
        "1 x 1e+10 section points",
        "GiB are free",
        "ask for fewer",
    ),
    "a mesh as a grid": (
        "a, b = np.meshgrid([3.0, 4.0], [0.1, 0.2])\nns.chart(osc, {'omega': a, 'rho': b})",
        "shape (2, 2)",
        "a list of numbers",
        "give one axis",
    ),
    "one parameter of a chart": (
        "ns.chart(osc, {'rho': [0.1, 0.2]})",
        "given: ['rho']",
        "two parameters",
        '{"omega": values, "rho": values}',
    ),
    "parameters as a plane of starts": (
        "ns.basins(osc, {'rho': [0.1, 0.2], 'omega': [3, 4]})",
        "`rho` is not a state",
        "all: v, x",
        "support'",
    ),
    "a GPU by its common name": (
        "ns.chart(osc, {'omega': [3.0, 4.0], 'rho': [0.1, 0.2]}, device='gpu')",
        "'gpu'",
        "'cpu', 'cuda'",
        "allowed: ",
    ),
    "a misspelt option of find_orbit": (
        "ns.find_orbit(osc, period=2)",
        "`period` is not an option",
        "all: ",
        "nearest: period_number",
    ),
    "a branch of a system": (
        "ns.continue_orbit(osc, 'rho', (0.2, 0.5))",
        "not System",
        "a branch (of continue_orbit)",
        "of find_orbit",
    ),
    # files
    "a result as a table": ("ns.load('data.csv')", "data.csv", ".nc (NetCDF) or .zarr (Zarr)", "must end in"),
    "no such file": ("ns.load('none.nc')", "none.nc: no such file", ".nc or .zarr", "written by nonsmooth.save"),
    "save in another order": ("ns.save('run.nc', osc)", "got str", "an xarray.Dataset", "save takes"),
    # elements and matrices
    "an element between two coordinates, as a list": (
        "ns.mechanical(np.eye(2), 0.1 * np.eye(2), np.eye(2), elements={'b': ns.elements.Stop(at=['q1', 'q2'])})",
        "not ['q1', 'q2']",
        "the name of a coordinate, 'q1', or a combination",
        '{"q2": 1, "q1": -1}',
    ),
    "an element between two coordinates, as a text": (
        "ns.mechanical(np.eye(2), 0.1 * np.eye(2), np.eye(2), elements={'b': ns.elements.Stop(at='q2-q1')})",
        "`q2-q1` is not a coordinate",
        "all: q1, q2",
        'between two: at={"q2": 1, "q1": -1}',
    ),
    "an element between two of three coordinates that have names": (
        "ns.mechanical(np.eye(3), np.eye(3), np.eye(3), coordinates=['a', 'b', 'c'], "
        "elements={'s': ns.elements.Stop(at=['a', 'b'])})",
        "the name of a coordinate, 'a', or a combination",
        '{"c": 1, "a": -1}',
        "not ['a', 'b']",
    ),
    "an element between the only coordinate and another": (
        "ns.mechanical(1.0, 0.1, 1.0, elements={'s': ns.elements.Stop(at='q-y')})",
        "`q-y` is not a coordinate",
        "all: q;",
        'between two: at={"q2": 1, "q1": -1}',
    ),
    "a coordinate by its number": (
        "ns.mechanical(np.eye(2), 0.1 * np.eye(2), np.eye(2), elements={'b': ns.elements.Stop(at=1)})",
        "element 'b': at= is",
        "the name of a coordinate",
        "not 1",
    ),
    "a list of masses": (
        "ns.mechanical([1.0, 2.0], np.eye(2), np.eye(2))",
        "not of shape (2,)",
        "a square array",
        "np.diag(masses)",
    ),
    "a coordinate twice": (
        "ns.mechanical(np.eye(2), np.eye(2), np.eye(2), coordinates=['a', 'a'])",
        "coordinates: ['a', 'a']",
        "give a name of its own",
        "to each row of the mass matrix",
    ),
    "a gap with a coordinate": (
        "ns.elements.Stop(at='q', gap=0.1)",
        "at= (of ns.mechanical) and gap=",
        "exclude each other",
        "is position=",
    ),
    "a coefficient of friction by its letter": (
        "ns.elements.Coulomb(at='q', mu=0.3)",
        "`mu` is not an option",
        "all: at, belt",
        "nearest: friction",
    ),
    "static friction as a ratio": (
        "ns.mechanical(1.0, 0.1, 1.0, elements={'r': ns.elements.Coulomb(at='q', friction=5.0, static=1.6)})",
        "the static friction of element 'r'",
        "must not be less than its kinetic friction",
        "no ratio",
    ),
    # figures and files
    "a sketch of a run": (
        "ns.plot.mechanism(xr.Dataset({'u': ('time', [0.0])}))",
        "not <xarray.Dataset>",
        "takes an ns.System",
        "ns.system_of(result)",
    ),
    "a run's figure of a system": ("ns.plot.phase_portrait(osc)", "not System", "the result of simulate", "first"),
    "two states in one figure": (
        "ns.plot.time_history(RUN, y=['x', 'v'])",
        "not ['x', 'v']; it is one name",
        "a call of its own",
        "the same axes with ax=",
    ),
    "all axes of a figure": (
        "ns.plot.time_history(RUN, ax=np.array([None, None]))",
        "ax = array([None, None]",
        "is no matplotlib Axes",
        "ax[0]",
    ),
    "a figure of a fit": (
        "ns.plot.fit_residuals",
        "`fit_residuals` is not a figure",
        "all: ",
        "ns.plot.identification.fit_residuals",
    ),
    "a figure behind its file": (
        "ns.plot.save_figure('fig.pdf', ns.plot.mechanism(osc))",
        "not 'fig.pdf'",
        "takes the figure",
        "first, then the file",
    ),
    "a figure as a document": (
        "ns.plot.save_figure(ns.plot.mechanism(osc), 'fig.docx')",
        "fig.docx",
        "allowed: ",
        "pdf",
    ),
    "a figure in a folder that is not there": (
        "ns.plot.save_figure(ns.plot.mechanism(osc), 'none/fig.pdf')",
        "fig.pdf",
        "does not exist",
        "create it first",
    ),
    "a result for MATLAB": ("ns.save(xr.Dataset(), 'run.mat')", "got '.mat'", "must end in .nc", "read .nc by ncread"),
    "an option of pandas": (
        "Path('a.csv').write_text('t,x' + 40 * '\\n0,1')\nns.load_recording('a.csv', sep=';')",
        "`sep` is not an option",
        "nearest: delimiter",
        "all: ",
    ),
    "the time column alone": (
        "Path('a.csv').write_text('t,x' + 40 * '\\n0,1')\nns.load_recording('a.csv', columns={'time': 't'})",
        "columns= names no channel",
        "leaves out what it does not name",
        "the columns are 't', 'x'",
    ),
    "a channel as an input": (
        "y = xr.DataArray([0.0, 1.0], coords={'time': [0.0, 1.0]}, dims='time')\n"
        "rig = ns.mechanical(1.0, 0.1, 1.0, inputs={'y': 'm'}, forcing={'q': lambda t, p: p.y})\n"
        "ns.simulate(rig, duration=1.0, inputs={'y': y})",
        "inputs['y'] is an array over its time",
        "give (y.time, y)",
        "such a y",
    ),
    # conditions
    "an extreme in a condition": (
        "ns.region(CHART, 'max(x) < 1')",
        "`max(x)`",
        "x_maximum and x_minimum",
        "every value along the motion",
    ),
    "the and of arrays": (
        "ns.region(CHART, 'x < 1 & v < 2')",
        "`&` and `|`",
        "write `and`, `or`",
        "a condition such as",
    ),
    "one sign of equality": (
        "ns.region(CHART, 'period_number = 1')",
        "cannot read the condition",
        "is equal to: ==",
        "a condition such as",
    ),
    "a unit in a condition": (
        "ns.region(CHART, 'abs(x) < 25 mm')",
        "cannot read the condition",
        "numbers stand without units",
        "a condition such as",
    ),
}


def system(**changes: Any) -> ns.System:
    """An impact oscillator with one part changed."""
    parts: dict[str, Any] = {
        "states": {"x": "m", "v": "m/s"},
        "parameters": {"k": 1.0, "g": 0.1, "e": 0.8, "omega": 1.0},
        "modes": {"free": lambda t, u, p: (u.v, np.cos(p.omega * t) - p.k * u.x)},
        "indicators": {"gap": lambda t, u, p: u.x - p.g},
        "transitions": [ns.Transition("free", "free", when="gap > 0", reset=lambda t, u, p: (u.x, -p.e * u.v))],
    }
    return ns.System(**(parts | changes))


NAMES = {
    "ns": ns,
    "np": np,
    "math": math,
    "system": system,
    "osc": ns.models.discontinuous_support(),
    "valve": ns.models.relief_valve(),
    "xr": xr,
    "Path": Path,
    "RUN": xr.Dataset({"u": (("time", "state"), np.zeros((2, 2)))}, {"time": [0.0, 1.0], "state": ["x", "v"]}),
    "CHART": xr.Dataset({f"{name}_{of}": ("rho", [0.5]) for name in "xv" for of in ("minimum", "maximum")}),
}


@pytest.fixture
def nothing_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    def compiles(*_: Any, **__: Any) -> None:
        raise AssertionError("work has begun that compiles kernels")

    for place, name in ((PlanarEngine, "prepare"), (SeriesEngine, "prepare"), (cache, "_compile_once")):
        monkeypatch.setattr(place, name, compiles)


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_answered_at_once(case: str, nothing_compiled: None, tmp_path: Path, monkeypatch: Any) -> None:
    typed, *expected = MISTAKES[case]
    monkeypatch.chdir(tmp_path)
    with pytest.raises((ValueError, TypeError, AttributeError, MemoryError)) as raised:
        exec(typed, dict(NAMES))
    said = str(raised.value)
    assert len(expected) == 3 and [part for part in expected if part not in said] == [], said
    assert len(said) < 1000 and "object at" not in said and "Scalar" not in said


STUDY = '[system]\nmodel = "discontinuous_support"\n'

FILES = {
    "a misspelt key": (STUDY + "[simulate]\nperiod = 3\n", "`period` is not a key", "nearest: periods", "all: "),
    "a misspelt table": (STUDY + "[simulat]\nperiods = 3\n", "`simulat` is not a table", "nearest: simulate", "all: "),
    "another file ending": (
        STUDY + '[simulate]\nperiods = 3\n[output]\ndata = "run.csv"\n',
        "'run.csv'",
        "must end in .nc, .zarr",
        "data =",
    ),
    "values as a range": (
        STUDY + '[sweep]\nparameter = "rho"\nvalues = "0.2:0.5"\n',
        "values is '0.2:0.5'",
        "give a list",
        "n = ... }",
    ),
    "more values than memory": (
        STUDY + '[sweep]\nparameter = "rho"\nvalues = { from = 0.2, to = 0.5, n = 5e12 }\n',
        "n = 5e+12 numbers",
        "GiB are free",
        "take fewer",
    ),
    "a number of 400 digits": (
        STUDY + f"[simulate]\nperiods = {'9' * 400}\n",
        "periods must be finite",
        "not inf",
        "nonsmooth: ",
    ),
    "a number of 5000 digits": (
        STUDY + f"[simulate]\nperiods = {'9' * 5000}\n",
        "is not a TOML file",
        "digits",
        "study",
    ),
    "5000 brackets": (STUDY + f"[simulate]\nperiods = {'[' * 5000}\n", "is not a TOML file", "recursion", "study"),
    "a text of a million letters": (
        STUDY + f'[simulate]\nperiods = 3\nmethod = "{"x" * 10**6}"\n',
        "(1000002 characters)",
        "'auto', 'exact'",
        "method",
    ),
}


@pytest.mark.parametrize("case", FILES)
def test_a_study_file_is_answered_before_it_is_run(
    case: str, nothing_compiled: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, *expected = FILES[case]
    path = tmp_path / "study.toml"
    path.write_text(text)
    assert cli.main(["run", str(path)]) == 2
    said = capsys.readouterr().err
    assert [part for part in expected if part not in said] == [], said
    assert said.count("\n") == 1 and len(said) < 1500


LONG = list(map(float, range(10**5)))


@pytest.mark.parametrize(
    "typed",
    [
        "ns.sweep(osc, 'rho', ['a', *LONG])",
        "ns.simulate(osc, periods=1, start=['a', *LONG])",
        "ns.chart(osc, LONG)",
        "osc.with_parameters(rho=LONG)",
        "ns.simulate(osc, periods=1, samples=['a', *LONG])",
        "ns.simulate(osc, periods=1, ramps={'rho': LONG})",
        "ns.poincare(osc, section=LONG)",
        "osc.smoothed(LONG)",
        "osc.with_parameters(rho=10**5000)",
        "osc.with_parameters({'x' * 10**6: 1.0})",
        "ns.simulate(osc, LONG)",
        "ns.System.from_text('{' * 10**6)",
        "system(transitions=[ns.Transition('free', 'free', when='gap > 0 or ' * 10**5)])",
    ],
)
def test_a_message_quotes_little_of_what_was_given(typed: str, nothing_compiled: None) -> None:
    with pytest.raises((ValueError, TypeError)) as raised:
        exec(typed, {**NAMES, "LONG": LONG})
    assert len(str(raised.value)) < 1000


def test_a_ball_in_micrometres_is_told_its_scale() -> None:
    """At 0.1 m rounding of the place lets the ball up faster than the least speed of an impact; nothing is wrong with
    its reset. With the scales of the message it comes to rest."""
    fall = {"duration": 1.0, "start": {"q": 1e5}}

    def ball(scale: dict[str, float] | None) -> ns.System:
        table = ns.elements.Stop(at="q", position=-1e5, side=-1, restitution=0.5)
        load = {"q": lambda t, p: -9.81e6}
        return ns.mechanical(
            1.0, 0.0, 0.0, coordinates=["q"], scale=scale, elements={"table": table}, forcing=load, parameters={}
        )

    with pytest.raises(ns.SolveError, match="Impacts are told from rest by the scales of the states") as raised:
        ns.simulate(ball(None), **fall)
    given = eval(str(raised.value).partition("scale=")[2].partition("}")[0] + "}")
    assert given == {"q": 1e5, "v_q": pytest.approx(np.sqrt(4 * 9.81e6 * 1e5), rel=0.05)}
    assert str(ns.simulate(ball(given), **fall)["mode"].attrs["flag_meanings"]).split()[1] == "table_rest"
    assert int(ns.simulate(ball(given), **fall)["mode"][-1]) == 1


@pytest.mark.parametrize(("sign", "e"), [(1, 0.8), (-1, 0.8), (1, 0.02)])
@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_a_reset_with_the_wrong_sign(method: str, sign: int, e: float) -> None:
    """It looks like infinitely many impacts; the rate that the mass has before the stop goes on behind it times e."""
    wrong = ns.System(
        states=["x", "v"],
        parameters={"k": 1.0, "c": 0.1, "omega": 1.0, "d": 1.0, "e": e, "A": 1.0},
        modes={"motion": lambda t, u, p: (u.v, p.A * np.cos(p.omega * t) - p.k * u.x - p.c * u.v)},
        indicators={"stop": lambda t, u, p: sign * (u.x - p.d)},
        transitions=[
            ns.Transition(
                "motion", "motion", when=f"stop {'>' if sign > 0 else '<'} 0", reset=lambda t, u, p: (u.x, p.e * u.v)
            )
        ],
    )
    with pytest.raises(ns.SolveError, match="The reset of motion -> motion leaves the state on its way on") as raised:
        ns.simulate(wrong, periods=10, method=method)
    before, after = (float(word) for word in str(raised.value).split("d(stop)/dt is ")[1].split()[0:6:4])
    assert after == pytest.approx(e * before, rel=1e-3) and np.sign(before) == sign
    assert "the other sign" in str(raised.value) and raised.value.status == "chatter"


def test_a_state_that_a_figure_does_not_hold() -> None:
    """The states stand in the list, although a table has their extremes only."""
    diagram = ns.sweep(ns.models.discontinuous_support(), "rho", [0.2, 0.3], transient=5, keep=5, max_period=2)
    with pytest.raises(
        ValueError, match="`speed` is not a quantity of this result.*, status, v, v_amplitude.*, x, x_amp"
    ):
        ns.plot.bifurcation(diagram, y="speed")


def test_a_parameter_that_was_not_fitted() -> None:
    found = ns.ParameterSet({"k": Estimate(8.0, 0.1)}, np.eye(1))
    with pytest.raises(KeyError, match="'m' was not identified; there are: k"):
        found["m"]
    assert found.get("m") is None


def test_a_push_through_its_surface_is_told_of_the_two_modes_that_it_takes() -> None:
    """An escapement that pushes in the middle: behind the push the condition of one mode holds again, without end."""
    clock = ns.System(
        states=["x", "v"],
        parameters={"K": 1.0},
        modes={"swing": lambda t, u, p: (u.v, -u.x - 0.1 * u.v)},
        indicators={"middle": lambda t, u, p: u.x},
        transitions=[ns.Transition("swing", "swing", when="middle > 0", reset=lambda t, u, p: (u.x, u.v + p.K))],
    )
    with pytest.raises(ns.SolveError, match="takes two modes, one on each side"):
        ns.simulate(clock, duration=20.0, start=[-0.5, 0.1])


def test_real_chatter_is_not_taken_for_a_wrong_sign() -> None:
    """A ball that comes to rest: the rates after its impacts point away from the floor."""
    ball = ns.System(
        states=["x", "v"],
        parameters={"e": 0.5},
        modes={"flight": lambda t, u, p: (u.v, -1.0)},
        indicators={"floor": lambda t, u, p: -u.x},
        transitions=[ns.Transition("flight", "flight", when="floor > 0", reset=lambda t, u, p: (u.x, -p.e * u.v))],
    )
    with pytest.raises(ns.SolveError, match="ever shorter times") as raised:
        ns.simulate(ball, duration=20.0, start=[1.0, 0.0])
    assert raised.value.status == "chatter" and "other sign" not in str(raised.value)


def test_two_ends_and_a_number_are_three_values() -> None:
    system = ns.models.discontinuous_support()
    with pytest.warns(UserWarning, match=r"three values, 3\.0, 4, 500; .* write np\.linspace\(3\.0, 4, 500\)"):
        found = ns.sweep(system, "omega", (3.0, 4, 500), progress=False)
    assert found["omega"].values.tolist() == [3.0, 4.0, 500.0]


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda orbit, found: orbit.multipliers, "an Orbit has no 'multipliers'; nearest: floquet_multipliers"),
        (lambda orbit, found: orbit.x, r"an Orbit has no 'x': orbit.u is the section point.*sel\(state='x'\)"),
        (lambda orbit, found: orbit.k, r"orbit.system.values\['k'\]"),
        (lambda orbit, found: orbit.eigenvalues, "it has clearance, .*virtual"),
        (lambda orbit, found: orbit.system.params, "a System has no 'params'; nearest: parameters"),
        (lambda orbit, found: orbit.system.parameter, "nearest: parameters, parameter_points, parameter_vector$"),
        (lambda orbit, found: found.k, r"found\['k'\] is the value, found.estimates\['k'\]"),
        (lambda orbit, found: found.covar, "a ParameterSet has no 'covar'; nearest: covariance"),
    ],
)
def test_an_attribute_that_there_is_not(ask: Callable[..., object], said: str) -> None:
    orbit = ns.find_orbit(ns.models.discontinuous_support())
    found = ns.ParameterSet({"k": Estimate(1.0, 0.1)}, [[0.01]])
    with pytest.raises(AttributeError, match=said):
        ask(orbit, found)
    assert not hasattr(orbit, "data_vars")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda orbit: ns.smoothing_report(orbit, [1e-3]), "orbit.system is that of an orbit"),
        (lambda orbit: ns.simulate(orbit.system, periods=1, start=orbit), r"orbit.trajectory\(\) is one"),
        (lambda orbit: ns.explore(orbit, browser=False), "explore takes an ns.System"),
        (lambda orbit: ns.explore("impact_oscillator"), r"called by its name: ns.models.impact_oscillator\(\)"),
        (lambda orbit: ns.explore(ns.models.impact_oscillator), r"call it: impact_oscillator\(\)"),
        (lambda orbit: ns.explore(orbit.system, port="a"), "port must be a whole number, not 'a'"),
        (lambda orbit: ns.explore(orbit.system, port=70000), "port = 70000 must be zero or more and at most 65535"),
    ],
)
def test_what_is_given_in_place_of_a_system(call: Callable[..., object], said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        call(ns.find_orbit(ns.models.discontinuous_support()))


def test_answers_can_be_copied_and_sent_to_another_process() -> None:
    orbit = ns.find_orbit(ns.models.discontinuous_support())
    found = ns.ParameterSet({"k": Estimate(1.0, 0.1)}, [[0.01]], notes=["one"], synthetic=True)
    for one in (orbit, orbit.system, found):
        for other in (copy.copy(one), copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
            assert type(other) is type(one) and repr(other) == repr(one)
    again = pickle.loads(pickle.dumps(found))
    assert again["k"] == 1.0 and again.notes == ("one",) and again.synthetic
    assert float(again.full_covariance[0, 0]) == 0.01
