"""Experiment against theory: overlays with numbers, and the uncertainty of the parameters carried into both."""

from nonsmooth.identification.compare.compare import compare
from nonsmooth.identification.compare.measured import measured_motion, measured_response, measured_rise
from nonsmooth.identification.compare.notebook import session_measurement

__all__ = ["compare", "measured_motion", "measured_response", "measured_rise", "session_measurement"]
