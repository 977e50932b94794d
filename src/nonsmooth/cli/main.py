"""The command ``nonsmooth``: one sub-command per file, errors as one message, Ctrl-C as one line."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

# Matrices here are tiny: threads of the linear algebra would wait for each other (20 times the processor time in small
# fits), and beside our own threads for a core. Must stand before NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from nonsmooth.cli import compare, identify, models, plan, reproduce, rig, run, show
from nonsmooth.cli.terminal import printable
from nonsmooth.errors import SolveError, shortened
from nonsmooth.results.provenance import package_version

__all__ = ["main"]

_COMMANDS = (run, plan, identify, compare, reproduce, models, show, rig)
#: What a user can have caused and mend. Anything else is a fault of the package and keeps its traceback.
_USER_ERRORS = (ValueError, TypeError, OSError, MemoryError, SolveError)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 2 wrong input, 3 done with anomalies, 130 interrupted."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        with _fit_for_a_terminal():
            code: int = options.run(options)
        return code
    except KeyboardInterrupt:
        print("nonsmooth: interrupted", file=sys.stderr)
        return 130
    except _USER_ERRORS as error:
        if options.traceback:
            raise
        print(f"nonsmooth: {printable(shortened(error, quoted=False, most=4000))}", file=sys.stderr)
        return 2


@contextmanager
def _fit_for_a_terminal() -> Iterator[None]:
    """Warnings quote what stands in files."""
    plain = warnings.formatwarning
    warnings.formatwarning = lambda *given, **named: printable(plain(*given, **named))
    try:
        yield
    finally:
        warnings.formatwarning = plain


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="nonsmooth",
        description="Piecewise-smooth dynamical systems: simulate, sweep, and reproduce published studies.",
        epilog="`nonsmooth COMMAND --help` explains a command.",
    )
    parser.add_argument("--version", action="version", version=f"nonsmooth {package_version()}")
    parser.add_argument("--traceback", action="store_true", help="show where in the program an error arose")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in _COMMANDS:
        command.add(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
