"""The exceptions of the package. Wrong values are plain ``ValueError``/``TypeError``; these add a meaning.

Beside them the sentence on packages that only some work needs.
"""

from __future__ import annotations

from typing import Any

__all__ = ["DataFileError", "Interrupted", "SolveError", "SystemDefinitionError", "not_installed", "shortened"]


def shortened(given: object, *, quoted: bool = True, most: int = 200) -> str:
    """Return what was given as a message repeats it: its ``repr`` (or ``str``), the middle of a long one left out."""
    try:
        text = (repr if quoted else str)(given)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        text = f"<{type(given).__name__}>"
    if len(text) <= most:
        return text
    return f"{text[: most // 2]} ... {text[-most // 4 :]} ({len(text)} characters)"


def not_installed(package: str, extra: str) -> str:
    """Return what to do where a package of an optional group is missing; nonsmooth itself is on no package index."""
    return (
        f"the package {package}, which is not installed: in a copy of the source of nonsmooth run "
        f'python -m pip install ".[{extra}]"'
    )


class SystemDefinitionError(ValueError):
    """A system whose description contradicts itself, or asks for what no method can see.

    The message names the mode, indicator or transition and says what to do.
    """


class SolveError(RuntimeError):
    """A single run that was asked for could not be completed.

    Parameters
    ----------
    message : str
        The sentence of the status.
    time : float, optional
        Where the run ended.
    state : dict, optional
        The state there, by name.
    mode : str, optional
        The mode there.
    status : str, optional
        The name of the status (``"diverged"``, ``"chatter"``, ...).
    """

    def __init__(
        self,
        message: str,
        *,
        time: float | None = None,
        state: dict[str, float] | None = None,
        mode: str | None = None,
        status: str | None = None,
    ) -> None:
        self.time, self.state, self.mode, self.status = time, state, mode, status
        where = [] if time is None else [f"t = {time:.9g}"]
        where += [f"{name} = {value:.9g}" for name, value in (state or {}).items()]
        where += [] if mode is None else [f"mode {mode!r}"]
        super().__init__(message + (f" (at {', '.join(where)})" if where else ""))


class Interrupted(KeyboardInterrupt):
    """Ctrl-C in a verb that can tell what it had found until then.

    It is a ``KeyboardInterrupt``: nothing that called the verb goes on, unless it catches this and takes the part.

    Parameters
    ----------
    message : str
    result : xarray.Dataset
        What was found.
    """

    def __init__(self, message: str, result: Any) -> None:
        super().__init__(message)
        self.result = result


class DataFileError(ValueError):
    """A file that cannot be read or written: the message names the file, the place in it, and what was expected.

    Attributes
    ----------
    result : xarray.Dataset or None
        The result that could not be written, so that it is not lost.
    """

    result: Any = None
