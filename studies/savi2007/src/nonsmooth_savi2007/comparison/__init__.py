"""Sessions of the paper's rig against its model: what ``compare`` takes, the gap referred to the mean position."""

from nonsmooth_savi2007.comparison.notebook import (
    SHOWS,
    GapOffset,
    GapReference,
    gap_offset,
    gap_reference,
    session_measurement,
)

__all__ = ["SHOWS", "GapOffset", "GapReference", "gap_offset", "gap_reference", "session_measurement"]
