"""A store says how far its work has come: chunks that are there, chunks begun, seconds, and what they say remains."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from simple_work import Squares

from nonsmooth.campaign.run import run
from nonsmooth.campaign.store import describe_store
from nonsmooth.cli import main as cli


def shown(path: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    """The lines that ``nonsmooth show`` prints, by their first word."""
    assert cli.main(["show", str(path)]) == 0
    lines = (line.split(None, 1) for line in capsys.readouterr().out.splitlines() if line.strip())
    return {first: rest[0] if rest else "" for first, *rest in lines}


def test_progress_of_a_store(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of 15 chunks of 7 places, 100 in all, the tenth fails; it is begun again."""
    path = tmp_path / "squares.zarr"
    with pytest.raises(RuntimeError, match="chunk 9"):
        run(Squares(fails_at=9), threads=1, store=path, progress=False)
    record = describe_store(path)
    assert [record[name] for name in ("chunks", "done", "started", "content", "places")] == [15, 9, 10, None, 100]
    marks = [json.loads(file.read_text()) for file in sorted((path / "run").glob("*.json"))]
    assert [mark["chunk"] for mark in marks] == list(range(9))
    assert record["seconds"] == pytest.approx(sum(mark["seconds"] for mark in marks))
    told = shown(path, capsys)
    assert told["squares:"] == "9 of 15 chunks are there (60 %), 100 points"
    assert told["worked"].startswith(f"{record['seconds']:.3g} s of one core, on a processor of type ")
    assert told["remains"] == f"about {record['seconds'] / 9 * 6:.3g} s of one core"
    assert told["begun"].startswith("10: some chunks are under way, or were lost") and "content" not in told
    with (path / "run" / "started.log").open("a", encoding="utf-8") as log:
        log.write('{"chunk": \n{"other": 3}\n')  # lines cut short or altered are passed over
    assert describe_store(path)["started"] == 10
    run(Squares(seconds=0.01), threads=1, store=path, progress=False)
    told, record = shown(path, capsys), describe_store(path)
    assert told["squares:"] == "15 of 15 chunks are there (100 %), 100 points"
    assert (told["remains"], record["started"]) == ("nothing", 16)
    assert re.match(r"sha256 [0-9a-f]{16}; stores of equal", told["content"]) and record["content"] in _hash(path)


def _hash(path: Path) -> list[str]:
    """The hash of all chunks' hashes, that of another store of the same results too."""
    other = path.with_name("other.zarr")
    run(Squares(), threads=2, store=other, progress=False)
    return [describe_store(other)["content"]]
