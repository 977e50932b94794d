"""``Orbit``: one periodic orbit with its signature and multipliers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.branches.reading import fields_of, layout_attributes, layouts_of, recorded, undamaged
from nonsmooth.continuation.problems.multipliers import stability, stable_by
from nonsmooth.continuation.problems.orbits import OrbitPoint
from nonsmooth.continuation.problems.signature import Signature
from nonsmooth.errors import Answering, SolveError
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.loads import checked_loads, meter_of
from nonsmooth.flow.starts import mode_number
from nonsmooth.results.representation import cut, html_table
from nonsmooth.system.system import System

if TYPE_CHECKING:
    import xarray as xr

RTOL = 1e-13  # of the trajectory, where the flow is not exact
AT_SECTION = 1e-14  # of the period: a transition nearer to the section than rounding tells


@dataclass(frozen=True, eq=False, repr=False)
class Orbit(Answering):
    """A periodic orbit, found by :func:`nonsmooth.find_orbit`.

    Attributes
    ----------
    system : System
        At the parameters of the orbit.
    u : array (n,)
        The state at the section: phase 0 of the forcing; of an autonomous system the middle of the first visit.
    mode : str
        The mode there.
    memory : array (n_memory,)
    period : float
    period_number : int
        Forcing periods once round; 0 where the system is autonomous.
    signature : Signature
        Modes visited and transitions taken, in order from the section.
    crossing_times : array (n_crossings,)
        Instants of the transitions after the section.
    crossing_states : array (n_crossings, n + n_memory)
        States (and memory) just after them.
    monodromy_matrix : array (n, n)
        Derivative of the return map, through every transition (with its saltation matrix); rows and columns of the
        memory follow those of the states. A state or a memory that nothing on the orbit changes counts as a parameter:
        its row, its column and its multiplier are 0.
    floquet_multipliers : array (n,), complex
        Its eigenvalues, largest modulus first; that of an autonomous orbit's own direction, 1, is among them.
    stable : bool
        All multipliers (but that one) lie inside the unit circle.
    maximum, minimum : array (n,)
        Extremes of the states.
    clearance : mapping of indicator to float
        Least distance to a transition that does not happen; NaN where none comes near.
    virtual : bool
        Whether the path goes through a boundary it should have obeyed: no orbit of the system then.
    loads : mapping of str to float
        Loads of elements and work, per forcing period (autonomous: once round), where they were asked for; names and
        signs are those of :func:`nonsmooth.sweep`.
    options : mapping
        Arguments of :func:`nonsmooth.find_orbit`, as they were given.
    """

    system: System
    u: FloatArray
    mode: str
    memory: FloatArray
    period: float
    period_number: int
    signature: Signature
    crossing_times: FloatArray
    crossing_states: FloatArray
    monodromy_matrix: FloatArray
    floquet_multipliers: ComplexArray
    stable: bool
    maximum: FloatArray
    minimum: FloatArray
    clearance: dict[str, float]
    virtual: bool = False
    options: Mapping[str, Any] = field(default_factory=dict)
    loads: Mapping[str, float] = field(default_factory=dict)

    def _elsewhere(self, name: str) -> str:
        if name in self.system.states:
            return f": orbit.u is the section point, orbit.trajectory()['u'].sel(state={name!r}) the orbit's {name}"
        return f": orbit.system.values[{name!r}] is that parameter" if name in self.system.values else ""

    @property
    def crossings_per_period(self) -> float:
        """Transitions per forcing period (autonomous: once round)."""
        return self.signature.rates(self.system.transitions, self.period_number)[0]

    @property
    def contacts_per_period(self) -> float:
        """Entries into contact per forcing period (autonomous: once round)."""
        return self.signature.rates(self.system.transitions, self.period_number)[1]

    def trajectory(self, samples: int | None = None) -> xr.Dataset:
        """The orbit once round, as a result of ``simulate``; begun behind the transitions that lie on the section."""
        from nonsmooth.flow.simulate import simulate

        state = self._begin()
        return simulate(
            self.system,
            duration=self.period,
            start=self._start(state),
            mode=self.system.modes[state.counters[0]],
            samples=samples or 1025,
            rtol=RTOL,
        )

    def with_loads(self) -> Orbit:
        """The same orbit with its ``loads``.

        Raises
        ------
        ValueError
            A system without elements that is not made by :func:`nonsmooth.mechanical`.
        SolveError
            An orbit that cannot be followed.
        """
        checked_loads(self.system, True, "with_loads")
        meter = meter_of(self.system)
        assert meter is not None
        state = self._begin()
        engine, values = engine_for(self.system, rtol=RTOL), self.system.parameter_vector()
        loads = meter.over(engine, values, state, self.period, max(self.period_number, 1))
        if loads is None:
            raise SolveError("the orbit cannot be followed once round, so its loads are not known: it is unstable")
        return replace(self, loads=loads)

    def _begin(self) -> State:
        """State, memory and mode behind the transitions that lie on the section: a start cannot lead into a stop."""
        z, mode = np.append(self.u, self.memory), mode_number(self.system, self.mode)
        assert mode is not None
        for i in np.flatnonzero(self.crossing_times <= AT_SECTION * self.period):
            z, mode = self.crossing_states[i], self.signature.visits[i + 1].mode
        state = State(z[: len(self.u)].copy(), z[len(self.u) :].copy())
        state.counters[0] = mode
        return state

    def _start(self, state: State) -> Any:
        """A state as a start; with the memory, where the system has one."""
        if not len(state.memory):
            return state.u
        import xarray as xr

        variables: dict[str, Any] = {
            "u": (("time", "state"), state.u[None, :]),
            "mode": ("time", np.zeros(1, dtype=int), {"flag_meanings": "-"}),  # given by name beside it
        }
        variables |= {name: ("time", [value]) for name, value in zip(self.system.memory, state.memory, strict=True)}
        return xr.Dataset(variables, {"state": list(self.system.states)})

    def __repr__(self) -> str:
        title, rows = self._shown()
        return "\n".join([f"<{title}", *(f"  {head}: {text}" for head, text in rows)]) + ">"

    def _repr_html_(self) -> str:
        return html_table(*self._shown())

    def _shown(self) -> tuple[str, list[tuple[str, str]]]:
        """Title and rows of the representations."""
        name = f"period-{self.period_number}" if self.period_number else "autonomous"
        words = stability(self.floquet_multipliers, self.period_number > 0)
        if self.virtual:
            words = "virtual"
        numbers = ", ".join(f"{mu:.6g}" for mu in self.floquet_multipliers)
        state = ", ".join(f"{k} = {v:.9g}" for k, v in zip(self.system.states, self.u, strict=True))
        signature, crossings = self.signature.text(self.system.traced), len(self.signature.crossings)
        if (short := cut(signature)) != signature:
            short += f" ({crossings} transitions)"
        return f"Orbit of {self.system.name!r}: {name}, {words}, period {self.period:.9g}", [
            ("section", f"{cut(state)} (mode {self.mode!r})"),
            ("multipliers", cut(numbers)),
            ("signature", short),
        ]

    def to_dataset(self) -> xr.Dataset:
        """The orbit as a Dataset that can be saved; ``from_dataset`` reads it back."""
        import xarray as xr

        from nonsmooth.results.branches import FOUND, attributes
        from nonsmooth.results.labels import labels_of
        from nonsmooth.results.provenance import provenance, with_short_record
        from nonsmooth.results.schema import parameter_coords, state_coords

        labels = labels_of(self.system)
        attrs: dict[str, Any] = dict(provenance(labels, "find_orbit", self.options, method="multiple shooting"))
        attrs |= layout_attributes([self.signature], self.system)
        values = vars(self) | {"clearance": np.array(list(self.clearance.values()), dtype=float)}
        variables = {column.name: (column.dims, values[column.field], attributes(labels, column)) for column in FOUND}
        if self.loads:
            for name, (words, unit) in checked_loads(self.system, True, "to_dataset").items():
                variables[name] = ((), self.loads[name], {"long_name": words, "units": unit})
        names = np.array([*self.system.states, *self.system.memory], dtype=str)
        coords = {
            **state_coords(labels),
            **parameter_coords(labels),
            "component": ("component", names),
            "column": ("column", names),
            "indicator": ("indicator", np.array(list(self.clearance), dtype=str)),
        }
        return with_short_record(xr.Dataset(variables, coords, attrs))

    @classmethod
    def from_dataset(cls, dataset: xr.Dataset) -> Orbit:
        """Read `to_dataset` back, from memory or from a file.

        Raises
        ------
        ValueError
            A result of another verb, or one that is damaged.
        """
        from nonsmooth.results.branches import FOUND

        source, system = recorded(dataset, "orbit")
        if source["verb"] != "find_orbit":
            verb = source["verb"]
            raise ValueError(f"this Dataset was made by {verb!r}; Orbit.from_dataset reads those of find_orbit")
        with undamaged("orbit"):
            (signature,), (values,) = layouts_of(dataset, system), fields_of(dataset, FOUND)
            shape = len(signature.crossings), len(system.states) + len(system.memory)
            values["crossing_states"] = values["crossing_states"].reshape(shape)
            names = map(str, dataset["indicator"].values)
            values["clearance"] = dict(zip(names, map(float, values["clearance"]), strict=True))
            meter = meter_of(system)
            loads = {name: float(dataset[name]) for name in meter.per_period if name in dataset} if meter else {}
            return cls(system=system, signature=signature, options=source["options"], loads=loads, **values)


def orbit_of(point: OrbitPoint, virtual: bool) -> Orbit:
    """The record of a solved orbit, at the parameters of its system."""
    shooting, path, once = point.shooting, point.path, point.shooting.once(point.X)
    system, mu = shooting.system, point.multipliers
    u, memory = np.split(once.states[0], [len(system.states)])
    clearance = point.curve.walk.clearance(path, len(system.indicators))
    return Orbit(
        system=system,
        u=u,
        mode=system.modes[shooting.at_section],
        memory=memory,
        period=once.period,
        period_number=shooting.period_number,
        signature=shooting.signature,
        crossing_times=once.times,
        crossing_states=once.states[1:],
        monodromy_matrix=point.M,
        floquet_multipliers=mu,
        stable=stable_by(mu, shooting.forced),
        maximum=path.maximum.copy(),
        minimum=path.minimum.copy(),
        clearance=dict(zip(system.indicators, map(float, clearance), strict=True)),
        virtual=virtual,
    )
