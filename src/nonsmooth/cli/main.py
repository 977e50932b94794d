"""The command ``nonsmooth``: one sub-command per file, errors as one message, Ctrl-C as one line."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

# Matrices here are tiny: threads of the linear algebra would wait for each other (20 times the processor time in small
# fits), and beside our own threads for a core. Must stand before NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from nonsmooth.cli import compare, completion, explore, identify, init, models, plan, reproduce, rig, run, schema, show
from nonsmooth.cli.terminal import printable
from nonsmooth.errors import Interrupted, SolveError, shortened, unknown

_COMMANDS = (init, run, plan, show, explore, models, identify, compare, reproduce, rig, schema, completion)
#: What a user can have caused and mend; anything else is a fault of the package.
_USER_ERRORS = (ValueError, TypeError, OSError, MemoryError, SolveError, ImportError)
DONE, FAULT, WRONG_INPUT, ANOMALIES, INTERRUPTED, PIPE_CLOSED = 0, 1, 2, 3, 130, 141
_EPILOG = """\
`nonsmooth COMMAND --help` explains a command, with examples.

examples:
  nonsmooth init discontinuous_support      # writes a study file that runs
  nonsmooth run discontinuous_support_simulate.toml
  nonsmooth show discontinuous_support_simulate.nc

exit codes:
    0  done
    1  a fault of nonsmooth itself: please report it
    2  wrong input: the message names it, and what to do
    3  done, but recordings contradict each other or their notebook (identify)
  130  interrupted by Ctrl-C
  141  what reads the output has closed it (as `| head` does)
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code (listed by ``nonsmooth --help``)."""
    try:
        try:
            return _answer(arguments)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()  # here, so that a closed pipe shows now
    except BrokenPipeError:
        with suppress(OSError, ValueError):  # nothing more can be said; nor shall the interpreter, when it ends
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_CLOSED


def _answer(arguments: Sequence[str] | None) -> int:
    with suppress(AttributeError):  # an output that cannot write a letter writes its escape, as that of errors does
        sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    known = parser()
    options = known.parse_args(arguments)
    if options.run is None:
        known.print_help()
        return DONE
    try:
        with _fit_for_a_terminal():
            code: int = options.run(options)
        return code
    except KeyboardInterrupt as error:
        kept = "" if isinstance(error, Interrupted) else str(error)
        print("nonsmooth:", kept or "interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        raise
    except Exception as error:
        if options.traceback:
            raise
        said: object = error
        if isinstance(error, OSError) and error.filename is not None and error.strerror:
            said = f"{error.filename}: {error.strerror}"
        text = printable(shortened(said, quoted=False, most=4000))
        if isinstance(error, _USER_ERRORS):
            print(f"nonsmooth: {text}", file=sys.stderr)
            return WRONG_INPUT
        print(
            f"nonsmooth: a fault of nonsmooth itself, please report it: {type(error).__name__}: {text}\n"
            "`nonsmooth --traceback COMMAND ...` shows where it arose",
            file=sys.stderr,
        )
        return FAULT


@contextmanager
def _fit_for_a_terminal() -> Iterator[None]:
    """Warnings quote what stands in files."""
    plain = warnings.formatwarning
    warnings.formatwarning = lambda *given, **named: printable(plain(*given, **named))
    try:
        yield
    finally:
        warnings.formatwarning = plain


class _Format(argparse.HelpFormatter):
    """Text in lines of its own (examples) stays in them."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=28)

    def add_argument(self, action: argparse.Action) -> None:
        super().add_argument(action)
        if isinstance(action, argparse._SubParsersAction):  # the names of commands are indented once more
            self._action_max_length += self._indent_increment

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        if "\n" not in text:
            return super()._fill_text(text, width, indent)
        return "".join(f"{indent}{line}\n" for line in text.splitlines())


class _Parser(argparse.ArgumentParser):
    def __init__(self, **settings: Any) -> None:
        super().__init__(**{"formatter_class": _Format, **settings})

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            what = "command" if isinstance(action, argparse._SubParsersAction) else action.dest
            raise argparse.ArgumentError(None, unknown(value, f"a {what}", f"`{self.prog}`", list(action.choices)))

    def _print_message(self, message: str, file: Any = None) -> None:
        (file or sys.stderr).write(message)  # the library passes over a closed pipe


class _Version(argparse.Action):
    """The version, looked up where it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from nonsmooth.results.provenance import package_version

        print(f"nonsmooth {package_version()}")
        parser.exit()


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line, with all sub-commands."""
    known = _Parser(
        prog="nonsmooth",
        description="Piecewise-smooth dynamical systems: simulate, sweep, and reproduce published studies.",
        epilog=_EPILOG,
    )
    known.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    known.add_argument("--traceback", action="store_true", help="show where in the program an error arose")
    known.set_defaults(run=None)
    commands = known.add_subparsers(title="commands", metavar="COMMAND")
    for command in _COMMANDS:
        command.add(commands).set_defaults(run=command.run)
    return known


if __name__ == "__main__":
    sys.exit(main())
