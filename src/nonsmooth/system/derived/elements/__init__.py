"""Contacts and friction by name: rigid and elastic stops, backlash, dry friction, preloaded springs."""

from nonsmooth.system.derived.elements.coulomb import Coulomb
from nonsmooth.system.derived.elements.elastic import Backlash, ElasticStop, PreloadedSpring
from nonsmooth.system.derived.elements.element import Element
from nonsmooth.system.derived.elements.rubbing import Rubbing
from nonsmooth.system.derived.elements.stop import Stop
from nonsmooth.system.names import by_name

__all__ = ["Backlash", "Coulomb", "ElasticStop", "Element", "PreloadedSpring", "Rubbing", "Stop"]

for kind in (Backlash, Coulomb, ElasticStop, PreloadedSpring, Stop):
    kind.__init__ = by_name(kind.__init__)  # type: ignore[method-assign]
