"""Parameters of any system from recordings: multiple shooting with exact derivatives through transitions."""

from nonsmooth.identification.fit.fit import fit
from nonsmooth.identification.fit.select import select_model
from nonsmooth.identification.fit.sensors import Sensor

__all__ = ["Sensor", "fit", "select_model"]
