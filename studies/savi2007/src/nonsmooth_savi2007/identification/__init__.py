"""Identification of the paper's rig: its Section 3.1 and what lies beyond, from a session to parameters.

:func:`identify` runs the whole chain; each procedure is a function of its own on the runs that :func:`gather` takes
out of a session.
"""

from nonsmooth_savi2007.identification.calibrations import crank_force, stiffness, voltage_frequency
from nonsmooth_savi2007.identification.chain import identify
from nonsmooth_savi2007.identification.decay_findings import decay_damping, natural_frequency, support_damping
from nonsmooth_savi2007.identification.evidence import gather
from nonsmooth_savi2007.identification.free_decay import free_decay
from nonsmooth_savi2007.identification.grazing import grazing_gap
from nonsmooth_savi2007.identification.multiple_shooting import shoot_contacts
from nonsmooth_savi2007.identification.referral import mean_of_drive, mean_shift
from nonsmooth_savi2007.identification.response_fits import amplitude_fit, receptance_fit, viscous_bias
from nonsmooth_savi2007.identification.statements import require
from nonsmooth_savi2007.identification.steady import steady

__all__ = [
    "amplitude_fit",
    "crank_force",
    "decay_damping",
    "free_decay",
    "gather",
    "grazing_gap",
    "identify",
    "mean_of_drive",
    "mean_shift",
    "natural_frequency",
    "receptance_fit",
    "require",
    "shoot_contacts",
    "steady",
    "stiffness",
    "support_damping",
    "viscous_bias",
    "voltage_frequency",
]
