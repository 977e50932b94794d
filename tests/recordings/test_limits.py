"""Small files that ask for much: they cost what they weigh."""

from __future__ import annotations

import io
import os
import time
import zipfile
from pathlib import Path

import pytest

import nonsmooth as ns
from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.session import load_session

WIDE = b"LabVIEW Measurement\n***End_of_Header***\nChannels\t4096\n***End_of_Header***\nX_Value"
SPACES = b" " * 100_000


def xml(content: bytes) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", b"<DSProExperiment>" + content + b"</DSProExperiment>")
    return packed.getvalue()


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(b"Time" + SPACES + b",x\n0,1\n", id="white space behind a header"),
        pytest.param(b"Time (s) r," + b"(" * 60_000 + b")" * 60_000 + b" r\n0,1\n", id="brackets"),
        pytest.param(b"Time (s) r,x r\n" + b"\n" * 300_000 + b"0,1\n", id="blank lines"),
        pytest.param(WIDE + b"\tA" * 4096 + b"\n" + b"1\t2\n" * 30_000, id="short rows under a wide header"),
        pytest.param(b"t,x" + b",y" * 4000 + b"\n" + b"1,2\n" * 30_000, id="short rows of a wide table"),
        pytest.param(b'Time (s) r,x r\n"' + b"1,\n" * 300_000, id="a quote left open"),
        pytest.param(xml(b"<a/>" * 500_000), id="many elements"),
        pytest.param(xml(b'<Header Version="' + b"a" * 5_000_000 + b'"/>'), id="a long attribute"),
    ],
)
def test_cost_is_that_of_the_file(data: bytes) -> None:
    begin = time.process_time()
    said = ""  # both outcomes are right: what is tested is the time, and that an error is short
    try:
        parse_recording(data, "x")
    except DataFileError as error:
        said = str(error)
    assert len(said) < 2000
    assert time.process_time() - begin < 8


def test_the_channels_of_all_segments_count() -> None:
    """Three segments of 1400 channels are 4200: more than the 4096 that are read of one file."""
    one = b"Channels\t1400\n***End_of_Header***\nX_Value" + b"\tA" * 1400 + b"\n0\t1\n"
    head = b"LabVIEW Measurement\n***End_of_Header***\n"
    assert len(parse_recording(head + 2 * one, "x.lvm").runs) == 2
    with pytest.raises(DataFileError, match="holds 4200 channels in 3 segments so far; at most 4096"):
        parse_recording(head + 3 * one, "x.lvm")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are of POSIX")
def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    """Nobody writes into it: a reader that opened it as a file would wait for ever."""
    for name in ("x.csv", "session.toml"):
        os.mkfifo(tmp_path / name)
    with pytest.raises(DataFileError, match=r"x\.csv: is a pipe, a socket or a device"):
        ns.load_recording(tmp_path / "x.csv")
    with pytest.raises(DataFileError, match=r"session\.toml: is a pipe"):
        load_session(tmp_path)
