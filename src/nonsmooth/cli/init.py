"""``nonsmooth init MODEL``: a study file that runs as it is, with every option of its verb as a comment."""

from __future__ import annotations

import argparse
import json
import os
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nonsmooth.cli.files import put_text
from nonsmooth.cli.verb_options import VERBS, Option, options_of

_WIDTH = 100


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "init",
        help="write a study file to begin with",
        description="Write a study file for a model: it runs as it is, and holds every option of the verb as a comment "
        "with its default. An existing file is left alone.",
        epilog="examples:\n"
        "  nonsmooth init discontinuous_support\n"
        "  nonsmooth init impact_oscillator --verb sweep --out stop.toml\n"
        "  nonsmooth init my_oscillator.py:oscillator --verb basins",
    )
    parser.add_argument("model", metavar="MODEL", help='a name of `nonsmooth models`, or "file.py:object"')
    parser.add_argument("--verb", choices=VERBS, default="simulate", help="what to compute (default: simulate)")
    parser.add_argument("--out", type=Path, metavar="STUDY.toml", help="the file (default: MODEL_VERB.toml)")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.cli.study import load_model

    system = load_model(options.model, Path())
    file, colon, name = options.model.rpartition(":")
    out = options.out or Path(f"{name}_{options.verb}.toml")
    if out.exists():
        raise ValueError(f"{out}: is there already and was left alone; give another name with --out")
    model = name if not colon else f"{Path(os.path.relpath(file, out.parent or Path())).as_posix()}:{name}"
    put_text(out, study_text(system, model, options.verb, out.stem))
    print(f"written to {out}; run it with: nonsmooth run {out}")
    return 0


def study_text(system: Any, model: str, verb: str, stem: str) -> str:
    """Return a study file for a model, named as study files name it, that writes ``stem.nc`` and ``stem.pdf``."""
    from nonsmooth.explorer.export import as_toml

    known = options_of(verb)
    set_here = _settings(system, verb) | _start(system)
    set_here = {name: value for name, value in set_here.items() if name in known}
    values = {name: parameter.value for name, parameter in system.parameters.items() if name in system.values}
    lines = [
        f"# A study of {json.dumps(system.name, ensure_ascii=False)}. Run it:  nonsmooth run {stem}.toml",
        "# What is a comment here is at its default. Editors check and complete this file after",
        "#     nonsmooth schema --out study.schema.json",
        "# with this as the first line:  #:schema ./study.schema.json",
        "",
        "[system]",
        f"model = {as_toml(model)}",
        "# Parameters, where they are to differ from the model's own values, which are",
        f"# parameters = {as_toml({name: value for name, value in values.items() if name != 'eta'})}",
        "# Half width of a smoothed switch in place of the discontinuity, in the indicators' units:",
        "# smoothed = 1e-5",
        "",
        f"[{verb}]",
    ]
    before = ""
    for option in [*(known[name] for name in set_here), *(o for o in known.values() if o.name not in set_here)]:
        if option.text != before:  # some share one description
            lines += ["", *(f"# {line}" for line in textwrap.wrap(option.text or "No description.", _WIDTH - 2))]
            before = option.text
        if option.name in set_here:
            lines.append(f"{option.name} = {as_toml(set_here[option.name])}")
        else:
            lines.append(f"# {option.name} = {as_toml(_example(option, system))}")
    states = list(system.states)
    lines += [
        "",
        "[output]",
        "# Results are written beside this file: .nc (NetCDF) or .zarr; a figure as .pdf, .png or .svg.",
        f"data = {as_toml(f'{stem}.nc')}",
        *([f"figure = {as_toml(f'{stem}.pdf')}"] if len(states) > 1 else []),
    ]
    return "\n".join(lines) + "\n"


def _settings(system: Any, verb: str) -> dict[str, Any]:
    """Options that are set in the file: what the verb needs, in a size that takes seconds."""
    forced = system.period() is not None
    section = {} if forced or not system.indicators else {"section": {"indicator": system.indicators[0]}}
    if verb == "simulate":
        return {"periods": 50} if forced else {"duration": 100.0}
    if verb == "poincare":
        return {"n": 500, "transient": 100, **section}
    if verb == "basins":
        plane = list(system.states)[:2]
        if len(plane) < 2:
            raise ValueError(f"{system.name!r} has one state; basins are a picture of two: choose another --verb")
        return {"grid": {name: _range(-system.scale[name], system.scale[name], 21) for name in plane}, **section}
    names = _parameters(system, 2 if verb == "chart" else 1)
    around = {name: _range(*_around(system.values[name]), 41 if verb != "chart" else 21) for name in names}
    if verb == "chart":
        return {"grid": around, "transient": 100, **section}
    (name,) = names
    least = {"transient": 100, "keep": 50} if verb != "basin_fractions" else {"n_starts": 50, "transient": 100}
    box = {"box": {state: [-size, size] for state, size in system.scale.items()}} if verb == "basin_fractions" else {}
    return {"parameter": name, "values": around[name], **least, **box, **section}


def _start(system: Any) -> dict[str, Any]:
    """A start on the admissible side of all stops, where the state zero, the default, is not on it."""
    import numpy as np

    from nonsmooth.system.symbolic.numeric import numeric

    traced, size = system.traced, system.scale_vector()
    stops = [jump.rows for jump in traced.transitions if jump.source == 0 and jump.reset is not None and jump.rows]
    along = [sign * row for row in np.diag(size) for sign in (1.0, -1.0)]
    tried = np.stack([0.0 * size, size, -size, *along])
    h = numeric(traced, traced.indicators)(system.parameter_vector(), 0.0, tried, system.memory_vector())
    before = [np.any([row.sign * h[:, row.indicator] < 0 for row in rows], axis=0) for rows in stops]
    found = tried[np.argmax(np.all(before, axis=0))].tolist()  # zero where none is
    return {"start": dict(zip(system.states, found, strict=True))} if any(found) else {}


def _parameters(system: Any, n: int) -> list[str]:
    """Parameters to vary: the forcing frequency first, then those that are declared last and are not zero."""
    names = [name for name in system.parameters if name != "eta"]
    if len(names) < n:
        raise ValueError(f"{system.name!r} has {len(names) or 'no'} parameter; this verb varies {n}")
    return sorted(names, key=lambda name: (name != "omega", system.values[name] == 0, -names.index(name)))[:n]


def _around(value: float) -> tuple[float, float]:
    low, high = sorted((0.9 * value, 1.1 * value))
    return (low, high) if value else (0.0, 1.0)


def _range(low: float, high: float, n: int) -> dict[str, Any]:
    return {"from": float(f"{low:.6g}"), "to": float(f"{high:.6g}"), "n": n}


def _example(option: Option, system: Any) -> Any:
    """The option's default; where that is None, a value of its kind."""
    if not option.required and option.default is not None:
        return option.default
    state = dict.fromkeys(system.states, 0.0)
    parameter = _parameters(system, 1)[0] if system.values else "name"
    section = {"indicator": system.indicators[0]} if system.indicators else {"phase": 0.25}
    examples: Mapping[str, Any] = {
        "periods": 50,
        "duration": 100.0,
        "start": state,
        "mode": system.modes[0],
        "samples": 1001,
        "step": 0.001,
        "ramps": {parameter: list(_around(system.values.get(parameter, 0.0)))},
        "rtol": 1e-9,
        "atol": 1e-12,
        "section": section if system.period() is None else {"phase": 0.25},
        "max_period": 8,
        "threads": 1,
        "order": 20,
        "carry": {parameter: "up"},
        "fixed": dict.fromkeys(list(system.states)[2:], 0.0),
        "box": {name: [-size, size] for name, size in system.scale.items()},
    }
    return examples[option.name]
