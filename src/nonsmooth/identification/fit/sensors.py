"""``Sensor``: from a state or an output of a system to the numbers of a channel, and its derivatives; what a fit may
find of sensors, of the system and of the clock, shared or of each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import check_keys, shortened, unknown
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, at_least, ends, real_number
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

    @cached_property
    def jumps(self) -> bool:
        """Mark of what may jump at a transition: a state does where a reset changes it."""
        traced, k = self.system.traced, self.state
        resets = [jump.reset[k] for jump in traced.transitions if jump.reset is not None]
        return k < 0 or traced.asks or any(x != traced.u[k] for x in resets)

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


_CLOCKS = (0.9, 1.1)  # within which the time of the model over that of the recording lies


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Names, first guesses, bounds and what is known before.

    The parameters of the system that all runs share come first, then those of each run, those of sensors, the clock,
    and one phase for each run (where it is unknown). On a run act those of `active`, of `sensors`, the clock and the
    phase, in this order: ``places[run]``.

    Attributes
    ----------
    names : tuple of str
    active : tuple of str
        The parameters of the system among them, each once.
    sensors : tuple of (str, str)
        Quantity and which of gain, offset and delay, for each unknown of a sensor.
    clock : bool
        Whether the clock is unknown.
    phases : int
        How many phases are unknown: none, or one for each run.
    units : tuple of str
    guess, low, high : array (p,)
    precision : array (p, p)
        Inverse covariance of what is known before, about ``centre``.
    places : array (runs, q)
        Places of the unknowns that act on each run.
    """

    names: tuple[str, ...]
    active: tuple[str, ...]
    sensors: tuple[tuple[str, str], ...]
    clock: bool
    phases: int
    units: tuple[str, ...]
    guess: FloatArray
    low: FloatArray
    high: FloatArray
    centre: FloatArray
    precision: FloatArray
    places: NDArray[np.intp]

    @property
    def bounds(self) -> dict[str, tuple[float | None, float | None]]:
        """Those of the unknowns that have one, None for no end."""
        return {
            name: (low if low > -np.inf else None, high if high < np.inf else None)
            for name, low, high in zip(self.names, self.low.tolist(), self.high.tolist(), strict=True)
            if low > -np.inf or high < np.inf
        }

    def clock_place(self, run: int) -> int:
        """The place of the clock of a run; -1 where it is known."""
        return int(self.places[run][len(self.active) + len(self.sensors)]) if self.clock else -1


def read_unknowns(
    system: System,
    sensors: Mapping[str, Sensor],
    parameters: Any,
    priors: Any,
    runs: Sequence[str],
    settings: Sequence[Mapping[str, float]],
    per_run: Sequence[str] = (),
    steady: int = 0,
) -> Unknowns:
    """Read the unknowns of a fit from names, bounds and priors, and those of which each run has its own; the last
    ``steady`` runs have no phase. A parameter that is set in a run is known there; one that is called ``clock`` or
    ``phase`` is a parameter as any other.
    """
    given = [parameters] if isinstance(parameters, str) else list(parameters or ())
    bounds = dict(parameters) if isinstance(parameters, Mapping) else {}
    known = {"clock": (1.0, ""), "phase": (0.0, "periods")}  # first guess and unit of all that may be found
    known |= {name: (system.values[name], parameter.unit) for name, parameter in system.parameters.items()}
    for q, unit in {**system.states, **system.outputs}.items():
        if q in sensors:
            same = sensors[q].gain == 1  # of the channel and the quantity
            inverse = f"1/({unit})" if unit and not same else ""
            for what, of in zip(OF_A_SENSOR, (inverse, unit * same, ""), strict=True):  # gain, offset, delay
                known[f"{q}.{what}"] = (getattr(sensors[q], what), of)
    allowed = {name: unit for name, (_, unit) in known.items()}
    if not given and parameters is not None:  # None: all is known
        raise ValueError(f"parameters names nothing to be found; allowed: {', '.join(allowed)}")
    if twice := [name for name in given if given.count(name) > 1]:
        raise ValueError(f"parameters names {twice[0]!r} twice; name each once")
    for name in given:
        if name not in allowed:
            raise ValueError(unknown(name, "an unknown of this fit", repr(system.name), allowed))
        if all(name in own for own in settings):
            raise ValueError(f"{name!r} stands in parameters, to be found, and in settings, as known: leave one out")
    clock, phase = (name in given and name not in system.values for name in ("clock", "phase"))
    if phase and (system.period() is None or steady == len(runs)):
        why = "it has no forcing period" if system.period() is None else "readings of steady states have none"
        raise ValueError(f"the phase of {system.name!r} cannot be found: {why}; leave 'phase' out")
    active = tuple(name for name in given if name in system.values)
    of_sensors = tuple((q, what) for name in given if "." in name for q, what in [name.split(".", 1)])
    check_keys(per_run, given, "per_run", "an unknown", "this fit")
    phases = (len(runs) - steady) * phase
    own = {*per_run, *["phase"] * phase}
    each = own if len(runs) > 1 else set()
    local = [*active, *(f"{q}.{what}" for q, what in of_sensors), *["clock"] * clock, *["phase"] * phase]
    rows = [
        (n, run) for n in local for run in (runs[: phases if phase and n == "phase" else None] if n in each else [""])
    ]
    rows.sort(key=lambda row: 2 if row[0] not in active else row[0] in each)
    base, names = [n for n, _ in rows], [f"{n}, {run}" if n in each else n for n, run in rows]
    last = [base.count(n) - 1 for n in local]  # of each
    places = np.array(
        [[base.index(n) + min(run, most) for n, most in zip(local, last, strict=True)] for run in range(len(runs))],
        np.intp,
    )
    guess = np.array([known[name][0] for name in base])
    low, high = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    for i, name in enumerate(names):
        if clock and base[i] == "clock":
            low[i], high[i] = _CLOCKS
        if (pair := bounds.get(base[i])) is not None:
            low[i], high[i] = ends(pair, name)
            if not low[i] <= guess[i] <= high[i]:
                raise ValueError(
                    f"the first guess {name} = {guess[i]:g} lies outside its bounds {low[i]:g} ... {high[i]:g}; set "
                    f"another with system.with_parameters({name}=...)"
                )
    centre, precision = _known(
        names, priors, guess, [name for name, n in zip(names, base, strict=True) if n not in own]
    )
    return Unknowns(
        tuple(names),
        active,
        of_sensors,
        clock,
        phases,
        tuple(allowed[name] for name in base),
        guess,
        low,
        high,
        centre,
        precision,
        places,
    )


def _known(names: list[str], priors: Any, guess: FloatArray, shared: list[str]) -> tuple[FloatArray, FloatArray]:
    """Centre and precision of what is known before: ``{name: (value, standard uncertainty)}``, or a ParameterSet, which
    tells nothing of what each run has for its own."""
    p = len(names)
    centre, precision = guess.copy(), np.zeros((p, p))
    if priors is None:
        return centre, precision
    if hasattr(priors, "full_covariance"):
        covariance = priors.full_covariance
        held = [name for name in shared if name in covariance["parameter"].values]
        places = [names.index(name) for name in held]
        part = covariance.sel(parameter=held, other=held).values
        centre[places] = [priors.estimate(name).value for name in held]
        precision[np.ix_(places, places)] = np.linalg.inv(part)
        return centre, precision
    if not isinstance(priors, Mapping):
        raise TypeError(
            f"priors = {shortened(priors)}: allowed are {{name: (value, standard uncertainty)}} and a ParameterSet"
        )
    check_keys(priors, names, "priors", "an unknown", "this fit")
    for name, pair in priors.items():
        if not isinstance(pair, list | tuple) or len(pair) != 2:
            raise TypeError(f"priors[{name!r}] = {shortened(pair)}: allowed is (value, standard uncertainty)")
        value, error = (real_number(number, f"priors[{name!r}]") for number in pair)
        if not error > 0:
            raise ValueError(f"priors[{name!r}]: the standard uncertainty {error:g} must be positive")
        i = names.index(name)
        centre[i], precision[i, i] = value, error**-2.0
    return centre, precision
