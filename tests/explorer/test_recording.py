"""Recordings in the page: files read or refused, the distance from the model, and the fit of its parameters."""

from __future__ import annotations

import base64
import os
import re
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from tests.explorer.conftest import HEARD, wait_until

import nonsmooth as ns
from nonsmooth.explorer.measured import read, strand_distance
from nonsmooth.explorer.recorded import LARGEST, frequency_of, matched
from nonsmooth.identification.compare.orbits import fold
from nonsmooth.recordings import Recording
from nonsmooth_savi2007.rig import write_cap, write_capstone_csv

TRUTH = {"k": 8.0, "c": 0.8, "g": -0.004}
TRAVEL = 0.0789 / (2 * np.pi)  # m per rad, of the rotary sensor
COUNT = 0.0789 / 1440  # m
NAME = "rig.csv"
PERIODS = 8  # of the record


@pytest.fixture(scope="session")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A steady record of a rig with other parameters than the page's: an encoder's counts, and turns of the crank."""
    system = ns.models.discontinuous_support(**TRUTH)
    period = system.period()
    time = np.arange(0.0, PERIODS * period, 0.02)[:-1]
    run = ns.simulate(system, transient=400, periods=PERIODS, samples=400 * period + time)
    x = np.interp(400 * period + time, run.time, run.u.sel(state="x"))
    step = 2 * np.pi / 1440
    sensors = {
        "Angle": xr.Dataset(
            {"Angle": ("time", np.rint(x / TRAVEL / step) * step, {"units": "rad"})},
            {"time": ("time", time + 0.3, {"units": "s"})},
        ),
        "Turn": xr.Dataset(
            {"Turn": ("time", np.arange(float(PERIODS)), {"units": "turns"})},
            {"time": ("time", np.arange(PERIODS) * period + 0.3, {"units": "s"})},
        ),
    }
    folder = tmp_path_factory.mktemp("rig")
    recording = Recording.from_runs({"Run #1": sensors}, synthetic=True)
    write_cap(recording, folder / "rig.cap")
    return write_capstone_csv(recording, folder / NAME)


def drop(page: Any, name: str, content: bytes) -> None:
    """Drop a file into the page, as from a folder on the desktop."""
    transfer = page.tab.evaluate_handle(
        """([name, content]) => {
            const bytes = Uint8Array.from(atob(content), letter => letter.charCodeAt(0)), transfer = new DataTransfer();
            transfer.items.add(new File([bytes], name));
            return transfer;
        }""",
        [name, base64.b64encode(content).decode()],
    )
    page.tab.dispatch_event("#upper", "drop", {"dataTransfer": transfer})


def distance(page: Any) -> float:
    """The distance in the read-out, in mm."""
    value, unit = page.readout()["distance of the recording"].split()[:2]
    return float(value) * {"mm": 1.0, "µm": 1e-3}[unit]


@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_dropped_recording_lies_over_the_model_and_its_parameters_are_found(
    page: Any, rig: Path, whole: bool
) -> None:
    page.until_done()
    drop(page, NAME, rig.read_bytes())
    page.tab.wait_for_selector("#recording-body:visible")
    page.until_done()
    assert "Angle is in rad, x in m: give the factor" in page.tab.inner_text("#recording-remarks")
    page.write("factor-x", repr(TRAVEL))
    remark = f"{PERIODS - 1} forcing periods compared"
    page.until(f'document.getElementById("recording-remarks").textContent.includes("{remark}")')
    page.write("v-p.omega", "3.5")
    page.until(HEARD)
    page.tab.click("#recording-drive")  # the frequency of the record
    page.until(HEARD)
    assert page.value("omega") == pytest.approx(ns.models.discontinuous_support().values["omega"], rel=1e-4)
    page.tab.click("#undo")
    page.tab.click("#undo")
    page.until_done()
    far, near = distance(page), 1000 * COUNT / np.sqrt(12)  # the steps of the encoder are left
    if whole:
        for name, value in TRUTH.items():
            page.write(f"v-p.{name}", repr(value))
        page.until_done()
        assert distance(page) == pytest.approx(near, rel=0.2)
        for _ in TRUTH:
            page.tab.click("#undo")
        page.until_done()
        assert distance(page) == far
    assert far > 100 * near
    drawn = page.tab.evaluate(
        '["curve", "history", "portrait", "section", "diagram"].map(key =>'
        ' Bokeh.documents[0].get_model_by_name("recorded " + key).data.x.length)'
    )
    assert min(drawn) >= PERIODS - 1
    beyond = page.tab.evaluate("""["portrait", "section", "history"].filter(name => {
        const plot = Bokeh.documents[0].get_model_by_name(name);
        const of = name === "history" ? "recorded history" : "recorded curve";
        const {x, y} = Bokeh.documents[0].get_model_by_name(of).data;
        const leaves = (values, {start, end}) => values.some(one => one < start || one > end);
        return leaves(y, plot.y_range) || (name !== "history" && leaves(x, plot.x_range));
    })""")
    assert beyond == []
    page.tab.click("#recording-fit")
    page.until('document.getElementById("recording-found").textContent.includes("fitted to")')
    page.until_done()
    told = page.tab.inner_text("#recording-found")
    print(f"distance {far} mm, {near} mm of the counts, {distance(page)} mm after the fit\n{told}")
    for name, value in TRUTH.items():
        assert page.value(name) == pytest.approx(value, rel=0.01)
    assert re.search(r"^k [78]\.\d+ ± 0\.00\d+ N/m$", told, re.M)
    assert distance(page) == pytest.approx(near, rel=0.2)
    page.picture("recording")
    page.tab.click("#undo")
    page.until(HEARD)
    assert page.value("k") == 8.47
    page.tab.click("#redo")
    page.tab.click("#tab-response")
    page.tab.select_option("#shown", "x")
    page.until('Bokeh.documents[0].get_model_by_name("recorded response").data.x.length === 1')
    if whole:
        page.until_done()
        measured, model = page.tab.evaluate("""(() => {
            const of = name => Bokeh.documents[0].get_model_by_name(name).data, point = of("recorded response");
            const curve = of("response up"), away = [...curve.x].map(x => Math.abs(x - point.x[0]));
            return [[point.x[0], point.y[0]], curve.y[away.indexOf(Math.min(...away))]];
        })()""")
        np.testing.assert_allclose([measured[0], measured[1]], [3.69, model], rtol=0.02)
        page.picture("recorded_response")
    page.tab.click("#recording-remove")  # which no undo does
    page.tab.wait_for_selector("#recording-body", state="hidden")


def test_a_file_that_is_no_recording_is_refused_and_nothing_is_lost(page: Any, rig: Path) -> None:
    page.until_done()
    page.write("v-p.rho", "0.3")
    drop(page, "rig.cap", rig.with_name("rig.cap").read_bytes())
    page.tab.wait_for_selector("#recording-body:visible")
    for name, content in {
        "notes.csv": b"import os\nos.abort()\n",
        "picture.mat": b"\x89PNG\r\n\x1a\n\0\0\0",
        "empty.lvm": b"",
    }.items():
        drop(page, name, content)
        page.until(f'document.getElementById("wrong-recording").textContent.includes("{name}")')
        assert page.tab.inner_text("#recording-name") == "rig.cap (synthetic)"
        assert page.value("rho") == 0.3
    page.tab.evaluate(
        """size => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([new Uint8Array(size)], "long.csv"));
            document.body.dispatchEvent(new DragEvent("drop", {dataTransfer: transfer, bubbles: true}));
        }""",
        LARGEST + 1,
    )
    page.until('document.getElementById("wrong-recording").textContent.includes("the page takes 64 MiB")')
    page.tab.set_input_files("#recording-file", rig)
    page.until('document.getElementById("recording-name").textContent === "rig.csv (synthetic)"')
    assert page.tab.inner_text("#wrong-recording") == ""
    page.tab.click("#recording-remove")
    page.tab.wait_for_selector("#recording-body", state="hidden")
    page.until_done()
    assert "distance of the recording" not in page.readout()


def test_a_fit_is_cancelled_and_a_crash_of_it_is_said(page: Any, server: Any, rig: Path) -> None:
    page.until_done()
    drop(page, NAME, rig.read_bytes())
    page.tab.wait_for_selector("#recording-body:visible")
    page.write("factor-x", repr(TRAVEL))
    page.until_done()
    before = len(server.workers())
    page.tab.click("#recording-fit")
    page.tab.click("#recording-cancel")
    page.tab.wait_for_selector("#recording-doing", state="hidden")
    page.until_done()
    wait_until(lambda: len(server.workers()) <= before)
    page.tab.click("#recording-fit")
    page.tab.wait_for_selector("#recording-doing:visible")
    for pid in server.workers():  # one of them fits
        os.kill(pid, signal.SIGKILL)
    page.until('document.getElementById("wrong-recording").textContent.includes("ended unexpectedly (code -9)")')
    page.until_done()
    assert page.tab.inner_text("#recording-found") == ""
    assert page.tab.inner_text("#recording-name") == "rig.csv (synthetic)"
    assert page.value("k") == 8.47
    page.tab.click("#recording-remove")
    page.tab.wait_for_selector("#recording-body", state="hidden")


@pytest.mark.parametrize("lead", [0.0, 0.37, -0.2])
def test_distance_of_harmonic_motions(lead: float) -> None:
    """Of two cosines with amplitudes a and b it is |a - b| / sqrt 2, and the shift is the lead."""
    phase = np.linspace(0.0, 9.0, 900)
    recorded = fold(phase, 3.0 * np.cos(2 * np.pi * (phase - lead))[:, None], 64)
    turns = np.linspace(100.0, 101.0, 200)
    motion = turns, 2.0 * np.cos(2 * np.pi * turns)[:, None]
    far, shift = strand_distance(recorded, motion, np.ones(1), closed=True)
    assert far[0] == pytest.approx(1 / np.sqrt(2), rel=1e-4)
    assert shift == pytest.approx(lead, abs=1e-4)


def test_distance_between_period_numbers_counts_both_ways() -> None:
    """A record of 1 and 3 in turn from a motion of 1 alone: half of the record is 2 away, and none of the motion."""
    phase = np.linspace(0.0, 8.0, 1600)
    wave = np.sin(2 * np.pi * phase) * np.where(np.floor(phase) % 2, 3.0, 1.0)
    recorded = fold(phase, wave[:, None], 64)
    turns = np.linspace(0.0, 1.0, 200)
    far, _ = strand_distance(recorded, (turns, np.sin(2 * np.pi * turns)[:, None]), np.ones(1), closed=True)
    assert far[0] == pytest.approx(np.sqrt(0.5 * 0.5 * 2.0**2 / 2), rel=1e-3)


def test_channels_are_matched_by_name_and_unit_and_scaled() -> None:
    table = b"t (s),pos (mm),v (mm/s)\n" + b"".join(b"%g,%g,%g\n" % (k, 1 + k, 10 * k) for k in range(20))
    recorded = read({"content": table, "name": "table.csv"})["recorded"]
    system = ns.models.discontinuous_support()
    setup = matched(recorded, system)
    assert {state: one.channel for state, one in setup.states.items()} == {"v": "v", "x": "pos"}
    samples = setup.samples
    assert samples is not None
    np.testing.assert_allclose(samples.columns["x"][:3], [1e-3, 2e-3, 3e-3])
    np.testing.assert_allclose(samples.columns["v"][:3], [0.0, 0.01, 0.02])
    moved = setup.changed("shift.x", "0.5").changed("begin", 4)
    samples = moved.samples
    assert samples is not None
    np.testing.assert_allclose([samples.time[0], samples.columns["x"][0]], [4.0, 0.505])
    for name, value in {"channel.x": "__class__", "factor.x": "0", "run": "Run #9", "gain.x": 1, "end": -1}.items():
        with pytest.raises(ValueError, match=r"no channel|every reading equal|no run|is nothing|is empty"):
            setup.changed(name, value)


def test_a_recorded_drive_sets_the_frequency_of_the_model() -> None:
    system = ns.models.discontinuous_support()
    assert frequency_of(system, system.values, 2.0) == {"omega": pytest.approx(np.pi)}
    assert frequency_of(system, {**system.values, "omega": 0.0}, 2.0) == {}  # nothing is forced there
    assert frequency_of(ns.models.border_collision(), {"mu": 1.0}, 2.0) == {}


def test_measured_responses_of_runs_and_of_a_table_over_frequency(tmp_path: Path) -> None:
    system = ns.models.discontinuous_support()
    runs = {}
    for k, omega in enumerate((3.0, 5.0), 1):
        counts = np.arange(8.0 if k == 1 else 3.0)  # three turns are the fewest
        time, turns = np.linspace(0.0, 20.0, 2001), counts * 2 * np.pi / omega
        runs[f"Run #{k}"] = {
            "Position": xr.Dataset(
                {"Position": ("time", 10.0 * k * np.cos(omega * time), {"units": "mm"})},
                {"time": ("time", time, {"units": "s"})},
            ),
            "Turn": xr.Dataset(
                {"Turn": ("time", counts, {"units": "turns"})}, {"time": ("time", turns, {"units": "s"})}
            ),
        }
    file = write_capstone_csv(Recording.from_runs(runs, synthetic=True), tmp_path / "steps.csv")
    recorded = read({"content": file.read_bytes(), "name": "steps.csv"})["recorded"]
    omega, height = matched(recorded, system).response(system.values, "omega", "x")
    np.testing.assert_allclose(omega, [3.0, 5.0], rtol=1e-6)
    np.testing.assert_allclose(height, [0.01, 0.02], rtol=1e-3)
    still = {**system.values, "omega": 0.0}
    for values, over in ((system.values, "rho"), (still, "omega")):
        assert not len(matched(recorded, system).response(values, over, "x")[0])
    table = b"frequency (Hz),amplitude (mm)\n" + b"".join(b"%g,%g\n" % (0.5 * k, k) for k in range(1, 12))
    recorded = read({"content": table, "name": "table.csv"})["recorded"]
    omega, height = matched(recorded, system).response(system.values, "omega", "x")
    np.testing.assert_allclose(omega, np.pi * np.arange(1, 12))
    np.testing.assert_allclose(height, 1e-3 * np.arange(1, 12))
