"""``nonsmooth show FILE``: what a saved result, a store of chunks or a recording holds."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonsmooth.cli.terminal import one_line, printable

if TYPE_CHECKING:
    import xarray as xr


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "show",
        help="show what a file holds",
        description="Show what a saved result (.nc, .zarr), a store of chunks or a recording (.csv, .cap, ...) holds.",
        epilog="examples:\n"
        "  nonsmooth show fig11.nc\n"
        "  nonsmooth show fig11.nc --text            # with the equations of the system\n"
        "  nonsmooth show springs.csv",
    )
    parser.add_argument("file", type=Path, help="a result saved by this package, or a recording")
    parser.add_argument("--text", action="store_true", help="show the whole text of the system too")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.results.store import load

    if (options.file / "run").is_dir():  # a store of chunks, finished or not
        print(progress_of(options.file))
        return 0
    if options.file.suffix == ".toml":
        raise ValueError(f"{options.file}: is a study file and no result; `nonsmooth run {options.file}` runs it")
    if options.file.suffix not in (".nc", ".zarr"):  # what an instrument wrote
        from nonsmooth.recordings.load import load_recording

        print(printable(repr(load_recording(options.file))))
        return 0
    result = load(options.file)
    print(summary(result))
    if options.text:
        system = read_provenance(result).get("system")
        text = system.get("text") if isinstance(system, dict) else None
        print(printable(text) if isinstance(text, str) else "(not made from a system)")
    return 0


def progress_of(path: Path) -> str:
    """Progress of a store of chunks, in a few lines."""
    from nonsmooth.campaign.store import describe_store

    record = describe_store(path)
    done, chunks = record["done"], record["chunks"]
    part, places = 100 * done / chunks, record["places"]
    whose = "a GPU" if record.get("device") == "cuda" else "one core"
    each = record["seconds"] / max(done, 1)
    left = f"about {each * (chunks - done):.3g} s of {whose}" if done else "unknown until a chunk is there"
    lines = [
        f"{one_line(record['verb'])}: {done} of {chunks} chunks are there ({part:.3g} %), {places} points",
        f"worked      {record['seconds']:.3g} s of {whose}, on a processor of type {one_line(record['cpu'], 80)}",
        f"remains     {left}" if done < chunks else "remains     nothing",
    ]
    if record["content"]:
        lines.append(f"content     sha256 {record['content'][:16]}; stores of equal results have the same")
    if record["started"] > done:
        lines.append(f"begun       {record['started']}: some chunks are under way, or were lost with their worker")
    return "\n".join(lines)


def summary(result: xr.Dataset) -> str:
    """A few lines: where the result comes from, its dims and variables, how its points ended."""
    from nonsmooth.results.provenance import read_provenance

    lines = _origin(read_provenance(result), result)
    lines.append("dims        " + ", ".join(f"{one_line(name)} {size}" for name, size in result.sizes.items()))
    for name, array in result.data_vars.items():
        dims = ", ".join(map(one_line, array.dims))
        unit = one_line(array.attrs.get("units", ""))
        what = one_line(array.attrs.get("long_name", ""), 80)
        lines.append(f"  {one_line(name)}({dims})  {what}{f' [{unit}]' if unit else ''}")
    if "status" in result:
        lines.append("status      " + _statuses(result))
    return "\n".join(lines)


def _origin(record: Mapping[str, Any], result: xr.Dataset) -> list[str]:
    """The system, its parameters and the options; what else the record holds, where it is not of a system."""
    system, options = record.get("system"), record.get("options")
    if not (isinstance(system, dict) and isinstance(system.get("parameters"), dict) and isinstance(options, dict)):
        return [f"{one_line(name):<12}{one_line(value)}" for name, value in record.items()]
    verb, version, method = (one_line(record.get(key)) for key in ("verb", "version", "method"))
    parameters = (
        f"{one_line(name)} = {'varied' if value is None or name in result.dims else _number(value)}"
        for name, value in system["parameters"].items()
    )
    return [
        f"{verb} of '{one_line(system.get('name'))}' (nonsmooth {version}, method {method})",
        "parameters  " + ", ".join(parameters),
        "options     " + ", ".join(f"{one_line(name)} = {one_line(value)}" for name, value in options.items()),
    ]


def _statuses(result: xr.Dataset) -> str:
    import numpy as np

    from nonsmooth.results.labels import BY_CODE

    codes, counts = np.unique(result["status"].values, return_counts=True)
    if result["status"].size == 1 and (status := BY_CODE.get(codes.tolist()[0])):
        return f"{status.name}: {status.sentence}"
    names = (BY_CODE[code].name if code in BY_CODE else f"{one_line(code)} (unknown)" for code in codes.tolist())
    return ", ".join(f"{name} {count}" for name, count in zip(names, counts, strict=True))


def _number(value: Any) -> str:
    try:
        return f"{float(value):.6g}"
    except (TypeError, ValueError, OverflowError):
        return one_line(value)
