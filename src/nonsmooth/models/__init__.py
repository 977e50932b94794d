"""Published oscillators, ready to run: each is a function that returns a `System`.

Parameters are given by name: ``discontinuous_support(omega=3.69, g=-0.0045)``.
"""

from typing import Any

from nonsmooth.models.bilinear_oscillator import bilinear_oscillator
from nonsmooth.models.border_collision import border_collision
from nonsmooth.models.bouncing_ball_map import bouncing_ball_map
from nonsmooth.models.buck_converter import buck_converter
from nonsmooth.models.chua_circuit import chua_circuit
from nonsmooth.models.discontinuous_support import discontinuous_support
from nonsmooth.models.double_impact_oscillator import double_impact_oscillator
from nonsmooth.models.drifting_impact_oscillator import drifting_impact_oscillator
from nonsmooth.models.dry_friction_oscillator import dry_friction_oscillator
from nonsmooth.models.gear_pair import gear_pair
from nonsmooth.models.impact_damper import impact_damper
from nonsmooth.models.impact_duffing import impact_duffing
from nonsmooth.models.impact_friction_oscillator import impact_friction_oscillator
from nonsmooth.models.impact_oscillator import impact_oscillator
from nonsmooth.models.parabolic_track import parabolic_track
from nonsmooth.models.relay_feedback import relay_feedback
from nonsmooth.models.relief_valve import relief_valve
from nonsmooth.models.rubbing_rotor import rubbing_rotor
from nonsmooth.models.square_root_map import square_root_map
from nonsmooth.models.stick_slip_belt import stick_slip_belt
from nonsmooth.models.stribeck_oscillator import stribeck_oscillator

__all__ = [
    "bilinear_oscillator",
    "border_collision",
    "bouncing_ball_map",
    "buck_converter",
    "chua_circuit",
    "discontinuous_support",
    "double_impact_oscillator",
    "drifting_impact_oscillator",
    "dry_friction_oscillator",
    "gear_pair",
    "impact_damper",
    "impact_duffing",
    "impact_friction_oscillator",
    "impact_oscillator",
    "names",
    "parabolic_track",
    "relay_feedback",
    "relief_valve",
    "rubbing_rotor",
    "square_root_map",
    "stick_slip_belt",
    "stribeck_oscillator",
]


def __getattr__(name: str) -> Any:
    from nonsmooth.errors import unknown

    raise AttributeError(unknown(name, "a model", "nonsmooth.models", names()))


def names() -> tuple[str, ...]:
    """Return the names of all models, in alphabetical order."""
    return tuple(sorted(name for name in __all__ if name != "names"))
