"""Sessions of the paper's rig against its model: what ``compare`` takes, the gap referred to the mean position."""

from nonsmooth.studies.savi2007.comparison.notebook import session_measurement
from nonsmooth.studies.savi2007.comparison.reference import GapOffset, GapReference, gap_offset, gap_reference

__all__ = ["GapOffset", "GapReference", "gap_offset", "gap_reference", "session_measurement"]
