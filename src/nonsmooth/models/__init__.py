"""Published oscillators, ready to run: each is a function that returns a `System`.

Parameters are given by name: ``discontinuous_support(omega=3.69, g=-0.0045)``.
"""

from typing import Any

from nonsmooth.models.border_collision import border_collision
from nonsmooth.models.bouncing_ball_map import bouncing_ball_map
from nonsmooth.models.buck_converter import buck_converter
from nonsmooth.models.discontinuous_support import discontinuous_support
from nonsmooth.models.dry_friction_oscillator import dry_friction_oscillator
from nonsmooth.models.impact_oscillator import impact_oscillator
from nonsmooth.models.relay_feedback import relay_feedback
from nonsmooth.models.relief_valve import relief_valve
from nonsmooth.models.square_root_map import square_root_map
from nonsmooth.models.stick_slip_belt import stick_slip_belt

__all__ = [
    "border_collision", "bouncing_ball_map", "buck_converter", "discontinuous_support", "dry_friction_oscillator",
    "impact_oscillator", "names", "relay_feedback", "relief_valve", "square_root_map", "stick_slip_belt",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    from nonsmooth.system.names import unknown

    raise AttributeError(unknown(name, "a model", "nonsmooth.models", names()))


def names() -> tuple[str, ...]:
    """Return the names of all models, in alphabetical order."""
    return tuple(sorted(name for name in __all__ if name != "names"))
