"""A mode: its vector field and the states it has; a band: how a switch is smoothed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nonsmooth.errors import SystemDefinitionError


@dataclass(frozen=True)
class Mode:
    """A vector field with, possibly, fewer states than the system.

    Parameters
    ----------
    field : callable
        ``field(t, u, p)`` returns du/dt for the states of this mode, in their order.
    states : sequence of str, optional
        The states this mode has (default: all). The others do not exist in it (NaN in results); a
        transition into a mode that has more states needs a ``reset`` that sets them.
    """

    field: Callable[..., Any]
    states: Sequence[str] | None = None

    def __post_init__(self) -> None:
        if not callable(self.field):
            raise SystemDefinitionError(f"a mode needs a function field(t, u, p), not {self.field!r}")
        if self.states is not None:
            if isinstance(self.states, str):
                raise SystemDefinitionError(f"`states` of a mode is a list of names: [{self.states!r}]")
            object.__setattr__(self, "states", tuple(self.states))


@dataclass(frozen=True)
class Band:
    r"""The vector field inside the narrow band of one indicator, where a model prescribes its own.

    Without it a smoothed switch uses :math:`(1-q) f_A + q f_B`, :math:`q = (g + \eta) / (2\eta)`.

    Parameters
    ----------
    field : callable
        ``field(t, u, p)`` with ``p.eta`` (half the width of the band) and the band's memory in ``p``.
    write : mapping, optional
        ``{"v_a": f}`` or ``{"v_a": (f, "m/s")}``: memory of the band, written at every entry into it.
    outputs : mapping of str to callable, optional
        The system's outputs inside the band, ``f(t, u, p)``; interpolated linearly in q where missing.
    """

    field: Callable[..., Any]
    write: Mapping[str, Any] | None = None
    outputs: Mapping[str, Callable[..., Any]] | None = None

    def __post_init__(self) -> None:
        if not callable(self.field):
            raise SystemDefinitionError(f"a band needs a function field(t, u, p), not {self.field!r}")
