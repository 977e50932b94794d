"""The page that says what each procedure needs: its lines can be read, and it names what a session is asked for."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import pytest

import nonsmooth as ns
from nonsmooth.recordings.session import PROCEDURES
from nonsmooth_savi2007.identification.evidence import NEEDS

PAGE = Path(__file__).parents[2] / "docs" / "guides" / "what_each_procedure_needs.md"
SECTIONS = dict(re.findall(r"^## `(\w+)`\n(.*?)(?=^## |\Z)", PAGE.read_text(encoding="utf-8"), flags=re.S | re.M))
UNITS = {"Angle": "rad", "Force": "N", "Turn": "turns"}


def test_every_procedure_has_its_section() -> None:
    assert set(SECTIONS) == set(PROCEDURES) == set(NEEDS)


@pytest.mark.parametrize("procedure", PROCEDURES)
def test_a_procedure_is_as_the_page_says(procedure: str, tmp_path: Path) -> None:
    section = SECTIONS[procedure]
    settings = next(line for line in section.splitlines() if line.startswith("- settings"))
    assert all(f"`{name}`" in settings.split("better")[0] for name in PROCEDURES[procedure])
    file = tmp_path / "lines.csv"
    lines = re.search(r"```text\n(.*?)```", section, flags=re.S)
    assert lines is not None and lines[1].count("\n") == 10
    file.write_text(lines[1], encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ns.recordings.RecordingWarning)
        recording = ns.load_recording(file)
    assert recording.units == {name: UNITS[name] for name in NEEDS[procedure]}
    if "Turn" in NEEDS[procedure]:
        assert recording.channel("Turn").size >= 1
