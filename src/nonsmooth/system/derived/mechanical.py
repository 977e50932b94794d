"""``mechanical``: M q'' + C q' + K q = forces, with elements at its coordinates, as a system."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened, unknown
from nonsmooth.system.arguments import checked
from nonsmooth.system.derived.combinations import element_names
from nonsmooth.system.derived.elements import Element
from nonsmooth.system.symbolic.scalar import Scalar, to_expression
from nonsmooth.system.symbolic.tracing import Symbols, call
from nonsmooth.system.system import System
from nonsmooth.system.units import product, read_unit, unit_of, write_unit


@checked(read=False)
def mechanical(
    M: Any,
    C: Any,
    K: Any,
    *,
    forcing: Mapping[str, Any] | None = None,
    elements: Any = None,
    parameters: Mapping[str, Any] | None = None,
    coordinates: Sequence[str] | Mapping[str, str] | None = None,
    base: Callable[..., Any] | None = None,
    scale: Mapping[str, float] | None = None,
    outputs: Mapping[str, Any] | None = None,
    indicators: Mapping[str, Callable[..., Any]] | None = None,
    symmetry: Any = None,
    period: Any = None,
    impacts: str = "simultaneous",
    inputs: Mapping[str, str | tuple[str, str]] | Sequence[str] | None = None,
    name: str = "mechanical system",
) -> System:
    r"""A mechanical system of N degrees of freedom with contacts and friction, ready for every verb.

    .. math:: M \ddot q + C \dot q + K q = F(t) - M r \ddot y(t) + \sum_e w_e F_e

    with forces :math:`F_e` of elements along :math:`w_e`, and q relative to a base that moves by y (r of ones).

    Parameters
    ----------
    M, C, K : array (N, N), SciPy sparse array, number, name of a parameter, or function
        Mass, damping, stiffness; a function of ``p`` where they depend on parameters: ``lambda p: [[p.m]]``. Entries of
        an array may be names of parameters too: ``[["m", 0], [0, "m"]]``.
    forcing : mapping of coordinate to function, number or name of a parameter, optional
        ``{"q1": lambda t, p: p.F * np.cos(p.w * t)}``; a rotating unbalance is ``p.me * p.w**2 * np.cos(p.w * t)``.
    elements : mapping of str to element, or sequence, optional
        Elements of :mod:`nonsmooth.elements` with ``at=``: a coordinate, or a combination of them.
    parameters : mapping, optional
        As for :class:`nonsmooth.System`.
    coordinates : sequence of str, or mapping of str to unit, optional
        Names of the coordinates (``q1``, ``q2``, ...; ``q`` for one). Speeds are called ``v_<coordinate>``.
    base : callable, number or name of a parameter, optional
        Acceleration of the base, ``lambda t, p: -p.Y * p.w**2 * np.cos(p.w * t)``; coordinates are relative to it.
    scale, outputs, indicators, symmetry, period, impacts, inputs, name
        As for :class:`nonsmooth.System`.

    Returns
    -------
    System
        States: the coordinates, then their speeds. The force of each element is an output ``<name>_force``, in the unit
        that follows from those of the coordinates and of the masses. Impulses are not in it: those of rigid stops stand
        in the results of :func:`nonsmooth.simulate`, and in those of sweeps with ``loads=True``.

    Raises
    ------
    SystemDefinitionError
        Matrices that do not fit together; a mass matrix that cannot be inverted or, of numbers, is not symmetric and
        positive definite; whatever else does not fit.

    Examples
    --------
    >>> import numpy as np
    >>> import nonsmooth as ns
    >>> rig = ns.mechanical(
    ...     1.0, 0.05, 1.0, parameters={"F": 0.5, "w": 0.8, "mu": 0.2},
    ...     forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
    ...     elements={"belt": ns.elements.Coulomb(at="q", friction="mu")})
    >>> curve = ns.frequency_response(rig, np.linspace(0.5, 1.5, 5), parameter="w", progress=False)
    >>> bool((curve.period_number == 1).all())
    True
    """
    size = _size(M)
    names = _coordinates(coordinates, size)
    speeds = [f"v_{key}" for key in names]
    if not isinstance(forcing, Mapping | None):
        raise SystemDefinitionError(
            f'{name!r}: `forcing` must be a mapping such as {{"{names[0]}": lambda t, p: p.F * np.cos(p.w * t)}}, '
            f"not {shortened(forcing)}"
        )
    for key in forcing or {}:
        if key not in names:
            raise SystemDefinitionError(f"forcing: {unknown(key, 'a coordinate', repr(name), names)}")

    forces = forcing or {}
    found: list[tuple[sp.Matrix, sp.Matrix, sp.Matrix, sp.Matrix]] = []

    def matrices(p: Any) -> tuple[sp.Matrix, sp.Matrix, sp.Matrix, sp.Matrix]:
        """Inverse mass, damping, stiffness, mass; the symbols in them are the same at every call."""
        if not found:
            mass, damping, stiffness = (_matrix(one, p, size, what) for one, what in ((M, "M"), (C, "C"), (K, "K")))
            found.append((_inverse(mass, name), damping, stiffness, mass))
        return found[0]

    def outside(t: Any, p: Any) -> tuple[sp.Matrix, sp.Expr]:
        """Forcing of each coordinate, acceleration of the base."""
        loads = [to_expression(_value(forces.get(key, 0), (t, p), f"forcing of {key!r}")) for key in names]
        return sp.Matrix(loads), to_expression(_value(0 if base is None else base, (t, p), "base, an acceleration,"))

    def field(t: Any, u: Any, p: Any) -> list[Any]:
        inverse, damping, stiffness, _ = matrices(p)
        q, v = list(u)[:size], list(u)[size:]
        loads, ride = outside(t, p)
        for i in range(size):
            for j in range(size):
                loads[i] -= damping[i, j] * v[j].expression + stiffness[i, j] * q[j].expression
        return [*v, *[Scalar(sp.Add(*[inverse[i, j] * loads[j] for j in range(size)]) - ride) for i in range(size)]]

    units = coordinates if isinstance(coordinates, Mapping) else dict.fromkeys(names, "")
    states = {**units, **{v: f"{units[q]}/s" if units[q] else "" for q, v in zip(names, speeds, strict=True)}}
    parts = {
        key: _placed(key, element, names, lambda p: matrices(p)[0], name)
        for key, element in element_names(elements or {}).items()
    }
    system = System(
        name=name,
        states=states,
        parameters=parameters or {},
        modes={"all": field},
        outputs=outputs,
        indicators=indicators,
        scale=scale,
        symmetry=symmetry,
        period=period,
        elements=parts or None,
        impacts=impacts,
        inputs=inputs,
    )
    d = system._description
    p = Symbols(name, d.states, dict.fromkeys(d.parameters, ""), {}, tuple(d.states)[2 * size :]).parameters()
    *_, mass = matrices(p)
    powers = _powers(*matrices(p)[1:], *outside(Scalar(d.traced.t), p), d.traced.u[: 2 * size])
    units_of = {symbol: read_unit(unit) for symbol, unit in d.symbol_units.items()}
    energies = (product(unit_of(mass[i, i], units_of), *2 * [units_of[d.traced.u[size + i]]]) for i in range(size))
    energy = next((one for one in energies if one is not None), None)
    positive = [(mass[i, i], f"the mass of coordinate {key!r} must be positive") for i, key in enumerate(names)]
    positive += [(one, "the mass matrix must be positive definite") for one in _pivots(mass)]
    positive = [one for one in positive if one[0].free_symbols]
    return system._of(d.refined(powers, write_unit(energy), [*positive, *d.ranges] if positive else ()))


def _powers(
    damping: sp.Matrix,
    stiffness: sp.Matrix,
    mass: sp.Matrix,
    forcing: sp.Matrix,
    ride: sp.Expr,
    u: Sequence[sp.Symbol],
) -> dict[str, sp.Expr]:
    """The powers that forcing and base give the masses, and those that they lose to damping and to what is not
    symmetric in a stiffness."""
    size = len(u) // 2
    at, speeds = sp.Matrix(u[:size]), sp.Matrix([u[size:]])
    powers = {
        "forcing": speeds * forcing,
        "base": -ride * speeds * mass * sp.ones(size, 1),
        "damping": speeds * damping * speeds.T,
        "stiffness": speeds * (stiffness - stiffness.T) * at / 2,
    }
    return {key: power[0, 0] for key, power in powers.items() if key in ("forcing", "damping") or power[0, 0] != 0}


def _value(given: Any, arguments: tuple[Any, ...], what: str) -> Any:
    """The value of a number, of the name of a parameter, or of a function of ``arguments``, the last being those."""
    if callable(given):
        return call(given, arguments, what)
    return arguments[-1][given] if isinstance(given, str) else given


def _placed(label: str, element: Any, names: list[str], inverse: Callable[[Any], sp.Matrix], system: str) -> Any:
    """The element with its place and its direction as functions of the states."""
    if not isinstance(element, Element) or element.at is None:
        return element
    if not isinstance(element.at, str | Mapping):
        raise SystemDefinitionError(
            f"element {label!r}: at= is the name of a coordinate, {names[0]!r}, or a combination, {_between(names)}; "
            f"not {shortened(element.at)}"
        )
    weights = {element.at: 1.0} if isinstance(element.at, str) else dict(element.at)
    for key in weights:
        if key not in names:
            several = f"; between two: at={_between(names)}" if any(sign in str(key) for sign in "+-,") else ""
            given = unknown(key, "a coordinate", repr(system), names)
            raise SystemDefinitionError(f"element {label!r}: {given}{several}")
    places = {names.index(key): to_expression(weight) for key, weight in weights.items()}

    def along(entries: Any) -> Any:
        return sum(Scalar(weight) * entries[i] for i, weight in places.items())

    def own(t: Any, u: Any, p: Any) -> Any:
        return element.placed(
            along(u[: len(names)]), along(u[len(names) :]), lambda given: _value(given, (t, u, p), "a function of its")
        )

    def acts(i: int) -> Callable[..., Any]:
        def into(t: Any, u: Any, p: Any) -> Any:
            mass = inverse(p)
            return Scalar(element.into * sp.Add(*[weight * mass[i, j] for j, weight in places.items()]))

        return into

    on = {f"v_{key}": acts(i) for i, key in enumerate(names)}
    placed = replace(element, at=None, on=on, **{element.kinematics: own})
    object.__setattr__(placed, "given", element)
    return placed


def _inverse(mass: sp.Matrix, system: str) -> sp.Matrix:
    """The inverse of a mass matrix; one of numbers must be symmetric and positive definite."""
    if not mass.free_symbols:
        numbers = np.array(mass.tolist(), dtype=float)
        if not np.allclose(numbers, numbers.T, rtol=1e-12, atol=0.0):
            raise SystemDefinitionError(f"{system!r}: the mass matrix is not symmetric; write M so that M = M^T")
        least = np.linalg.eigvalsh(numbers).min()
        if not least > 1e-14 * np.abs(numbers).max():
            raise SystemDefinitionError(
                f"{system!r}: the mass matrix is not positive definite, its least eigenvalue is {least:.3g}: a motion "
                f"with a mass of zero or less; leave out coordinates without a mass"
            )
    try:
        return mass.inv()
    except (ValueError, sp.matrices.exceptions.NonInvertibleMatrixError) as error:
        raise SystemDefinitionError(f"{system!r}: the mass matrix cannot be inverted: {error}") from error


def _pivots(mass: sp.Matrix) -> list[sp.Expr]:
    """Pivots other than the diagonal's own: positive where the matrix is positive definite. Minors of a chain would be
    written out with exponentially many terms."""
    left, n = mass.as_mutable(), mass.rows
    for i in range(n):
        below = [j for j in range(i + 1, n) if left[j, i] != 0]
        for j in below:
            for k in below:
                left[j, k] -= left[j, i] * left[i, k] / left[i, i]
    return [left[i, i] for i in range(n) if left[i, i] != mass[i, i]]


def _between(names: list[str]) -> str:
    """The text of ``at=`` for an element between two coordinates."""
    first, last = (names[0], names[-1]) if len(names) > 1 else ("q1", "q2")
    return f'{{"{last}": 1, "{first}": -1}}'


def _size(M: Any) -> int:
    found = _array(M, _Any(), "M")
    if found.ndim == 0:
        return 1
    if found.ndim != 2 or found.shape[0] != found.shape[1] or not found.size:
        hint = "; a list of masses is its diagonal, np.diag(masses)" if found.ndim == 1 and found.size else ""
        raise SystemDefinitionError(
            f"M is a square array, a number or a function of p; not of shape {found.shape}{hint}"
        )
    return len(found)


class _Any:
    """Parameters of any name, to see a matrix's shape."""

    def __getattr__(self, name: str) -> Scalar:
        return Scalar(sp.Symbol(f"p_{name}", real=True))

    __getitem__ = __getattr__


def _coordinates(given: Any, size: int) -> list[str]:
    if given is None:
        return ["q"] if size == 1 else [f"q{i + 1}" for i in range(size)]
    names = [given] if isinstance(given, str) else list(given)
    if len({*names}) != size:
        raise SystemDefinitionError(f"coordinates: {names}: give a name of its own to each row of the mass matrix")
    return names


def _array(given: Any, p: Any, what: str) -> np.ndarray:
    """A matrix that is an array, one of SciPy, or a function of parameters, with its entries as they are."""
    found = call(given, (p,), what) if callable(given) else given
    return np.asarray(found.toarray() if hasattr(found, "toarray") else found, dtype=object)


def _matrix(given: Any, p: Any, size: int, what: str) -> sp.Matrix:
    array = found = _array(given, p, what)
    if array.ndim == 0:
        array = array.reshape(1, 1)
    if array.shape != (size, size):
        raise SystemDefinitionError(f"{what} has the shape {array.shape}, M {(size, size)}: both must be the same")
    try:
        return sp.Matrix(size, size, [to_expression(p[one] if isinstance(one, str) else one) for one in array.ravel()])
    except TypeError as error:
        raise SystemDefinitionError(
            f"{what} holds {shortened(found)}: numbers or names of parameters are wanted ({error})"
        ) from error
