"""`Map`: a piecewise-smooth map, made as a system in which nothing moves but once in every period of length 1.

One mode holds the point. At the end of a period it goes to a second mode, and from there back at the same instant by
the transition of the region it lies in, whose reset is the branch. Multipliers, exponents and continuation therefore
have the derivative of that branch, and a point of an orbit that reaches a border is an event of its branch.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.arguments import checked
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.scalar import Scalar
from nonsmooth.system.symbolic.tracing import KnownFunction, call_scalar, call_vector
from nonsmooth.system.system import System
from nonsmooth.system.transition import Transition, condition_text, read_condition

HOLD, CHOOSE = "hold", "choose"
ESCAPED = 1e300  # a state beyond every limit: the run ends as diverged
MOST_BORDERS = 10
DRAWN = 4000  # points in which a region is looked for where its borders are curved

Rows = tuple[tuple[str, int, bool], ...]


@dataclass(frozen=True)
class Branch:
    """One piece of a map.

    Parameters
    ----------
    function : callable
        ``function(u, p)`` returns the image of the state u.
    when : str, optional
        The region: signs of states or indicators joined by ``and``, as ``"x < 0 and side > 0"``. A map with one branch
        needs none.
    """

    function: Callable[..., Any]
    when: str | None = None

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise SystemDefinitionError(f"a branch needs a function f(u, p), not {shortened(self.function)}")


class Map(System):
    r"""A piecewise-smooth map :math:`u_{n+1} = F_i(u_n, p)` for :math:`u_n` in region i: a `System` for all verbs.

    Parameters
    ----------
    states : mapping of str to str, or sequence of str
        Names and units of the states, in order.
    parameters : mapping
        ``{"mu": 0.01, "m": (0.838, "kg")}``, as for a `System`.
    branches : sequence of Branch
        The pieces. Their regions cover the states once; a point on a border belongs to the branch listed first. The
        map may jump at a border.
    indicators : mapping of str to callable, optional
        Functions ``h(u, p)`` whose signs bound the regions, besides the states themselves.
    outputs : mapping, optional
        ``{"energy": (f, "J")}`` with ``f(u, p)``.
    scale : mapping of str to float, optional
        Typical sizes of the states (1 where missing).
    name : str

    Raises
    ------
    SystemDefinitionError
        What does not fit together; a point that no region holds, or that two hold, is named.

    Notes
    -----
    An iterate is a period: ``transient``, ``keep`` and ``period_number`` count iterates, and so does the time. The
    first section point is the image of the start. Whether regions cover the states once is shown by the signs of their
    indicators, else searched at the given values of the parameters. At other values the first of two regions is
    taken, and a point that no region holds ends the run with the status ``diverged``.
    """

    __slots__ = ()

    @checked(read=False)
    def __init__(
        self,
        *,
        states: Mapping[str, str] | Sequence[str],
        parameters: Mapping[str, Any],
        branches: Sequence[Branch],
        indicators: Mapping[str, Callable[..., Any]] | None = None,
        outputs: Mapping[str, Any] | None = None,
        scale: Mapping[str, float] | None = None,
        name: str = "map",
    ) -> None:
        pieces = _pieces(branches, name)
        given = {key: _number(function, f"indicator {key!r}") for key, function in (indicators or {}).items()}
        regions, borders = _regions(pieces, given, list(states))
        still, escape = (KnownFunction([one] * len(list(states))) for one in (0, ESCAPED))
        modes: dict[str, Any] = {HOLD: still}
        if regions == [()]:
            transitions = [Transition(HOLD, HOLD, at=0.0, reset=_image(pieces[0], list(states), "the branch"))]
        else:
            modes[CHOOSE] = still
            transitions = [Transition(HOLD, CHOOSE, at=0.0)]
            for i, (piece, rows) in enumerate(zip(pieces, regions, strict=True)):
                reset = _image(piece, list(states), f"branch {i + 1}")
                transitions.append(Transition(CHOOSE, HOLD, when=condition_text(rows), reset=reset))
            nowhere = [pattern for pattern, holders in _patterns(regions).items() if not holders]
            transitions += [Transition(CHOOSE, HOLD, when=condition_text(one), reset=escape) for one in nowhere]
        super().__init__(
            name=name,
            states=states,
            parameters=parameters,
            modes=modes,
            indicators={**given, **borders},
            transitions=transitions,
            outputs={key: _output(key, one) for key, one in (outputs or {}).items()},
            scale=scale,
            period=1.0,
        )
        _check_regions(self, regions)


def _pieces(branches: Any, name: str) -> list[Branch]:
    if isinstance(branches, Branch):
        branches = [branches]
    if isinstance(branches, str) or not isinstance(branches, Sequence) or not branches:
        raise SystemDefinitionError(
            f'{name!r}: `branches` is a list such as [ns.Branch(left, when="x < 0"), ns.Branch(right, when="x > 0")], '
            f"not {shortened(branches)}"
        )
    for one in branches:
        if not isinstance(one, Branch):
            raise SystemDefinitionError(f"{name!r}: `branches` is a list of ns.Branch, not of {shortened(one)}")
        if one.when is None and len(branches) > 1:
            raise SystemDefinitionError(
                f'{name!r}: each of several branches needs its region: ns.Branch(f, when="x < 0")'
            )
    return list(branches)


def _regions(
    pieces: Sequence[Branch], indicators: Mapping[str, Any], states: Sequence[str]
) -> tuple[list[Rows], dict[str, Callable[..., Any]]]:
    """The signs of each region, and an indicator for every state that bounds one."""
    regions, borders = [], {}
    for i, piece in enumerate(pieces):
        rows: list[tuple[str, int, bool]] = []
        if piece.when is not None:
            for key, sign, _ in read_condition(piece.when, [*indicators, *states], f"branch {i + 1}"):
                if key not in indicators:
                    borders[f"border_{key}"] = _coordinate(key)
                    key = f"border_{key}"
                rows.append((key, sign, False))
        regions.append(tuple(rows))
    return regions, borders


def _patterns(regions: Sequence[Rows]) -> dict[Rows, list[int]]:
    """Every combination of signs of the indicators that bound regions, and the branches whose regions have it."""
    names = list(dict.fromkeys(key for rows in regions for key, _, _ in rows))
    if len(names) > MOST_BORDERS:
        raise SystemDefinitionError(f"the regions have {len(names)} indicators; at most {MOST_BORDERS} are allowed")
    found = {}
    for signs in product((-1, 1), repeat=len(names)):
        here = dict(zip(names, signs, strict=True))
        pattern = tuple((key, sign, False) for key, sign in here.items())
        found[pattern] = [i for i, rows in enumerate(regions) if all(here[key] == sign for key, sign, _ in rows)]
    return found


def _check_regions(system: Map, regions: Sequence[Rows]) -> None:
    """Raise where a point lies in no region or in two."""
    for pattern, holders in _patterns(regions).items():
        if len(holders) == 1:
            continue
        point = _point_with(system, pattern)
        if point is None:
            continue
        where = ", ".join(f"{key} = {value:.6g}" for key, value in zip(system.states, point, strict=True))
        if holders:
            raise SystemDefinitionError(
                f"{system.name!r}: the point {where} lies in the regions of the branches "
                f"{' and '.join(str(i + 1) for i in holders)}; every point must lie in one"
            )
        raise SystemDefinitionError(
            f"{system.name!r}: the point {where} lies in no region; give a branch for it, or end a condition earlier"
        )


def _point_with(system: Map, pattern: Rows) -> list[float] | None:
    """A point at which the indicators have these signs, at the present values of the parameters; None where none is."""
    traced = system.traced
    values = dict(zip(traced.p, system.parameter_vector(), strict=True))
    own = [sign * traced.indicators[traced.indicator_names.index(key)] for key, sign, _ in pattern]
    rows = [row.subs(values) for row in own]
    scale = system.scale_vector()
    slopes = [[row.diff(symbol) for symbol in traced.u] for row in rows]
    if all(slope.is_number for row in slopes for slope in row):
        from scipy.optimize import linprog

        # The largest t <= 1 with row >= t at some u, in units of the scale.
        A = np.array([[float(slope) for slope in row] for row in slopes]) * scale
        b = np.array([float(row.subs(dict.fromkeys(traced.u, 0))) for row in rows])
        size = np.maximum(np.abs(A).max(axis=1), 1e-300)
        upper = np.hstack([-A / size[:, None], np.ones((len(rows), 1))])
        aim, box = [*[0.0] * len(scale), -1.0], [*[(None, None)] * len(scale), (None, 1.0)]
        found = linprog(aim, A_ub=upper, b_ub=b / size, bounds=box)
        inside = found.status == 0 and -found.fun > 1e-12 * max(1.0, np.abs(b / size).max(initial=0.0))
        return (found.x[:-1] * scale).tolist() if inside else None
    random = np.random.default_rng(11)
    spread = 10.0 ** random.uniform(-3, 2, (DRAWN, 1))
    points = random.standard_normal((DRAWN, len(scale))) * spread * scale
    inside = np.flatnonzero((numeric(traced, tuple(own))(system.parameter_vector(), u=points) > 0).all(axis=1))
    return points[inside[0]].tolist() if len(inside) else None


def _coordinate(state: str) -> Callable[..., Any]:
    return lambda t, u, p: u[state]


def _image(branch: Branch, states: Sequence[str], what: str) -> Callable[..., Any]:
    """The branch as a reset."""
    return lambda t, u, p: [Scalar(entry) for entry in call_vector(branch.function, (u, p), states, what)]


def _number(function: Any, what: str) -> Callable[..., Any]:
    """A function of (u, p) with one value as one of (t, u, p)."""
    return lambda t, u, p: Scalar(call_scalar(function, (u, p), what))


def _output(key: str, given: Any) -> Any:
    function, unit = given if isinstance(given, (tuple, list)) and len(given) == 2 else (given, "")
    return _number(function, f"output {key!r}"), unit
