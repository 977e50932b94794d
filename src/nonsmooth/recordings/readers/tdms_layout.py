"""The segments of a TDMS file, walked before a library trusts them: every offset must lie inside the file."""

from __future__ import annotations

import struct

from nonsmooth.recordings.reading import Source

__all__ = ["check_layout"]

_LEAD_IN = 28
_UNFINISHED = 0xFFFF_FFFF_FFFF_FFFF  # the writer was stopped before it could say where the segment ends
_MAX_SEGMENTS = 100_000


def check_layout(data: bytes, source: Source) -> None:
    """DataFileError with the segment whose lead-in is damaged or points outside the file."""
    position = 0
    for segment in range(1, _MAX_SEGMENTS + 1):
        place = f"segment {segment}, byte {position}"
        if len(data) - position < _LEAD_IN:
            raise source.error(place, f"its lead-in of {_LEAD_IN} bytes is cut short")
        tag, contents, _, end, raw = struct.unpack_from("<4sIIQQ", data, position)
        if tag != b"TDSm":
            raise source.error(place, f"begins with {tag!r}, expected b'TDSm'")
        if contents & (1 << 6):
            raise source.error(place, "is written in big-endian order, which is not read; save it again on a PC")
        left = len(data) - position - _LEAD_IN
        if end == _UNFINISHED:
            end = left
        if end > left or raw > end:
            raise source.error(
                place, f"says it is {end} bytes long with data from {raw} on, but {left} bytes follow: it is cut short"
            )
        position += _LEAD_IN + end
        if position == len(data):
            return
    raise source.error("", f"holds more than {_MAX_SEGMENTS} segments")
