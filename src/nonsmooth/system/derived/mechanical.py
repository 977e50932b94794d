"""``mechanical``: M q'' + C q' + K q = forces, with elements at its coordinates, as a system."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.derived.combinations import element_names
from nonsmooth.system.derived.elements import Element
from nonsmooth.system.names import by_name, unknown
from nonsmooth.system.symbolic.scalar import Scalar, to_expression
from nonsmooth.system.system import System

__all__ = ["mechanical"]


@by_name
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
    symmetry: Any = None,
    period: Any = None,
    name: str = "mechanical system",
) -> System:
    r"""A mechanical system of N degrees of freedom with contacts and friction, ready for every verb.

    .. math:: M \ddot q + C \dot q + K q = F(t) - M r \ddot y(t) + \sum_e w_e F_e

    with forces :math:`F_e` of elements along :math:`w_e`, and q relative to a base that moves by y (r of ones).

    Parameters
    ----------
    M, C, K : array (N, N), SciPy sparse array, number, or function
        Mass, damping, stiffness; a function of ``p`` where they depend on parameters: ``lambda p: [[p.m]]``.
    forcing : mapping of coordinate to function, optional
        ``{"q1": lambda t, p: p.F * np.cos(p.w * t)}``; a rotating unbalance is ``p.me * p.w**2 * np.cos(p.w * t)``.
    elements : mapping of str to element, or sequence, optional
        Elements of :mod:`nonsmooth.elements` with ``at=``: a coordinate, or a combination of them.
    parameters : mapping, optional
        As for :class:`nonsmooth.System`.
    coordinates : sequence of str, or mapping of str to unit, optional
        Names of the coordinates (``q1``, ``q2``, ...; ``q`` for one). Speeds are called ``v_<coordinate>``.
    base : callable, optional
        Acceleration of the base, ``lambda t, p: -p.Y * p.w**2 * np.cos(p.w * t)``; coordinates are relative to it.
    scale, outputs, symmetry, period, name
        As for :class:`nonsmooth.System`.

    Returns
    -------
    System
        States: the coordinates, then their speeds. The force of each element is an output ``<name>_force``.

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
    given = dict(parameters or {})
    for key in forcing or {}:
        if key not in names:
            raise SystemDefinitionError(f"forcing: {unknown(key, 'a coordinate', repr(name), names)}")

    found: list[tuple[sp.Matrix, sp.Matrix, sp.Matrix]] = []

    def matrices(p: Any) -> tuple[sp.Matrix, sp.Matrix, sp.Matrix]:
        """Inverse mass, damping, stiffness; the symbols in them are the same at every call."""
        if not found:
            mass, damping, stiffness = (_matrix(one, p, size, what) for one, what in ((M, "M"), (C, "C"), (K, "K")))
            found.append((_inverse(mass, name), damping, stiffness))
        return found[0]

    def field(t: Any, u: Any, p: Any) -> list[Any]:
        inverse, damping, stiffness = matrices(p)
        q, v = list(u)[:size], list(u)[size:]
        loads = [to_expression((forcing or {}).get(key, lambda t, p: 0.0)(t, p)) for key in names]
        for i in range(size):
            for j in range(size):
                loads[i] -= damping[i, j] * v[j].expression + stiffness[i, j] * q[j].expression
        ride = sp.Integer(0) if base is None else to_expression(base(t, p))
        return [*v, *[Scalar(sp.Add(*[inverse[i, j] * loads[j] for j in range(size)]) - ride) for i in range(size)]]

    units = coordinates if isinstance(coordinates, Mapping) else dict.fromkeys(names, "")
    states = {**units, **{v: f"{units[q]}/s" if units[q] else "" for q, v in zip(names, speeds, strict=True)}}
    parts = {
        key: _placed(key, element, names, lambda p: matrices(p)[0], name)
        for key, element in element_names(elements or {}).items()
    }
    return System(
        name=name, states=states, parameters=given, modes={"all": field}, outputs=outputs, scale=scale,
        symmetry=symmetry, period=period, elements=parts or None,
    )  # fmt: skip


def _placed(label: str, element: Any, names: list[str], inverse: Callable[[Any], sp.Matrix], system: str) -> Any:
    """The element with its place and its direction as functions of the states."""
    if not isinstance(element, Element) or element.at is None:
        return element
    weights = {element.at: 1.0} if isinstance(element.at, str) else dict(element.at)
    for key in weights:
        if key not in names:
            raise SystemDefinitionError(f"element {label!r}: {unknown(key, 'a coordinate', repr(system), names)}")
    places = {names.index(key): to_expression(weight) for key, weight in weights.items()}

    def along(entries: Any) -> Any:
        return sum(Scalar(weight) * entries[i] for i, weight in places.items())

    def own(t: Any, u: Any, p: Any) -> Any:
        return element.placed(along(u[: len(names)]), along(u[len(names) :]), lambda given: _law(given, t, u, p))

    def acts(i: int) -> Callable[..., Any]:
        def into(t: Any, u: Any, p: Any) -> Any:
            mass = inverse(p)
            return Scalar(element.into * sp.Add(*[weight * mass[i, j] for j, weight in places.items()]))

        return into

    on = {f"v_{key}": acts(i) for i, key in enumerate(names)}
    return replace(element, at=None, on=on, **{element.kinematics: own})


def _law(given: Any, t: Any, u: Any, p: Any) -> Any:
    return p[given] if isinstance(given, str) else given(t, u, p) if callable(given) else given


def _inverse(mass: sp.Matrix, system: str) -> sp.Matrix:
    """The inverse of a mass matrix; one of numbers must be symmetric and positive definite."""
    if not mass.free_symbols:
        numbers = np.array(mass.tolist(), dtype=float)
        least = np.linalg.eigvalsh(0.5 * (numbers + numbers.T)).min()
        if not np.allclose(numbers, numbers.T, rtol=1e-12, atol=0.0):
            raise SystemDefinitionError(f"{system!r}: the mass matrix is not symmetric; write M so that M = M^T")
        if not least > 1e-14 * np.abs(numbers).max():
            raise SystemDefinitionError(
                f"{system!r}: the mass matrix is not positive definite, its least eigenvalue is {least:.3g}: a motion "
                f"with a mass of zero or less; leave out coordinates without a mass"
            )
    try:
        return mass.inv()
    except (ValueError, sp.matrices.exceptions.NonInvertibleMatrixError) as error:
        raise SystemDefinitionError(f"{system!r}: the mass matrix cannot be inverted: {error}") from error


def _size(M: Any) -> int:
    if callable(M):
        return _size(M(_Any()))
    found = np.asarray(M.toarray() if hasattr(M, "toarray") else M, dtype=object)
    if found.ndim == 0:
        return 1
    if found.ndim != 2 or found.shape[0] != found.shape[1] or not found.size:
        raise SystemDefinitionError(f"M is a square array, a number or a function of p; not of shape {found.shape}")
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
    if len(names) != size:
        raise SystemDefinitionError(f"coordinates: {len(names)} names for a mass matrix of {size} rows")
    return names


def _matrix(given: Any, p: Any, size: int, what: str) -> sp.Matrix:
    found = given(p) if callable(given) else given.toarray() if hasattr(given, "toarray") else given
    array = np.asarray(found, dtype=object)
    if array.ndim == 0:
        array = array.reshape(1, 1)
    if array.shape != (size, size):
        raise SystemDefinitionError(f"{what} has the shape {array.shape}, M {(size, size)}: both must be the same")
    try:
        return sp.Matrix(size, size, [to_expression(entry) for entry in array.ravel()])
    except TypeError as error:
        raise SystemDefinitionError(f"{what} holds {shortened(found)}: numbers are wanted ({error})") from error
