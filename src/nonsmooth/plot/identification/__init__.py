"""Pictures of what identification found, one for each procedure: ``(finding, ax=None) -> ax``."""

from nonsmooth.plot.identification.damping import (
    amplitude_fit,
    backbone,
    drop_decay,
    forced_responses,
    free_decay,
    modal_damping,
    nyquist,
)
from nonsmooth.plot.identification.estimates import (
    calibration,
    coverage,
    fit_residuals,
    force_displacement,
    profile,
    steady_readings,
)
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
    "impulse_history",
    "impulse_response",
    "modal_damping",
    "multiple_shooting",
    "nyquist",
    "profile",
    "restitution",
    "steady_amplitude",
    "steady_phase",
    "steady_readings",
    "toss",
]
