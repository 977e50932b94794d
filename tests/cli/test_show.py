"""``nonsmooth show`` on files that others have made: no byte of theirs steers the terminal, no odd type is a crash."""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.cli import main as cli
from nonsmooth.cli.terminal import one_line, printable
from nonsmooth.results.store import save

ESCAPE = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202eevil\r"
ODD: dict[str, Any] = {
    "nothing else": {},
    "system is a word": {"system": "x", "options": {}},
    "parameters are a list": {"system": {"parameters": [1], "text": 3}, "options": {}},
    "options are missing": {"system": {"parameters": {}, "text": "t"}},
    "parameters of every type": {
        "system": {"parameters": {"a": None, "b": "nan", "c": [1], "d": {}, "e": 10**400, "f": "word"}},
        "options": {},
    },
    "text that would never end": {
        "system": {"name": "s", "parameters": {}, "text": "((9**9999)**9999)*u.x " + "(" * 3000},
        "options": {},
    },
    "long": {"verb": "x" * 1_500_000, "system": {"name": "n" * 10**6, "parameters": {}}, "options": {"o": "p" * 10**6}},
    "escapes": {
        "verb": ESCAPE,
        "method": ESCAPE,
        "system": {"name": ESCAPE, "parameters": {ESCAPE: ESCAPE}, "text": ESCAPE},
        "options": {ESCAPE: ESCAPE, "list": [ESCAPE] * 9},
    },
    "escapes without a system": {ESCAPE: ESCAPE, "list": [ESCAPE]},
}


def shown(capsys: pytest.CaptureFixture[str]) -> str:
    out, err = capsys.readouterr()
    assert all(letter.isprintable() or letter == "\n" for letter in out + err)
    assert "Traceback" not in err and len(out + err) < 5000
    return out + err


@pytest.mark.parametrize("record", ODD)
@pytest.mark.parametrize("text", [(), ("--text",)])
def test_odd_records(record: str, text: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = xr.Dataset({"a": ("x", [1.0])}, attrs={"nonsmooth": json.dumps({"version": "0", **ODD[record]})})
    assert cli.main(["show", str(save(result, tmp_path / "r.nc")), *text]) == 0
    assert "a(x)" in shown(capsys)


@pytest.mark.parametrize("record", ["{", "[]", "3", '{"version": ' + "[" * 5000 + "]" * 5000 + "}"])
def test_a_record_that_is_none(record: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = xr.Dataset({"a": ("x", [1.0])}, attrs={"nonsmooth": '{"version": "0"}'})
    path = save(result, tmp_path / "r.zarr")
    for name in (".zattrs", ".zmetadata"):
        whole = json.loads((path / name).read_text())
        whole.get("metadata", {".zattrs": whole})[".zattrs"]["nonsmooth"] = record
        (path / name).write_text(json.dumps(whole))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("nonsmooth.results.store.unstamp", lambda text: (None, text))
        with pytest.warns(UserWarning, match="without a hash"):
            assert cli.main(["show", str(path)]) == 2
    assert "the attribute 'nonsmooth' of this Dataset is" in shown(capsys)


def test_odd_variables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = xr.Dataset(
        {
            f"a{ESCAPE}": (("x", f"y{ESCAPE}"), [[1.0]], {"units": ESCAPE, "long_name": ESCAPE * 1000}),
            "b": ("x", [1.0], {"units": 3, "long_name": np.array([1, 2])}),
            "status": ("s", [0.5, np.nan, 0.0, 99.0]),
        },
        attrs={"nonsmooth": '{"version": "0"}'},
    )
    path = save(result, tmp_path / "r.zarr")
    assert cli.main(["show", str(path)]) == 0
    out = shown(capsys)
    assert r"a\x1b]0;owned\x07" in out and "[3]" in out and "ok 1" in out and "99.0 (unknown) 1" in out
    for status in (np.array("word"), np.array(99), np.array([], np.int8)):
        save(result.drop_vars("status").assign(status=(("s",)[: status.ndim], status)), path)
        assert cli.main(["show", str(path)]) == 0
        assert "status" in shown(capsys)


def test_names_of_a_recording_and_of_a_missing_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tap.csv"
    path.write_text("Time (s) Run #1,Position\x1b[2J (m) Run #1\n0,0.25\n0.01,0.5\n0.02,0.75\n")
    with pytest.warns(UserWarning, match="too short"):
        assert cli.main(["show", str(path)]) == 0
    assert "3 samples" in shown(capsys)
    assert cli.main(["show", f"{ESCAPE}.nc"]) == 2
    assert r"\x1b]0;owned\x07" in shown(capsys)


def test_warnings(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    plain, known = warnings.formatwarning, ns.models.names()

    def names() -> Any:
        print(warnings.formatwarning(ESCAPE, UserWarning, "file.py", 3, ""), file=sys.stderr)
        return known

    monkeypatch.setattr(ns.models, "names", names)
    assert cli.main(["models"]) == 0
    assert r"file.py:3: UserWarning: \x1b]0;owned" in shown(capsys)
    assert warnings.formatwarning is plain


def test_text_for_a_terminal() -> None:
    assert printable("a\tb\nµ 石\x1b[0m\x00\ud800") == "a\tb\nµ 石\\x1b[0m\\x00\\ud800"
    assert one_line("a\nb") == "a\\nb" and one_line("x" * 41) == "x" * 37 + "..." and one_line("x" * 40) == "x" * 40
    assert one_line([1, 2, 3, 4, 5]) == "[1 ... 5] (5)" and one_line(None) == "None"
