"""``nonsmooth compare STUDY.toml`` or a session folder: measurements against a model, as numbers and as a picture."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonsmooth.cli.files import TEXT, read_tables, write
from nonsmooth.cli.study import SYSTEM, system_of
from nonsmooth.errors import unknown

if TYPE_CHECKING:
    import xarray as xr

_TABLES: dict[str, Any] = {
    "system": SYSTEM,
    "identified": {"data": TEXT, "session": TEXT},
    "measured": {
        **dict.fromkeys(("session", "procedure"), TEXT),
        **dict.fromkeys(("run", "crank_force", "gap_offset", "referred"), Any),
    },
    "output": dict.fromkeys(("data", "figure", "picture", "x", "y"), TEXT),
}
#: Pictures by what is compared: the functions ``comparison_NAME`` of ``nonsmooth.plot``, the usual one first.
_PICTURES = {
    "motion": ("phase_portrait", "time", "section", "distances"),
    "response": ("response",),
    "diagram": ("diagram",),
}


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "compare",
        help="compare a measurement with a model",
        description="Lay a measurement of a session over a model, as the study file describes it: [system], "
        "[identified], [measured], [compare], [output]. Paths in the file are relative to the file.",
        epilog="examples:\n  nonsmooth compare compare.toml\n  nonsmooth compare session/ --identified parameters.nc",
    )
    parser.add_argument(
        "study",
        type=Path,
        metavar="STUDY.toml",
        help="the study file; or a session folder: all that it holds is compared, run by run, and no file is written",
    )
    parser.add_argument("--model", default="discontinuous_support", help="the model for a session folder")
    parser.add_argument("--identified", type=Path, metavar="FILE", help="identified parameters for a session folder")
    parser.add_argument(
        "--identified-from",
        type=Path,
        metavar="SESSION",
        help="the session that they were identified from: its screw readings tell the screw's zero",
    )
    parser.add_argument("--quiet", action="store_true", help="no summary")
    return parser


def run(options: argparse.Namespace) -> int:
    if options.study.is_dir():
        return _run_folder(options)
    if options.identified is not None or options.identified_from is not None:
        raise ValueError("--identified and --identified-from go with a session folder; a study file has [identified]")
    study = _read(options.study)
    _Theory(study, options.study.parent).compare(study["measured"], options.quiet)
    return 0


def _run_folder(options: argparse.Namespace) -> int:
    """Everything in a session that a model can be laid over: a response, a rise, and each section by itself."""
    from nonsmooth.studies import study as package

    lab = package("savi2007", "comparison")

    study: dict[str, Any] = {"system": {"model": options.model}}
    if options.identified is not None:
        study["identified"] = {"data": str(options.identified.resolve())}
        if options.identified_from is not None:
            study["identified"]["session"] = str(options.identified_from.resolve())
    theory, place = _Theory(study, Path()), str(options.study.resolve())
    session = theory.session(place)
    wanted: list[dict[str, Any]] = []
    for procedure in session.procedures:
        runs = [item for item in session.recordings(procedure) if "gap" in item.settings]
        if not runs or procedure not in lab.SHOWS:
            continue
        shown: list[dict[str, Any]] = [{}] if lab.SHOWS[procedure] != "motion" else [{"run": item.run} for item in runs]
        wanted += [{"session": place, "procedure": procedure, **one} for one in shown]
    if not wanted:
        raise ValueError(
            f"{options.study}: has no run with the support mounted; it has: {', '.join(session.procedures)}"
        )
    reference = lab.gap_reference(session, offset=theory.offset(session))
    for measured in wanted:
        theory.compare({**measured, "reference": reference}, options.quiet, keep=False)
    return 0


class _Theory:
    """The model of a study, at identified parameters where it has them; each session is read once."""

    def __init__(self, study: Mapping[str, Any], folder: Path) -> None:
        from nonsmooth.identification.parameter_set import ParameterSet
        from nonsmooth.recordings.session import load_session
        from nonsmooth.results.store import load

        self.study, self.folder = study, folder
        self.session = cache(lambda name: load_session(folder / name))
        found = study.get("identified")
        self.parameters = None if found is None else ParameterSet.from_dataset(load(folder / found["data"]))
        self.system = system_of(study["system"], folder)

    def offset(self, session: Any) -> Any:
        """Identified gap less the screw's reading; 0 where the gap was not identified, or not from contact."""
        from nonsmooth.studies import study as package

        if "gap_at_rest" not in getattr(self.parameters, "extra", {}):
            return 0.0
        source = self.study["identified"].get("session")
        origin = session if source is None else self.session(source)
        found = package("savi2007", "comparison").gap_offset
        return found(self.parameters, origin) if origin.recordings("contact") else 0.0

    def compare(self, asked: Mapping[str, Any], quiet: bool, keep: bool = True) -> None:
        """Lay a measurement over the model, as a table [measured] says; write and print what is asked for."""
        from nonsmooth.identification.compare import compare
        from nonsmooth.studies import study as package

        table, given = dict(asked), dict(self.study.get("compare", {}))
        session = self.session(table.pop("session"))
        procedure, runs = table.pop("procedure"), table.pop("run", None)
        k = float((self.parameters or self.system.values).get("k", self.system.values.get("k", 1.0)))
        if "gap_offset" not in table and "reference" not in table:
            table["gap_offset"] = self.offset(session)
        lab = package("savi2007", "comparison")
        measured, settings = lab.session_measurement(session, procedure, runs, k=k, **table)
        settings |= given.pop("settings", {})
        if procedure == "rise":
            given = {"parameter": "rho", "direction": "up", **given}
        result = compare(measured, self.system, parameters=self.parameters, settings=settings, **given)
        output = self.study.get("output", {})
        written = write(result, output, self.folder, lambda plot: _draw(plot, result, output))
        if not quiet:
            print(_summary(result))
            for path in written:
                print(f"written to {path}")
            if keep and not written:
                print("nothing was kept: the file has no [output] with `data` or `figure`")


def _read(path: Path) -> dict[str, Any]:
    from nonsmooth.identification.compare import compare

    ours = ("measured", "theory", "parameters", "options")
    allowed = [name for name in inspect.signature(compare).parameters if name not in ours]
    known = {**_TABLES, "compare": dict.fromkeys([*allowed, "method", "rtol", "atol"], Any)}
    document = read_tables(path, known, needed={"system": ("model",), "measured": ("session", "procedure")})
    if "data" not in document.get("identified", {"data": ""}):
        raise ValueError(f'{path}: table [identified] needs data = "..." (a file that `nonsmooth identify` wrote)')
    return document


def _draw(plot: Any, result: xr.Dataset, output: Mapping[str, str]) -> Any:
    kind = result.attrs["comparison"]
    wanted = output.get("picture", _PICTURES[kind][0])
    if wanted not in _PICTURES[kind]:
        raise ValueError(unknown(wanted, "a picture", f"a comparison of a {kind}", _PICTURES[kind]))
    draw = getattr(plot, f"comparison_{wanted}")
    axes = {key: output[key] for key in ("x", "y") if key in output and key in inspect.signature(draw).parameters}
    zone = {"zone": "g"} if wanted == "phase_portrait" and "g" in result.coords else {}
    return draw(result, **axes, **zone)


def _summary(result: xr.Dataset) -> str:
    """The numbers, one a line: those that are single, and small tables of jumps and flips."""
    label = " (synthetic)" if result.attrs["synthetic"] == "yes" else ""
    lines = [f"comparison of a {result.attrs['comparison']}: {result.attrs['title']}{label}"]
    for name, array in result.data_vars.items():
        small = array.ndim == 0 or (array.ndim == 1 and array.dims[0] in ("jump", "flip", "attractor", "state"))
        if small and name != "section_scale":
            values = (
                " ".join(value if isinstance(value, str) else f"{float(value):.5g}" for value in array.values.ravel())
                or "none"
            )
            unit = array.attrs.get("units", "")
            lines.append(f"  {name:<28}{values}{f' {unit}' if unit not in ('', '1') else ''}")
    return "\n".join(lines)
