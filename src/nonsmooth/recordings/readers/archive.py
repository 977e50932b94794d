"""Members of a ZIP file from elsewhere, unpacked in pieces and never beyond what the file's size warrants.

What the directory of the archive says of sizes is not believed: bytes are counted as they come out.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.reading import Source, inflation_limit

__all__ = ["Archive"]

_PIECE = 1 << 16
_MAX_MEMBERS = 20_000


class Archive:
    """A ZIP file in memory. All pieces ever taken out of it, together, stay below ``inflation_limit``."""

    def __init__(self, data: bytes, source: Source) -> None:
        self._source = source
        self._left = self._limit = inflation_limit(len(data))
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
            infos = self._zip.infolist()
        # A damaged directory surfaces as almost any exception of zipfile.
        except Exception as error:
            raise source.error("", f"is not a whole ZIP archive ({error})") from error
        if len(infos) > _MAX_MEMBERS:
            raise source.error("", f"holds {len(infos)} members; at most {_MAX_MEMBERS} are read")
        self._infos = {info.filename.replace("\\", "/"): info for info in infos}

    @property
    def names(self) -> tuple[str, ...]:
        """The members, with forward slashes."""
        return tuple(self._infos)

    def pieces(self, name: str) -> Iterator[bytes]:
        """The bytes of a member, piece by piece."""
        info = self._infos.get(name)
        if info is None:
            raise self._source.error(name, "is not in the archive, though main.xml names it")
        if info.flag_bits & 1:
            raise self._source.error(name, "is encrypted; save the experiment without a password")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise self._source.error(name, f"is packed by method {info.compress_type}; expected stored or deflated")
        try:
            with self._zip.open(info) as opened:
                while piece := opened.read(_PIECE):
                    self._left -= len(piece)
                    if self._left < 0:
                        raise self._source.error(
                            name,
                            f"unpacks to more than {self._limit} bytes, more than a file of {self._source.size} bytes "
                            "warrants; it may be made to exhaust memory",
                        )
                    yield piece
        except DataFileError:
            raise
        # zipfile raises NotImplementedError for a compression or a version of the format that it does not know.
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, NotImplementedError) as error:
            raise self._source.error(name, f"cannot be unpacked, it is damaged or cut short ({error})") from error
