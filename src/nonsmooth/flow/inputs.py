"""`Input`: a measured or chosen function of time that drives a run: held, linear or smooth between its samples."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import factorial
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.errors import shortened, unknown
from nonsmooth.flow.engines.engine import Changes, State
from nonsmooth.flow.saltation import Jump
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, float_array

if TYPE_CHECKING:
    from nonsmooth.flow.variational import VariationalFlow
    from nonsmooth.system.system import System


@checked
@dataclass(frozen=True, eq=False)
class Input:
    """Samples of an input of a system: linear between them, held until the next, or on a smooth curve.

    Parameters
    ----------
    time, values : array
        Instants, increasing, and the input there. Before the first and behind the last sample the nearest value holds.
        For a fit the name of a channel of the recording alone: ``Input("motor force", delay="late")``.
    between : {"linear", "steps", "smooth"}, optional
        The course between samples; ``"smooth"`` is a cubic spline (of ends "not a knot"), for inputs that are declared
        as ``(unit, "smooth")`` and by default taken for such. Others are linear by default.
    noise : float, optional
        Standard deviation of the values of a smooth input: the spline passes them by so much (``splrep`` of SciPy with
        ``s`` the number of values), with as few pieces as do, where it passes through all of them otherwise.
    delay : float or str
        The input acts so much later than its samples say; the name of a parameter of the system, so that it can be
        found by a fit.

    Examples
    --------
    >>> import numpy as np
    >>> import nonsmooth as ns
    >>> cart = ns.mechanical(2.0, 0.0, 0.0, forcing={"q": lambda t, p: p.force}, inputs={"force": "N"})
    >>> run = ns.simulate(cart, duration=3.0, inputs={"force": ns.Input([0, 1, 2], [4, 0, -4], between="steps")})
    >>> float(round(run.u.sel(state="q").values[-1], 12))
    4.0
    """

    time: Any
    values: Any = None
    between: Literal["linear", "steps", "smooth"] | None = None
    delay: float | str = 0.0
    noise: Annotated[float, above(0)] | None = None

    def __post_init__(self) -> None:
        if self.noise is not None and self.between in ("linear", "steps"):
            raise ValueError(f"noise = {self.noise} is that of a smooth input; this one is {self.between!r}")
        if isinstance(self.time, str) and self.values is None:
            return
        t, y = float_array(self.time, "the time of an input"), float_array(self.values, "the values of an input")
        if t.ndim != 1 or t.shape != y.shape or not len(t):
            raise ValueError(f"an input is as many values as instants, in one row; got shapes {y.shape} and {t.shape}")
        if not (np.isfinite(t).all() and np.isfinite(y).all()):
            where = int(np.flatnonzero(~(np.isfinite(t) & np.isfinite(y)))[0])
            raise ValueError(
                f"sample {where} of an input is not finite; drop such samples or fill them: nothing is said about the "
                "input there"
            )
        if (np.diff(t) <= 0).any():
            where = int(np.flatnonzero(np.diff(t) <= 0)[0])
            raise ValueError(
                f"the time of an input must increase; sample {where + 1} is at {t[where + 1]:.9g} after {t[where]:.9g}"
            )
        if self.noise is not None and len(t) < 4:
            raise ValueError(f"noise = {self.noise} of an input of {len(t)} values: at least 4 tell a curve from it")
        for name, array in (("time", t), ("values", y)):
            array = array.copy()
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def course(self, delay: float, width: int) -> tuple[FloatArray, FloatArray]:
        """Instants of change (K,), and the value and its derivatives behind them (K, ``width``)."""
        t, pieces = self._pieces
        found = np.zeros((len(t), width))
        found[:, : pieces.shape[1]] = pieces
        return t + delay, found

    @functools.cached_property
    def _pieces(self) -> tuple[FloatArray, FloatArray]:
        """Instants (K,), without a delay, and the value and those derivatives behind them that are not zero."""
        t, y = self.time, self.values
        if self.between == "steps" or len(t) == 1:
            return t, y[:, None]
        if self.between == "linear":
            return t, np.stack([y, np.append(np.diff(y) / np.diff(t), 0.0)], axis=1)
        from scipy.interpolate import CubicSpline, PPoly, splrep

        spline = CubicSpline(t, y)
        if self.noise is not None:
            found, over, code, _ = splrep(t, y, np.full(len(t), 1 / self.noise), s=len(t), full_output=True)
            spline = PPoly.from_spline(found)
            if code > 0:
                warnings.warn(
                    f"noise = {self.noise:.6g} of a smooth input: no spline was found that passes its {len(t)} values "
                    f"by so much; this one passes them by {self.noise * np.sqrt(over / len(t)):.3g}. Give the noise "
                    "that they have",
                    RuntimeWarning,
                    stacklevel=2,
                )
        real = np.append(np.diff(spline.x) > 0, True)  # its ends stand there four times
        found = [np.append(spline.c[-1 - i] * factorial(i), 0.0 if i else spline(t[-1])) for i in range(4)]
        return spline.x[real], np.stack(found, axis=1)[real]

    def data(self) -> dict[str, Any]:
        """The input as data that a result can record."""
        about = {"samples": len(self.time), "first": float(self.time[0]), "last": float(self.time[-1])}
        return {**about, "between": self.between, "delay": self.delay} | ({"noise": self.noise} if self.noise else {})


class Driven:
    """The inputs of one run of a system, all of them."""

    def __init__(self, system: System, inputs: Mapping[str, Input]) -> None:
        self.inputs = {name: inputs[name] for name in system.inputs}
        self.first = system._description.n_own
        self.widths = [len(states) for states in system._description.driven.values()]
        self._known: dict[tuple[float, ...], DelayedInputs] = {}

    def at(self, values: Mapping[str, float]) -> DelayedInputs:
        """The inputs at values of the parameters, among which delays may be."""
        delays = tuple(values[one.delay] if isinstance(one.delay, str) else one.delay for one in self.inputs.values())
        if delays not in self._known:
            self._known = {delays: DelayedInputs(self, delays)}
        return self._known[delays]

    def data(self) -> dict[str, Any]:
        """The inputs as data that a result can record."""
        return {name: one.data() for name, one in self.inputs.items()}


class DelayedInputs:
    """The inputs of a run with known delays.

    Attributes
    ----------
    times : array (K,)
        Instants at which an input changes.
    table : array (K, states)
        The states of all m inputs behind them.
    """

    def __init__(self, drive: Driven, delays: Sequence[float]) -> None:
        self.first, self.delays = drive.first, [one.delay for one in drive.inputs.values()]
        self.of = np.repeat(np.arange(len(delays)), drive.widths)  # the input of each state
        given = zip(drive.inputs.values(), delays, drive.widths, strict=True)
        self.courses = [one.course(delay, width) for one, delay, width in given]
        self.times = np.unique(np.concatenate([t for t, _ in self.courses]))
        self.table = self.at(self.times)

    def at(self, times: Any) -> FloatArray:
        """The states (..., n) of all inputs just behind some instants (...)."""
        found = []
        for t, course in self.courses:
            k = np.searchsorted(t, times, "right") - 1
            behind = np.where(k >= 0, times - t[k], 0.0)
            rows = [np.where((k >= 0) | (i == 0), course[np.maximum(k, 0), i], 0.0) for i in range(course.shape[1])]
            found += [sum(row * behind**i / factorial(i) for i, row in enumerate(rows[j:])) for j in range(len(rows))]
        return np.stack(found, axis=-1)

    def changes(self, begin: float, until: float) -> Changes:
        """The changes between two instants, the ends left out."""
        here = slice(np.searchsorted(self.times, begin, "right"), np.searchsorted(self.times, until, "left"))
        return Changes(self.times[here], self.table[here], self.first)

    def by_delays(self, flow: VariationalFlow, rates: FloatArray) -> FloatArray:
        """Derivatives (..., n, n_active) of the states that are inputs in the active parameters: in their delays."""
        found = np.zeros((*rates.shape[:-1], flow.n, flow.n_active))
        for k, i in enumerate(self.of, start=self.first):
            if self.delays[i] in flow.active:
                found[..., k, flow.active.index(str(self.delays[i]))] = -rates[..., k]
        return found

    def moved(self, flow: VariationalFlow, times: FloatArray) -> tuple[BoolArray, BoolArray]:
        """Does an active parameter move what changes at some times (K, n_active), and some of it only?"""
        changed = np.stack([t[np.searchsorted(t[:-1], times)] == times for t, _ in self.courses], axis=1)[:, None]
        mine = np.array([[delay == name for delay in self.delays] for name in flow.active], dtype=bool)
        mine = mine.reshape(flow.n_active, len(self.delays))
        moved = (changed & mine).any(axis=2)
        return moved, moved & (changed & ~mine).any(axis=2)

    def lasting(
        self,
        flow: VariationalFlow,
        values: FloatArray,
        modes: IntArray,
        times: FloatArray,
        states: tuple[FloatArray, FloatArray],
        before: FloatArray,
    ) -> FloatArray:
        """Rates (K, n_active, n) that last longer where an active parameter is greater, at changes of inputs.

        Those before the change, where it moves all that changes there; else what it does not move has changed: where
        forces multiply two such inputs, derivatives are those towards a greater delay. Modes are those before,
        ``states`` those before and behind (K, n)."""
        found = np.repeat(before[:, None], flow.n_active, axis=1)
        for j, some in enumerate(self.moved(flow, times)[1].T):
            if some.any():
                z = states[0][some]
                others = self.first + np.flatnonzero([self.delays[i] != flow.active[j] for i in self.of])
                z[:, others] = states[1][some][:, others]
                found[some, j] = flow.segments(values, modes[some], times[some], np.zeros(len(z)), z).f_begin
        return found

    def steps(
        self, flow: VariationalFlow, times: FloatArray, lasting: FloatArray, after: FloatArray, then: Jump | None = None
    ) -> FloatArray:
        """Derivatives (K, N, N) across changes of inputs, from the rates that last longer where a delay is greater
        (:meth:`lasting`) to those behind (K, n), and the transitions that they bring about (``then``), which happen at
        their times whatever their conditions.

        Inputs take values of their own."""
        n, own = flow.n, slice(self.first, flow.n_u)
        R, late = np.eye(n + flow.n_active), lasting - after[:, None]
        R[own] = 0.0
        if then is not None:
            R = then.R @ R
            late = lasting @ R[:n, :n].T + then.fields[2, :n] - after[:, None]
        S = np.repeat(R[None], len(times), axis=0)
        S[:, :n, n:] += self.moved(flow, times)[0][:, None, :] * late.transpose(0, 2, 1)
        S[:, own, n:] = self.by_delays(flow, after)[:, own]
        return S


def under(course: DelayedInputs | None, state: State, begin: float, until: float) -> Changes | None:
    """The changes of inputs between two instants, the state given those with which it begins; None without inputs."""
    if course is None:
        return None
    state.u[course.first :] = course.at(begin)
    return course.changes(begin, until)


def driven(system: System, given: Any) -> Driven | None:
    """The inputs of a run as they were given: a mapping of input to `Input` or (time, values); a table with ``time``.

    Raises
    ------
    ValueError, TypeError
        An input that is missing or that the system does not have.
    """
    if given is None:
        if system.inputs:
            raise ValueError(
                f"{system.name!r} has the inputs {', '.join(map(repr, system.inputs))}: give inputs=, such as "
                f'{{"{next(iter(system.inputs))}": (time, values)}}'
            )
        return None
    if not system.inputs:
        raise ValueError(f'{system.name!r} has no inputs; declare them: ns.System(..., inputs={{"force": "N"}})')
    if isinstance(given, Mapping) and not hasattr(given, "data_vars") and "time" not in given:
        for name in given:
            if name not in system.inputs:
                raise ValueError(f"inputs: {unknown(str(name), 'an input', repr(system.name), system.inputs)}")
        table = given
    elif isinstance(given, Mapping) or hasattr(given, "columns") or hasattr(given, "data_vars"):
        try:
            table = {name: (np.asarray(given["time"]), np.asarray(given[name])) for name in system.inputs}
        except KeyError as error:
            raise ValueError(
                f"inputs: the table has no column {error}; it needs 'time' and {', '.join(map(repr, system.inputs))}"
            ) from None
    else:
        raise TypeError(
            f"inputs = {shortened(given)}: allowed are a mapping of input to (time, values) or ns.Input(...), and a "
            "table with a column 'time'"
        )
    found = {}
    for name in system.inputs:
        if name not in table:
            raise ValueError(
                f"inputs: {name!r} is missing; {system.name!r} has {', '.join(map(repr, system.inputs))}: give each as "
                "(time, values) or ns.Input(...), beside a recording also by the name of a channel"
            )
        one = table[name]
        if not isinstance(one, Input):
            if not isinstance(one, list | tuple) or len(one) != 2:
                if hasattr(one, "dims") and "time" in getattr(one, "coords", ()):  # a channel of a recording
                    raise TypeError(f"inputs[{name!r}] is an array over its time: give (y.time, y) of such a y")
                raise TypeError(f"inputs[{name!r}] = {shortened(one)}: give (time, values) or ns.Input(...)")
            one = Input(*one)
        smooth = len(system._description.driven[name]) > 2
        if one.between is None:
            one = replace(one, between="smooth" if smooth or one.noise is not None else "linear")
        if one.between == "smooth" and not smooth:
            raise ValueError(
                f"inputs[{name!r}] is smooth between its samples, which {system.name!r} has to know: declare it with "
                f"ns.System(..., inputs={{{name!r}: ({system.inputs[name]!r}, 'smooth')}})"
            )
        if isinstance(one.time, str):
            raise ValueError(
                f"inputs[{name!r}] names the channel {one.time!r}, which fit takes from its recording; here give its "
                "samples: ns.Input(time, values)"
            )
        if isinstance(one.delay, str) and one.delay not in system.values:
            raise ValueError(
                f"the delay of {name!r}: {unknown(one.delay, 'a parameter', repr(system.name), system.values)}"
            )
        found[name] = one
    _refuse_jumps(system, found)
    return Driven(system, found)


def _refuse_jumps(system: System, inputs: Mapping[str, Input]) -> None:
    """Raise where the place of a rigid stop jumps: no motion goes on from beyond it."""
    loads, description = system._description.loads, system._description
    of = dict(zip(description.traced.state_names, description.traced.u, strict=True))
    for name, one in inputs.items():
        for load in loads.elements if loads is not None and one.between == "steps" else ():
            if load.element.bears and of[name] in load.where.free_symbols:
                raise ValueError(
                    f"inputs[{name!r}] moves the stop {load.name!r} and is held between its samples: the stop would "
                    'jump into the mass. Give it as linear between them, ns.Input(..., between="linear")'
                )
