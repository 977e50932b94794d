"""Non-smooth (piecewise-smooth) dynamical systems, from the equations to the measured twin.

The verbs are the front door; each answers one question. Names are loaded when they are first used, so that
``import nonsmooth`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from nonsmooth.kernels.compile.forking import watch_forks
from nonsmooth.results import progress as _progress  # noqa: F401  it says when kernels are compiled

if TYPE_CHECKING:
    from nonsmooth import elements as elements
    from nonsmooth import models as models
    from nonsmooth import plot as plot
    from nonsmooth.attractors.basin_fractions import basin_fractions as basin_fractions
    from nonsmooth.attractors.basins import basins as basins
    from nonsmooth.continuation.bifurcation_diagram import bifurcation_diagram as bifurcation_diagram
    from nonsmooth.continuation.branches.orbit import Orbit as Orbit
    from nonsmooth.continuation.continue_curve import continue_curve as continue_curve
    from nonsmooth.continuation.continue_equilibrium import continue_equilibrium as continue_equilibrium
    from nonsmooth.continuation.continue_orbit import continue_orbit as continue_orbit
    from nonsmooth.continuation.find import find_orbit as find_orbit
    from nonsmooth.continuation.manifolds.manifolds import manifolds as manifolds
    from nonsmooth.continuation.special import special_points as special_points
    from nonsmooth.control.continuation import control_based_continuation as control_based_continuation
    from nonsmooth.control.holding import Holding as Holding
    from nonsmooth.control.simulated_rig import SimulatedRig as SimulatedRig
    from nonsmooth.diagrams.amplitude_spectrum import amplitude_spectrum as amplitude_spectrum
    from nonsmooth.diagrams.chart import chart as chart
    from nonsmooth.diagrams.correlation_dimension import correlation_dimension as correlation_dimension
    from nonsmooth.diagrams.lyapunov import lyapunov as lyapunov
    from nonsmooth.diagrams.response import frequency_response as frequency_response
    from nonsmooth.diagrams.sweep import sweep as sweep
    from nonsmooth.diagrams.zero_one_test import zero_one_test as zero_one_test
    from nonsmooth.errors import DataFileError as DataFileError
    from nonsmooth.errors import Interrupted as Interrupted
    from nonsmooth.errors import SolveError as SolveError
    from nonsmooth.errors import SystemDefinitionError as SystemDefinitionError
    from nonsmooth.explorer.serve import explore as explore
    from nonsmooth.flow.inputs import Input as Input
    from nonsmooth.flow.poincare import poincare as poincare
    from nonsmooth.flow.sections import Poincare as Poincare
    from nonsmooth.flow.sections import Stroboscopic as Stroboscopic
    from nonsmooth.flow.sensitivity import sensitivity as sensitivity
    from nonsmooth.flow.simulate import simulate as simulate
    from nonsmooth.flow.starts import random_starts as random_starts
    from nonsmooth.identification.compare.compare import compare as compare
    from nonsmooth.identification.fit.fit import fit as fit
    from nonsmooth.identification.fit.plan import plan_experiment as plan_experiment
    from nonsmooth.identification.fit.plan import select_model as select_model
    from nonsmooth.identification.fit.sensors import Sensor as Sensor
    from nonsmooth.identification.parameter_set import ParameterSet as ParameterSet
    from nonsmooth.identification.propagate import propagate as propagate
    from nonsmooth.plot.animation import animate as animate
    from nonsmooth.recordings.load import load_recording as load_recording
    from nonsmooth.recordings.recording import Recording as Recording
    from nonsmooth.results.store import load as load
    from nonsmooth.results.store import save as save
    from nonsmooth.smoothing.report import smoothing_report as smoothing_report
    from nonsmooth.system.derived.maps import Branch as Branch
    from nonsmooth.system.derived.maps import Map as Map
    from nonsmooth.system.derived.mechanical import mechanical as mechanical
    from nonsmooth.system.origin import system_of as system_of
    from nonsmooth.system.symbolic.scalar import where as where
    from nonsmooth.system.system import System as System
    from nonsmooth.system.transition import Band as Band
    from nonsmooth.system.transition import Mode as Mode
    from nonsmooth.system.transition import Surface as Surface
    from nonsmooth.system.transition import Transition as Transition
    from nonsmooth.tables.region import region as region
    from nonsmooth.tables.table import table as table
    from nonsmooth_savi2007.identification.chain import identify as identify

_WHERE = {
    "System": "system.system",
    "Transition": "system.transition",
    "Surface": "system.transition",
    "Map": "system.derived.maps",
    "Branch": "system.derived.maps",
    "Mode": "system.transition",
    "mechanical": "system.derived.mechanical",
    "Band": "system.transition",
    "where": "system.symbolic.scalar",
    "system_of": "system.origin",
    "Input": "flow.inputs",
    "simulate": "flow.simulate",
    "sensitivity": "flow.sensitivity",
    "poincare": "flow.poincare",
    "Stroboscopic": "flow.sections",
    "Poincare": "flow.sections",
    "random_starts": "flow.starts",
    "amplitude_spectrum": "diagrams.amplitude_spectrum",
    "sweep": "diagrams.sweep",
    "frequency_response": "diagrams.response",
    "lyapunov": "diagrams.lyapunov",
    "correlation_dimension": "diagrams.correlation_dimension",
    "zero_one_test": "diagrams.zero_one_test",
    "basins": "attractors.basins",
    "basin_fractions": "attractors.basin_fractions",
    "chart": "diagrams.chart",
    "bifurcation_diagram": "continuation.bifurcation_diagram",
    "find_orbit": "continuation.find",
    "Orbit": "continuation.branches.orbit",
    "continue_orbit": "continuation.continue_orbit",
    "continue_curve": "continuation.continue_curve",
    "continue_equilibrium": "continuation.continue_equilibrium",
    "special_points": "continuation.special",
    "manifolds": "continuation.manifolds.manifolds",
    "control_based_continuation": "control.continuation",
    "Holding": "control.holding",
    "SimulatedRig": "control.simulated_rig",
    "smoothing_report": "smoothing.report",
    "load_recording": "recordings.load",
    "Recording": "recordings.recording",
    "fit": "identification.fit.fit",
    "Sensor": "identification.fit.sensors",
    "select_model": "identification.fit.plan",
    "plan_experiment": "identification.fit.plan",
    "ParameterSet": "identification.parameter_set",
    "compare": "identification.compare.compare",
    "propagate": "identification.propagate",
    "explore": "explorer.serve",
    "animate": "plot.animation",
    "table": "tables.table",
    "region": "tables.region",
    "save": "results.store",
    "load": "results.store",
    "SystemDefinitionError": "errors",
    "SolveError": "errors",
    "DataFileError": "errors",
    "Interrupted": "errors",
}
_ROOMS = ("elements", "models", "plot")

__all__ = sorted([*_WHERE, *_ROOMS, "__version__"])


watch_forks()


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from nonsmooth.results.provenance import package_version

        return package_version()
    if name in _ROOMS:
        return import_module(f"nonsmooth.{name}")
    if name == "identify":  # of the study of the paper, a distribution of its own
        try:
            return import_module("nonsmooth.studies").study("savi2007", "identification").identify
        except ValueError as error:
            raise AttributeError(str(error), name=name) from None
    if name in _WHERE:
        value = getattr(import_module(f"nonsmooth.{_WHERE[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(_not_there(name), name=name)


def _not_there(name: str) -> str:
    """The sentence for a name that is not here; private names are asked for by machines."""
    text = f"module 'nonsmooth' has no attribute {name!r}"
    if name.startswith("_"):
        return text
    from nonsmooth.errors import nearest

    elsewhere = [f"ns.{room}.{name}" for room in _ROOMS if name in import_module(f"nonsmooth.{room}").__all__]
    near = elsewhere or [f"ns.{one}" for one in nearest(name, __all__)]
    return text + (f"; nearest: {', '.join(near)}" if near else "") + "; dir(nonsmooth) lists all"


def __dir__() -> list[str]:
    return __all__
