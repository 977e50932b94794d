"""Sections of a trajectory: at a phase of the forcing, or on a surface, and what counts as a return there.

The rules in code are ``note_side`` of the steppers (:mod:`nonsmooth.kernels.linear.stepper`, ``series.stepper``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from nonsmooth.errors import shortened
from nonsmooth.kernels.hybrid.kept import Section
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, at_least

if TYPE_CHECKING:
    from nonsmooth.system.system import System


@checked
@dataclass(frozen=True)
class Stroboscopic:
    """The state at one phase of every forcing period.

    Parameters
    ----------
    phase : float
        In forcing periods, 0 <= phase < 1.

    Raises
    ------
    ValueError
        A phase outside 0..1.
    """

    phase: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.phase < 1.0:
            raise ValueError(f"phase = {self.phase}: the phase is given in forcing periods, 0 <= phase < 1")


@checked
@dataclass(frozen=True)
class Poincare:
    """The state each time an indicator goes through zero.

    Parameters
    ----------
    indicator : str
        Name of the indicator.
    rising : bool or None
        Through zero upwards, downwards, or (None) both. A motion that comes to the surface and slides or rests on it
        has passed it when it arrives, not when it leaves; an impact passes it both upwards and downwards. A jump from
        one side to the other is no pass: the motion is nowhere on the surface.
    mode : str, optional
        Count it in this mode only.
    side : str
        ``"after"`` or ``"before"``: which limit is taken where the section lies on a switching surface.
    every : int
        Take each ``every``-th return.
    t_max : float, optional
        The longest wait for one return, in time; beyond it the status is ``no_convergence``. Default: 1000 forcing
        periods, or 1e6 units of time.
    """

    indicator: str
    rising: Annotated[bool, "True (upwards), False (downwards), None (both)"] | None = True
    mode: str | None = None
    side: Literal["after", "before"] = "after"
    every: Annotated[int, at_least(1)] = 1
    t_max: Annotated[float, above(0)] | None = None


_EACH_PERIOD = Stroboscopic()


def section_plan(system: System, section: Any) -> tuple[Stroboscopic | Poincare, Section]:
    """The section meant (``Stroboscopic(0)`` where None and the system has a period), and its integers.

    Raises
    ------
    ValueError, TypeError
        No section for an autonomous system, an unknown indicator or mode.
    """
    period = system.period()
    if section is None:
        if period is None:
            raise ValueError(
                f"{system.name!r} has no forcing period, so there is no stroboscopic section; "
                f'pass section=ns.Poincare("indicator"), one of: {", ".join(system.indicators) or "(it has none)"}'
            )
        section = _EACH_PERIOD
    if isinstance(section, Stroboscopic):
        if period is None:
            raise ValueError(f"{system.name!r} has no forcing period: use ns.Poincare(...) in place of {section}")
        return section, Section(phase=section.phase)
    if not isinstance(section, Poincare):
        raise TypeError(f"section must be ns.Stroboscopic(...) or ns.Poincare(...), not {shortened(section)}")
    from nonsmooth.errors import unknown
    from nonsmooth.flow.starts import mode_number

    indicators = list(system.indicators)
    mode = -1 if section.mode is None else mode_number(system, section.mode)
    if section.indicator not in indicators:
        raise ValueError(unknown(section.indicator, "an indicator", repr(system.name), indicators))
    if mode is None:
        raise ValueError(unknown(str(section.mode), "a mode", repr(system.name), system.written_out().modes))
    t_max = section.t_max
    if t_max is None:
        t_max = 1e6 if period is None else 1e3 * period
    return section, Section(
        phase=-1.0,
        indicator=indicators.index(section.indicator),
        rising=0 if section.rising is None else 2 * int(section.rising) - 1,
        mode=mode,
        after=int(section.side == "after"),
        every=int(section.every),
        t_max=float(t_max),
    )
