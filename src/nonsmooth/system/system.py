"""`System`: a piecewise-smooth dynamical system, complete and checked."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from nonsmooth.errors import Answering, SystemDefinitionError
from nonsmooth.system.arguments import checked
from nonsmooth.system.description import Description, describe
from nonsmooth.system.equations import TracedSurface
from nonsmooth.system.parameter import Parameter
from nonsmooth.system.show import latex, page, table
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.traced import Traced, TracedTransition
from nonsmooth.system.symmetry import Symmetry
from nonsmooth.system.text import read_system, write_system
from nonsmooth.system.transition import Band, Mode, Surface, Transition
from nonsmooth.system.variant import (
    Derivatives,
    Variant,
    positive,
    smoothed_values,
    variant_of,
)


class System(Answering):
    r"""A piecewise-smooth dynamical system: smooth in each of its modes, switching between them.

    Parameters
    ----------
    states : mapping of str to str, or sequence of str
        Names and units of the states, in order: ``{"x": "m", "v": "m/s"}``.
    parameters : mapping
        ``{"m": (0.838, "kg"), "k": 8.47}``; a third entry is a LaTeX symbol.
    modes : mapping of str to callable or Mode
        Vector fields ``f(t, u, p)``; a run starts in the first. They are called once, with symbols: ``x, v = u``,
        ``u.x``, ``p.k``, NumPy functions. They return one value for each state, in order or by name
        (``{"x": u.v, "v": -u.x}``). No ``if`` on a state: that is two modes.
    indicators : mapping of str to callable, optional
        Functions ``h(t, u, p)`` whose zeros bound the modes.
    transitions : sequence of Transition or Surface, optional
    memory : mapping, optional
        What transitions write and modes read: ``{"v_a": "m/s"}`` or ``{"v_a": (0.0, "m/s")}``; read as ``p.v_a``.
    outputs : mapping, optional
        ``{"contact_force": (f, "N")}``, f a function or a mapping mode -> function.
    symmetry : tuple, optional
        ``(map, shift)`` or ``(map, shift, {mode: mode})``: ``map(u)`` of a solution, ``shift`` periods later, is one.
        It is checked against the equations and kept with the system; bifurcations are named without it.
    scale : mapping of str to float, optional
        Typical sizes of the states (1 where missing): used by every norm and tolerance.
    period : float or callable, optional
        Forcing period, a number or a function of ``p``; read off sin and cos of ``w * t`` where not given. Values at
        which the equations do not repeat after it are refused.
    bands : mapping of str to Band, optional
        Fields prescribed inside the bands of the smoothed system, by indicator.
    elements : mapping of str to element, or sequence, optional
        Stops, friction, backlash (:mod:`nonsmooth.elements`): there is a mode for each combination of their phases (see
        `written_out`); the force of each, without impulses, is an output ``<name>_force``.
    impacts : {"simultaneous", "sequential"}, optional
        Impacts of several contacts at one instant: all at once by Newton's law, or one after the other, the fastest
        approach first, as of bodies that are not quite in touch.
    inputs : mapping of str to str or (str, "smooth"), or sequence of str, optional
        Names and units of inputs, ``{"force": "N"}``: functions of time that come with a run, such as a measured force;
        read as ``p.force``, its rate as ``p.force_rate``. Both stand among the states, behind the system's own. Of one
        whose course is smooth, ``{"base": ("m", "smooth")}``, ``p.base_rate2`` and ``p.base_rate3`` do too (`Input`).
    name : str

    Raises
    ------
    SystemDefinitionError
        Whatever does not fit together; the message says where and what to do.

    Notes
    -----
    Systems do not change. `with_parameters` and `smoothed` return new ones that share the equations.
    """

    __slots__ = {
        "name": "Its name.",
        "states": "Names and units of the states.",
        "values": "Present values of the parameters.",
        "memory": "Names and units of the memory.",
        "outputs": "Names and units of the outputs.",
        "inputs": "Names and units of the inputs.",
        "scale": "Typical size of each state.",
        "surfaces": "Surfaces on which motion may slide; empty for a smoothed system. Their modes are among the modes.",
        "symmetry": "The declared symmetry, as expressions.",
        "explicit_time": "True where it depends on time without a known period: runs then need a ``duration``.",
        "is_smoothed": "True where the switches are smoothed.",
        "eta": "Half width of the bands: None, a number, or a number for each indicator.",
        "band": 'Shape of the bands: "linear", "tanh" or "arctan"; None where nothing is smoothed.',
        **dict.fromkeys(("_description", "_variant", "__weakref__"), ""),
    }
    name: str
    states: Mapping[str, str]
    values: Mapping[str, float]
    memory: Mapping[str, str]
    outputs: Mapping[str, str]
    inputs: Mapping[str, str]
    scale: Mapping[str, float]
    surfaces: tuple[TracedSurface, ...]
    symmetry: Symmetry | None
    explicit_time: bool
    is_smoothed: bool
    eta: float | dict[str, float] | None
    band: str | None
    _description: Description
    _variant: Variant

    @checked(read=False)
    def __init__(
        self,
        *,
        states: Mapping[str, str] | Sequence[str],
        parameters: Mapping[str, Any],
        modes: Mapping[str, Callable[..., Any] | Mode],
        indicators: Mapping[str, Callable[..., Any]] | None = None,
        transitions: Sequence[Transition | Surface] = (),
        memory: Mapping[str, Any] | None = None,
        outputs: Mapping[str, Any] | None = None,
        symmetry: Any = None,
        scale: Mapping[str, float] | None = None,
        period: Any = None,
        bands: Mapping[str, Band] | None = None,
        elements: Any = None,
        impacts: str = "simultaneous",
        inputs: Mapping[str, str | tuple[str, str]] | Sequence[str] | None = None,
        name: str = "system",
    ) -> None:
        description = describe({key: one for key, one in locals().items() if key != "self"})
        values = {key: parameter.value for key, parameter in description.parameters.items()}
        self._set(description, values, variant_of(description))
        self._variant.domain.check(values)

    def _set(self, description: Description, values: dict[str, float], variant: Variant) -> Self:
        facts = variant.facts | {
            "values": MappingProxyType(values),
            "eta": variant.eta(values),
            "_description": description,
            "_variant": variant,
        }
        for name, fact in facts.items():
            object.__setattr__(self, name, fact)
        return self

    @classmethod
    def _make(cls, description: Description, values: dict[str, float], variant: Variant) -> Self:
        return object.__new__(cls)._set(description, values, variant)

    def _of(self, description: Description) -> Self:
        """The same with another description, at the same values."""
        return self._make(description, dict(self.values), variant_of(description))

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a System does not change: use with_parameters(...) (tried to set {name!r})")

    def _elsewhere(self, name: str) -> str:
        if name in self.__slots__ or name not in self.values:  # an object that is not whole yet has no values
            return ""
        return f": the value of a parameter is system.values[{name!r}], set by with_parameters({name}=...)"

    def __delattr__(self, name: str) -> None:
        raise AttributeError("a System does not change")

    # What it is

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters with present value, unit and symbol; a smoothed system has ``eta`` at the end."""
        known = self._variant.parameters
        return MappingProxyType({key: replace(known[key], value=now) for key, now in self.values.items()})

    @property
    def modes(self) -> tuple[str, ...]:
        """Names of the modes, the bands of a smoothed system included; those visited so far (see `written_out`)."""
        return self.traced.mode_names

    @property
    def indicators(self) -> tuple[str, ...]:
        """Names of the indicators, those derived for a smoothed system at the end."""
        return self.traced.indicator_names

    @property
    def transitions(self) -> tuple[TracedTransition, ...]:
        """The allowed jumps, in declared order."""
        return self.traced.transitions

    @property
    def traced(self) -> Traced:
        """The equations as expressions; those of the smoothed system where it is smoothed.

        Where modes are made when they are first visited, the names of those visited so far (see `written_out`)."""
        traced = self._variant.traced
        if traced.decider is not None:
            return traced.decider.known()
        return traced if traced.patterns is None else traced.patterns.seen()

    @property
    def declared(self) -> Traced:
        """The equations as expressions, without the sliding modes that are derived from them."""
        return self.traced if self.is_smoothed or self.traced.patterns is not None else self._description.traced

    @property
    def derivatives(self) -> Derivatives:
        """Exact derivatives of the equations (`written_out`), shared by all copies."""
        whole = self.written_out()
        whole.refuse_patterns("what needs derivatives of the equations")
        return whole._variant.derivatives

    @property
    def depends_on_time(self) -> bool:
        """Return whether the time occurs in the equations, or transitions happen at phases of a period."""
        return self.traced.period is not None or self.explicit_time

    @property
    def is_map(self) -> bool:
        """Return whether the states change by transitions alone and the period is 1, as those of a `Map` do."""
        return self.traced.is_map

    def refuse_patterns(self, verb: str) -> None:
        """Raise SystemDefinitionError where the modes are made when they are first visited."""
        if (patterns := self._variant.traced.patterns) is not None:
            raise SystemDefinitionError(
                f"{self.name!r}: its elements {patterns.why}; a mode is made when a run first visits it. Not so for "
                f"{verb}: take fewer elements for it"
            )

    # Numbers

    def parameter_vector(self) -> np.ndarray:
        """Return the present values, float64, in declared order (``eta`` last)."""
        return np.array(list(self.values.values()), dtype=np.float64)

    def memory_vector(self) -> np.ndarray:
        """Return the memory at a start, float64."""
        return np.array([initial for initial, _ in self._variant.memory.values()], dtype=np.float64)

    def scale_vector(self) -> np.ndarray:
        """Return the typical sizes of the states, float64."""
        return np.array(list(self._description.scale.values()), dtype=np.float64)

    def period(self) -> float | None:
        """Return the forcing period at the present values of the parameters; None where there is none."""
        return self.period_at(self.values)

    def period_at(self, values: Mapping[str, float] | Sequence[float] | np.ndarray) -> float | None:
        """Return the forcing period at other values: a mapping (others stay), or a vector in declared order."""
        traced = self._variant.traced
        if traced.period is None:
            return None
        if isinstance(values, Mapping):
            values = [values.get(key, value) for key, value in self.values.items()]
        return float(numeric(traced, (traced.period,), quick=True)([*map(float, values)])[0])

    def parameter_points(self, columns: Mapping[str, Any]) -> np.ndarray:
        """Return checked rows of parameter values, (P, n_parameters), for columns of equal length P.

        Raises
        ------
        ValueError, SystemDefinitionError
            An unknown name, a value that is not finite, or one the equations do not allow.
        """
        variant = self._variant
        lists = {key: np.atleast_1d(np.asarray(column, dtype=np.float64)) for key, column in columns.items()}
        sizes = {column.shape for column in lists.values()}
        if len(sizes) > 1 or any(len(size) != 1 for size in sizes):
            raise ValueError(f"columns of parameters must be one-dimensional and of equal length, not {sizes}")
        points = np.tile(self.parameter_vector(), (next(iter(sizes))[0] if sizes else 1, 1))
        for key, column in lists.items():
            variant.check_known(key)
            if not np.isfinite(column).all():
                raise ValueError(f"parameter {key!r} must be finite, not {column[~np.isfinite(column)][0]}")
            if key in dict(variant.etas):
                positive(float(column.min()), key)
            points[:, [*self.values].index(key)] = column
        if len(points):
            variant.domain.check_points(points)
        return points

    # Copies

    @checked(read=False)
    def with_parameters(self, given: Any = None, /, **values: float) -> Self:
        """Return the same system at other values of its parameters.

        Parameters
        ----------
        given : mapping, or object with a mapping ``values``, optional
            ``{"g": 0.0018}``, another system, or a set of identified parameters.
        **values : float
            ``g=0.0018``; these win over ``given``.

        Raises
        ------
        ValueError
            An unknown parameter or a value that is not finite (TypeError: not a number).
        SystemDefinitionError
            A value the equations do not allow, such as a mass of zero.
        """
        return self._make(self._description, self._variant.changed(self.values, given, values), self._variant)

    def written_out(self) -> Self:
        """Return the same system with all its modes, indicators and transitions as expressions.

        Elements whose forces depend on each other (two stops on coupled masses, a stop and a friction) have modes that
        are made when a run visits them. What needs expressions (a series, a band, derivatives, LaTeX, a fit) writes all
        of them out by itself; here they are to be looked at. Many elements take seconds.
        """
        description = self._description.written_out()
        return self if description is self._description else self._of(description)

    def as_solved_by(self, options: Mapping[str, Any]) -> Self:
        """Return the system as the options of a verb need it: written out for a series, a step or a ramp."""
        stepped = any(options.get(name) for name in ("order", "step", "ramps")) or not options.get("locate", True)
        return self.written_out() if stepped or options.get("method") in ("taylor", "rkf45") else self

    def smoothed(self, eta: float | Mapping[str, float] | None, band: str = "linear") -> Self:
        r"""Return the system with its switches smoothed over bands (Savi et al. 2007, Eqs. 6-10).

        Between the fields on both sides of an indicator g the smoothed one is :math:`(1 - q) f_- + q f_+`, with

        .. math:: q = \tfrac12 (1 + g / \eta) \ (|g| < \eta), \qquad \tfrac12 (1 + \tanh (g / \eta)), \qquad
            \tfrac12 + \tfrac1\pi \arctan (g / \eta)

        A surface that slides (dry friction, a relay) is smoothed without its sliding mode.

        Parameters
        ----------
        eta : float, mapping of indicator to float, or None
            Half width of the bands, in the indicators' units; None takes the smoothing away.
        band : {"linear", "tanh", "arctan"}
            Shape of q. Fields of one's own (``bands=``) belong to the linear one.

        Raises
        ------
        SystemDefinitionError
            Transitions with a reset (impacts) or at a time, hysteresis, static friction above the kinetic one, or bands
            that overlap without crossing, as those of three regions do: the pair is named.

        See Also
        --------
        nonsmooth.smoothing_report : what a band does to an orbit.
        """
        whole = self.written_out()
        whole.refuse_patterns("smoothed")
        new, variant = smoothed_values(whole._description, self.values, eta, band)
        return self._make(whole._description, new, variant)

    # Text

    def to_text(self) -> str:
        """Return the whole system as text (JSON): equations, units and values; data only."""
        return write_system(self)

    @classmethod
    def from_text(cls, text: str) -> System:
        """Read `to_text` back. Nothing in the text is executed.

        Raises
        ------
        SystemDefinitionError
            What was expected, and what was found.
        """
        return read_system(text)

    def content_hash(self, *, values: bool = False) -> str:
        """Return a hash of the equations (64 hex digits); with ``values`` also of the parameters' present values."""
        return hashlib.sha256(write_system(self, values=values).encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, System):
            return NotImplemented
        if self._description is other._description:
            return self._variant is other._variant and self.values == other.values
        return self.to_text() == other.to_text()

    def __hash__(self) -> int:
        return hash((self.name, tuple(self.values.items())))

    def __copy__(self) -> System:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> System:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        known = self.traced.known
        return _sent, (self.to_text(), self.traced.patterns is None), known and known.sent()

    def __setstate__(self, sent: Any) -> None:
        self.traced.known.receive(sent)

    def __repr__(self) -> str:
        return table(self, whole=False)

    def __str__(self) -> str:
        return table(self)

    def _repr_html_(self) -> str:
        return page(self)

    def summary(self, *, verbose: bool = False) -> str:
        """Return the system as a table, as ``print`` shows it.

        Parameters
        ----------
        verbose : bool
            True: the modes, indicators and transitions that were made of elements stand there as well.
        """
        return table(self.written_out() if verbose else self, verbose=verbose)

    def to_latex(self) -> str:
        """Return the equations as LaTeX (an ``align*`` environment)."""
        return latex(self.written_out())

    def _repr_latex_(self) -> str | None:
        return None if self.traced.patterns is not None else self.to_latex()


def _sent(text: str, written: bool) -> System:
    """The system of a text, ``written`` out where it was so: modes and transitions have the same numbers."""
    system = System.from_text(text)
    return system.written_out() if written else system
