"""Tables of results: numbers against closed forms, headers, files as other programs read them."""

from __future__ import annotations

import csv
import errno
import importlib.util
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import nonsmooth as ns

E = ns.elements


@pytest.fixture(scope="module")
def swinging():
    """Free, undamped, of frequency 2 rad/s; q = cos 2t."""
    return ns.mechanical("m", 0.0, 8.0, coordinates={"q": "m"}, parameters={"m": (2.0, "kg")})


@pytest.fixture(scope="module")
def bouncing():
    """A ball under unit gravity on a table, e = 1/2, from height 1/2: impacts at 1, 2, 2.5, ..."""
    return ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={"g": 1.0},
        modes={"fly": lambda t, u, p: (u.v, -p.g)},
        indicators={"below": lambda t, u, p: -u.x},
        transitions=[ns.Transition("fly", "fly", when="below > 0", reset=lambda t, u, p: (u.x, -0.5 * u.v))],
    )


def test_a_run_at_even_instants_is_computed_not_interpolated(swinging) -> None:
    run = ns.simulate(swinging, duration=3.0, start={"q": 1.0}, samples=5)  # no spline through five points does it
    found = ns.table(run, step=0.1)
    assert list(found.columns) == ["time (s)", "q (m)", "v_q (m/s)", "mode"]
    assert len(found) == 31
    t = found["time (s)"].to_numpy()
    assert np.allclose(t, 0.1 * np.arange(31), rtol=0, atol=1e-15)
    assert np.abs(found["q (m)"] - np.cos(2 * t)).max() < 1e-12
    assert np.abs(found["v_q (m/s)"] + 2 * np.sin(2 * t)).max() < 1e-12
    part = ns.table(run.sel(time=slice(0.5, 2.5)), step=0.25)  # a window of the run is computed anew too
    assert np.abs(part["q (m)"] - np.cos(2 * part["time (s)"])).max() < 1e-12
    at = [0.3, 1.7]
    assert np.allclose(ns.table(run, ["q"], samples=at)["q (m)"], np.cos(2 * np.array(at)), rtol=0, atol=1e-12)
    assert len(ns.table(run, samples=7)) == 7


def test_a_crossing_stands_once_with_the_state_after_it(bouncing) -> None:
    run = ns.simulate(bouncing, duration=2.2, start={"x": 0.5}, samples=[0.0, 0.5, 1.5, 2.2])
    found = ns.table(run)
    assert found["time (s)"].tolist() == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0, 2.2], abs=1e-12)
    assert found["v (m/s)"].tolist() == pytest.approx([0.0, -0.5, 0.5, 0.0, 0.25, 0.05], abs=1e-12)
    crossings = ns.table(run, over="crossing")
    assert crossings["crossing_time (s)"].tolist() == pytest.approx([1.0, 2.0], abs=1e-12)
    assert crossings["v_before (m/s)"].tolist() == pytest.approx([-1.0, -0.5], abs=1e-12)
    assert crossings["v_after (m/s)"].tolist() == pytest.approx([0.5, 0.25], abs=1e-12)
    # at the very instant of an impact: the state after it
    assert ns.table(run, ["v"], samples=[0.999, float(run.crossing_time[0])])["v (m/s)"][1] == pytest.approx(0.5)


def test_without_its_record_a_run_is_interpolated_between_crossings(bouncing) -> None:
    run = ns.simulate(bouncing, duration=2.2, start={"x": 0.5}, samples=[0.0, 0.5, 1.5, 2.2])  # three in each fall
    run.attrs.clear()
    with pytest.warns(UserWarning, match="interpolated by cubic splines"):
        found = ns.table(run, ["x"], step=0.01)
    t = found["time (s)"].to_numpy()
    falls = np.where(t < 1, 0.5 - t**2 / 2, 0.5 * (t - 1) - (t - 1) ** 2 / 2)
    some = t < 1.99
    assert np.abs(found["x (m)"] - falls)[some].max() < 1e-12  # parabolas between impacts


def test_a_ramp_and_a_transient_are_run_again() -> None:
    system = ns.models.discontinuous_support(g=0.02)
    run = ns.simulate(system, periods=2, transient=3, ramps={"rho": (0.1, 0.2)}, samples=50)
    found = ns.table(run, ["x"], samples=run.time.values[[3, 20]])
    assert found["x (m)"].tolist() == pytest.approx(run.u.values[[3, 20], 0].tolist(), rel=1e-7)
    with pytest.raises(ValueError, match="lie outside the run"):
        ns.table(run, samples=[0.0, 1.0])


def test_a_sweep_has_a_row_for_each_point_and_names_for_all(swinging) -> None:
    forced = ns.mechanical(
        1.0,
        0.5,
        1.0,
        coordinates={"q": "m"},
        parameters={"F": (2.0, "N"), "w": (1.0, "rad/s")},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
    )
    w = np.linspace(0.5, 2.0, 4)
    found = ns.table(ns.frequency_response(forced, w, parameter="w", progress=False))
    assert found["direction"].tolist() == ["up", "down"] * 4
    assert found["w (rad/s)"].tolist() == np.repeat(w, 2).tolist()
    exact = 2.0 / np.hypot(1 - w**2, 0.5 * w)
    assert np.allclose(found["q_amplitude (m)"], np.repeat(exact, 2), rtol=1e-9)
    assert np.allclose(found["q_maximum (m)"], np.repeat(exact, 2), rtol=1e-9)
    assert set(found["status"]) == {"ok"}
    assert found.attrs["parameters"] == {"F (N)": 2.0}
    points = ns.table(ns.sweep(forced, "w", w, keep=3, progress=False), over="iterate")
    assert len(points) == 12
    assert list(points.columns) == ["iterate", "w (rad/s)", "q_section (m)", "v_q_section (m/s)"]


def test_other_results(swinging) -> None:
    orbit = ns.find_orbit(ns.models.discontinuous_support(g=0.02))
    one = ns.table(orbit)
    assert len(one) == 1
    assert one["period (s)"][0] == pytest.approx(2 * math.pi / 3.69)
    assert one["stable"][0]
    branch = ns.continue_orbit(orbit, "rho", (0.4, 0.5))
    assert len(ns.table(branch, ["x_amplitude"])) == branch.sizes["point"]
    assert list(ns.table(branch, ["x_amplitude"]).columns) == ["rho (N)", "x_amplitude (m)"]
    assert len(ns.table(branch, over="special")) == branch.sizes["special"]
    assert len(ns.table(ns.lyapunov(ns.models.discontinuous_support(), periods=50, transient=20))) == 1


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


def test_files_as_others_read_them(swinging, tmp_path) -> None:
    run = ns.simulate(swinging, duration=1.0, start={"q": 1.0})
    found = ns.table(run, ["q"], step=0.25, file=tmp_path / "run.csv")
    header, *rows = read(tmp_path / "run.csv")
    assert header == ["time (s)", "q (m)"]
    assert [list(map(float, row)) for row in rows] == found.to_numpy().tolist()  # every digit
    if importlib.util.find_spec("openpyxl"):
        import openpyxl

        ns.table(run, ["q"], step=0.25, file=tmp_path / "run.xlsx")
        book = openpyxl.load_workbook(tmp_path / "run.xlsx")
        first, *others = [[cell.value for cell in row] for row in book["table"]]
        assert first == header
        assert np.allclose(others, found.to_numpy(), rtol=1e-14, atol=0)  # a sheet keeps fifteen digits
        assert ("m (kg)", 2.0) in [tuple(cell.value for cell in row) for row in book["parameters"]]
    if importlib.util.find_spec("pyarrow"):
        import pandas as pd

        ns.table(run, ["q"], step=0.25, file=tmp_path / "run.parquet")
        assert pd.read_parquet(tmp_path / "run.parquet").equals(found)


@pytest.mark.parametrize(("ending", "package"), [("xlsx", "openpyxl"), ("parquet", "pyarrow")])
def test_a_package_that_is_missing_is_named_with_its_command(
    swinging, tmp_path, monkeypatch, ending: str, package: str
) -> None:
    monkeypatch.setattr("nonsmooth.tables.table.find_spec", lambda name: None)
    run = ns.simulate(swinging, duration=1.0, start={"q": 1.0})
    with pytest.raises(ImportError, match=f"needs the package {package}.*python -m pip install {package}"):
        ns.table(run, file=tmp_path / f"run.{ending}")


def test_what_does_not_fit_is_said(swinging, tmp_path) -> None:
    run = ns.simulate(swinging, duration=1.0, start={"q": 1.0})
    for wrong, words in [
        (lambda: ns.table(5), "a result is wanted"),
        (lambda: ns.table(run, 5), "columns must be a list of text, not 5"),
        (lambda: ns.table(run, ["qq"]), "`qq` is not a quantity of this result; nearest: q"),
        (lambda: ns.table(run, over="jump"), "`jump` is not a dim of this result"),
        (lambda: ns.table(run, step=0.1, samples=3), "give the instants once"),
        (lambda: ns.table(run, step=-1.0), "must be positive"),
        (lambda: ns.table(run, step=1e-320), "more than 1e8 rows"),
        (lambda: ns.table(run, file="run.txt"), "written to .csv, .xlsx or .parquet"),
        (lambda: ns.table(run, file=tmp_path / "no" / "run.csv"), "does not exist"),
        (lambda: ns.table(ns.poincare(ns.models.discontinuous_support(), n=3), step=1.0), "results have no motion"),
    ]:
        with pytest.raises((TypeError, ValueError), match=words):
            wrong()


def test_rows_of_spectra_and_special_points() -> None:
    system = ns.models.discontinuous_support(g=0.02)
    lines = ns.table(ns.amplitude_spectrum(system, periods=16))
    at = lines.iloc[(lines["order"] - 1.0).abs().argmin()]
    assert at["frequency (Hz)"] == pytest.approx(3.69 / (2 * math.pi))  # the line of the force
    branch = ns.continue_orbit(ns.find_orbit(system), "rho", (0.05, 0.5))
    special = ns.special_points(branch)
    found = ns.table(special, ["kind"])
    assert found["kind"].tolist() == special["kind"].values.tolist()
    assert found["rho (N)"].tolist() == special["rho"].values.tolist()


def test_parameters_with_their_uncertainties() -> None:
    from nonsmooth.identification.finding import Estimate

    found = ns.table(ns.ParameterSet({"k": Estimate(8.0, 0.1, "N/m"), "m": Estimate(2.0, 0.2, "kg")}, np.eye(2)))
    assert found[["parameter", "value", "uncertainty", "unit"]].to_numpy().tolist() == [
        ["k", 8.0, 0.1, "N/m"],
        ["m", 2.0, 0.2, "kg"],
    ]


def test_counts_of_a_state_have_no_unit() -> None:
    dense = ns.sweep(ns.models.discontinuous_support(), "rho", [0.3], keep=5, transient=5, density=True, progress=False)
    assert ns.table(dense, ["x_outside", "x_maximum"]).columns.tolist() == ["rho (N)", "x_outside", "x_maximum (m)"]
    assert "x_density" in ns.table(dense, over="bin").columns


def test_a_file_that_is_open_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Excel holds a table that it shows."""

    def held(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(pd.DataFrame, "to_csv", held)
    with pytest.raises(ns.DataFileError, match=r"run\.csv: it may not be written .*close it where it is open"):
        ns.table(ns.simulate(ns.models.impact_oscillator(), periods=1), file=tmp_path / "run.csv")


WRITERS = {
    ".csv": lambda run, file: ns.table(run, file=file),
    ".xlsx": lambda run, file: ns.table(run, file=file),
    ".pdf": lambda run, file: ns.plot.save_figure(ns.plot.time_history(run), file),
    ".gif": lambda run, file: ns.animate(run, seconds=0.2, rate=10, pixels=150).save(file),
    ".html": lambda run, file: ns.animate(run, seconds=0.2, rate=10, pixels=150).save(file),
}


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_file_that_cannot_be_written_leaves_the_old_one(suffix: str, tmp_path: Path) -> None:
    """A table, a figure and an animation say the same."""
    run = ns.simulate(ns.models.impact_oscillator(), periods=1)
    write = WRITERS[suffix]
    with pytest.raises(ns.DataFileError, match="does not exist; create it first"):
        write(run, tmp_path / "no" / f"run{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(ns.DataFileError, match="a folder stands there .*give another name"):
        write(run, tmp_path / f"folder{suffix}")
    old = tmp_path / f"run{suffix}"
    old.write_bytes(b"old")
    with pytest.MonkeyPatch.context() as patched:

        def full(*_: object) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        patched.setattr("nonsmooth.results.whole.replace", full)
        with pytest.raises(ns.DataFileError, match="the disk is full .*make room"):
            write(run, old)
    assert old.read_bytes() == b"old"
    write(run, old)
    assert len(old.read_bytes()) > 100
    assert sorted(one.name for one in tmp_path.iterdir()) == [f"folder{suffix}", f"run{suffix}"]
