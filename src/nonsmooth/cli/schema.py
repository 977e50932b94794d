"""``nonsmooth schema``: the JSON Schema of study files, so that an editor completes and checks them while one types."""

from __future__ import annotations

import argparse
import ast
import inspect
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nonsmooth.cli.files import with_folder
from nonsmooth.cli.verb_options import VERBS, Option, options_of

__all__ = ["add", "study_schema"]

_TYPES: dict[str, dict[str, Any]] = {
    "bool": {"type": "boolean"}, "int": {"type": "integer"}, "float": {"type": "number"}, "str": {"type": "string"},
    "Mapping[str, Any]": {"type": "object"},
    "Mapping[str, str]": {"type": "object", "additionalProperties": {"type": "string"}},
    "Mapping[str, float]": {"type": "object", "additionalProperties": {"type": "number"}},
    "Mapping[str, tuple[float, float]]": {
        "type": "object",
        "additionalProperties": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
    },
    "Stroboscopic": {"$ref": "#/definitions/stroboscopic"}, "Poincare": {"$ref": "#/definitions/poincare"},
}  # fmt: skip
#: Options that a file writes in a way of its own.
_WRITTEN: dict[str, dict[str, Any]] = {
    "values": {"allOf": [{"$ref": "#/definitions/values"}]},  # beside a $ref nothing else would count
    "start": {"allOf": [{"$ref": "#/definitions/start"}]},
    "grid": {
        "type": "object",
        "additionalProperties": {"$ref": "#/definitions/values"},
        "minProperties": 2,
        "maxProperties": 2,
    },
}
_NUMBERS = {"type": "array", "items": {"type": "number"}}
_STATE = {"anyOf": [_NUMBERS, _TYPES["Mapping[str, float]"]]}


def add(commands: Any) -> None:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "schema",
        help="write the JSON Schema of study files, for editors",
        description="Write the JSON Schema (draft 4) of the study files of `nonsmooth run`, made from the verbs' own "
        "options. An editor with a TOML language server (taplo; in VS Code: Even Better TOML) checks a study file "
        "whose first line is  #:schema ./study.schema.json",
        epilog="examples:\n  nonsmooth schema --out study.schema.json",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="where to write it (else it is printed)")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    text = json.dumps(study_schema(), indent=2, ensure_ascii=False)
    if options.out is None:
        print(text)
    else:
        with_folder(options.out).write_text(text + "\n", encoding="utf-8")
        print(f"written to {options.out}; in a study file beside it the first line is  #:schema ./{options.out.name}")
    return 0


def study_schema() -> dict[str, Any]:
    """Return the JSON Schema of study files, of draft 4: what TOML editors read."""
    import nonsmooth
    from nonsmooth import models
    from nonsmooth.cli.study import OUTPUT

    name = {"enum": list(models.names())}
    file = {"type": "string", "pattern": r"^.+\.py:\w+$"}
    numbers = _TYPES["Mapping[str, float]"]
    tables: dict[str, Any] = {
        "system": _table(
            {
                "model": {"anyOf": [name, file], "description": 'A name of `nonsmooth models`, or "file.py:object".'},
                "text": {"type": "string", "description": "A system as System.to_text writes it, in place of a model."},
                "parameters": numbers | {"description": "Parameters that differ from the model's own values."},
                "smoothed": {
                    "anyOf": [{"type": "number"}, numbers],
                    "description": "Half width of the smoothed switch, in the indicators' units.",
                },
            },
        )
        | {"oneOf": [{"required": ["model"]}, {"required": ["text"]}]},
        "output": _table({key: _place(key, endings) for key, endings in OUTPUT.items()}),
    }
    for verb in VERBS:
        known = options_of(verb)
        required = [key for key, option in known.items() if option.required]
        about = (getattr(nonsmooth, verb).__doc__ or "").strip().partition("\n")[0]
        tables[verb] = _table({key: _option(option) for key, option in known.items()}, required)
        tables[verb]["description"] = about
    return {
        "$schema": "http://json-schema.org/draft-04/schema#",
        "title": "Study file of nonsmooth",
        "description": "A system, one verb with its options, and where the result goes: nonsmooth run STUDY.toml",
        **_table(tables, ["system"]),
        "oneOf": [{"required": [verb]} for verb in VERBS],
        "definitions": {
            "values": {"anyOf": [
                _NUMBERS,
                _table({"from": {"type": "number"}, "to": {"type": "number"}, "n": {"type": "integer", "minimum": 1}},
                       ["from", "to", "n"]),
            ]},
            "start": {"anyOf": [
                _STATE, {"type": "array", "items": _STATE},
                _arguments(nonsmooth.random_starts, low=_STATE, high=_STATE),
            ]},
            "stroboscopic": _arguments(nonsmooth.Stroboscopic), "poincare": _arguments(nonsmooth.Poincare),
        },
    }  # fmt: skip


def _table(properties: dict[str, Any], required: Iterable[str] = ()) -> dict[str, Any]:
    needed = list(required)
    table = {"type": "object", "properties": properties, "additionalProperties": False}
    return table | ({"required": needed} if needed else {})  # draft 4 has no empty list there


def _place(key: str, endings: tuple[str, ...]) -> dict[str, Any]:
    if not endings:
        return {"type": "string", "description": f"State on the figure's {key} axis."}
    pattern = "|".join(re.escape(ending) for ending in endings)
    return {
        "type": "string",
        "pattern": f"({pattern})$",
        "description": f"Name of a file that ends in {', '.join(endings)}; relative to the study file.",
    }


def _option(option: Option) -> dict[str, Any]:
    found = dict(_WRITTEN.get(option.name) or _of_annotation(option.annotation))
    if option.name == "method":
        from nonsmooth.flow.engines.methods import METHODS

        found = {"enum": list(METHODS)}
    elif option.kind.startswith("{"):
        # a TOML file has no None: "none" is read as it
        found = {"enum": ["none" if word is None else word for word in ast.literal_eval(f"[{option.kind[1:-1]}]")]}
    if option.text:
        found["description"] = option.text
    if not option.required and option.default is not None:
        found["default"] = option.default
    return found


def _of_annotation(annotation: str) -> dict[str, Any]:
    """Type of an argument; anything where its annotation says no more."""
    parts = [part for part in annotation.split(" | ") if part != "None"]
    kinds = [_TYPES.get(part, {}) for part in parts]
    if {} in kinds or not kinds:
        return {}
    return dict(kinds[0]) if len(kinds) == 1 else {"anyOf": kinds}


def _arguments(function: Any, **written: dict[str, Any]) -> dict[str, Any]:
    """A table whose keys are the arguments of a function."""
    items = inspect.signature(function).parameters
    properties = {key: written.get(key) or _of_annotation(str(item.annotation)) for key, item in items.items()}
    return _table(properties, [key for key, item in items.items() if item.default is inspect.Parameter.empty])
