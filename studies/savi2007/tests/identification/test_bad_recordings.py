"""Damaged session folders, all the way through ``identify``: which run, which channel, what to do.

A session of the virtual rig (pulls and taps, three runs of each) is written as Capstone exports it, and one run of one
file is damaged as it happens in a laboratory. What can be used is used, with a warning; what cannot is an error.
"""

from __future__ import annotations

import csv
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.errors import DataFileError
from nonsmooth.recordings import Recording, RecordingWarning
from nonsmooth_savi2007.rig import VirtualRig, write_capstone_csv

Rows = list[list[str]]
Damage = Callable[[list[str], Rows], tuple[list[str], Rows]]
RUNS = ("Run #1", "Run #2", "Run #3")
NOTEBOOK = """
[session]
synthetic = true
[apparatus]
distance_per_turn = 0.0789
counts_per_turn = 1440
force_resolution = 0.03
mass = { value = 0.6997, uncertainty = 0.001 }
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    rig = VirtualRig(seed=3)
    text = NOTEBOOK
    for procedure in ("springs", "impulse"):
        made = rig.record(procedure)
        chosen = {run: {name: node.to_dataset() for name, node in made.tree[run].children.items()} for run in RUNS}
        write_capstone_csv(Recording.from_runs(chosen, synthetic=True), folder / f"{procedure}.csv")
        runs = ", ".join(f'{{ run = "{run}" }}' for run in RUNS)
        text += f'[[recording]]\nfile = "{procedure}.csv"\nprocedure = "{procedure}"\nruns = [{runs}]\n'
    (folder / "session.toml").write_text(text, encoding="utf-8")
    return folder


def damaged(whole: Path, folder: Path, procedure: str, damage: Damage) -> Path:
    """A copy of the session in which Run #2 of one procedure is damaged."""
    copy = folder / "session"
    shutil.copytree(whole, copy)
    file = copy / f"{procedure}.csv"
    with file.open(encoding="utf-8-sig", newline="") as opened:
        head, *rows = csv.reader(opened)
    head, rows = damage(head, rows)
    with file.open("w", encoding="utf-8-sig", newline="") as opened:
        csv.writer(opened).writerows([head, *rows])
    return copy


def columns(head: list[str], quantity: str = "") -> list[int]:
    """Columns of Run #2 that measure this."""
    return [i for i, text in enumerate(head) if "Run #2" in text and text.startswith(quantity)]


def without(quantity: str) -> Damage:
    def damage(head: list[str], rows: Rows) -> tuple[list[str], Rows]:
        (i,) = columns(head, quantity)
        return head[:i] + head[i + 1 :], [row[:i] + row[i + 1 :] for row in rows]

    return damage


def in_unit(quantity: str, unit: str, factor: float = 1.0) -> Damage:
    def damage(head: list[str], rows: Rows) -> tuple[list[str], Rows]:
        (i,) = columns(head, quantity)
        head[i] = head[i].replace("(rad)", unit).replace("(N)", unit)
        for row in rows:
            row[i] = repr(float(row[i]) * factor) if row[i] else ""
        return head, rows

    return damage


def slower(head: list[str], rows: Rows) -> tuple[list[str], Rows]:
    """Every second sample of the second half only, as after a change of the rate."""
    here = columns(head)
    n = sum(1 for row in rows if row[here[0]])
    kept = [[rows[k][i] for i in here] for k in range(n) if k < n // 2 or k % 2 == 0]
    for k, row in enumerate(rows):
        for j, i in enumerate(here):
            row[i] = kept[k][j] if k < len(kept) else ""
    return head, rows


def holes(quantity: str) -> Damage:
    def damage(head: list[str], rows: Rows) -> tuple[list[str], Rows]:
        (i,) = columns(head, quantity)
        for row in rows[300:340]:
            row[i] = "NaN"
        return head, rows

    return damage


def cut(n: int) -> Damage:
    def damage(head: list[str], rows: Rows) -> tuple[list[str], Rows]:
        for i in columns(head):
            for row in rows[n:]:
                row[i] = ""
        return head, rows

    return damage


WHO = "run 'Run #2', channel '{}'"
ANGLE, FORCE = WHO.format("Angle"), WHO.format("Force")
TIMELESS = r"line 1: column \d+ \('Angle \(rad\) Run #2.*'\) belongs to no run .*export the time of its run too"


@pytest.mark.parametrize(
    ("procedure", "damage", "error", "sentence"),
    [
        ("impulse", without("Time"), DataFileError, r"impulse\.csv: " + TIMELESS),
        ("springs", without("Time"), DataFileError, r"springs\.csv: " + TIMELESS),
        ("springs", without("Force"), ValueError, "run 'Run #2' has no channel 'Force'; it has: Angle"),
        (
            "impulse",
            in_unit("Angle", "(N)"),
            ValueError,
            ANGLE + ": its unit is 'N'; an angle in rad, deg or rev is needed",
        ),
        ("impulse", in_unit("Angle", ""), ValueError, ANGLE + ": its unit is ''; an angle in rad, .*; say it with"),
        ("springs", in_unit("Force", "(kN)", 1e-3), ValueError, FORCE + ": its unit is 'kN', needed is N"),
        ("springs", slower, ValueError, ANGLE + ": the sample rate changes from 100 Hz to 50 Hz near t ="),
        ("impulse", holes("Angle"), ValueError, ANGLE + ": 40 of .* not finite .* leave this run out"),
        ("springs", holes("Force"), ValueError, FORCE + ": 40 of .* 40 from time = 3 on; cut the record"),
        ("springs", holes("Angle"), ValueError, ANGLE + ": 40 of .* 40 from time = 3 on; cut the record"),
        ("impulse", cut(20), ValueError, ANGLE + ": 20 samples are too short .* 32 are needed"),
        ("springs", cut(20), ValueError, ANGLE + ": 20 samples are too short .* 32 are needed"),
    ],
    ids=lambda value: getattr(value, "__qualname__", "").split(".")[0] if callable(value) else None,
)
@pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning")
def test_what_cannot_be_used_is_an_error(
    whole: Path, tmp_path: Path, procedure: str, damage: Damage, error: type[Exception], sentence: str
) -> None:
    with pytest.raises(error, match=sentence):
        ns.identify(damaged(whole, tmp_path, procedure, damage))


def said_by(folder: Path) -> tuple[ns.identification.ParameterSet, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = ns.identify(folder)
    return found, [str(w.message) for w in caught if issubclass(w.category, RecordingWarning)]


@pytest.fixture(scope="module")
def undamaged(whole: Path) -> ns.identification.ParameterSet:
    found, said = said_by(whole)
    assert not said, said
    return found


def same(found: ns.identification.ParameterSet, undamaged: ns.identification.ParameterSet) -> bool:
    """Equal within the standard uncertainty."""
    return all(abs(found[name] - undamaged[name]) <= undamaged.uncertainty[name] for name in undamaged)


def test_other_units_of_an_angle_are_converted_and_said(whole: Path, tmp_path: Path, undamaged: object) -> None:
    degrees = in_unit("Angle", "(°)", 180 / np.pi)
    found, said = said_by(damaged(whole, tmp_path, "impulse", degrees))
    assert same(found, undamaged)
    assert [s for s in said if "channel 'Angle': has units mixed: rad (Run #1), ° (Run #2)" in s]


def test_a_changed_rate_is_said_where_it_does_no_harm(whole: Path, tmp_path: Path, undamaged: object) -> None:
    found, said = said_by(damaged(whole, tmp_path, "impulse", slower))
    assert same(found, undamaged)
    (sentence,) = said
    assert f"{WHO.format('Angle')}: the sample rate changes from 100 Hz to 50 Hz" in sentence and "split" in sentence


def test_a_tap_that_is_too_short_is_left_out_and_said(whole: Path, tmp_path: Path) -> None:
    found, said = said_by(damaged(whole, tmp_path, "impulse", cut(60)))
    notes = [note for finding in found.findings for note in finding.notes]
    told = [text for text in [*said, *notes] if "not used" in text]
    assert told and all("half swings" in text and ("Run #2" in text or "decay 2" in text) for text in told)


def test_a_file_without_any_time_says_how_to_read_it(whole: Path, tmp_path: Path) -> None:
    def timeless(head: list[str], rows: Rows) -> tuple[list[str], Rows]:
        keep = [i for i, text in enumerate(head) if not text.startswith("Time")]
        return [head[i] for i in keep], [[row[i] for i in keep] for row in rows]

    with pytest.raises(DataFileError, match=r"impulse\.csv: no time column among .* give its sample rate in Hz, rate="):
        ns.identify(damaged(whole, tmp_path, "impulse", timeless))


def test_few_turns_of_a_photogate_are_no_fault(tmp_path: Path) -> None:
    """One row for each turn of the crank: the remark on short runs is for channels that sample a motion."""
    t = np.arange(200) / 100
    lines = ["Time (s) Run #1,Angle (rad) Run #1,Time (s) Run #2,Turn (turns) Run #2"]
    lines += [f"{x:.4f},{np.cos(x):.6f}," + (f"{i},{i}" if i < 5 else ",") for i, x in enumerate(t)]
    file = tmp_path / "gate.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        recording = ns.load_recording(file)
    assert recording.channel("Turn", "Run #2").size == 5
    assert not [w for w in caught if "too short" in str(w.message)]
