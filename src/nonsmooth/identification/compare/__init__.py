"""Experiment against theory: overlays with numbers, and the uncertainty of the parameters carried into both."""

from nonsmooth.identification.compare.compare import compare
from nonsmooth.identification.compare.measured import measured_motion, motion_of
from nonsmooth.identification.compare.series import measured_response, measured_rise, measured_sections

__all__ = ["compare", "measured_motion", "measured_response", "measured_rise", "measured_sections", "motion_of"]
