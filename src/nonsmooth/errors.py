"""The exceptions of the package. Wrong values are plain ``ValueError``/``TypeError``; these add a meaning.

Beside them the sentences that all refusals share: on a name that is not known, on a package that only some work needs.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

__all__ = [
    "DataFileError",
    "Interrupted",
    "SolveError",
    "SystemDefinitionError",
    "not_installed",
    "shortened",
    "unknown",
]


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


def check_keys(table: Iterable[str], allowed: Iterable[str], where: str, what: str, of: str = "this place") -> None:
    """Check names that a user wrote; ``where`` names their place, ``what`` and ``of`` are as in :func:`unknown`."""
    known = list(allowed)
    for key in table:
        if key not in known:
            raise ValueError(f"{where}: {unknown(key, what, of, known)}")


def unknown(name: object, what: str, of: str, known: Mapping[str, str] | Iterable[str]) -> str:
    """Return the sentence on a name that is not known: the nearest, then all.

    Parameters
    ----------
    name : object
        The name that was given.
    what : str
        What it should have been, with its article: "a parameter".
    of : str
        The owner as it shall be printed: "'discontinuous support'".
    known : mapping of name to unit, or iterable of names
        What is allowed.
    """
    units = known if isinstance(known, Mapping) else dict.fromkeys(known, "")
    ordered = sorted(units)
    text = f"`{shortened(name, quoted=False)}` is not {what} of {of}"
    for near in nearest(str(name), ordered)[:1]:
        text += f"; nearest: {near}" + (f" [{units[near]}]" if units[near] else "")
    return text + (f"; all: {', '.join(ordered)}" if ordered else f"; {of} has none")


class Answering:
    """An object that answers for an attribute which it has not: where that stands instead, or what is like it."""

    __slots__ = ()

    def __getattr__(self, name: str) -> Any:
        kind = type(self).__name__
        text = f"{'an' if kind[0] in 'AEIO' else 'a'} {kind} has no {name!r}"
        if not name.startswith("_"):  # machines ask for those, of objects that are not whole yet
            known = [word for word in dir(self) if not word.startswith("_")]
            alike = f"; nearest: {', '.join(nearest(name, known))}".removesuffix("; nearest: ")
            text += self._elsewhere(name) or alike or f"; it has {', '.join(known)}"
        raise AttributeError(text)

    def _elsewhere(self, name: str) -> str:
        """The end of the sentence on a name that many look for; "" where nothing is known."""
        return ""


#: Words of other programs for our options.
ELSEWHERE = {
    **dict.fromkeys(("x0", "y0", "u0", "z0", "initial", "initial_state"), "start"),
    **dict.fromkeys(("t_end", "tend", "t_final", "t_max", "tmax", "t_span", "tspan"), "duration"),
    **dict.fromkeys(("dt", "t_eval", "tout", "sampling"), "samples"),
    **dict.fromkeys(("tol", "reltol", "rel_tol"), "rtol"),
    **dict.fromkeys(("abstol", "abs_tol"), "atol"),
    **dict.fromkeys(("solver", "integrator", "algorithm"), "method"),
    **dict.fromkeys(("n_jobs", "workers", "processes", "cores"), "threads"),
    **dict.fromkeys(("sep", "separator"), "delimiter"),
    **dict.fromkeys(("skiprows", "skip_rows", "skiplines"), "skip"),
    **dict.fromkeys(("usecols", "names"), "columns"),
    **dict.fromkeys(("fps", "framerate", "frame_rate"), "rate"),
    **dict.fromkeys(("mu", "mu_k", "mu_d", "muk", "mud"), "friction"),
    **dict.fromkeys(("mu_s", "mus", "stiction"), "static"),
    "bounds": "parameters",  # of fit: {"k": (5.0, 12.0)}
    "cor": "restitution",
}


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """Return the known names that are like ``name``, the nearest first, at most three."""
    likeness = {candidate: _likeness(name[:100], candidate) for candidate in known}
    return sorted((one for one in likeness if likeness[one] >= 0.5), key=lambda one: -likeness[one])[:3]


def _likeness(given: str, candidate: str) -> float:
    """Similarity, 0 to about 1; the same beginning counts (``gap`` means g rather than omega)."""
    if ELSEWHERE.get(given.lower()) == candidate:
        return 2.0
    begins = given[:1].lower() == candidate[:1].lower()
    return difflib.SequenceMatcher(None, given.lower(), candidate.lower()).ratio() + 0.2 * begins


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

    @classmethod
    def with_points(cls, why: KeyboardInterrupt, done: int, size: int, what: str, result: Any) -> Interrupted:
        """That of a result over many points, some of which were computed."""
        return cls(
            f"{str(why) or 'interrupted'}: {done} of {size} points of the {what} were computed; they are in `result` "
            'of this exception (at a prompt: sys.last_value.result), where others have the status "interrupted" or are '
            "left out",
            result,
        )


class DataFileError(ValueError):
    """A file that cannot be read or written: the message names the file, the place in it, and what was expected.

    Attributes
    ----------
    result : xarray.Dataset or None
        The result that could not be written, so that it is not lost.
    """

    result: Any = None
