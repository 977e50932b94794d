"""Study files: TOML that says which system, which verb with which options, and where the result goes.

``[system]`` names the model, its parameters and, with ``smoothed``, the band of the smoothed switch; the one table
named after a verb holds the verb's options; ``[output]`` says what to keep. Keys are strict: an unknown one is an
error that names the nearest, because a misspelt option that is silently ignored makes a wrong figure.
"""

from __future__ import annotations

import importlib.util
import inspect
import os
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonsmooth.cli.files import TEXT, read_tables, write
from nonsmooth.cli.verb_options import VERBS, options_of
from nonsmooth.errors import check_keys, shortened, unknown

if TYPE_CHECKING:
    import xarray as xr

SYSTEM = {"model": TEXT, "text": TEXT, "parameters": Any, "smoothed": Any}
_FORMATS = (".pdf", ".png", ".svg", ".eps", ".ps", ".pgf", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
#: Keys of the table [output], with the endings that a name may have.
OUTPUT = {"data": (".nc", ".zarr"), "figure": _FORMATS, "store": (".zarr",), "x": (), "y": ()}
_FIGURES = {
    "simulate": "phase_portrait",
    "sweep": "bifurcation",
    "frequency_response": "frequency_response",
    "poincare": "section",
    "chart": "chart",
    "basins": "basins",
    "basin_fractions": "basin_fractions",
}


@dataclass(frozen=True)
class Study:
    """A study file that has been read and checked."""

    path: Path
    system: Any
    verb: str
    options: Mapping[str, Any]
    output: Mapping[str, str] = field(default_factory=dict)

    def compute(self, *, progress: bool = False, store: Path | None = None, client: Any = None) -> xr.Dataset:
        """Call the verb.

        Parameters
        ----------
        store : path, optional
            Where finished chunks are kept.
        client : dask.distributed.Client, optional
            Computes the chunks.

        Raises
        ------
        ValueError
            A store or a client for a verb whose work is not cut into chunks.
        """
        import nonsmooth

        verb = getattr(nonsmooth, self.verb)
        given = {"progress": progress, "store": store, "client": client}
        known = inspect.signature(verb).parameters
        for name in ("store", "client"):
            if given[name] is not None and name not in known:
                what = "store" if name == "store" else "scheduler"
                raise ValueError(
                    f"{self.path}: {self.verb} is not cut into chunks and takes no {what}; "
                    "those that do: chart, basins, basin_fractions"
                )
        extra = {name: value for name, value in given.items() if name in known}
        result: xr.Dataset = verb(self.system, **self.options, **extra)
        return result

    @property
    def store(self) -> Path | None:
        """Folder for finished chunks, as ``[output]`` gives it."""
        return self.path.parent / self.output["store"] if "store" in self.output else None

    def write(self, result: xr.Dataset) -> list[Path]:
        """Save the data and draw the figure that ``[output]`` asks for; returns what was written."""
        axes = {axis: self.output[axis] for axis in ("x", "y") if axis in self.output}
        figure = _figure(self.verb, self.options)
        return write(
            result,
            self.output,
            self.path.parent,
            lambda plot: getattr(plot, figure)(result, **axes),
        )


def read_study(path: Path) -> Study:
    """Read and check a study file.

    Raises
    ------
    ValueError
        Not TOML, an unknown table or key, no verb or two, a value that cannot be read; the message names the
        file and the table.
    """
    known = {"system": SYSTEM, **dict.fromkeys(VERBS), "output": dict.fromkeys(OUTPUT, TEXT)}
    document = read_tables(path, known)
    where = str(path)
    verbs = [name for name in document if name in VERBS]
    if len(verbs) != 1:
        raise ValueError(
            f"{where}: a study runs exactly one verb, this one has {verbs or 'none'}; "
            f"keep one table of: {', '.join(VERBS)}"
        )
    output = document.get("output", {})
    _check_output(output, path)
    if len({"model", "text"} & document.get("system", {}).keys()) != 1:
        raise ValueError(
            f'{where}: needs a table [system] with model = "name" (see `nonsmooth models`), model = "file.py:object" '
            "or text = what System.to_text gave, one of them"
        )
    system = system_of(document["system"], path.parent)
    options = _options(verbs[0], document[verbs[0]], where)
    _check_axes(output, _figure(verbs[0], options), system, f"{where}, table [output]")
    return Study(path, system, verbs[0], options, output)


def named_model(name: str) -> Any:
    """The ready model of that name, with its published parameters."""
    from nonsmooth import models

    if name not in models.names():
        raise ValueError(unknown(name, "a model", "nonsmooth.models", models.names()))
    return getattr(models, name)()


def load_model(text: str, folder: Path) -> Any:
    """A system from ``"name"`` (of ``nonsmooth.models``) or ``"file.py:object"``, the file relative to ``folder``.

    The object is a ``System`` or a function without arguments that returns one. The file is executed.
    """
    from nonsmooth.system.system import System

    file, colon, name = text.rpartition(":")
    if not colon:
        return named_model(text)
    source = folder / file
    if not source.is_file():
        raise ValueError(f"{source}: no such file (asked for by model = {shortened(text)})")
    spec = importlib.util.spec_from_file_location(source.stem, source)
    if spec is None or spec.loader is None:
        raise ValueError(f"{source}: is not a Python file (model = {shortened(text)})")
    module = importlib.util.module_from_spec(spec)
    _told(source, partial(spec.loader.exec_module, module))
    if not hasattr(module, name):
        public = [one for one in vars(module) if not one.startswith("_")]
        raise ValueError(f"{source}: {unknown(name, 'an object', source.name, public)}")
    found = getattr(module, name)
    system = _told(source, found) if callable(found) and not isinstance(found, System) else found
    if not isinstance(system, System):
        what = type(system).__name__
        raise ValueError(f"{source}: {name!r} is of type {what}; it must be a System or a function that returns one")
    return system


def _told(source: Path, call: Callable[[], Any]) -> Any:
    """Turn an error of a user's file into one sentence with the line."""
    try:
        return call()
    except ValueError as error:  # the package's own sentences among them
        raise ValueError(f"{source}: {error}") from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if Path(frame.filename).resolve() == source.resolve()]
        what: object = error
        if isinstance(error, SyntaxError):
            lines, what = [error.lineno], error.msg
        where = f", line {lines[-1]}" if lines else ""
        raise ValueError(f"{source}{where}: {type(error).__name__}: {what}") from error


def _check_output(output: Mapping[str, Any], path: Path) -> None:
    """Refuse before the computation what would fail after it."""
    from nonsmooth.results.store import check_place, needs_zarr

    place = f"{path}, table [output]"
    for name, endings in OUTPUT.items():
        if name not in output or not endings:
            continue
        target = path.parent / output[name]
        if (target.suffix.lower() if name == "figure" else target.suffix) not in endings:
            raise ValueError(f"{place}: {name} = {output[name]!r} must end in {', '.join(endings)}")
        if target.suffix == ".zarr":
            needs_zarr(target)
        folder = next((one for one in target.parents if one.exists()), path.parent)
        if not (folder.is_dir() and os.access(folder, os.W_OK)):
            raise ValueError(f"{place}: {name} = {output[name]!r}: nothing may be written into {folder}")
        if name == "data" and target.exists():
            check_place(target)
        elif name == "figure" and target.is_dir():
            raise ValueError(f"{place}: {name} = {output[name]!r} is a folder; give another name")
    if "store" in output and len({(path.parent / output.get(key, "")).resolve() for key in ("store", "data")}) == 1:
        raise ValueError(
            f"{place}: data and store are both {output['data']!r}: the result would replace the chunks; give two names"
        )


def _figure(verb: str, options: Mapping[str, Any]) -> str:
    """The plot of a verb's result."""
    return "density" if verb == "sweep" and options.get("density") else _FIGURES[verb]


def _check_axes(output: Mapping[str, Any], figure: str, system: Any, place: str) -> None:
    """Refuse axes that the figure of this system cannot have."""
    if "figure" not in output:
        return
    from nonsmooth import plot

    taken = inspect.signature(getattr(plot, figure)).parameters
    states = list(system.states)
    known = [*states, *system.outputs, *system.memory, "mode"] if figure == "phase_portrait" else states
    for axis in ("x", "y"):
        if axis in output and axis not in taken:
            raise ValueError(f"{place}: {axis} = {output[axis]!r}: this figure has no such choice; take the line out")
        if axis in output and output[axis] not in known:
            raise ValueError(f"{place}: {axis} = {output[axis]!r} is not in the result; there are: {', '.join(known)}")
    if "x" in taken and len(states) < 2:
        raise ValueError(f"{place}: the figure is of two states, and the system has one ({states[0]}); take it out")


def system_of(table: Mapping[str, Any], folder: Path) -> Any:
    """The system of a table [system], its file relative to ``folder``; one in text is data, and nothing is executed."""
    from nonsmooth.system.system import System

    system = System.from_text(table["text"]) if "text" in table else load_model(table["model"], folder)
    if "parameters" in table:
        system = system.with_parameters(table["parameters"])
    return system.smoothed(table["smoothed"]) if "smoothed" in table else system


def _options(verb: str, table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The keys of a verb's table, checked against the verb's own arguments and read."""
    known = options_of(verb)
    place = f"{where}, table [{verb}]"
    check_keys(table, known, place, "a key")
    missing = [name for name, option in known.items() if option.required and name not in table]
    if missing:
        raise ValueError(f"{place}: needs {', '.join(missing)}; all keys: {', '.join(known)}")
    readers = {"values": _values, "grid": _grid, "section": _section, "start": _start}
    found = {name: readers[name](value, place) if name in readers else value for name, value in table.items()}
    # TOML has no None: every point from its start is written "none", as results store it
    return found | ({"direction": None} if found.get("direction") == "none" else {})


def _values(value: Any, place: str) -> Any:
    import numpy as np

    from nonsmooth.results.memory import room_for
    from nonsmooth.system.kinds import float_array, real_number, whole_number

    if isinstance(value, dict):
        check_keys(value, ("from", "to", "n"), f"{place}, values", "a key")
        if set(value) == {"from", "to", "n"}:
            low, high = (real_number(value[key], f"{place}, values: {key}") for key in ("from", "to"))
            n = whole_number(value["n"], f"{place}, values: n", 1)
            room_for(8.0 * n, f"{place}, values: a list of n = {n:.6g} numbers", "take fewer")
            return np.linspace(low, high, n)
    elif isinstance(value, list):
        return float_array(value, f"{place}: values")
    raise ValueError(f"{place}: values is {shortened(value)}; give a list or {{ from = ..., to = ..., n = ... }}")


def _grid(value: Any, place: str) -> Any:
    if not isinstance(value, dict):
        raise ValueError(f"{place}: grid is {shortened(value)}; give {{ name = VALUES, other = VALUES }}")
    return {name: _values(values, f"{place}, grid, {name}") for name, values in value.items()}


def _section(value: Any, place: str) -> Any:
    import nonsmooth

    if not isinstance(value, dict):
        form = '{ phase = 0.25 } or { indicator = "name" }'
        raise ValueError(f"{place}: section is {shortened(value)}; give {form}")
    kind = nonsmooth.Poincare if "indicator" in value else nonsmooth.Stroboscopic
    check_keys(value, list(inspect.signature(kind).parameters), f"{place}, section", "a key")
    return kind(**value)


def _start(value: Any, place: str) -> Any:
    import nonsmooth

    if isinstance(value, dict) and "seed" in value:
        check_keys(value, ("n", "low", "high", "seed"), f"{place}, start", "a key")
        return nonsmooth.random_starts(**value)
    return value
