"""``Sensor``: from a state or an output of a system to the numbers of a channel, and its derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import shortened, unknown
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, at_least
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.system import System

#: What a fit may find of a sensor, as ``"x.offset"``.
OF_A_SENSOR = ("gain", "offset", "delay")


@checked
@dataclass(frozen=True)
class Sensor:
    r"""A sensor between a state or an output of a system and a channel of a recording.

    .. math:: y(t) = \text{gain} \cdot q(t - \text{delay}) + \text{offset} + \text{noise}

    Parameters
    ----------
    channel : str, optional
        Channel of the recording; the name of the measured quantity where not given.
    gain, offset, delay : float
        First guesses where :func:`nonsmooth.fit` is asked for ``"<quantity>.gain"``, ``.offset`` or ``.delay``, and
        known values elsewhere. The delay is in units of time.
    resolution : float
        Distance of two readings that can be told apart (a count of an encoder): the residuals have a variance of at
        least resolution² / 12.
    noise : float, optional
        Standard deviation of a reading, without that of the resolution, where it is known; found from the residuals
        where not given.
    range : (low, high), optional
        Limits of the sensor, in units of the channel; infinite where there is none on a side. A reading at a limit says
        that the quantity, with its noise, was there or beyond (a censored likelihood).

    Examples
    --------
    >>> import nonsmooth as ns
    >>> ns.Sensor("Position", gain=1e3, resolution=0.05).gain  # of a position in m: readings in mm
    1000.0
    """

    channel: Annotated[str, "a sensor's channel is given by its name"] = ""
    gain: float = 1.0
    offset: float = 0.0
    delay: float = 0.0
    resolution: Annotated[float, at_least(0)] = 0.0
    noise: Annotated[float, above(0), "leave it out where unknown"] | None = None
    range: Any = None

    def __post_init__(self) -> None:
        if self.gain == 0:
            raise ValueError("gain = 0: a sensor with this gain shows nothing; give how the channel grows with it")
        if self.range is not None:
            try:
                low, high = map(float, self.range)
            except (TypeError, ValueError):
                raise ValueError(f"range = {shortened(self.range)}: give (low, high), the sensor's limits") from None
            if not low < high:
                raise ValueError(f"range = ({low:g}, {high:g}): the lower limit comes first")
            object.__setattr__(self, "range", (low, high))

    def limit(self, y: FloatArray) -> FloatArray:
        """1 where a reading is at the upper limit, -1 at the lower one, else 0."""
        low, high = self.range or (-np.inf, np.inf)
        return (y >= high).astype(float) - (y <= low)

    @property
    def floor(self) -> float:
        """Least standard deviation of a reading: that of rounding."""
        return self.resolution / np.sqrt(12.0)


def read_sensors(system: System, measured: Any, channels: Sequence[str]) -> dict[str, Sensor]:
    """The measured quantities, states or outputs of the system, with their sensors."""
    own = list(system.states)[: system._description.n_own]
    known = {name: system.states[name] for name in own} | dict(system.outputs)
    if measured is None:
        found = {name: Sensor(name) for name in known if name in channels}
        if not found:
            raise ValueError(
                f"no channel is named as a state or an output of {system.name!r} ({', '.join(known)}); the recording "
                f"has {', '.join(channels) or 'none'}: say which measures what, measured={{"
                f"{next(iter(known))!r}: {next(iter(channels), 'channel')!r}}}"
            )
        return found
    if isinstance(measured, str):
        measured = [measured]
    if not isinstance(measured, Mapping):
        measured = {name: name for name in measured}
    sensors = {}
    for name, given in measured.items():
        if name not in known:
            raise ValueError(unknown(name, "a state or an output", repr(system.name), known))
        sensor = Sensor(given) if isinstance(given, str) else given
        if not isinstance(sensor, Sensor):
            raise TypeError(f"measured[{name!r}] = {given!r}: allowed are the name of a channel and ns.Sensor(...)")
        sensors[str(name)] = sensor if sensor.channel else replace(sensor, channel=str(name))
    if not sensors:
        raise ValueError(f"measured names nothing; allowed: {', '.join(known)}")
    return sensors


class Observable:
    """A state or an output of a system along a motion, with its derivatives in the parameters at these places."""

    def __init__(self, system: System, name: str, places: Sequence[int]) -> None:
        self.system, self.places = system, tuple(places)
        self.state = list(system.states).index(name) if name in system.states else -1
        self.output = -1 if self.state >= 0 else list(system.outputs).index(name)
        patterns = system.traced.patterns
        if patterns is not None and name in patterns.outputs:
            raise ValueError(
                f"{name!r} is the force of an element of a system whose modes are made when they are visited: such a "
                "force cannot be fitted; measure a state or an output of your own"
            )

    def value(self, t: FloatArray, z: FloatArray, mode: Any, p: FloatArray) -> FloatArray:
        """Values (N,) at N samples."""
        if self.state >= 0:
            return z[:, self.state]
        return self._evaluate(t, z, mode, p)[:, 0]

    def slopes(
        self,
        t: FloatArray,
        z: FloatArray,
        mode: Any,
        p: FloatArray,
        D: FloatArray,
        rate: FloatArray,
        of_time: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Derivatives of the values in the start and the active parameters (N, n + n_active), along the motion, and in
        the time of the whole run (N,): by those of the motion."""
        if self.state >= 0:
            return D[:, self.state], rate[:, self.state], of_time[:, self.state]
        traced, n = self.system.traced, z.shape[1]
        symbols = (*traced.u, *traced.m, *(traced.p[i] for i in self.places), traced.t)
        own = self._evaluate(t, z, mode, p, symbols)[:, 1:]
        in_z, in_t = own[:, :n], own[:, -1]
        of_all = np.einsum("ri,rij->rj", in_z, D)
        of_all[:, n:] += own[:, n:-1]
        return of_all, (in_z * rate).sum(axis=1) + in_t, (in_z * of_time).sum(axis=1) + in_t

    def _evaluate(
        self, t: FloatArray, z: FloatArray, mode: Any, p: FloatArray, symbols: tuple[Any, ...] | None = None
    ) -> FloatArray:
        """The output (N, 1), and its derivatives in some symbols behind it."""
        traced, out = self.system.traced, np.empty((len(t), 1 + len(symbols or ())))
        for m in dict.fromkeys(mode.tolist()):
            here = mode == m
            own = numeric(traced, (traced.outputs[self.output][m],), symbols)
            n_u, states = len(traced.u), z[here]
            out[here] = own(p, t[here], states[:, :n_u], states[:, n_u:]).reshape(len(states), -1)
        return out
