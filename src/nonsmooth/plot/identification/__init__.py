"""Pictures of what identification found, one for each procedure: ``(finding, ax=None) -> ax``."""

from nonsmooth.plot.identification.amplitude_dependent import backbone, forced_responses, modal_damping
from nonsmooth.plot.identification.damping import amplitude_fit, drop_decay, free_decay, half_power, nyquist
from nonsmooth.plot.identification.fit_residuals import fit_residuals
from nonsmooth.plot.identification.motions import (
    grazing,
    impulse_history,
    impulse_response,
    multiple_shooting,
    restitution,
    steady_amplitude,
    steady_phase,
    toss,
)
from nonsmooth.plot.identification.statics import calibration, force_displacement
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
