"""``nonsmooth show FILE``: what a saved result holds."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["add", "summary"]


def add(commands: Any) -> None:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "show", help="show what a saved result holds", description="Show what a saved result (.nc, .zarr) holds."
    )
    parser.add_argument("file", type=Path, help="a result saved by this package")
    parser.add_argument("--text", action="store_true", help="show the whole text of the system too")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.results.store import load

    result = load(options.file)
    print(summary(result))
    if options.text:
        print(read_provenance(result).get("system", {}).get("text", "(not made from a system)"))
    return 0


def summary(result: xr.Dataset) -> str:
    """A few lines: where the result comes from, its dims and variables, how its points ended."""
    from nonsmooth.results.provenance import read_provenance

    record = read_provenance(result)
    if "system" in record:
        system = record["system"]
        lines = [
            f"{record['verb']} of {system['name']!r} (nonsmooth {record['version']}, method {record['method']})",
            "parameters  " + ", ".join(f"{name} = {_number(value)}" for name, value in system["parameters"].items()),
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
