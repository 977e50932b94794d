"""Contacts and friction by name, for ``System(..., elements={...})`` and :func:`nonsmooth.mechanical`."""

from nonsmooth.system.derived.elements import Backlash, Coulomb, ElasticStop, PreloadedSpring, Stop

__all__ = ["Backlash", "Coulomb", "ElasticStop", "PreloadedSpring", "Stop"]
