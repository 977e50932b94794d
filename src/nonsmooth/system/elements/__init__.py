"""Contacts and friction by name: rigid and elastic stops, backlash, dry friction, preloaded springs."""

from nonsmooth.system.elements.coulomb import Coulomb
from nonsmooth.system.elements.elastic import Backlash, ElasticStop, PreloadedSpring
from nonsmooth.system.elements.element import Element
from nonsmooth.system.elements.stop import Stop

__all__ = ["Backlash", "Coulomb", "ElasticStop", "Element", "PreloadedSpring", "Stop"]
