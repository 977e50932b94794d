"""MATLAB files of versions 5 to 7: checked element by element and unpacked within limits, then read by SciPy.

SciPy's reader believes the lengths and shapes that a file claims. Here each is compared with the bytes that are there
before it sees them. Variables of classes that hold no plain data (sparse, objects, functions) are left out.
"""

from __future__ import annotations

import io
import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.recordings.limits import MAX_DEPTH, inflation_limit
from nonsmooth.recordings.reading import Source
from nonsmooth.recordings.remarks import Remarks

__all__ = ["load_v5"]

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}  # bytes of a number, by its type
_TEXT = frozenset([1, 2, 3, 4, 16, 17, 18])
_CELL, _STRUCT, _CHAR = 1, 2, 4
_NUMBERS = range(6, 16)


class _Element(NamedTuple):
    kind: int
    begin: int
    end: int
    following: int


class _LeftOut(Exception):
    """The variable is of a class that holds no plain data."""


def load_v5(data: bytes, source: Source, remarks: Remarks) -> dict[str, Any]:
    """The variables of a file, as dicts (structs), lists (cells, arrays of structs), text and arrays."""
    from scipy.io import loadmat

    if len(data) < _HEADER or data[126:128] not in (b"IM", b"MI"):
        raise source.error("byte 126", "expected the byte order mark of a MATLAB file of version 5")
    order = "<" if data[126:128] == b"IM" else ">"
    # The offset of a part that only objects use is cleared with them.
    plain = bytearray(data[:116] + b"\0" * 8 + data[124:_HEADER])
    left = inflation_limit(len(data))
    for body, place in _variables(data, order, left, source):
        try:
            name = _Checker(body, order, place, source).check()
        except _LeftOut as why:
            remarks.say(f"{place}: holds {why}; left out")
            continue
        if name:
            plain += struct.pack(order + "II", _MATRIX, len(body)) + body
    try:
        found = loadmat(io.BytesIO(bytes(plain)), struct_as_record=True, squeeze_me=False, mat_dtype=False)
    # What is still wrong surfaces as almost any exception of the reader.
    except Exception as error:
        raise source.error("", f"cannot be read as a MATLAB file ({type(error).__name__}: {error})"[:300]) from error
    return {name: _plain(value) for name, value in found.items() if not name.startswith("__")}


def _variables(data: bytes, order: str, left: int, source: Source) -> Iterator[tuple[bytes, str]]:
    """The body of each top-level matrix, unpacked."""
    limit, position = left, _HEADER
    while position < len(data):
        place = f"variable at byte {position}"
        if len(data) - position < 8:
            raise source.error(place, "its tag is cut short")
        kind, size = struct.unpack_from(order + "II", data, position)
        begin, position = position + 8, position + 8 + size
        if position > len(data):
            raise source.error(place, f"is {size} bytes long, only {len(data) - begin} follow: the file is cut short")
        body = data[begin:position]
        if kind == _COMPRESSED:
            try:
                unpacker = zlib.decompressobj()
                body = unpacker.decompress(body, left + 1)
                whole = unpacker.eof
            except zlib.error as error:
                raise source.error(place, f"cannot be unpacked, it is damaged ({error})") from None
            left -= len(body)
            if left < 0:
                raise source.error(place, f"unpacks to more than {limit} bytes, more than the file's size warrants")
            if not whole or len(body) < 8:
                raise source.error(place, "cannot be unpacked, it is cut short")
            kind, size = struct.unpack_from(order + "II", body)
            if len(body) < 8 + size:
                raise source.error(place, f"holds {len(body) - 8} bytes, its tag says {size}")
            body = body[8 : 8 + size]
        if kind != _MATRIX:
            raise source.error(place, f"is of type {kind}, expected a matrix (14) or a packed one (15)")
        yield body, place


class _Checker:
    """Compares what one variable claims with the bytes it has."""

    def __init__(self, body: bytes, order: str, place: str, source: Source) -> None:
        self._body, self._order, self._place, self._source = body, order, place, source

    def check(self) -> str:
        """The variable's name; DataFileError if a claim does not fit, _LeftOut if it holds no plain data."""
        return self._matrix(0, len(self._body), 0)

    def _error(self, position: int, message: str) -> Exception:
        return self._source.error(f"{self._place}, byte {position} of it", message)

    def _next(self, position: int, end: int) -> _Element:
        if end - position < 8:
            raise self._error(position, "an element is missing or cut short")
        first, size = struct.unpack_from(self._order + "II", self._body, position)
        if first >> 16:
            # A small element: up to four bytes inside its own tag.
            kind, size = first & 0xFFFF, first >> 16
            if size > 4:
                raise self._error(position, f"a small element says it has {size} bytes, at most 4 fit")
            return _Element(kind, position + 4, position + 4 + size, position + 8)
        begin = position + 8
        if size > end - begin:
            raise self._error(position, f"an element says it has {size} bytes, {end - begin} are left")
        return _Element(first, begin, begin + size, min(begin + -(-size // 8) * 8, end))

    def _ints(self, element: _Element) -> tuple[int, ...]:
        n = (element.end - element.begin) // 4
        return struct.unpack_from(f"{self._order}{n}i", self._body, element.begin)

    def _matrix(self, begin: int, end: int, depth: int) -> str:
        if depth > MAX_DEPTH:
            raise self._error(begin, f"is nested deeper than {MAX_DEPTH}")
        flags = self._next(begin, end)
        if flags.kind != 6 or flags.end - flags.begin != 8:
            raise self._error(begin, "expected the flags of a matrix")
        (word,) = struct.unpack_from(self._order + "I", self._body, flags.begin)
        kind, is_complex = word & 0xFF, bool(word & 0x0800)
        if kind not in (_CELL, _STRUCT, _CHAR, *_NUMBERS):
            raise _LeftOut(f"a MATLAB array of class {kind} (sparse, object or function)")
        shape = self._next(flags.following, end)
        dims = self._ints(shape)
        if shape.kind != 5 or not 2 <= len(dims) <= 32 or min(dims) < 0:
            raise self._error(flags.following, f"expected the dimensions of a matrix, got {dims[:4]}")
        n = math.prod(dims)
        name = self._next(shape.following, end)
        if name.kind not in (1, 2, 16):
            raise self._error(shape.following, "expected the name of a matrix")
        text = self._body[name.begin : name.end].split(b"\0")[0]
        position = name.following
        if kind in _NUMBERS:
            for _ in range(1 + is_complex):
                position = self._numbers(position, end, n)
        elif kind == _CHAR:
            letters = self._next(position, end)
            if letters.kind not in _TEXT or n > letters.end - letters.begin:
                raise self._error(position, f"expected {n} letters, there are {letters.end - letters.begin} bytes")
        elif kind == _CELL:
            self._members(position, end, n, depth)
        else:
            self._struct(position, end, n, depth)
        return text.decode("ascii", errors="replace")

    def _numbers(self, position: int, end: int, n: int) -> int:
        numbers = self._next(position, end)
        size = _SIZES.get(numbers.kind)
        if size is None or numbers.end - numbers.begin != n * size:
            raise self._error(
                position, f"expected {n} numbers, there are {numbers.end - numbers.begin} bytes of type {numbers.kind}"
            )
        return numbers.following

    def _struct(self, position: int, end: int, n: int, depth: int) -> None:
        width = self._next(position, end)
        (length,) = self._ints(width)[:1] or (0,)
        names = self._next(width.following, end)
        size = names.end - names.begin
        if width.kind != 5 or names.kind not in (1, 2) or not 0 < length <= 256 or size % length:
            raise self._error(position, "expected the names of a struct's fields")
        fields = [self._body[k : k + length].split(b"\0")[0] for k in range(names.begin, names.end, length)]
        if len(set(fields)) < len(fields) or b"" in fields:
            raise self._error(position, "the names of a struct's fields are empty or stand there twice")
        self._members(names.following, end, n * len(fields), depth)

    def _members(self, position: int, end: int, n: int, depth: int) -> None:
        if n > (end - position) // 8:
            raise self._error(position, f"expected {n} elements, {end - position} bytes are left")
        for _ in range(n):
            member = self._next(position, end)
            if member.kind != _MATRIX:
                raise self._error(position, f"an element is of type {member.kind}, expected a matrix (14)")
            if member.end > member.begin:
                self._matrix(member.begin, member.end, depth + 1)
            position = member.following


def _plain(value: Any) -> Any:
    """SciPy's arrays as dicts, lists, text and numbers."""
    if not isinstance(value, np.ndarray):
        return value if isinstance(value, str) else None
    if value.dtype.names:
        rows = [{name: _plain(row[name]) for name in value.dtype.names} for row in value.ravel(order="F")]
        return rows[0] if len(rows) == 1 else rows
    if value.dtype.kind == "O":
        return [_plain(member) for member in value.ravel(order="F")]
    if value.dtype.kind == "U":
        return "\n".join(str(text) for text in value.ravel())
    return value if value.dtype.kind in "fiubc" else None
