"""The exceptions of the package. Wrong values are plain ``ValueError``/``TypeError``; these add a meaning."""

from __future__ import annotations

from typing import Any

__all__ = ["DataFileError", "SolveError", "SystemDefinitionError"]


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


class DataFileError(ValueError):
    """A file that cannot be read or written: the message names the file, the place in it, and what was expected.

    Attributes
    ----------
    result : xarray.Dataset or None
        The result that could not be written, so that it is not lost.
    """

    result: Any = None
