"""``nonsmooth compare STUDY.toml``: a measurement of a session against a model, as numbers and as a picture."""

from __future__ import annotations

import argparse
import inspect
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonsmooth.system.names import unknown

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["add"]

_TABLES = ("system", "identified", "measured", "compare", "output")
_KEYS = {
    "system": ("model", "parameters", "smoothed"), "identified": ("data",),
    "measured": ("session", "procedure", "run", "crank_force", "gap_offset", "referred"),
    "output": ("data", "figure", "picture", "x", "y"),
}  # fmt: skip
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
    )
    parser.add_argument("study", type=Path, metavar="STUDY.toml", help="the study file")
    parser.add_argument("--quiet", action="store_true", help="no summary")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from nonsmooth.experiment.session import load_session
    from nonsmooth.identification.compare import compare, session_measurement

    study = _read(options.study)
    folder = options.study.parent
    system, parameters = _theory(study, folder)
    table = dict(study["measured"])
    session = load_session(folder / table.pop("session"))
    procedure, runs = table.pop("procedure"), table.pop("run", None)
    k = float((parameters or system.values).get("k", system.values.get("k", 1.0)))
    if "gap_offset" not in table and "gap_at_rest" in getattr(parameters, "extra", {}):
        table["gap_offset"] = _offset(parameters, session)
    measured, settings = session_measurement(session, procedure, runs, k=k, **table)
    given = dict(study.get("compare", {}))
    settings |= given.pop("settings", {})
    if procedure == "rise":
        given.setdefault("parameter", "rho")
        given.setdefault("direction", "up")
    result = compare(measured, system, parameters=parameters, settings=settings, **given)
    written = _write(result, study.get("output", {}), folder)
    if not options.quiet:
        print(_summary(result))
        for path in written:
            print(f"written to {path}")
        if not written:
            print("nothing was kept: the file has no [output] with `data` or `figure`")
    return 0


def _offset(parameters: Any, session: Any) -> float:
    """What the gap identified from the runs with contact is more than the screw read in them; 0 without such runs."""
    readings = {run.settings["gap"] for run in session.recordings("contact")}
    return float(parameters.extra["gap_at_rest"]) - readings.pop() if len(readings) == 1 else 0.0


def _read(path: Path) -> dict[str, Any]:
    from nonsmooth.identification.compare import compare

    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(f"{path}: no such study file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is not a TOML file: {error}") from None
    _check(document, _TABLES, str(path), "a table")
    ours = ("measured", "theory", "parameters")
    allowed = [name for name in inspect.signature(compare).parameters if name not in ours]
    for name, table in document.items():
        if not isinstance(table, dict):
            raise ValueError(f"{path}: `{name}` must be a table: write [{name}] and its keys below it")
        keys = [*(key for key in allowed if key != "options"), "method", "rtol", "atol"]
        _check(table, keys if name == "compare" else _KEYS[name], f"{path}, table [{name}]", "a key")
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
        from nonsmooth.results.store import save

        written.append(save(result, _with_folder(folder / output["data"])))
    if "figure" in output:
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
        written.append(plot.save_figure(draw(result, **axes, **zone), _with_folder(folder / output["figure"])))
    return written


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


def _check(table: Mapping[str, Any], allowed: Iterable[str], where: str, what: str) -> None:
    known = list(allowed)
    for key in table:
        if key not in known:
            raise ValueError(f"{where}: {unknown(key, what, 'this place', known)}")


def _with_folder(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
