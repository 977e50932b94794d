"""Modes, and allowed jumps between them: by a condition, at a phase of the forcing, or across a surface."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.errors import SystemDefinitionError, shortened, unknown
from nonsmooth.system.kinds import real_number
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced


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
        ``reset(t, u, p)`` returns the new state: the target mode's states, in their order or by name.
    write : mapping of str to callable, optional
        ``{"v_a": f}``: memory written, ``f(t, u, p)`` evaluated just before the jump.
    contact : bool, optional
        Whether a contact begins by it, which ``contacts_per_period`` counts. Where not given: if it has a reset, or
        leaves the first mode.
    """

    source: str
    target: str
    when: str | None = None
    at: float | Callable[..., Any] | None = None
    reset: Callable[..., Any] | None = None
    write: Mapping[str, Callable[..., Any]] | None = field(default=None)
    contact: bool | None = None

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
        if self.contact not in (None, True, False):
            raise SystemDefinitionError(f"{self.label}: `contact` is True, False or None, not {self.contact!r}")
        if self.source == self.target and self.reset is None and not self.write:
            raise SystemDefinitionError(f"{self.label}: a transition into its own mode needs a `reset` or a `write`")

    @property
    def label(self) -> str:
        """Name in errors and logs: ``free -> contact``."""
        return f"{self.source} -> {self.target}"

    def begins_contact(self, first: str) -> bool:
        """Return whether a contact begins by it, in a system with this ``first`` mode."""
        return bool(self.reset or self.source == first) if self.contact is None else self.contact


@dataclass(frozen=True)
class Surface:
    r"""Two modes either side of the surface where an indicator vanishes (Filippov's form).

    Whether a trajectory crosses the surface or slides on it is decided by the two vector fields themselves. Where both
    point at the surface, motion goes on in a further mode with Filippov's convex combination
    :math:`f_s = (1-a) f_- + a f_+` that stays on the surface, until one of them turns away.

    Parameters
    ----------
    indicator : str
        The surface is its zero set.
    below, above : str
        The modes where the indicator is negative and positive.
    mode : str, optional
        Name of the mode in which motion slides; ``<indicator>_sliding`` where not given.
    static : float or callable, optional
        How much the static value exceeds the kinetic one (1 or more): a number or ``f(t, u, p)``. Sliding then ends,
        and is avoided at the surface, only where the field between both would have to be outside by this factor:
        static friction that is larger than kinetic friction.
    field : callable, optional
        ``field(t, u, p)``: the vector field on the surface in place of Filippov's, such as Utkin's equivalent
        control. The states are those of the two modes, and the surface must be invariant under it.
    """

    indicator: str
    below: str
    above: str
    mode: str | None = None
    static: Any = None
    field: Callable[..., Any] | None = None

    def __post_init__(self) -> None:
        if self.below == self.above:
            raise SystemDefinitionError(
                f"surface {self.indicator!r}: `below` and `above` are both {self.below!r}; they must be two modes"
            )
        if self.mode is not None and not isinstance(self.mode, str):
            raise SystemDefinitionError(f"{self.label}: `mode` is the name of the sliding mode, not {self.mode!r}")
        if self.field is not None and not callable(self.field):
            raise SystemDefinitionError(f"{self.label}: `field` must be a function field(t, u, p), not {self.field!r}")
        if not (self.static is None or callable(self.static)):
            ratio = real_number(self.static, f"{self.label}: `static`")
            if ratio < 1:
                raise SystemDefinitionError(
                    f"{self.label}: `static` is the static value over the kinetic one, 1 or more; not {self.static!r}"
                )

    @property
    def label(self) -> str:
        """Name in errors."""
        return f"surface {self.indicator} ({self.below} | {self.above})"


GRAMMAR = "<indicator> > 0  or  <indicator> < 0,  joined by 'and'"
_SIGN = re.compile(r"\s*([A-Za-z_]\w*)\s*([<>])(=?)\s*0(?:\.0*)?\s*\Z")


def read_condition(text: object, indicators: Sequence[str], label: str) -> tuple[tuple[str, int, bool], ...]:
    """Return (indicator, sign, strict) for each sign of a condition such as ``"penetration > 0 and separation < 0"``;
    ``>= 0`` is not strict. ``label`` names the transition in messages."""
    if not isinstance(text, str):
        raise SystemDefinitionError(f"{label}: `when` must be a string of the form: {GRAMMAR}; not {shortened(text)}")
    signs: dict[str, tuple[int, bool]] = {}
    for part in re.split(r"\band\b", text):
        match = _SIGN.match(part)
        if match is None:
            raise SystemDefinitionError(
                f"{label}: cannot read {shortened(part.strip())} in the condition {shortened(text)}; the grammar is: "
                f"{GRAMMAR}. "
                "('or' is a second transition; anything else is a new indicator: for x > g declare "
                'indicators={"gap": lambda t, u, p: u.x - p.g} and write "gap > 0".)'
            )
        name, sign = match[1], 1 if match[2] == ">" else -1
        if name not in indicators:
            raise SystemDefinitionError(f"{label}: {unknown(name, 'an indicator', 'this system', indicators)}")
        before, strict = signs.get(name, (sign, False))
        if before != sign:
            raise SystemDefinitionError(f"{label}: {shortened(text)} asks for both signs of {name!r} at once")
        signs[name] = sign, strict or not match[3]
    return tuple((name, sign, strict) for name, (sign, strict) in signs.items())


def condition_text(rows: Sequence[tuple[str, int, bool]]) -> str:
    """Return the condition as the user would write it; inverse of `read_condition`."""
    return " and ".join(f"{name} {'>' if sign > 0 else '<'}{'' if strict else '='} 0" for name, sign, strict in rows)


def phases(traced: Traced) -> NDArray[np.float64]:
    """One for each transition: -1 where it has a condition, 0 where the phase depends on the parameters."""
    given = [-1.0 if jump.at is None else jump.at for jump in traced.transitions]
    return np.array([0.0 if hasattr(at, "free_symbols") else at for at in given], dtype=float)


@lru_cache(maxsize=32)
def varying_phases(traced: Traced) -> Callable[[Any], NDArray[np.float64]] | None:
    """The same as a function of the parameters' values; None where no phase depends on them."""
    found = tuple(-1.0 if jump.at is None else jump.at for jump in traced.transitions)
    if not any(hasattr(at, "free_symbols") for at in found):
        return None
    function = numeric(traced, found, quick=True)
    return lambda values: np.array(function(np.asarray(values, dtype=float).tolist()))
