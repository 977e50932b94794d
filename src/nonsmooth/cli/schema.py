"""``nonsmooth schema``: the JSON Schema of study files, so that an editor completes and checks them while one types."""

from __future__ import annotations

import argparse
import inspect
import json
import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from nonsmooth.cli.files import put_text
from nonsmooth.cli.verb_options import VERBS, Option, options_of

_TYPES: dict[str, dict[str, Any]] = {
    "bool": {"type": "boolean"},
    "int": {"type": "integer"},
    "float": {"type": "number"},
    "str": {"type": "string"},
    "Stroboscopic": {"$ref": "#/definitions/stroboscopic"},
    "Poincare": {"$ref": "#/definitions/poincare"},
    "tuple": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
}
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
_STATE_BY_NAME = {"type": "object", "additionalProperties": {"type": "number"}}
_STATE = {"anyOf": [_NUMBERS, _STATE_BY_NAME]}
_START = {"anyOf": [_NUMBERS, _STATE_BY_NAME | {"properties": {"mode": {"type": "string"}}}]}


def add(commands: Any) -> Any:
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
    return parser


def run(options: argparse.Namespace) -> int:
    text = json.dumps(study_schema(), indent=2, ensure_ascii=False)
    if options.out is None:
        print(text)
    else:
        put_text(options.out, text + "\n")
        print(f"written to {options.out}; in a study file beside it the first line is  #:schema ./{options.out.name}")
    return 0


def study_schema() -> dict[str, Any]:
    """Return the JSON Schema of study files, of draft 4: what TOML editors read."""
    import nonsmooth
    from nonsmooth import models
    from nonsmooth.cli.study import OUTPUT

    name = {"enum": list(models.names())}
    file = {"type": "string", "pattern": r"^.+\.py:\w+$"}
    numbers = _STATE_BY_NAME
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
            "values": {
                "anyOf": [
                    _NUMBERS,
                    _table(
                        {"from": {"type": "number"}, "to": {"type": "number"}, "n": {"type": "integer", "minimum": 1}},
                        ["from", "to", "n"],
                    ),
                ]
            },
            "start": {
                "anyOf": [
                    _START,
                    {"type": "array", "items": _START},
                    _arguments(nonsmooth.random_starts, low=_STATE, high=_STATE),
                ]
            },
            "stroboscopic": _arguments(nonsmooth.Stroboscopic),
            "poincare": _arguments(nonsmooth.Poincare),
        },
    }


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
    found = dict(_WRITTEN.get(option.name) or _of_kind(option.kind))
    if option.text:
        found["description"] = option.text
    if not option.required and option.default is not None:
        found["default"] = option.default
    return found


def _of_kind(kind: Any) -> dict[str, Any]:
    """The values that a verb declares of an argument; any where it declares nothing."""
    from nonsmooth.system.kinds import Limit

    parts = get_args(kind)
    if get_origin(kind) is Annotated:
        limit = next((mark for mark in parts if isinstance(mark, Limit)), None)
        return _of_kind(parts[0]) | (_limits(limit) if limit else {})
    if get_origin(kind) is Literal:  # a TOML file has no None: "none" is read as it
        return {"enum": ["none" if word is None else word for word in parts]}
    if get_origin(kind) in (Union, UnionType):
        kinds = [_of_kind(part) for part in parts if part is not NoneType]
        return kinds[0] if len(kinds) == 1 else {} if {} in kinds else {"anyOf": kinds}
    if get_origin(kind) is Mapping:
        return {"type": "object"} | ({"additionalProperties": values} if (values := _of_kind(parts[1])) else {})
    return dict(_TYPES.get(getattr(get_origin(kind) or kind, "__name__", ""), {}))


def _limits(limit: Any) -> dict[str, Any]:
    ends = {"minimum": limit.low, "maximum": limit.high}
    found: dict[str, Any] = {name: end for name, end in ends.items() if math.isfinite(end)}
    return found | ({"exclusiveMinimum": True} if limit.without_low else {})


def _arguments(function: Any, **written: dict[str, Any]) -> dict[str, Any]:
    """A table whose keys are the arguments of a function."""
    from nonsmooth.system.arguments import declared

    items, kinds = inspect.signature(function).parameters, declared(function)
    properties = {key: written.get(key) or _of_kind(kinds[key]) for key in items}
    return _table(properties, [key for key, item in items.items() if item.default is inspect.Parameter.empty])
