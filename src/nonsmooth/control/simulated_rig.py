"""``SimulatedRig``: any driven ``System`` with an actuator as a rig, with a sampled, noisy, stepped position sensor."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from nonsmooth.errors import SystemDefinitionError, unknown
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Count, above, at_least, real_number

if TYPE_CHECKING:
    from nonsmooth.system.system import System


FORCE = "control_force"


def actuated(system: System, *, velocity: str, mass: str | float) -> System:
    """Return the system with the memory ``control_force``, which acts on the rate of ``velocity`` as force / mass.

    Raises
    ------
    SystemDefinitionError
        A system without a forcing period, or with a mode that no force could end.
    """
    content = json.loads(system.to_text())
    _check(system, content, velocity)
    content["memory"][FORCE] = {"value": 0.0, "unit": ""}
    rate = f"p.{FORCE}/{f'p.{mass}' if isinstance(mass, str) else repr(float(mass))}"
    for rates in content["modes"].values():
        rates[velocity] = f"({rates[velocity]}) + {rate}"
    content.pop("bands", None)  # fields of the smoothed system, which know no actuator
    return type(system).from_text(json.dumps(content))


def _check(system: System, content: dict[str, Any], velocity: str) -> None:
    name = repr(system.name)
    if "period" not in content:
        raise SystemDefinitionError(f"{name} has no forcing period, with which the reference of a controller repeats")
    if system.is_smoothed:
        raise SystemDefinitionError(
            f"{name} is smoothed: an actuator is added to the fields of modes; give the system before `smoothed`"
        )
    held = [mode for mode, rates in content["modes"].items() if rates.get(velocity, "0") == "0"]
    if held:
        raise SystemDefinitionError(
            f"{name}: in mode {held[0]!r} no force acts on {velocity!r}, so that no controller could end it; give its "
            "contacts and frictions as elements (ns.elements), which the force of an actuator moves like any other"
        )


_NO_SAMPLES = np.empty(0)


class SimulatedRig:
    r"""A driven system as a rig: a force acts on its mass, a sensor samples its position.

    .. math:: y_k = q \left\lfloor \frac{x(t_k) + n_k}{q} + \tfrac12 \right\rfloor

    with the steps q (``resolution``) and the noise n of the sensor. The force stays constant between samples.

    Parameters
    ----------
    system : System
        Its parameters are those of the rig; those of the drive are set by :meth:`set_drive`.
    position, velocity : str
        The state that is measured, and the one on whose rate the force acts.
    mass : str or float
        A parameter of the system, or a number: the rate of ``velocity`` gets force / mass.
    frequency, amplitude : str
        The drive's parameters; the frequency is angular.
    rate : float
        Samples per unit of time. They are not tied to the period of the drive.
    resolution, noise, jitter : float
        Steps of the sensor, standard deviation of its readings, and of the instants of sampling.
    seed : int
        Of noise and jitter.
    start : state, optional
        Where the motion begins.
    method : str
        Of the simulation; see :func:`nonsmooth.simulate`.

    Raises
    ------
    ValueError, TypeError
        Names that the system does not have, values that cannot be.
    SystemDefinitionError
        A system on which no such force can act: no forcing period, a mode that holds the velocity.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> rig = ns.SimulatedRig(ns.models.discontinuous_support(), noise=1e-5)
    >>> rig.set_drive(4.5, 0.14)
    (4.5, 0.14)
    >>> rig.apply_force(0.01)
    >>> phase, position = rig.read()
    """

    @checked
    def __init__(
        self,
        system: System,
        *,
        position: str = "x",
        velocity: str = "v",
        mass: str | float = "m",
        frequency: str = "omega",
        amplitude: str = "rho",
        rate: Annotated[float, above(0), "samples per unit of time"] = 100.0,
        resolution: Annotated[float, at_least(0)] = 0.0,
        noise: Annotated[float, at_least(0)] = 0.0,
        jitter: Annotated[float, at_least(0)] = 0.0,
        seed: Count = 0,
        start: Any = None,
        method: Literal["auto", "exact", "taylor", "rkf45"] = "auto",
    ) -> None:
        from nonsmooth.flow.engines.methods import engine_for
        from nonsmooth.flow.starts import first_state

        units = {key: one.unit for key, one in system.parameters.items()}
        states, knobs = {"position": position, "velocity": velocity}, {"frequency": frequency, "amplitude": amplitude}
        for some, kind, known in (states, "a state", system.states), (knobs | {"mass": mass}, "a parameter", units):
            for option, name in some.items():
                if isinstance(name, str) and name not in known:
                    said = unknown(name, kind, repr(system.name), known)
                    raise ValueError(f"{option} = {name!r}: {said}; give {option}= of this system")
        self.names = {"frequency": frequency, "amplitude": amplitude, "position": position, "velocity": velocity}
        self.units = {name: system.parameters[name].unit for name in (frequency, amplitude)} | dict(system.states)
        self.mass = float(system.values[mass]) if isinstance(mass, str) and mass in system.values else mass
        self.rate, self.resolution, self.noise, self.jitter = float(rate), resolution, noise, jitter
        self.system = system
        self._system = actuated(system, velocity=velocity, mass=mass)
        self._engine = engine_for(self._system, method)
        self._state = first_state(self._system, start)
        self._place = list(system.states).index(position)
        self._memory = list(self._system.memory).index(FORCE)
        self._rng = np.random.default_rng(seed)
        self._tables: Any = None
        self._due = 1.0 / self.rate  # until the next sample
        self._late = 0.0  # of the last sample, by jitter
        self.set_drive(system.values[frequency], system.values[amplitude])

    def set_drive(self, frequency: float, amplitude: float) -> tuple[float, float]:
        """Set the drive; the motion goes on from where it is, at equal phase."""
        values = {
            self.names["frequency"]: real_number(frequency, "frequency"),
            self.names["amplitude"]: real_number(amplitude, "amplitude"),
        }
        self._system = self._system.with_parameters(values)
        self._tables = self._engine.prepare(self._system.parameter_vector()[None, :])
        self._room = self._engine.room(self._tables)
        period = self._system.period()
        assert period is not None  # `actuated` refuses systems without
        self._period = period
        self._state.keep_phase(period, -1.0)
        return values[self.names["frequency"]], values[self.names["amplitude"]]

    def apply_force(self, force: float) -> None:
        """Set the force on the mass; it stays until it is set again."""
        self._state.memory[self._memory] = force

    def read(self) -> tuple[float, float]:
        """Go on to the next sample; return the drive's phase in turns, and the position that the sensor shows.

        Raises
        ------
        SolveError
            The simulation could not go on.
        """
        clock = self._state.clock
        late = self.jitter * min(max(float(self._rng.standard_normal()), -3.0), 3.0) if self.jitter else 0.0
        wait = max(self._due + late - self._late, 0.0)
        self._late = late
        until = clock[1] * self._period + clock[0] + wait
        log = self._engine.record(self._tables, self._state, until, _NO_SAMPLES, self._room)
        if log.status != codes.OK:
            from nonsmooth.flow.failure import solve_error

            names = list(self._system.states)
            raise solve_error(
                log.status,
                time=float(clock[1] * self._period + clock[0]),
                state={name: float(value) for name, value in zip(names, self._state.u, strict=True)},
                mode=self._system.modes[int(self._state.counters[0])],
            )
        phase = clock[1] + (clock[0] - late) / self._period  # by the even clock of the interface
        return float(phase), self.reading(float(self._state.u[self._place]))

    def reading(self, position: float) -> float:
        """Return what the sensor shows at a position."""
        shown = position + (self.noise * float(self._rng.standard_normal()) if self.noise else 0.0)
        return self.resolution * math.floor(shown / self.resolution + 0.5) if self.resolution else shown
