"""``nonsmooth explore [MODEL | STUDY.toml | RESULT.nc]``: a page whose diagrams follow the parameters of a system."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "explore",
        help="explore a model in the browser",
        description="Open a page on this machine in which bifurcation diagram, phase portrait, time history and "
        "section follow the parameters of a model. Needs the package bokeh. Only who has the address that is printed "
        "can open it.",
        epilog="examples:\n"
        "  nonsmooth explore                                   # the paper's oscillator\n"
        "  nonsmooth explore impact_oscillator\n"
        "  nonsmooth explore my_oscillator.py:oscillator\n"
        "  nonsmooth explore fig11.toml                        # the system and the range of a study\n"
        "  nonsmooth explore fig11.nc                          # those of a result\n"
        '  nonsmooth explore "http://127.0.0.1:5180/?model=..."  # a view that somebody shared',
    )
    parser.add_argument(
        "model",
        nargs="?",
        metavar="MODEL",
        help='a name of `nonsmooth models`, "file.py:object", a study file, a result, or the address of a view',
    )
    parser.add_argument("--port", type=int, help="port on 127.0.0.1 (default: 5180, or any that is free)")
    parser.add_argument("--no-browser", action="store_true", help="print the address, open no browser")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.cli.study import load_model, named_model, read_study
    from nonsmooth.explorer.export import opened_result, opened_study
    from nonsmooth.explorer.serve import explore
    from nonsmooth.recordings.load import ENDINGS
    from nonsmooth.results.store import load

    system, query = None, ""
    given = options.model
    if given is None:
        pass
    elif given.startswith(("http://", "https://")):
        query = urlsplit(given).query
    elif Path(given).suffix == ".toml":
        study = read_study(Path(given))
        system, query = opened_study(study.system, study.options, study.output)
    elif Path(given).suffix in (".nc", ".zarr"):
        system, query = opened_result(load(given))
    elif ":" in given:
        system = load_model(given, Path())
    elif Path(given).suffix.lower() in ENDINGS:
        raise ValueError(f"{given}: is a recording; open a model, `nonsmooth explore MODEL`, and drop it into the page")
    else:
        named_model(given)
        query = f"model={given}"
    explore(system, query=query, port=options.port, browser=not options.no_browser)
    return 0
