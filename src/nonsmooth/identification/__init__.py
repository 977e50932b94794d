"""Recordings to parameters with uncertainty, and experiment against theory.

:func:`identify` runs the whole chain; each procedure is a function of its own on the runs that :func:`gather` takes
out of a session.
"""

from nonsmooth.identification.calibrations import crank_force, voltage_frequency
from nonsmooth.identification.chain import identify
from nonsmooth.identification.damping import amplitude_fit, viscous_bias
from nonsmooth.identification.decay_damping import decay_damping
from nonsmooth.identification.evidence import Evidence, Run, gather
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.free_decay import DecayFit, free_decay
from nonsmooth.identification.gap import mean_of_drive, mean_shift
from nonsmooth.identification.grazing import grazing_gap
from nonsmooth.identification.half_power import half_power
from nonsmooth.identification.multiple_shooting import ContactFit, shoot_contacts
from nonsmooth.identification.natural_frequency import natural_frequency
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.identification.receptance import receptance_fit
from nonsmooth.identification.report import report
from nonsmooth.identification.steady import Steady, steady
from nonsmooth.identification.stiffness import stiffness
from nonsmooth.identification.support_damping import support_damping

__all__ = [
    "ContactFit",
    "DecayFit",
    "Estimate",
    "Evidence",
    "Finding",
    "ParameterSet",
    "Run",
    "Steady",
    "amplitude_fit",
    "crank_force",
    "decay_damping",
    "free_decay",
    "gather",
    "grazing_gap",
    "half_power",
    "identify",
    "mean_of_drive",
    "mean_shift",
    "natural_frequency",
    "receptance_fit",
    "report",
    "shoot_contacts",
    "steady",
    "stiffness",
    "support_damping",
    "viscous_bias",
    "voltage_frequency",
]
