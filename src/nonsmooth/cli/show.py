"""``nonsmooth show FILE``: what a saved result, a store of chunks or a recording holds."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["add", "progress_of", "summary"]


def add(commands: Any) -> None:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "show", help="show what a file holds",
        description="Show what a saved result (.nc, .zarr), a store of chunks or a recording (.csv, .cap, ...) holds.",
    )
    parser.add_argument("file", type=Path, help="a result saved by this package, or a recording")
    parser.add_argument("--text", action="store_true", help="show the whole text of the system too")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.results.store import load

    if (options.file / "run").is_dir():  # a store of chunks, finished or not
        print(progress_of(options.file))
        return 0
    if options.file.suffix not in (".nc", ".zarr"):  # what an instrument wrote
        from nonsmooth.experiment.load import load_recording

        print(load_recording(options.file))
        return 0
    result = load(options.file)
    print(summary(result))
    if options.text:
        print(read_provenance(result).get("system", {}).get("text", "(not made from a system)"))
    return 0


def progress_of(path: Path) -> str:
    """How far a store of chunks is."""
    from nonsmooth.campaign.store import describe_store

    record = describe_store(path)
    done, chunks = record["done"], record["chunks"]
    each = record["seconds"] / done if done else 0.0
    part, places = 100 * done / chunks, record["places"]
    whose = "a GPU" if record.get("device") == "cuda" else "one core"
    lines = [
        f"{record['verb']}: {done} of {chunks} chunks are there ({part:.3g} %), {places} points",
        f"worked      {record['seconds']:.3g} s of {whose}, on a processor of type {record['cpu']}",
        f"remains     about {each * (chunks - done):.3g} s of {whose}" if done < chunks else "remains     nothing",
    ]
    if record["started"] > done:
        lines.append(f"begun       {record['started']}: some chunks are under way, or were lost with their worker")
    return "\n".join(lines)


def summary(result: xr.Dataset) -> str:
    """A few lines: where the result comes from, its dims and variables, how its points ended."""
    from nonsmooth.results.provenance import read_provenance

    record = read_provenance(result)
    if "system" in record:
        system = record["system"]
        lines = [
            f"{record['verb']} of {system['name']!r} (nonsmooth {record['version']}, method {record['method']})",
            "parameters  " + ", ".join(
                f"{name} = {_number(None if name in result.dims else value)}"
                for name, value in system["parameters"].items()
            ),
            "options     " + ", ".join(f"{name} = {_short(value)}" for name, value in record["options"].items()),
        ]
    else:  # a recording: made from a file, not from a system
        lines = [f"{name:<12}{_short(value)}" for name, value in record.items()]
    lines.append("dims        " + ", ".join(f"{name} {size}" for name, size in result.sizes.items()))
    for name, array in result.data_vars.items():
        dims = ", ".join(map(str, array.dims))
        unit = array.attrs.get("units", "")
        lines.append(f"  {name}({dims})  {array.attrs.get('long_name', '')}{f' [{unit}]' if unit else ''}")
    if "status" in result:
        lines.append("status      " + _statuses(result))
    return "\n".join(lines)


def _statuses(result: xr.Dataset) -> str:
    from nonsmooth.results.statuses import by_code

    codes, counts = np.unique(result["status"].values, return_counts=True)
    if result["status"].size == 1:
        status = by_code(codes[0])
        return f"{status.name}: {status.sentence}"
    return ", ".join(f"{by_code(code).name} {count}" for code, count in zip(codes, counts, strict=True))


def _short(value: Any, limit: int = 40) -> str:
    if isinstance(value, list) and len(value) > 4:
        return f"[{value[0]} ... {value[-1]}] ({len(value)})"
    text = str(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _number(value: float | None) -> str:
    return "varied" if value is None else f"{float(value):.6g}"
