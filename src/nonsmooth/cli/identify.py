"""``nonsmooth identify STUDY.toml``: the parameters behind a session's recordings, with their uncertainty."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nonsmooth.cli.files import (
    LENGTH,
    NAMES,
    QUANTITIES,
    TEXT,
    keep,
    put_text,
    read_tables,
    with_folder,
    without_screen,
)
from nonsmooth.errors import check_keys, unknown

_TABLES = {
    "identify": {
        "session": TEXT,
        "model": TEXT,
        "parameters": NAMES,
        "crank_length": LENGTH,
        "apparatus": QUANTITIES,
    },
    "output": dict.fromkeys(("data", "table", "figures", "format"), TEXT),
}
_FORMATS = ("pdf", "png", "svg")


@dataclass(frozen=True)
class _Study:
    """Contents of a study file, paths already relative to where the command runs."""

    session: Path
    model: Any = None
    parameters: tuple[str, ...] = ()
    crank_length: float | None = None
    apparatus: Mapping[str, Any] = field(default_factory=dict)
    data: Path | None = None
    table: Path | None = None
    figures: Path | None = None
    format: str = "pdf"


def add(commands: Any) -> None:
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
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from nonsmooth.studies import study as package

    rig = package("savi2007", "identification")
    study = _read(options.study)
    found = rig.identify(
        study.session,
        study.model,
        apparatus=study.apparatus,
        crank_length=study.crank_length if options.crank is None else options.crank,
    )
    rig.require(found, study.parameters)
    print(found)
    if not options.quiet:
        for finding in found.findings:
            print(f"\n{finding}")
        print()
        for name, sentence in found.identifiability.items():
            print(f"{name}: {sentence}")
    for path in _write(found, study, study.data if options.out is None else options.out):
        print(f"written to {path}")
    return said(found)


def said(found: Any) -> int:
    """The exit code of identified parameters: 0, or 3 where anomalies stand, each named on the error stream."""
    for sentence in found.anomalies:
        print(f"nonsmooth: anomaly: {sentence}", file=sys.stderr)
    return 3 if found.anomalies else 0


def _read(path: Path) -> _Study:
    from nonsmooth.recordings.session import NOTEBOOK

    if path.is_dir():
        if not (path / NOTEBOOK).is_file():
            raise ValueError(f"{path}: this folder has no {NOTEBOOK}; a session has one, beside its recordings")
        return _Study(path)
    if path.name == NOTEBOOK:
        return _Study(path.parent)
    document = read_tables(path, _TABLES, "study file or session folder", {"identify": ("session",)})
    return _study(path, document["identify"], document.get("output", {}))


def _study(path: Path, asked: Mapping[str, Any], output: Mapping[str, Any]) -> _Study:
    from nonsmooth.cli.study import load_model
    from nonsmooth.recordings.session import APPARATUS

    where, folder = f"{path}, table [identify]", path.parent
    session = folder / asked["session"]
    if not session.is_dir():
        raise ValueError(f"{where}: session = {asked['session']!r}: no such folder beside the study file ({session})")
    apparatus, crank, style = asked.get("apparatus", {}), asked.get("crank_length"), output.get("format", "pdf")
    check_keys(apparatus, APPARATUS, f"{where}, apparatus", "a key")
    if style not in _FORMATS:
        raise ValueError(f"{path}, table [output]: {unknown(style, 'a format', 'figures', _FORMATS)}")
    return _Study(
        session,
        load_model(asked["model"], folder) if "model" in asked else None,
        tuple(asked.get("parameters", [])),
        None if crank is None else float(crank),
        {
            name: (value.get("value"), value.get("uncertainty", 0.0)) if isinstance(value, dict) else value
            for name, value in apparatus.items()
        },
        **{key: folder / output[key] if key in output else None for key in ("data", "table", "figures")},
        format=style,
    )


def _write(found: Any, study: _Study, data: Path | None) -> list[Path]:
    written = []
    if data is not None:
        written.append(keep(found.to_dataset(), data))
    if study.table is not None:
        from nonsmooth.identification.report import report

        written.append(put_text(study.table, report(found)))
    if study.figures is not None:
        plot = without_screen()
        from matplotlib import pyplot as plt

        from nonsmooth.plot.identification.picture import pictures

        for name, ax in pictures(found):
            written.append(plot.save_figure(ax, with_folder(study.figures / f"{name}.{study.format}")))
            plt.close("all")
    return written
