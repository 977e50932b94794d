"""``nonsmooth compare STUDY.toml`` or a session folder: measurements against a model, as numbers and as a picture."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonsmooth.cli.keep import keep, kept_whatever_comes
from nonsmooth.cli.tables import read_tables, with_folder
from nonsmooth.errors import shortened
from nonsmooth.system.names import check_keys, unknown

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["add"]

_TABLES = ("system", "identified", "measured", "compare", "output")
_KEYS = {
    "system": ("model", "parameters", "smoothed"), "identified": ("data", "session"),
    "measured": ("session", "procedure", "run", "crank_force", "gap_offset", "referred"),
    "output": ("data", "figure", "picture", "x", "y"),
}  # fmt: skip
_TEXTS = ("model", "session", "procedure", *_KEYS["output"])
_PICTURES = {
    "motion": {
        "phase_portrait": "comparison_phase_portrait", "time": "comparison_time", "section": "comparison_section",
        "distances": "comparison_distances",
    },
    "response": {"response": "comparison_response"}, "diagram": {"diagram": "comparison_diagram"},
}  # fmt: skip


def add(commands: Any) -> None:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "compare",
        help="compare a measurement with a model",
        description="Lay a measurement of a session over a model, as the study file describes it: [system], "
        "[identified], [measured], [compare], [output]. Paths in the file are relative to the file.",
        epilog="examples:\n  nonsmooth compare compare.toml\n  nonsmooth compare session/ --identified parameters.nc",
    )
    parser.add_argument(
        "study", type=Path, metavar="STUDY.toml",
        help="the study file; or a session folder: all that it holds is compared, run by run, and no file is written",
    )  # fmt: skip
    parser.add_argument("--model", default="discontinuous_support", help="the model for a session folder")
    parser.add_argument("--identified", type=Path, metavar="FILE", help="identified parameters for a session folder")
    parser.add_argument(
        "--identified-from", type=Path, metavar="SESSION",
        help="the session that they were identified from: its screw readings tell the screw's zero",
    )  # fmt: skip
    parser.add_argument("--quiet", action="store_true", help="no summary")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.study.is_dir():
        return _run_folder(options)
    if options.identified is not None or options.identified_from is not None:
        raise ValueError("--identified and --identified-from go with a session folder; a study file has [identified]")
    return _run_study(_read(options.study), options.study.parent, options.quiet)


def _run_folder(options: argparse.Namespace) -> int:
    """Everything in a session that a model can be laid over: a response, a rise, and each section by itself."""
    from nonsmooth.recordings.session import load_session
    from nonsmooth.studies.savi2007.comparison import gap_reference
    from nonsmooth.studies.savi2007.comparison.notebook import SHOWS

    here = Path()
    read = cache(load_session)  # each file once, however many runs of it are compared
    session = read(options.study.resolve())
    wanted: list[dict[str, Any]] = []
    for procedure in session.procedures:
        runs = [item for item in session.recordings(procedure) if "gap" in item.settings]
        if not runs or procedure not in SHOWS:
            continue
        shown: list[dict[str, Any]] = [{}] if SHOWS[procedure] != "motion" else [{"run": item.run} for item in runs]
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
    reference = gap_reference(session, offset=_offset(study, parameters, session, here, read))
    for measured in wanted:
        whole = {**study, "measured": {**measured, "reference": reference}}
        _run_study(whole, here, options.quiet, keep=False, read=read)
    return 0


def _run_study(
    study: Mapping[str, Any], folder: Path, quiet: bool, keep: bool = True, read: Callable[[Path], Any] | None = None
) -> int:
    from nonsmooth.identification.compare import compare
    from nonsmooth.recordings.session import load_session
    from nonsmooth.studies.savi2007.comparison import session_measurement

    system, parameters = _theory(study, folder)
    table = dict(study["measured"])
    read = read or load_session
    session = read(folder / table.pop("session"))
    procedure, runs = table.pop("procedure"), table.pop("run", None)
    k = float((parameters or system.values).get("k", system.values.get("k", 1.0)))
    if "gap_offset" not in table and "reference" not in table:
        table["gap_offset"] = _offset(study, parameters, session, folder, read)
    measured, settings = session_measurement(session, procedure, runs, k=k, **table)
    given = dict(study.get("compare", {}))
    settings |= given.pop("settings", {})
    if procedure == "rise":
        given.setdefault("parameter", "rho")
        given.setdefault("direction", "up")
    result = compare(measured, system, parameters=parameters, settings=settings, **given)
    written = _write(result, study.get("output", {}), folder)
    if not quiet:
        print(_summary(result))
        for path in written:
            print(f"written to {path}")
        if keep and not written:
            print("nothing was kept: the file has no [output] with `data` or `figure`")
    return 0


def _offset(study: Mapping[str, Any], parameters: Any, session: Any, folder: Path, read: Callable[[Path], Any]) -> Any:
    """Identified gap less the screw's reading; 0 where the gap was not identified, or not from contact."""
    from nonsmooth.studies.savi2007.comparison import gap_offset

    if "gap_at_rest" not in getattr(parameters, "extra", {}):
        return 0.0
    source = study["identified"].get("session")
    origin = session if source is None else read(folder / source)
    return gap_offset(parameters, origin) if origin.recordings("contact") else 0.0


def _read(path: Path) -> dict[str, Any]:
    from nonsmooth.identification.compare import compare

    document = read_tables(path, _TABLES)
    ours = ("measured", "theory", "parameters")
    allowed = [name for name in inspect.signature(compare).parameters if name not in ours]
    for name, table in document.items():
        keys = [*(key for key in allowed if key != "options"), "method", "rtol", "atol"]
        check_keys(table, keys if name == "compare" else _KEYS[name], f"{path}, table [{name}]", "a key")
        for key in _TEXTS if name != "compare" else ():
            if key in table and not isinstance(table[key], str):
                raise ValueError(f"{path}, table [{name}]: {key} = {shortened(table[key])} must be a text")
    for name, needed in (("system", ("model",)), ("measured", ("session", "procedure"))):
        if missing := [key for key in needed if key not in document.get(name, {})]:
            raise ValueError(f"{path}: table [{name}] needs {', '.join(missing)}")
    if "identified" in document and "data" not in document["identified"]:
        raise ValueError(f'{path}: table [identified] needs data = "..." (a file that `nonsmooth identify` wrote)')
    return document


def _theory(study: Mapping[str, Any], folder: Path) -> tuple[Any, Any]:
    from nonsmooth.cli.study import load_model
    from nonsmooth.results.store import load

    table = study["system"]
    system = load_model(table["model"], folder)
    if "parameters" in table:
        system = system.with_parameters(table["parameters"])
    if "smoothed" in table:
        system = system.smoothed(table["smoothed"])
    if "identified" not in study:
        return system, None
    from nonsmooth.identification.parameter_set import ParameterSet

    return system, ParameterSet.from_dataset(load(folder / study["identified"]["data"]))


def _write(result: xr.Dataset, output: Mapping[str, str], folder: Path) -> list[Path]:
    written = []
    if "data" in output:
        written.append(keep(result, folder / output["data"]))
    if "figure" in output:
        with kept_whatever_comes(result, written, folder / "comparison.nc"):
            written.append(_draw(result, output, folder / output["figure"]))
    return written


def _draw(result: xr.Dataset, output: Mapping[str, str], path: Path) -> Path:
    import matplotlib as mpl

    mpl.use("Agg")
    from nonsmooth import plot
    from nonsmooth.plot import comparison_diagram, comparison_motion, comparison_response

    pictures = _PICTURES[result.attrs["comparison"]]
    wanted = output.get("picture", next(iter(pictures)))
    if wanted not in pictures:
        raise ValueError(unknown(wanted, "a picture", f"a comparison of a {result.attrs['comparison']}", pictures))
    module = {"motion": comparison_motion, "response": comparison_response, "diagram": comparison_diagram}
    draw = getattr(module[result.attrs["comparison"]], pictures[wanted])
    axes = {key: output[key] for key in ("x", "y") if key in output and key in inspect.signature(draw).parameters}
    zone = {"zone": "g"} if wanted == "phase_portrait" and "g" in result.coords else {}
    return plot.save_figure(draw(result, **axes, **zone), with_folder(path))


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
