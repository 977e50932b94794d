"""Time stamps as seconds: ISO 8601, hours:minutes:seconds, dates of a library, and whatever a format describes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.reading import Source

if TYPE_CHECKING:
    from nonsmooth.recordings.readers.fields import Field

__all__ = ["EPOCH", "seconds_of"]

#: Seconds: a time that begins later counts from an epoch, and begins at 0 here, so that no digit of it is lost.
EPOCH = 1e8

_ISO = re.compile(r"\d{4}-?\d\d-?\d\d[ T]\d\d.*")
_CLOCK = re.compile(r"(?:(\d+):)?(\d{1,2}):(\d{1,2}(?:[.,]\d*)?)")


def seconds_of(axis: Field, lines: NDArray[np.int64] | None, source: Source) -> tuple[FloatArray, str]:
    """Seconds since the first stamp and, where stamps have dates, when that was."""
    import pandas

    if axis.values.dtype.kind in "mM":
        dates = axis.values.astype("datetime64[ns]" if axis.values.dtype.kind == "M" else "timedelta64[ns]")
        return _since(dates.astype(np.int64)), str(dates[0]) if axis.values.dtype.kind == "M" and len(dates) else ""
    texts = [str(text).strip() for text in axis.values]
    given = axis.unit if "%" in axis.unit else None
    if given is None and texts and _CLOCK.fullmatch(texts[0]):
        found = [_CLOCK.fullmatch(text) for text in texts]
        if None in found:
            raise _unread(texts, found.index(None), axis, lines, source)
        parts = [[float((part or "0").replace(",", ".")) for part in match.groups()] for match in found if match]
        return np.array(parts) @ np.array([3600.0, 60.0, 1.0]), ""
    if given is None and not (texts and _ISO.fullmatch(texts[0])):
        raise _unread(texts, 0, axis, lines, source)
    plain = [text.replace(",", ".") for text in texts] if given is None else texts
    read = pandas.to_datetime(plain, format=given or "ISO8601", utc=True, errors="coerce")
    if read.hasnans:
        raise _unread(texts, int(np.flatnonzero(read.isna())[0]), axis, lines, source)
    return _since(read.as_unit("ns").asi8), str(read[0].isoformat()) if len(read) else ""


def _since(nanoseconds: NDArray[np.int64]) -> FloatArray:
    return np.asarray((nanoseconds - nanoseconds[:1]) * 1e-9, np.float64)


def _unread(
    texts: list[str], place: int, axis: Field, lines: NDArray[np.int64] | None, source: Source
) -> Exception:
    row = f"row {place + 1}" if lines is None else f"line {lines[place if axis.rows is None else axis.rows[place]]}"
    return source.error(
        row,
        f"the time {texts[place][:40]!r} is neither a number nor a stamp as 2026-05-31T14:05:09.25 or 14:05:09.25"
        + (f" nor of the form {axis.unit!r}" if "%" in axis.unit else "")
        + "; say how it is written, units={'time': '%d.%m.%Y %H:%M:%S,%f'}, or give rate=",
    )
