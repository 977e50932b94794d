"""Allowed jumps between modes: by a condition, at a phase of the forcing, or across a surface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from nonsmooth.errors import SystemDefinitionError

__all__ = ["Surface", "Transition"]


@dataclass(frozen=True)
class Transition:
    """An allowed jump from the mode ``source`` to the mode ``target``.

    Parameters
    ----------
    source, target : str
        Names of modes; equal for an impact that stays in its mode.
    when : str, optional
        Signs of indicators joined by ``and``: ``"penetration > 0 and separation < 0"``. The transition fires
        at the instant the condition *becomes* true. ``>= 0`` also holds where an indicator is and stays zero.
    at : float or callable, optional
        Instead of ``when``: a phase of the forcing, in periods (0 <= at < 1), or a function of the parameters that
        returns it: ``at=lambda p: p.duty``.
    reset : callable, optional
        ``reset(t, u, p)`` returns the new state (in the order of the target mode's states).
    write : mapping of str to callable, optional
        ``{"v_a": f}``: memory written, ``f(t, u, p)`` evaluated just before the jump.
    """

    source: str
    target: str
    when: str | None = None
    at: float | Callable[..., Any] | None = None
    reset: Callable[..., Any] | None = None
    write: Mapping[str, Callable[..., Any]] | None = field(default=None)

    def __post_init__(self) -> None:
        if (self.when is None) == (self.at is None):
            raise SystemDefinitionError(
                f"{self.label}: give either `when` (a condition) or `at` (a phase of the forcing), not "
                + ("neither" if self.when is None else "both")
            )
        if not (self.at is None or callable(self.at) or (isinstance(self.at, (int, float)) and 0 <= self.at < 1)):
            raise SystemDefinitionError(
                f"{self.label}: `at` is a phase in forcing periods, 0 <= at < 1, or a function of the parameters; not "
                f"{self.at!r}"
            )
        if self.reset is not None and not callable(self.reset):
            raise SystemDefinitionError(f"{self.label}: `reset` must be a function reset(t, u, p), not {self.reset!r}")
        if self.write is not None and not isinstance(self.write, Mapping):
            raise SystemDefinitionError(
                f"{self.label}: `write` must map names of memory to functions f(t, u, p), not {self.write!r}"
            )
        if self.source == self.target and self.reset is None and not self.write:
            raise SystemDefinitionError(f"{self.label}: a transition into its own mode needs a `reset` or a `write`")

    @property
    def label(self) -> str:
        """Name in errors and logs: ``free -> contact``."""
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True)
class Surface:
    """Two modes either side of the surface where an indicator vanishes (Filippov's form).

    Whether a trajectory crosses the surface or slides on it is decided by the two vector fields themselves.

    Parameters
    ----------
    indicator : str
        The surface is its zero set.
    below, above : str
        The modes where the indicator is negative and positive.
    """

    indicator: str
    below: str
    above: str

    def __post_init__(self) -> None:
        if self.below == self.above:
            raise SystemDefinitionError(
                f"surface {self.indicator!r}: `below` and `above` are both {self.below!r}; they must be two modes"
            )

    @property
    def label(self) -> str:
        """Name in errors."""
        return f"surface {self.indicator} ({self.below} | {self.above})"
