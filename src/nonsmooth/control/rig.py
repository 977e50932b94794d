"""``Rig``: the three methods by which an experiment is steered; ``Guard``: their readings and forces, checked."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any, Protocol

from nonsmooth.errors import SolveError, shortened


class Rig(Protocol):
    """An experiment that can be driven, pushed and read.

    Any object with these three methods is a rig: an interface to hardware, or a simulation (:class:`SimulatedRig`).
    Nothing else is asked of it. Three attributes are used where they are there: ``mass`` (from which the gains follow),
    ``names`` (a mapping from "frequency", "amplitude", "position" and "velocity" to the names in results) and ``units``
    (from these names, and "force", to units).
    """

    def set_drive(self, frequency: float, amplitude: float) -> tuple[float, float]:
        """Set the drive's angular frequency and amplitude; return what was really set, to the last step of a knob."""

    def apply_force(self, force: float) -> None:
        """Set the control force on the moving mass; it stays until it is set again."""

    def read(self) -> tuple[float, float]:
        """Wait for the next sample; return the drive's phase in turns, which counts on, and the position."""


ATTEMPTS = 3  # to set the force to zero, where the rig answers with an exception


@dataclass
class Guard:
    """A rig within limits. It ends by ``SolveError``, the force set to zero before."""

    rig: Rig
    low: float = -math.inf  # of the position
    high: float = math.inf
    force: float = math.inf  # the greatest
    _phase: float = -math.inf
    _shown: float = math.nan
    _since: float = math.inf  # phase from which on the sensor shows the same

    def set_drive(self, frequency: float, amplitude: float) -> tuple[float, float]:
        """Set the drive; return what was really set."""
        self._phase, self._shown = -math.inf, math.nan
        first, second = self._asked("set_drive", frequency, amplitude)
        return first, second

    def apply_force(self, force: float) -> None:
        """Set a force within its limit; beyond it, or where it is no number, set zero and stop."""
        if not abs(force) <= self.force:
            raise self.stopped(
                f"the controller asked for a force of {force:.3g}, beyond its limit of {self.force:.3g}: the "
                "controlled motion grows (an actuator or sensor of the wrong sign, a delay too long for the rate of "
                "the readings, gains too high), or greatest_force= is too small"
            )
        self._asked("apply_force", force)

    def read(self) -> tuple[float, float]:
        """Return phase and position of the next sample, checked."""
        phase, position = self._asked("read")
        if not phase > self._phase:
            raise self.stopped(f"the phase of the drive went from {self._phase:.6g} to {phase:.6g}: it must count on")
        if not self.low <= position <= self.high:
            raise self.stopped(f"the position {position:.6g} is beyond its limit, {self.low:.6g} to {self.high:.6g}")
        if position != self._shown:
            self._shown, self._since = position, phase
        elif phase - self._since >= 1.0:
            raise self.stopped(f"the sensor showed {position:.6g} for a whole turn of the drive: it does not follow")
        self._phase = phase
        return phase, position

    def off(self) -> str:
        """Set the force to zero; where the rig does not take it, warn and say so."""
        error: Exception | None = None
        for _ in range(ATTEMPTS):
            try:
                self.rig.apply_force(0.0)
            except Exception as reason:
                error = reason
            else:
                return ""
        words = f"the force could not be set to zero ({_told(error)}): switch the actuator off"
        warnings.warn(words, RuntimeWarning, stacklevel=2)
        return f"; {words}"

    def stopped(self, why: str) -> SolveError:
        """The force set to zero, and the error that says why."""
        return SolveError(f"stopped: {why}{self.off()}", status="stopped")

    def _asked(self, method: str, *values: float) -> tuple[float, ...]:
        """Answer of a method of the rig: two finite numbers, or none where a force is set."""
        try:
            answer: Any = getattr(self.rig, method)(*values)
        except Exception as error:
            raise self.stopped(f"{method} of the rig failed ({_told(error)})") from error
        if method == "apply_force":
            return ()
        try:
            first, second = (float(one) for one in answer)
        except (TypeError, ValueError):
            first = second = math.nan
        if not math.isfinite(first) or not math.isfinite(second):
            raise self.stopped(f"{method} of the rig returned {shortened(answer)}, not two finite numbers")
        return first, second


def _told(error: Exception | None) -> str:
    return f"{type(error).__name__}: {shortened(error, quoted=False)}"
