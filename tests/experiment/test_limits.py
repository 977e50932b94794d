"""Small files that ask for much: they cost what they weigh."""

from __future__ import annotations

import io
import time
import zipfile

import pytest

from nonsmooth.errors import DataFileError
from nonsmooth.experiment.load import parse_recording

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
