"""``nonsmooth compare STUDY.toml`` or a session folder: measurements against a model, as numbers and as a picture."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Mapping
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
    return _run_study(_read(options.study), options.study.parent, options.quiet)


def _run_folder(options: argparse.Namespace) -> int:
    """Everything in a session that a model can be laid over: a response, a rise, and each section by itself."""
    from nonsmooth.recordings.session import load_session
    from nonsmooth.studies import study as package

    lab = package("savi2007", "comparison")

    here = Path()
    read = cache(load_session)  # each file once, however many runs of it are compared
    session = read(options.study.resolve())
    wanted: list[dict[str, Any]] = []
    for procedure in session.procedures:
        runs = [item for item in session.recordings(procedure) if "gap" in item.settings]
        if not runs or procedure not in lab.SHOWS:
            continue
        shown: list[dict[str, Any]] = [{}] if lab.SHOWS[procedure] != "motion" else [{"run": item.run} for item in runs]
        wanted += [{"session": str(options.study.resolve()), "procedure": procedure, **one} for one in shown]
    if not wanted:
        raise ValueError(
            f"{options.study}: has no run with the support mounted; it has: {', '.join(session.procedures)}"
        )
    study: dict[str, Any] = {"system": {"model": options.model}}
    if options.identified is not None:
        study["identified"] = {"data": str(options.identified.resolve())}
        if options.identified_from is not None:
            study["identified"]["session"] = str(options.identified_from.resolve())
    _, parameters = _theory(study, here)
    reference = lab.gap_reference(session, offset=_offset(study, parameters, session, here, read))
    for measured in wanted:
        whole = {**study, "measured": {**measured, "reference": reference}}
        _run_study(whole, here, options.quiet, keep=False, read=read)
    return 0


def _run_study(
    study: Mapping[str, Any], folder: Path, quiet: bool, keep: bool = True, read: Callable[[Path], Any] | None = None
) -> int:
    from nonsmooth.identification.compare import compare
    from nonsmooth.recordings.session import load_session
    from nonsmooth.studies import study as package

    system, parameters = _theory(study, folder)
    table = dict(study["measured"])
    read = read or load_session
    session = read(folder / table.pop("session"))
    procedure, runs = table.pop("procedure"), table.pop("run", None)
    k = float((parameters or system.values).get("k", system.values.get("k", 1.0)))
    if "gap_offset" not in table and "reference" not in table:
        table["gap_offset"] = _offset(study, parameters, session, folder, read)
    measured, settings = package("savi2007", "comparison").session_measurement(session, procedure, runs, k=k, **table)
    given = dict(study.get("compare", {}))
    settings |= given.pop("settings", {})
    if procedure == "rise":
        given.setdefault("parameter", "rho")
        given.setdefault("direction", "up")
    result = compare(measured, system, parameters=parameters, settings=settings, **given)
    output = study.get("output", {})
    written = write(result, output, folder, lambda plot: _draw(plot, result, output))
    if not quiet:
        print(_summary(result))
        for path in written:
            print(f"written to {path}")
        if keep and not written:
            print("nothing was kept: the file has no [output] with `data` or `figure`")
    return 0


def _offset(study: Mapping[str, Any], parameters: Any, session: Any, folder: Path, read: Callable[[Path], Any]) -> Any:
    """Identified gap less the screw's reading; 0 where the gap was not identified, or not from contact."""
    from nonsmooth.studies import study as package

    if "gap_at_rest" not in getattr(parameters, "extra", {}):
        return 0.0
    source = study["identified"].get("session")
    origin = session if source is None else read(folder / source)
    return package("savi2007", "comparison").gap_offset(parameters, origin) if origin.recordings("contact") else 0.0


def _read(path: Path) -> dict[str, Any]:
    from nonsmooth.identification.compare import compare

    ours = ("measured", "theory", "parameters", "options")
    allowed = [name for name in inspect.signature(compare).parameters if name not in ours]
    known = {**_TABLES, "compare": dict.fromkeys([*allowed, "method", "rtol", "atol"], Any)}
    document = read_tables(path, known, needed={"system": ("model",), "measured": ("session", "procedure")})
    if "data" not in document.get("identified", {"data": ""}):
        raise ValueError(f'{path}: table [identified] needs data = "..." (a file that `nonsmooth identify` wrote)')
    return document


def _theory(study: Mapping[str, Any], folder: Path) -> tuple[Any, Any]:
    from nonsmooth.identification.parameter_set import ParameterSet
    from nonsmooth.results.store import load

    found = study.get("identified")
    parameters = None if found is None else ParameterSet.from_dataset(load(folder / found["data"]))
    return system_of(study["system"], folder), parameters


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
            values = " ".join(_word(value) for value in array.values.ravel()) or "none"
            unit = array.attrs.get("units", "")
            lines.append(f"  {name:<28}{values}{f' {unit}' if unit not in ('', '1') else ''}")
    return "\n".join(lines)


def _word(value: Any) -> str:
    return str(value) if isinstance(value, str) else f"{float(value):.5g}"
