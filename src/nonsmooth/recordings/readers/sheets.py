"""Workbooks (``.xlsx``): each sheet is read as a table of text, so that all options of tables hold for it."""

from __future__ import annotations

import datetime
import io
import warnings
from collections.abc import Iterator
from typing import Any

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.readers.delimited import read_lines
from nonsmooth.recordings.reading import Archive, Reading, needed, readable


def read(data: bytes, reading: Reading) -> None:
    """Read a workbook; a sheet that is no table is left out, where another is one."""
    openpyxl = needed("openpyxl", "openpyxl", reading)
    archive = Archive(data, reading)
    for name in archive.names:  # what it unpacks to is counted, and entities are refused, before another reads it
        for piece in archive.pieces(name):
            if name.endswith((".xml", ".rels")) and b"<!DOCTYPE" in piece:
                raise reading.error(name, "has a document type, which is refused")
    with readable("read as a workbook", reading), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = [(sheet.title, list(_lines(sheet))) for sheet in book.worksheets]
    refused: list[DataFileError] = []
    filled = [(title, lines) for title, lines in sheets if any(map(str.strip, lines))]
    for title, lines in filled:
        run = title if len(filled) > 1 else "Run #1"
        try:
            read_lines(lines, run, reading, delimiter="\t")
        except DataFileError as error:
            refused.append(error)
            reading.say(f"sheet {title!r} is left out: {str(error).removeprefix(reading.name + ': ')}")
    if not reading.traces:
        raise refused[0] if refused else reading.error("", "holds no table")
    reading.told["sheets"] = [title for title, _ in sheets]


def _lines(sheet: Any) -> Iterator[str]:
    for row in sheet.iter_rows(values_only=True):
        yield "\t".join(map(_text, row)).rstrip("\t") + "\n"


def _text(value: Any) -> str:
    if isinstance(value, datetime.datetime | datetime.time):
        return value.isoformat()
    if isinstance(value, datetime.timedelta):
        return str(value)
    return "" if value is None else " ".join(str(value).split()).replace('"', "'")
