"""``nonsmooth identify STUDY.toml``: the parameters behind a session's recordings, with their uncertainty."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from nonsmooth.cli.files import TEXT, keep, put_text, read_tables, with_folder, without_screen
from nonsmooth.errors import check_keys, unknown

_TABLES: dict[str, Any] = {
    "identify": {
        "session": TEXT,
        "model": TEXT,
        "parameters": Annotated[Sequence[str], 'a list of names, as ["k", "c", "g"]'],
        "crank_length": Annotated[float, "a length in m"],
        "apparatus": Annotated[Mapping, "a table of numbers or of { value = ..., uncertainty = ... }"],
    },
    "output": dict.fromkeys(("data", "table", "figures", "format"), TEXT),
}
_FORMATS = ("pdf", "png", "svg")


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "identify",
        help="identify parameters from a session's recordings",
        description="Identify the parameters of the oscillator from recordings. A study file says which: [identify] "
        "with `session`, the folder of session.toml, and optionally `model`, `parameters` that must be found, "
        "`crank_length` and `apparatus`; [output] with `data` (.nc or .zarr), `table` (.md) and `figures` (a folder). "
        "Paths in the file are relative to the file. A session folder in its place prints what is found. "
        "The exit code is 3 where something contradicts itself: each such anomaly is named.",
        epilog="examples:\n  nonsmooth identify session/\n  nonsmooth identify rig.toml --out parameters.nc",
    )
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="the study file, or a session folder")
    parser.add_argument("--out", type=Path, help="write the parameters with their covariance (.nc or .zarr)")
    parser.add_argument("--crank", type=float, help="crank length (m) to whose mean position the gap is referred")
    parser.add_argument("--quiet", action="store_true", help="parameters only, no findings")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.studies import study as package

    rig = package("savi2007", "identification")
    study = _read(options.study)
    crank = study.get("crank_length") if options.crank is None else options.crank
    found = rig.identify(study["session"], study.get("model"), apparatus=study.get("apparatus", {}), crank_length=crank)
    rig.require(found, study.get("parameters", []))
    print(found)
    if not options.quiet:
        for finding in found.findings:
            print(f"\n{finding}")
        print()
        for name, sentence in found.identifiability.items():
            print(f"{name}: {sentence}")
    for path in _write(found, study if options.out is None else {**study, "data": options.out}):
        print(f"written to {path}")
    return said(found)


def said(found: Any) -> int:
    """The exit code of identified parameters: 0, or 3 where anomalies stand, each named on the error stream."""
    for sentence in found.anomalies:
        print(f"nonsmooth: anomaly: {sentence}", file=sys.stderr)
    return 3 if found.anomalies else 0


def _read(path: Path) -> dict[str, Any]:
    """Contents of a study file, paths already relative to where the command runs."""
    from nonsmooth.cli.study import load_model
    from nonsmooth.recordings.session import APPARATUS, NOTEBOOK

    if path.is_dir():
        if not (path / NOTEBOOK).is_file():
            raise ValueError(f"{path}: this folder has no {NOTEBOOK}; a session has one, beside its recordings")
        return {"session": path}
    if path.name == NOTEBOOK:
        return {"session": path.parent}
    document = read_tables(path, _TABLES, "study file or session folder", {"identify": ("session",)})
    asked, output = document["identify"], document.get("output", {})
    where, folder = f"{path}, table [identify]", path.parent
    session = folder / asked["session"]
    if not session.is_dir():
        raise ValueError(f"{where}: session = {asked['session']!r}: no such folder beside the study file ({session})")
    apparatus, style = asked.get("apparatus", {}), output.get("format", "pdf")
    check_keys(apparatus, APPARATUS, f"{where}, apparatus", "a key")
    if style not in _FORMATS:
        raise ValueError(f"{path}, table [output]: {unknown(style, 'a format', 'figures', _FORMATS)}")
    known = {
        name: (value.get("value"), value.get("uncertainty", 0.0)) if isinstance(value, dict) else value
        for name, value in apparatus.items()
    }
    places = {key: folder / name for key, name in output.items() if key != "format"}
    model = {"model": load_model(asked["model"], folder)} if "model" in asked else {}
    return {**asked, **places, **model, "session": session, "apparatus": known, "format": style}


def _write(found: Any, study: Mapping[str, Any]) -> list[Path]:
    written = []
    if "data" in study:
        written.append(keep(found.to_dataset(), study["data"]))
    if "table" in study:
        from nonsmooth.identification.report import report

        written.append(put_text(study["table"], report(found)))
    if "figures" in study:
        plot = without_screen()
        from matplotlib import pyplot as plt

        from nonsmooth.plot.identification.picture import pictures

        for name, ax in pictures(found):
            written.append(plot.save_figure(ax, with_folder(study["figures"] / f"{name}.{study['format']}")))
            plt.close("all")
    return written
