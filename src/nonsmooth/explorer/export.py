"""Files of what a page shows: figures by ``nonsmooth.plot``, data, and the script or study file that makes them.

And back: the first view of a page that opens on a study file or a result. Scripts are written from the record that a
result carries, not from the page: what they compute is what was shown.
"""

from __future__ import annotations

import inspect
import json
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.catalogue import GIVEN, first_state
from nonsmooth.explorer.kinds import KINDS as VIEWS
from nonsmooth.explorer.state import changed, to_query, within
from nonsmooth.results.provenance import read_provenance

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System


def opened_study(system: System, options: Mapping[str, Any], output: Mapping[str, str]) -> tuple[System | None, str]:
    """The system of a study and the query of its view; no system where it is one of ``nonsmooth.models``."""
    name, states = _name_of(system), list(system.states)
    state = first_state(name, system)
    for parameter, values in _ranges(options):
        low, high = float(np.min(values, initial=np.inf)), float(np.max(values, initial=-np.inf))
        if parameter in state.values and low < high:
            state = replace(state, over=parameter, low=low, high=high)
            break
    section, start = options.get("section"), options.get("start")
    if isinstance(start, Mapping):
        start = [start.get(one, 0.0) for one in states] if set(start) <= set(states) else None
    found: dict[str, Any] = {field: options.get(field) for field in ("direction", "method")} | {"start": start}
    found |= {
        field: within(field, options[field]) for field in ("transient", "keep") if isinstance(options.get(field), int)
    }
    found["phase"] = section.get("phase") if isinstance(section, Mapping) else getattr(section, "phase", None)
    plane = {"x", "y"} <= output.keys()
    found |= {field if plane else "shown": chosen for field, chosen in output.items() if field in ("x", "y")}
    for field, value in found.items():
        with suppress(ValueError, TypeError):  # what no page shows stays as it is
            state = changed(state, field, value, states)
    return (None if name != GIVEN else system), to_query(state)


def opened_result(result: xr.Dataset) -> tuple[System | None, str]:
    """The system of a result and the query of its view; no system where it is one of ``nonsmooth.models``.

    ValueError: a Dataset that was not made from a system."""
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.system.origin import system_of

    system, options = system_of(result), dict(read_provenance(result).get("options", {}))
    for name in system.parameters:
        if name in result.dims:
            options |= {"parameter": name, "values": result[name].values}
            break
    return opened_study(system, options, {})


def _ranges(options: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Parameters that a verb varies, with their values or their range."""
    grid = options.get("grid")
    pairs = list(grid.items()) if isinstance(grid, Mapping) else []
    values = options.get("values", options.get("range"))
    if isinstance(values, np.ndarray | list | tuple):
        pairs.insert(0, (str(options.get("parameter", "omega")), values))
    return [(name, one) for name, one in pairs if isinstance(one, np.ndarray | list | tuple)]


def _name_of(system: System) -> str:
    """The model of the gallery that this system is, at any values of its parameters."""
    from nonsmooth import models

    name = system.name.replace(" ", "_")
    if name in models.names():
        model = getattr(models, name)()
        if list(model.parameters) == list(system.parameters) and model.with_parameters(system.values) == system:
            return name
    return GIVEN


#: Kinds of files.
KINDS = {
    "pdf": "PDF",
    "png": "PNG",
    "svg": "SVG",
    "nc": "NetCDF",
    "py": "Python script",
    "toml": "study file",
    "gif": "GIF, moving",
    "html": "HTML, moving",
}


def exported(view: str, kind: str, results: Mapping[str, Any], state: Any) -> tuple[str, bytes]:
    """The name and the bytes of a file.

    ValueError: a view that is not computed yet, a kind that does not exist or that the view has not."""
    known = {name: one for name, one in VIEWS.items() if one.saved is not None}
    if view not in known or kind not in KINDS:
        raise ValueError(f"{view!r} cannot be saved as {kind!r}; views: {', '.join(known)}; kinds: {', '.join(KINDS)}")
    key, plot = known[view].saved or ("", "")
    result = results.get(key)
    if result is None or (view == "diagram" and "period_number" not in result):
        raise ValueError(f"the view {view!r} has no result to save yet; show it, and wait until it is computed")
    moves = kind in ("gif", "html")
    if moves and key != "run":
        of = " and ".join(repr(one.title) for one in known.values() if one.saved and one.saved[0] == "run")
        raise ValueError(f"{kind}: a motion moves, and {view!r} shows many; choose {of} under Save")
    axes = {name: getattr(state, field) for name, field in known[view].axes.items()}
    stem = f"{state.model}_{view}"
    if kind == "py":
        return f"{stem}.py", python_of(result, plot, axes, state.model, stem).encode()
    if kind == "toml":
        return f"{stem}.toml", study_of(result, axes, state.model, stem).encode()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{stem}.{kind}"
        if kind == "nc":
            ns.save(result, path)
        elif moves:
            ns.animate(result, x=state.x, y=state.y, seconds=4.0, rate=15).save(path)
        else:
            import matplotlib.pyplot as plt

            ax = getattr(ns.plot, plot)(result, **axes)
            ns.plot.save_figure(ax, path)
            plt.close(ax.figure)
        return path.name, path.read_bytes()


def python_of(result: Any, plot: str, axes: Mapping[str, str], model: str, stem: str) -> str:
    """A script that computes a result, saves it and draws its figure."""
    record, system, values = _origin(result)
    options, verb = _options(record, result), record["verb"]
    names = ("grid", "values", "range") if verb == "frequency_response" else ("grid", "parameter", "values", "range")
    given = ["system", *(_python(options.pop(name)) for name in names if name in options)]
    given += [f"{name}={_python(value)}" for name, value in options.items()]
    marks = ", ".join(f"{name}={value!r}" for name, value in axes.items())
    text, made, band = f"TEXT = {record['system']['text']!r}\n\n", "ns.System.from_text(TEXT)", ""
    if model in ns.models.names():
        text, made = "", f"ns.models.{model}()"
        band = f".smoothed({system.eta!r})" if system.is_smoothed else ""
    return (
        f'"""{verb} of {json.dumps(system.name)[1:-1]}, as the explorer showed it."""\n\n'
        "import numpy as np\n\nimport nonsmooth as ns\n\n"
        f"{text}system = {made}.with_parameters({_python(values)}){band}\nresult = ns.{verb}({', '.join(given)})\n"
        f'ns.save(result, "{stem}.nc")\nns.plot.save_figure(ns.plot.{plot}(result, {marks}), "{stem}.pdf")\n'
    )


def study_of(result: Any, axes: Mapping[str, str], model: str, stem: str) -> str:
    """A study file for ``nonsmooth run``."""
    record, system, values = _origin(result)
    verb = record["verb"]
    if verb in ("bifurcation_diagram", "amplitude_spectrum"):
        raise ValueError(f"{verb} has no table in a study file; save the Python script instead")
    made = {"model": model} if model in ns.models.names() else {"text": record["system"]["text"]}
    tables: dict[str, Mapping[str, Any]] = {
        "system": {**made, "parameters": values, **({"smoothed": system.eta} if system.is_smoothed else {})},
        verb: _options(record, result),
        "output": {"data": f"{stem}.nc", "figure": f"{stem}.pdf"},
    }
    if verb != "simulate" or axes.keys() >= {"x", "y"}:
        tables["output"] = {**tables["output"], **axes}
    lines = [
        [f"[{name}]", *(f"{key} = {as_toml(one, key)}" for key, one in of.items()), ""] for name, of in tables.items()
    ]
    return "\n".join(line for block in lines for line in block)


def _origin(result: Any) -> tuple[dict[str, Any], Any, dict[str, float]]:
    """The record of a result, its system, and the parameters that the verb was given."""
    record, system = read_provenance(result), ns.system_of(result)
    names = (name for name in system.parameters if name != "eta" or not system.is_smoothed)
    values = {name: float(record["system"]["parameters"][name] or system.values[name]) for name in names}
    return record, system, values


def _options(record: Mapping[str, Any], result: Any) -> dict[str, Any]:
    """The options of the verb that are not at their defaults; values of a parameter as an array."""
    defaults = inspect.signature(getattr(ns, record["verb"])).parameters
    found = {
        name: value
        for name, value in record["options"].items()
        if name not in defaults or value != defaults[name].default
    }
    if "values" in found:
        found["values"] = result[record["options"]["parameter"]].values
    if "grid" in found:
        found["grid"] = {name: result[name].values for name in found["grid"]}
    return found


def _even(values: Any) -> tuple[float, float, int] | None:
    """Ends and number of equidistant values; None where they are not."""
    ends = float(values[0]), float(values[-1]), len(values)
    return ends if np.array_equal(np.linspace(*ends), values) else None


def _python(value: Any) -> str:
    if isinstance(value, np.ndarray):
        ends = _even(value)
        return repr(value.tolist()) if ends is None else f"np.linspace({ends[0]!r}, {ends[1]!r}, {ends[2]})"
    if isinstance(value, Mapping) and "type" in value:
        kind = getattr(ns, value["type"])
        known = inspect.signature(kind).parameters
        given = [f"{k}={v!r}" for k, v in value.items() if k in known and v != known[k].default]
        return f"ns.{value['type']}({', '.join(given)})"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k!r}: {_python(v)}" for k, v in value.items()) + "}"
    return repr(value)


def as_toml(value: Any, name: str = "") -> str:
    """Plain data as TOML on one line; ``name`` is that of an option of a verb."""
    if isinstance(value, np.ndarray):
        ends = _even(value)
        return as_toml(value.tolist() if ends is None else dict(zip(("from", "to", "n"), ends, strict=True)))
    if isinstance(value, Mapping):
        pairs = ", ".join(
            f"{k if k.isascii() else as_toml(k)} = {as_toml(v)}"
            for k, v in value.items()
            if k != "type" and v is not None
        )
        return f"{{ {pairs} }}" if pairs else "{}"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if value is None and name == "direction":
        return '"none"'
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
