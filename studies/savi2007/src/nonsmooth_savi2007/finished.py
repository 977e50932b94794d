"""Figures that are finished in a folder: a run that was interrupted, or is repeated, goes on from them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TypeAlias

import xarray as xr

import nonsmooth
from nonsmooth import DataFileError, load, save
from nonsmooth_savi2007.flows import Settings

#: The datasets of a figure by key, and the seconds that they took.
Made: TypeAlias = "tuple[dict[str, xr.Dataset], float]"


def finish(name: str, data: Mapping[str, xr.Dataset], seconds: float, settings: Settings) -> None:
    """Write the datasets of a figure, and last the record that it is finished."""

    folder = settings.place
    record = folder / f"{name}.json"
    record.unlink(missing_ok=True)
    for key, dataset in data.items():
        save(dataset, folder / f"{name}_{key}.nc")
    words = {"made_by": _made_by(settings), "datasets": list(data), "seconds": seconds}
    record.write_text(json.dumps(words) + "\n", encoding="utf-8")


def finished(name: str, settings: Settings) -> Made | None:
    """Read what :func:`finish` wrote with the same sources and settings; None where that is not there, or damaged.

    Raises
    ------
    ValueError
        If it is of a quick run and this one is not, or the reverse.
    """
    folder = settings.place
    try:
        record = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        made_by, keys, seconds = dict(record["made_by"]), list(record["datasets"]), float(record["seconds"])
        quick = bool(made_by["quick"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if quick != settings.quick:
        raise ValueError(
            f"{folder} holds figures of a {'quick' if quick else 'whole'} run, and would mix the two: give another "
            "folder (--out)"
        )
    wanted = _made_by(settings)
    return _loaded(folder, name, keys, seconds) if made_by in (wanted, wanted | {"full": True}) else None


def just_made(name: str, settings: Settings) -> Made:
    """Read what another process of this run has finished, even if the sources have been changed meanwhile.

    Raises
    ------
    RuntimeError
        If it is not there, or damaged.
    """
    folder = settings.place
    record = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    found = _loaded(folder, name, record["datasets"], record["seconds"])
    if found is None:
        raise RuntimeError(f"{folder}: datasets of {name} are not there, or damaged, although it was measured")
    return found


def _loaded(folder: Path, name: str, keys: Sequence[str], seconds: float) -> Made | None:

    try:
        return {key: load(folder / f"{name}_{key}.nc") for key in keys}, seconds
    except (OSError, DataFileError):
        return None


def _made_by(settings: Settings) -> dict[str, str | bool]:
    """Identity of a figure: the sources of both packages, and how much work was asked for."""
    return {"sources": _sources(), "quick": settings.quick, "full": settings.full}


@cache
def _sources() -> str:
    """A hash of all sources of the toolbox and of this study."""

    digest = hashlib.sha256()
    for room in (Path(nonsmooth.__file__).parent, Path(__file__).parent):
        for file in sorted(room.rglob("*.py")):
            digest.update(f"{file.relative_to(room)}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def refuse_strange(folder: Path, names: Collection[str]) -> None:
    """Refuse a folder that holds files, none of them of this study.

    Raises
    ------
    ValueError
        If it is such a folder.
    """
    there = [path.name for path in folder.iterdir()]
    ours = {"rig", "claims.json", *(f"{name}.json" for name in names), *(f"{name}.png" for name in names)}
    if there and not ours.intersection(there):
        raise ValueError(
            f"{folder} holds other files ({', '.join(sorted(there)[:3])}{', ...' if len(there) > 3 else ''}), which a "
            "reproduction might replace: give a new or an empty folder (--out)"
        )
