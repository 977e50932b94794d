"""Experiment against theory: overlays with numbers, and the uncertainty of the parameters carried into both."""

from nonsmooth.identification.compare.compare import compare
from nonsmooth.identification.compare.measured import measured_motion
from nonsmooth.identification.compare.notebook import session_measurement
from nonsmooth.identification.compare.reference import GapOffset, GapReference, gap_offset, gap_reference
from nonsmooth.identification.compare.series import measured_response, measured_rise, measured_sections

__all__ = [
    "GapOffset", "GapReference", "compare", "gap_offset", "gap_reference", "measured_motion", "measured_response",
    "measured_rise", "measured_sections", "session_measurement",
]  # fmt: skip
