"""Contacts and friction by name: rigid and elastic stops, backlash, dry friction, preloaded springs."""

from nonsmooth.system.arguments import checked
from nonsmooth.system.derived.elements.coulomb import Coulomb
from nonsmooth.system.derived.elements.elastic import Backlash, ElasticStop, PreloadedSpring
from nonsmooth.system.derived.elements.element import Element
from nonsmooth.system.derived.elements.stop import Rubbing, Stop

__all__ = ["Backlash", "Coulomb", "ElasticStop", "Element", "PreloadedSpring", "Rubbing", "Stop"]

for kind in (Backlash, Coulomb, ElasticStop, PreloadedSpring, Stop):
    checked(read=False)(kind)
