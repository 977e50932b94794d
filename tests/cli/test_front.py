"""The command line as a newcomer meets it: help, a first study file, completion, an editor's checks, no traceback."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

from nonsmooth import System, models
from nonsmooth.cli import main as cli
from nonsmooth.cli.init import study_text
from nonsmooth.cli.study import named_model, read_study
from nonsmooth.cli.verb_options import VERBS, options_of

COMMANDS = (
    "init",
    "run",
    "plan",
    "show",
    "explore",
    "models",
    "identify",
    "compare",
    "reproduce",
    "rig",
    "schema",
    "completion",
)


def run(*arguments: str | Path) -> int:
    return cli.main([str(item) for item in arguments])


def process(*arguments: str | bytes, **settings: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "nonsmooth", *arguments], capture_output=True, text=True, **settings)


def test_without_arguments_it_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 0
    out, err = capsys.readouterr()
    assert not err
    for command in COMMANDS:
        assert re.search(rf"^    {command}  +\S", out, re.M), command
    for code in ("0  done", "2  wrong input", "3  done, but", "130  interrupted", "141  "):
        assert code in out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_shows_examples_that_it_understands(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run(command, "--help")
    lines = capsys.readouterr().out.partition("examples:\n")[2].splitlines()
    assert lines
    for line in lines:
        words = re.search(r"nonsmooth ([^#>)]*)", line)
        assert words is not None and words[1].split()[0] == command
        assert cli.parser().parse_args(words[1].split()).run is not None


def test_a_command_without_what_it_needs_says_what(capsys: pytest.CaptureFixture[str]) -> None:
    file = "STUDY.toml"
    needed = {"init": "MODEL", "run": file, "plan": file, "show": "file", "identify": file, "compare": file}
    needed |= {"reproduce": "STUDY", "rig": "--out", "completion": "shell"}
    for command in COMMANDS:
        if command not in needed:
            assert cli.parser().parse_args([command]).run is not None
            continue
        with pytest.raises(SystemExit) as ended:
            run(command)
        assert ended.value.code == 2
        assert capsys.readouterr().err.endswith(f"the following arguments are required: {needed[command]}\n")


def test_it_runs_as_a_module() -> None:
    done = process("models")
    assert done.returncode == 0
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(models.names())


def test_models_are_listed_without_formulas(capsys: pytest.CaptureFixture[str]) -> None:
    run("models")
    out = capsys.readouterr().out
    assert not set("\\`$") & set(out) and "Return" not in out
    assert all(len(line.split(maxsplit=1)[1]) > 20 for line in out.splitlines())


@pytest.mark.parametrize(
    ("command", "unbuffered"),
    [
        (("--help",), ""),
        (("models",), "1"),
        *(
            pytest.param(*others, marks=pytest.mark.slow)
            for others in ((("--help",), "1"), (("models",), ""), (("run", "--help"), ""), (("run", "--help"), "1"))
        ),
    ],
)
def test_a_closed_pipe_is_silent(command: tuple[str, ...], unbuffered: str) -> None:
    """As after `| head`: nobody reads any more, which shows at once or when the buffer is written."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "nonsmooth", *command],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
    )
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


# What is not the user's fault, and what is


def test_a_fault_of_the_package_is_one_message_that_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fault() -> None:
        raise ZeroDivisionError("not the user's")

    monkeypatch.setattr(models, "names", fault)
    assert run("models") == 1
    err = capsys.readouterr().err
    assert "a fault of nonsmooth itself" in err and "ZeroDivisionError: not the user's" in err and "--traceback" in err
    with pytest.raises(ZeroDivisionError):
        run("--traceback", "models")


WEIRD = (
    '""',
    '"a"',
    "-1",
    "1e308",
    "nan",
    "true",
    "[]",
    '[1, "a"]',
    "{}",
    '{ x = "b" }',
    "[{}]",
    "1979-05-27",
    "[[1, 2], [3]]",
    "9223372036854775807",
    "{ x = { y = 1 } }",
    '"\\u0000"',
)
LEAST = {
    "simulate": {"periods": "1"},
    "sweep": {"parameter": '"rho"', "values": "[0.3, 0.31]", "transient": "3", "keep": "3"},
    "chart": {"grid": "{ omega = [3.0, 3.1], rho = [0.3, 0.31] }", "transient": "3", "keep": "3"},
}


@pytest.mark.parametrize("verb", LEAST)
@pytest.mark.parametrize("part", [15, pytest.param(1, marks=pytest.mark.slow)], ids=["a fifteenth", "all"])
def test_no_value_of_any_key_ends_in_a_traceback(
    verb: str, part: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sixteen values of every key, or each key with one of them, by turns."""
    monkeypatch.chdir(tmp_path)
    tables = [({verb: {**LEAST[verb], key: value}}, f"{key} = {value}") for key in options_of(verb) for value in WEIRD]
    for key in ("data", "figure", "store", "x", "y"):
        tables += [({verb: LEAST[verb], "output": {key: value}}, f"{key} = {value}") for value in WEIRD]
    for key in ("model", "parameters", "smoothed"):
        tables += [({"system": {key: value}, verb: LEAST[verb]}, f"{key} = {value}") for value in WEIRD]
    for given, what in tables[::part]:  # fifteen and sixteen have no divisor in common
        system = {"model": '"discontinuous_support"'} | given.pop("system", {})
        text = "".join(
            f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in table.items())
            for name, table in {"system": system, **given}.items()
        )
        Path("study.toml").write_text(text)
        code = run("run", "study.toml", "--quiet")
        _, err = capsys.readouterr()
        assert code in (0, 2), (what, err)
        assert code == 0 or err.startswith("nonsmooth: "), what
        assert "object has no attribute" not in err and "unsupported operand" not in err, (what, err)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run", "."), r"\.: Is a directory"),
        (("show", b"\xff.nc"), r"no such file"),
        (("init", "wrong.py:system"), r"wrong\.py, line 1: BaseException: x"),
        (("init", "nothing.py:system"), "no such file"),
        (("schema", "--out", "."), r"\.: a folder stands there .*; close it where it is open, make room"),
        (("compare", "odd.toml"), r"\[measured\]: session must be text, not 3"),
        (("run", "a" * 5000), "File name too long"),
        (("run", "odd.nc"), r"odd\.nc: is a saved result and no study file; `nonsmooth show odd\.nc`"),
        (("show", "odd.toml"), r"odd\.toml: is a study file and no result; `nonsmooth run odd\.toml`"),
    ],
)
def test_odd_arguments_are_one_message(
    arguments: tuple[str | bytes, ...],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.py").write_text("raise BaseException('x')\n")
    (tmp_path / "odd.nc").touch()
    (tmp_path / "odd.toml").write_text('[system]\nmodel = "a"\n[measured]\nsession = 3\nprocedure = 4\n')
    assert cli.main([os.fsdecode(word) for word in arguments]) == 2
    out, err = capfd.readouterr()
    assert not out and re.match(rf"nonsmooth: .*{message}", err) and "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("rnu",), "`rnu` is not a command of `nonsmooth`; nearest: run; all: compare, "),
        (("init", "impact_oscillator", "--verb", "swep"), "`swep` is not a verb of `nonsmooth init`; nearest: sweep; "),
        (("completion", "tcsh"), "`tcsh` is not a shell of `nonsmooth completion`; "),
    ],
)
def test_a_misspelt_word_is_told_the_nearest(
    arguments: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        run(*arguments)
    out, err = capsys.readouterr()
    assert not out and message in err and len(err) < 600


# A first study file


#: Basins are a picture of two states.
NONE = ("square_root_map", "basins")
POSSIBLE = [(model, verb) for model in models.names() for verb in VERBS if (model, verb) != NONE]


once = cache(named_model)  # a model is traced once, not for each line of each file


@pytest.mark.parametrize(("model", "verb"), POSSIBLE)
def test_a_first_study_file_reads_with_each_of_its_comments_taken_out(
    model: str, verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nonsmooth.cli.study.named_model", once)
    path = tmp_path / "study.toml"
    text = study_text(once(model), model, verb, "study")
    lines = text.splitlines()
    settings = [i for i, line in enumerate(lines) if re.match(r"# \w+ = (?!A )", line)]
    assert {lines[i].split()[1] for i in settings} | set(re.findall(r"^(\w+) = ", text, re.M)) >= set(options_of(verb))
    for i in [None, *settings[models.names().index(model) % 3 :: 3]]:  # each comment with a third of the models
        changed = [line.removeprefix("# ") if k == i else line for k, line in enumerate(lines)]
        if i is not None and lines[i].startswith("# smoothed") and model != "discontinuous_support":
            continue  # a transition with a reset cannot be smoothed
        path.write_text("\n".join(changed))
        assert read_study(path).verb == verb


@pytest.mark.parametrize(
    ("model", "verb"),
    [
        pytest.param("discontinuous_support", "simulate", marks=pytest.mark.slow),  # the last is one too
        ("discontinuous_support", "sweep"),
        ("discontinuous_support", "frequency_response"),
        ("impact_oscillator", "poincare"),
        ("relief_valve", "simulate"),
    ],
)
def test_a_first_study_file_runs(
    model: str, verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("init", model, "--verb", verb) == 0
    (path,) = tmp_path.iterdir()
    given = tomllib.loads(path.read_text(encoding="utf-8"))[verb]
    if "parameter" in given:  # what is varied is varied about its own value
        assert given["values"]["from"] < named_model(model).values[given["parameter"]] < given["values"]["to"]
    said = capsys.readouterr().out.strip().rpartition(": ")[2]
    assert run(*said.split()[1:]) == 0
    assert f"{verb} of" in capsys.readouterr().out
    assert {path.suffix for path in tmp_path.iterdir()} == {".toml", ".nc", ".pdf"}
    assert run("init", model, "--verb", verb) == 2  # what is there is left alone
    assert "was left alone" in capsys.readouterr().err


def test_a_study_file_elsewhere_finds_the_model_of_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text("from nonsmooth import models\nsystem = models.impact_oscillator(A=0.5)\n")
    assert run("init", "mine.py:system", "--out", "studies/first.toml") == 0
    assert 'model = "../mine.py:system"' in Path("studies/first.toml").read_text()
    assert read_study(Path("studies/first.toml")).system.values["A"] == 0.5


# Editors


@cache
def schema() -> dict:
    done = process("schema")
    assert done.returncode == 0
    return json.loads(done.stdout)


def test_the_schema_takes_every_study_of_the_documentation_and_of_init() -> None:
    """The judge is the library jsonschema."""
    import tomllib

    jsonschema = pytest.importorskip("jsonschema", reason="the judge of the schema is not installed (group `test`)")
    jsonschema.Draft4Validator.check_schema(schema())
    judge = jsonschema.Draft4Validator(schema())
    guides = Path(__file__).parents[2] / "docs"
    pages = [page.read_text() for page in guides.rglob("*.md")]
    studies = [tomllib.loads(block) for text in pages for block in re.findall(r"```toml\n(.*?)```", text, re.S)]
    studies = [study for study in studies if set(study) & set(VERBS)]
    wrong = [study for study in studies if not judge.is_valid(study)]
    assert len(studies) >= 6
    assert [sorted(set(study) & set(VERBS)) for study in wrong] == [["sweep"], ["simulate", "sweep"]]  # under "Errors"
    for model, verb in POSSIBLE:
        judge.validate(tomllib.loads(study_text(once(model), model, verb, "study")))


def test_an_editor_shows_what_each_option_is() -> None:
    verbs = {name: one["properties"] for name, one in schema()["properties"].items() if name in VERBS}
    silent = [
        (verb, name) for verb, options in verbs.items() for name, one in options.items() if "description" not in one
    ]
    assert verbs and not silent


@pytest.mark.parametrize("verb", VERBS)
def test_names_in_other_letters_are_read_back(verb: str) -> None:
    """Also those in comments, when the comment sign is taken away."""
    system = System(
        states=["weg", "größe"],
        parameters={"ω": 1.0, "härte": 2.0},
        modes={"frei": lambda t, u, p: (u.größe, p.ω - p.härte * u.weg)},
        name="Schwinger",
    )
    text = study_text(system, "schwinger.py:system", verb, "study")
    bare = re.sub(r"(?m)^# (?=[a-z_]+ = )", "", text)
    for study in (tomllib.loads(text), tomllib.loads(bare)):
        assert study["system"]["model"] == "schwinger.py:system"
    assert study["system"]["parameters"] == {"ω": 1.0, "härte": 2.0}


@pytest.mark.parametrize(
    "change",
    [
        {"sweep": {"parameter": "rho", "values": {"from": 0, "to": 1}}},
        {"sweep": {"parameter": "rho", "values": "many"}},
        {"sweep": {"values": [1]}},
        {"sweep": {"parameter": "rho", "values": [1], "transients": 3}},
        {"sweep": {"parameter": "rho", "values": [1], "direction": "left"}},
        {"sweep": {"parameter": "rho", "values": [1], "method": "euler"}},
        {"sweep": {"parameter": "rho", "values": [1], "keep": "all"}},
        {"sweep": {"parameter": "rho", "values": [1], "section": {"phases": 0.5}}},
        {"output": {"data": "a.csv"}},
        {"system": {"model": "discontinous_support"}},
        {"system": {}},
        {"simulate": {"periods": 3}},
    ],
)
def test_the_schema_refuses_what_run_refuses(change: dict, tmp_path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema", reason="the judge of the schema is not installed (group `test`)")
    study = {"system": {"model": "discontinuous_support"}, "sweep": {"parameter": "rho", "values": [0.3]}}
    judge = jsonschema.Draft4Validator(schema())
    judge.validate(study)
    assert not judge.is_valid(study | change)


# Shells


BASH = r"""
source "$1"
while IFS= read -r line; do
    read -r -a COMP_WORDS <<< "$line"; [[ "$line" == *" " ]] && COMP_WORDS+=("")
    COMP_CWORD=$(( ${#COMP_WORDS[@]} - 1 )); COMPREPLY=(); _nonsmooth; echo "${COMPREPLY[*]}"
done
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes_commands_options_and_names(tmp_path: Path) -> None:
    script = tmp_path / "completion"
    script.write_text(process("completion", "bash").stdout)
    asked = {
        "nonsmooth ": " ".join(COMMANDS),
        "nonsmooth re": "reproduce",
        "nonsmooth --v": "--version",
        "nonsmooth init impact_o": "impact_oscillator",
        "nonsmooth init impact_oscillator --verb ba": "basins basin_fractions",
        "nonsmooth run --s": "--store --scheduler",
        "nonsmooth --traceback reproduce ": "savi2007",
        "nonsmooth run ": "",  # the shell's own: names of files
        "nonsmooth completion z": "zsh",
    }
    done = subprocess.run(
        ["bash", "-c", BASH, "bash", str(script)], input="\n".join(asked) + "\n", capture_output=True, text=True
    )
    assert not done.stderr
    assert dict(zip(asked, done.stdout.splitlines(), strict=True)) == asked


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_read_their_script(shell: str) -> None:
    text = process("completion", shell).stdout
    for command in COMMANDS:
        assert command in text
    if found := shutil.which(shell):
        done = subprocess.run([found, "-n"], input=text, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


def test_an_output_that_cannot_write_a_letter_is_written_all_the_same(tmp_path: Path) -> None:
    """On Windows a pipe takes the letters of one language only."""
    command = [
        sys.executable,
        "-m",
        "nonsmooth",
        "schema",
        "--out",
        str(tmp_path / "\u03c9.json"),
    ]
    done = subprocess.run(command, env={**os.environ, "PYTHONIOENCODING": "ascii"}, capture_output=True, text=True)
    assert done.returncode == 0 and "\\u03c9.json" in done.stdout, done.stderr
