"""Places where the right-hand sides of a system may hide something from a Taylor step, and what to watch there.

The length of a Taylor step is read off its last coefficients. They tell nothing of a term that is below rounding at
the beginning of the step and large at its end: a saturated tanh, the flank of a bell, a wall x**40. Such a term rests
on a function whose singularities (or growth) lie off the solution; what decides is its argument, and it is largest, or
turns over, where the argument vanishes or is stationary. These *watched arguments* become further rows of the
generated jets, and ``kernels.series.taylor.trusted`` compares the polynomial with the equations at their zeros and
extremes.

Right-hand sides without such functions need no comparison: polynomials of a low degree in the states, sines, cosines
and positive powers of what is linear. Their series shows the last terms at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sympy import Expr

    from nonsmooth.system.symbolic.traced import Traced

# A term of degree d grows like exp(d r) where the states grow like exp(r); its series shows that from the order d r on,
# and r stays below 1.5 on a step of any order used here (the last term would not be small otherwise).
LOW_DEGREE = 4


@dataclass(frozen=True)
class Layers:
    """Result of :func:`layers`.

    ``model`` is the system with the watched arguments as further outputs (itself where there are none), ``count``
    their number; ``checked`` says whether steps need checking at all.
    """

    model: Traced
    count: int
    checked: bool


@lru_cache(maxsize=256)
def layers(traced: Traced) -> Layers:
    """The watched arguments of a system's fields and indicators, mode by mode."""
    from sympy import S

    variables = frozenset({traced.t, *traced.u})
    finder = _Finder(variables)
    expressions = [(*fields, *traced.indicators) for fields in traced.fields]
    watched = {e: finder.guards(e) for e in dict.fromkeys(chain.from_iterable(expressions))}  # modes share most
    modes = [list(dict.fromkeys(one for e in of_mode for one in watched[e])) for of_mode in expressions]
    count = max(map(len, modes))
    if not any(map(finder.suspicious, watched)):
        return Layers(traced, 0, False)
    rows = tuple(tuple(mode[i] if i < len(mode) else S.Zero for mode in modes) for i in range(count))
    names = tuple(f"guard_{i}" for i in range(count))
    model = replace(traced, output_names=traced.output_names + names, outputs=traced.outputs + rows)
    return Layers(model, count, True)


class _Finder:
    """Walks expressions of the variables; all other symbols are constant along a trajectory."""

    def __init__(self, variables: frozenset[Any]) -> None:
        self.variables = variables

    def guards(self, e: Expr) -> list[Expr]:
        """Arguments to be watched, in an order that does not depend on hashes."""
        return [one for part in self._parts(e) for argument in self._arguments(part) for one in self._plain(argument)]

    def suspicious(self, e: Expr) -> bool:
        """Return whether the expression holds anything to be watched, or a high power."""
        return self._degree(e) > LOW_DEGREE or any(self._arguments(part) for part in self._parts(e))

    def _varies(self, e: Any) -> bool:
        return bool(e.free_symbols & self.variables)

    def _parts(self, e: Expr) -> Iterator[Any]:
        from sympy import preorder_traversal

        return (part for part in preorder_traversal(e) if self._varies(part))

    def _linear(self, e: Expr) -> bool:
        """Return whether all slopes are constant."""
        return not any(self._varies(e.diff(v)) for v in sorted(e.free_symbols & self.variables, key=str))

    def _degree(self, e: Any) -> int:
        """Degree as a polynomial in the variables, any function counting as one of them."""
        if not self._varies(e):
            return 0
        if e.is_Add:
            return max(self._degree(a) for a in e.args)
        if e.is_Mul:
            return sum(self._degree(a) for a in e.args)
        if e.is_Piecewise:
            return max(self._degree(a) for a, _ in e.args)
        if e.is_Pow and e.exp.is_Integer and e.exp > 0:
            return int(e.exp) * self._degree(e.base)
        return 1

    def _arguments(self, e: Any) -> tuple[Expr, ...]:
        """The arguments of one operation that decide whether it hides something; none where it cannot."""
        import sympy

        if e.is_Pow:
            if self._varies(e.exp):
                return e.base, e.exp
            if e.exp.is_Integer and e.exp > 0:
                return (e.base,) if self._degree(e) > LOW_DEGREE else ()
            # A root of something linear: beyond its zero there is nothing, and before it the root is bounded.
            return () if e.exp.is_number and e.exp > 0 and self._linear(e.base) else (e.base,)
        if isinstance(e, sympy.sin | sympy.cos):
            return () if self._linear(e.args[0]) else e.args
        if isinstance(e, sympy.atan2):
            return (*e.args, e.args[0] ** 2 + e.args[1] ** 2)
        if isinstance(e, sympy.Function) and not isinstance(e, sympy.Piecewise):
            return e.args
        return ()

    def _plain(self, e: Expr) -> Iterator[Expr]:
        """The argument without what moves neither its zeros nor its extremes, and the simplest row with the latter.

        -(v/w)**2 gives v; 1 + (v/w)**2 itself and v."""
        _, e = e.as_independent(*self.variables, as_Add=False)
        while e.is_Pow and not self._varies(e.exp) and e.exp.is_positive:
            e = e.base
            _, e = e.as_independent(*self.variables, as_Add=False)
        if not self._varies(e):
            return
        yield e
        constant, rest = e.as_independent(*self.variables, as_Add=True)
        if constant != 0 and not self._linear(rest):
            yield from self._plain(rest)
