"""``nonsmooth identify``: errors at the door, and a small session from its study file to table and figures."""

from __future__ import annotations

import pytest

import nonsmooth as ns
from nonsmooth.cli import main as cli
from nonsmooth.identification.parameter_set import ParameterSet


@pytest.fixture(scope="module")
def taps(tmp_path_factory):
    """Taps and calibrations of a virtual rig, without what tells the support or the gap."""
    from nonsmooth_savi2007.rig import VirtualRig

    folder = tmp_path_factory.mktemp("rig") / "session"
    few = {"impulse": {"velocities": (0.5, -0.3), "duration": 6.0}}
    return VirtualRig(7).write_session(folder, ["impulse", "voltage"], options=few)


def study(folder, text):
    path = folder / "study.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("identify = 3", "`identify` must be a table: write [identify]"),
        ("[identifi]\nsession = 'x'", "identify"),
        ("[output]\ndata = 'a.nc'", "needs a table [identify] with session"),
        ("[identify]\nsession = 3", "session must be text, not 3"),
        ("[identify]\nsession = 'nowhere'", "session = 'nowhere': no such folder beside the study file"),
        ("[identify]\nsession = '.'\nmodl = 'x'", "model"),
        ("[identify]\nsession = '.'", "session.toml: cannot be opened"),
        ("[identify]\nsession = '.'\nmodel = 'discontinous_support'", "discontinuous_support"),
        ("[identify]\nsession = '.'\nparameters = 3", "must be a list of text, not 3; a list of names"),
        ("[identify]\nsession = '.'\ncrank_length = 'long'", "must be a real number, not 'long'; a length in m"),
        ("[identify]\nsession = '.'\n[identify.apparatus]\nmas = 1.0", "mass"),
        ("[identify]\nsession = '.'\n[output]\nformat = 'bmp'", "a format"),
        ("[identify]\nsession = '.'\n[output]\nfigure = 'a.pdf'", "figures"),
        ("[identify\n", "is not a TOML file"),
    ],
)
def test_what_is_wrong_with_a_study_is_said_at_the_door(text, said, tmp_path, capsys):
    assert cli.main(["identify", str(study(tmp_path, text))]) == 2
    assert said in capsys.readouterr().err


def test_a_folder_without_a_notebook_is_no_session(tmp_path, capsys):
    assert cli.main(["identify", str(tmp_path)]) == 2
    assert "has no session.toml" in capsys.readouterr().err
    assert cli.main(["identify", str(tmp_path / "nothing")]) == 2
    assert "no such study file or session folder" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore::nonsmooth.recordings.recording.RecordingWarning")
def test_what_was_not_recorded_cannot_be_asked_for(taps, capsys):
    path = study(taps.parent, f"[identify]\nsession = '{taps.name}'\nparameters = ['k', 'g']")
    assert cli.main(["identify", str(path)]) == 2
    said = capsys.readouterr().err
    assert "'g' was not identified: it needs contact, impulse" in said and "no recordings of: springs" in said


@pytest.mark.filterwarnings("ignore::nonsmooth.recordings.recording.RecordingWarning")
def test_a_study_writes_numbers_a_table_and_figures(taps, capsys):
    path = study(
        taps.parent,
        f"""
[identify]
session = "{taps.name}"
model = "discontinuous_support"
parameters = ["k", "c", "m"]

[output]
data = "out/found.nc"
table = "out/found.md"
figures = "out"
format = "svg"
""",
    )
    assert cli.main(["identify", str(path)]) == 0
    out = taps.parent / "out"
    written = capsys.readouterr().out
    assert "omega_0 = " in written and f"written to {out / 'found.nc'}" in written
    found = ParameterSet.from_dataset(ns.load(out / "found.nc"))
    assert set(found) == {"m", "k", "c"} and found.synthetic
    system = ns.models.discontinuous_support().with_parameters(found)
    assert system.values["k"] == found["k"] and system.values["k_s"] == 1210.0
    # the same as in Python
    direct = ns.identify(taps, ns.models.discontinuous_support())
    assert dict(direct) == dict(found) and direct.covariance.equals(found.covariance)
    assert "(synthetic recordings)" in (out / "found.md").read_text()
    names = {p.name for p in out.glob("*.svg")}
    assert names == {"omega_0.svg", "omega_0_history.svg", "c_decay.svg", "voltage_frequency.svg"}
    assert all(b"synthetic" in (out / name).read_bytes() for name in names)


@pytest.mark.filterwarnings("ignore::nonsmooth.recordings.recording.RecordingWarning")
def test_a_session_folder_prints_what_is_found(taps, capsys):
    assert cli.main(["identify", str(taps), "--quiet"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("ParameterSet (synthetic recordings)") and "k = " in said
