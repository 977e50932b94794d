"""Calling each of the user's functions once, with symbols, and checking what comes back."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from typing import Any, NoReturn

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened, unknown
from nonsmooth.system.symbolic.printing import CORNERS
from nonsmooth.system.symbolic.scalar import Scalar, as_written, exact, to_expression

_LARGEST = sp.Integer(int(sys.float_info.max))


class Symbols:
    """The symbols of a system, by names with units; prefixes keep a parameter called ``lambda`` or ``t`` from clashing.

    ``inputs`` are the states that stand for inputs: functions read them among the parameters."""

    def __init__(
        self,
        name: str,
        states: Mapping[str, str],
        parameters: Mapping[str, str],
        memory: Mapping[str, str],
        inputs: Sequence[str] = (),
    ) -> None:
        self.name = name
        self.units = {**states, **parameters, **memory}
        self.t = sp.Symbol("t_", real=True)
        self.u = {key: sp.Symbol(f"u_{key}", real=True) for key in states}
        self.p = {key: sp.Symbol(f"p_{key}", real=True) for key in parameters}
        self.m = {key: sp.Symbol(f"m_{key}", real=True) for key in memory}
        self.inputs = {key: self.u[key] for key in inputs}

    def of_traced(self) -> dict[str, Any]:
        """The symbols and their names, as parts of a `Traced`."""
        return {
            "t": self.t,
            "u": tuple(self.u.values()),
            "p": tuple(self.p.values()),
            "m": tuple(self.m.values()),
            "state_names": tuple(self.u),
            "parameter_names": tuple(self.p),
            "memory_names": tuple(self.m),
        }

    def states(self, names: Sequence[str] | None = None, owner: str | None = None) -> States:
        """The state vector as a function sees it: all states, or those a mode has."""
        chosen = {name: self.u[name] for name in (self.u if names is None else names) if name not in self.inputs}
        units = {name: self.units[name] for name in chosen}
        return States({name: Scalar(symbol) for name, symbol in chosen.items()}, units, owner or repr(self.name))

    def arguments(
        self, own: Sequence[str] | None = None, owner: str | None = None
    ) -> tuple[Scalar, States, Parameters]:
        """The arguments (t, u, p) of a function of a mode, which has all states or its ``own``."""
        return Scalar(self.t), self.states(own, owner), self.parameters()

    def parameters(self, extra: Mapping[str, sp.Symbol] | None = None) -> Parameters:
        """The parameters as a function sees them: parameters, memory, inputs and ``extra`` symbols by name."""
        symbols = {**self.p, **self.m, **self.inputs, **(extra or {})}
        return Parameters({name: Scalar(s) for name, s in symbols.items()}, self.units, repr(self.name))


class _Named:
    """Symbols by name, as attributes; ``_of`` is what one of them is called in messages."""

    __slots__ = ("_owner", "_units", "_values")
    _of: str

    def __init__(self, values: dict[str, Scalar], units: Mapping[str, str], owner: str) -> None:
        self._values, self._units, self._owner = values, units, owner

    def __getattr__(self, name: str) -> Scalar:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._values[name]
        except KeyError:
            known = {key: self._units.get(key, "") for key in self._values}
            raise SystemDefinitionError(unknown(name, self._of, self._owner, known)) from None

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in _Named.__slots__:
            raise SystemDefinitionError(
                f"{name} cannot be set: a function returns; memory is written by Transition(..., write=)"
            )
        object.__setattr__(self, name, value)


class States(_Named, np.lib.mixins.NDArrayOperatorsMixin):
    """The state vector in a user's function: ``x, v = u``, ``u.x``, ``u[0]``, ``A @ u``."""

    __slots__ = ()
    _of = "a state"

    def __iter__(self) -> Iterator[Scalar]:
        return iter(self._values.values())

    def __len__(self) -> int:
        return len(self._values)

    def __getitem__(self, key: Any) -> Any:
        return getattr(self, key) if isinstance(key, str) else self.__array__()[key]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        array = np.empty(len(self._values), dtype=object)
        array[:] = list(self._values.values())
        return array if dtype is None or np.dtype(dtype) == object else array.astype(dtype)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        plain = [item.__array__() if isinstance(item, States) else item for item in inputs]
        return getattr(ufunc, method)(*plain, **kwargs)

    def __repr__(self) -> str:
        return f"({', '.join(self._values)})"


class Parameters(_Named):
    """Parameters and memory in a user's function: ``p.k``, ``p.v_a``, ``p["k"]``."""

    __slots__ = ()
    _of = "a parameter"

    def __getitem__(self, name: str) -> Scalar:
        if not str(name).isidentifier():
            raise SystemDefinitionError(
                f"{shortened(name)} is not the name of a parameter; what is computed is a function"
            )
        return getattr(self, name)


class KnownFunction:
    """A function whose expressions are known, one or a list of them, as those of elements and those of a text are.

    An indicator among them may be of time alone."""

    def __init__(self, found: Any) -> None:
        several = isinstance(found, (list, tuple))
        self.found = [Scalar(sp.sympify(one)) for one in found] if several else Scalar(sp.sympify(found))

    def __call__(self, *arguments: Any) -> Any:
        return self.found


def call_vector(function: Callable[..., Any], arguments: Sequence[Any], names: Sequence[str], what: str) -> tuple:
    """Call a user's function and return one expression per name; what it returns is in their order or a mapping.

    ``what`` says in messages which function it is: "the vector field of mode 'free'"."""
    result = call(function, arguments, what)
    if isinstance(result, Scalar) or np.isscalar(result):
        result = (result,)
    if isinstance(result, Set):
        _shape(what, names, "it returned a set, { }, which has no order: write ( ) or [ ]")
    if isinstance(result, Mapping):  # by name
        if set(result) != set(names):
            _shape(what, names, f"it returned values of {', '.join(map(str, result)) or 'none'}")
        result = [result[name] for name in names]
    try:
        entries = list(result)
    except TypeError:
        _shape(what, names, f"it returned {type(result).__name__} {result!r}")
    if len(entries) != len(names):
        _shape(what, names, f"it returned {len(entries)} values")
    return tuple(_entry(entry, f"{what}, component {name!r},") for name, entry in zip(names, entries, strict=True))


def call_scalar(function: Callable[..., Any], arguments: Sequence[Any], what: str) -> sp.Expr:
    """Call a user's function and return the one expression it gives."""
    return one_number(call(function, arguments, what), what)


def one_number(result: Any, what: str) -> sp.Expr:
    """The expression of a number, given or returned by a user's function."""
    if isinstance(result, (tuple, list, States)) or (isinstance(result, np.ndarray) and result.ndim):
        if len(result) != 1:
            raise SystemDefinitionError(f"{what} must return one number; it returned {len(result)} values")
        result = result[0]
    return _entry(result, what)


def _shape(what: str, names: Sequence[str], got: str) -> NoReturn:
    raise SystemDefinitionError(
        f"{what} must return {len(names)} value{'s' * (len(names) != 1)}, one for each of {', '.join(names)}; {got}"
    )


def call(function: Callable[..., Any], arguments: Sequence[Any], what: str) -> Any:
    """Return what a user's function gives; the message says which function, and what it is called with."""
    if not callable(function):
        raise SystemDefinitionError(f"{what} must be a function, not {function!r}")
    name = getattr(function, "__name__", "")
    called = f" (function `{name}`)" if name and name != "<lambda>" else ""
    how = _order(function, arguments)
    if how.startswith("its arguments"):
        raise SystemDefinitionError(f"{what}{called}: {how}")
    try:
        return function(*arguments)
    except SystemDefinitionError as error:
        raise SystemDefinitionError(f"{what}: {error}") from error
    except Exception as error:
        said = str(error).replace("'Scalar' object", "a symbolic number")
        raise SystemDefinitionError(
            f"{what}{called} failed when it was called with symbols: {type(error).__name__}: {said}{how}"
        ) from error


#: What a function is called with, by the type of the argument; parameters otherwise.
_ROLES = {"Scalar": ("t", "time"), "States": ("u", "states")}


def _order(function: Callable[..., Any], arguments: Sequence[Any]) -> str:
    """Sentence on how a function is called, where its own arguments do not look like it."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # a function of C
        return ""
    roles = [_ROLES.get(type(argument).__name__, ("p", "parameters")) for argument in arguments]
    expected = [letter for letter, _ in roles]
    own = list(signature.parameters)
    if own == expected:
        return ""
    form = f"f({', '.join(expected)}): {', '.join(word for _, word in roles)}"
    try:
        signature.bind(*arguments)
    except TypeError:
        return f"its arguments are ({', '.join(own)}), but it is called as {form}; write them so"
    if sorted(own) == sorted(expected):
        return f"its arguments are ({', '.join(own)}), in another order than it is called: {form}; write them so"
    return f" (it is called as {form}, and its arguments are ({', '.join(own)}))"


def _entry(value: Any, what: str) -> sp.Expr:
    try:
        expression = to_expression(value)
    except (TypeError, SystemDefinitionError) as error:
        raise SystemDefinitionError(f"{what} did not give a real number: {error}") from error
    if expression.has(sp.nan, sp.zoo, sp.oo, -sp.oo):
        text = shortened(as_written(expression), quoted=False)
        raise SystemDefinitionError(f"{what} divides by zero or is not finite: {text}")
    if expression.has(sp.I):
        raise SystemDefinitionError(f"{what} is not real: {shortened(as_written(expression), quoted=False)}")
    if any(abs(number) > _LARGEST for number in expression.atoms(sp.Number)):
        raise SystemDefinitionError(f"{what} holds a number beyond {float(_LARGEST):.3g}, more than a float can hold")
    return exact(expression)


def refuse_corners(expression: sp.Expr, state: set[sp.Symbol], what: str) -> None:
    """Raise where ``expression`` has a corner (abs, sign, max, where, ...) in one of the symbols ``state``."""
    for corner in expression.atoms(*CORNERS):
        if corner.free_symbols & state:
            kind = {"Piecewise": "where", "Abs": "abs", "Max": "max", "Min": "min"}.get(
                type(corner).__name__, type(corner).__name__
            )
            raise SystemDefinitionError(
                f"{what} contains `{kind}` of the state or the time: a corner no method can see. Make it two modes "
                f"with an indicator that changes sign at the corner and a transition each way (in an "
                f"indicator: one indicator for each side, with a transition each; of the time alone: transitions with "
                f"`at=`, or an input)"
            )
