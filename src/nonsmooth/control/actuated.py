"""A system with an actuator: a force that is set from outside and stays until it is set again."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from nonsmooth.errors import SystemDefinitionError, unknown

if TYPE_CHECKING:
    from nonsmooth.system.system import System

FORCE = "control_force"


def actuated(system: System, *, velocity: str, mass: str | float) -> System:
    """Return the system with the memory ``control_force``, which acts on the rate of ``velocity`` as force / mass.

    Raises
    ------
    ValueError
        A state or a parameter that the system has not.
    SystemDefinitionError
        A system without a forcing period, or with a mode that no force could end.
    """
    content = json.loads(system.to_text())
    _check(system, content, velocity, mass)
    content["memory"][FORCE] = {"value": 0.0, "unit": ""}
    rate = f"p.{FORCE}/{f'p.{mass}' if isinstance(mass, str) else repr(float(mass))}"
    for rates in content["modes"].values():
        rates[velocity] = f"({rates[velocity]}) + {rate}"
    content.pop("bands", None)  # fields of the smoothed system, which know no actuator
    return type(system).from_text(json.dumps(content))


def _check(system: System, content: dict[str, Any], velocity: str, mass: str | float) -> None:
    name = repr(system.name)
    if velocity not in system.states:
        raise ValueError(unknown(velocity, "a state", name, system.states))
    if isinstance(mass, str) and mass not in system.parameters:
        raise ValueError(unknown(mass, "a parameter", name, {k: one.unit for k, one in system.parameters.items()}))
    if "period" not in content:
        raise SystemDefinitionError(f"{name} has no forcing period, with which the reference of a controller repeats")
    if system.is_smoothed or "elements" in content:
        raise SystemDefinitionError(
            f"{name} is smoothed, or has so many elements that its modes are not written out: an actuator is added to "
            "the fields of modes; give the system before `smoothed`, or with fewer elements"
        )
    held = [mode for mode, rates in content["modes"].items() if rates.get(velocity, "0") == "0"]
    if held:
        raise SystemDefinitionError(
            f"{name}: in mode {held[0]!r} no force acts on {velocity!r}, so that no controller could end it; give a "
            "system whose contacts are elastic"
        )
