"""``nonsmooth models``: the published oscillators that come ready."""

from __future__ import annotations

import argparse
import re
from typing import Any


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "models",
        help="list the models that come ready",
        description="List the models that come ready.",
        epilog="examples:\n  nonsmooth models\n  nonsmooth models discontinuous_support",
    )
    parser.add_argument("name", nargs="?", metavar="MODEL", help="show this model's equations and parameters")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth import models
    from nonsmooth.cli.study import named_model

    if options.name is not None:
        print(named_model(options.name))
        return 0
    width = max(map(len, models.names()))
    for name in models.names():
        print(f"{name:{width}}  {_summary(getattr(models, name))}")
    return 0


def _summary(model: Any) -> str:
    """The first line of a model's documentation, without its verb and without formulas."""
    line = (model.__doc__ or "").strip().partition("\n")[0]
    line = re.sub(r"\s*:math:`[^`]*`", "", line).replace("``", "").removeprefix("Return the ")
    return line[:1].upper() + line[1:]
