"""Pictures of what identification found, one for each procedure: ``(finding, ax=None) -> ax``."""

from nonsmooth.plot.identification.amplitude_dependent import backbone, forced_responses, modal_damping
from nonsmooth.plot.identification.amplitude_fit import amplitude_fit
from nonsmooth.plot.identification.calibration import calibration
from nonsmooth.plot.identification.decays import drop_decay, free_decay
from nonsmooth.plot.identification.fit_residuals import fit_residuals
from nonsmooth.plot.identification.force_displacement import force_displacement
from nonsmooth.plot.identification.gap import grazing, multiple_shooting
from nonsmooth.plot.identification.half_power import half_power
from nonsmooth.plot.identification.impacts import restitution, toss
from nonsmooth.plot.identification.impulse_response import impulse_history, impulse_response
from nonsmooth.plot.identification.nyquist import nyquist
from nonsmooth.plot.identification.steady_response import steady_amplitude, steady_phase
from nonsmooth.plot.identification.uncertainty import coverage, profile

__all__ = [
    "amplitude_fit",
    "backbone",
    "calibration",
    "coverage",
    "drop_decay",
    "fit_residuals",
    "force_displacement",
    "forced_responses",
    "free_decay",
    "grazing",
    "half_power",
    "impulse_history",
    "impulse_response",
    "modal_damping",
    "multiple_shooting",
    "nyquist",
    "profile",
    "restitution",
    "steady_amplitude",
    "steady_phase",
    "toss",
]
