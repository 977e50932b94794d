"""Recurrences of Taylor coefficients: from the coefficients of the operands to those of the result.

Each function gives a :class:`Node`: the text that computes coefficient 0 and coefficient k of one operation. All
follow from a differential equation of the operation, for example y = exp(x), y' = y x', hence
k y_k = sum over 0 < j <= k of j x_j y_(k-j). Of every such sum the terms 0 < j < k are left to the caller, who
computes the sums of all nodes in one loop; the text holds the two end terms.

Source: G. Corliss, Y. F. Chang, ACM Trans. Math. Softw. 8 (1982) 114-144; A. Griewank, A. Walther, *Evaluating
Derivatives* (2008), ch. 13.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

Sum = tuple[str, int, int]  # (weight, x, y): the sum over 0 < j < k of weight * x_j * y_(k-j)


@dataclass(frozen=True)
class Node:
    """One series.

    In the texts z3 is coefficient 0 and c3 coefficient k of node 3, r is 1/k, and s[0], s[1], ... are the names
    of the inner sums ``sums``; in their weights x is j and xk is k. ``needs`` are the nodes computed before it,
    ``partner`` one that is always computed together with it. Where ``carried``, c of the node itself and of its
    partner still stand for coefficient k - 1.
    """

    value: str
    step: Callable[[list[str]], str]
    needs: tuple[int, ...] = ()
    sums: tuple[Sum, ...] = ()
    partner: int = -1
    carried: bool = False


def scaled(factor: str, text: str) -> str:
    """The product of a factor and a text, without factors of one."""
    return {"1.0": text, "-1.0": f"-({text})"}.get(factor, f"{factor}*({text})")


def opposite(factor: str) -> str:
    return factor[1:] if factor.startswith("-") else "-" + factor


def times(a: int, b: int) -> Node:
    """y = a b."""
    if a == b:
        return Node(f"z{a}*z{a}", lambda s: f"2.0*z{a}*c{a} + {s[0]}", (a,), (("", a, a),))
    return Node(f"z{a}*z{b}", lambda s: f"z{a}*c{b} + z{b}*c{a} + {s[0]}", (a, b), (("", a, b),))


def quotient(y: int, a: int, b: int) -> Node:
    """y b = a."""
    return Node(f"z{a}/z{b}", lambda s: f"(c{a} - z{y}*c{b} - {s[0]})/z{b}", (a, b), (("", b, y),))


def inverse(y: int, b: int) -> Node:
    """y b = 1."""
    return Node(f"1.0/z{b}", lambda s: f"-(z{y}*c{b} + {s[0]})*z{y}", (b,), (("", b, y),))


def root(y: int, a: int, sqrt: str) -> Node:
    """y^2 = a."""
    return Node(f"{sqrt}(z{a})", lambda s: f"(c{a} - {s[0]})*(0.5/z{y})", (a,), (("", y, y),))


def power(y: int, a: int, value: str, exponent: str, exponent_plus_one: str) -> Node:
    """y = a^e with a constant e: a y' = e y a'."""
    weight = f"(({exponent_plus_one})*x - xk)*"
    return Node(value, lambda s: f"(({exponent})*z{y}*c{a} + r*{s[0]})/z{a}", (a,), ((weight, a, y),))


def exponential(y: int, x: int, value: str, w: str) -> Node:
    """y = exp(w x + constant): y' = w y x'."""
    return Node(value, lambda s: scaled(w, f"z{y}*c{x} + r*{s[0]}"), (x,), (("x*", x, y),))


def exponential_in_time(y: int, value: str, w: str) -> Node:
    """y = exp(w t + constant): y' = w y."""
    return Node(value, lambda s: f"{w}*r*c{y}", carried=True)


def logarithm(y: int, a: int, log: str) -> Node:
    """y = log(a): a y' = a'."""
    return Node(f"{log}(z{a})", lambda s: f"(c{a} - r*{s[0]})/z{a}", (a,), (("x*", y, a),))


def circular(y: int, x: int, values: tuple[str, str], w: str, hyperbolic: bool) -> tuple[Node, Node]:
    """The pair y = sin(w x + constant), v = cos(...): y' = w v x', v' = -w y x' (sinh, cosh: + w y x')."""
    v, down = y + 1, w if hyperbolic else opposite(w)
    return (
        Node(values[0], lambda s: scaled(w, f"z{v}*c{x} + r*{s[0]}"), (x,), (("x*", x, v),), v),
        Node(values[1], lambda s: scaled(down, f"z{y}*c{x} + r*{s[0]}"), (x,), (("x*", x, y),), y),
    )


def circular_in_time(y: int, values: tuple[str, str], w: str, hyperbolic: bool) -> tuple[Node, Node]:
    """The same pair with x = t: no sums."""
    v, down = y + 1, w if hyperbolic else opposite(w)
    return (
        Node(values[0], lambda s: f"{w}*r*c{v}", partner=v, carried=True),
        Node(values[1], lambda s: f"{down}*r*c{y}", partner=y, carried=True),
    )


def tangent(y: int, x: int, value: str, w: str, hyperbolic: bool) -> tuple[Node, Node]:
    """The pair y = tan(w x + constant), v = 1 + y^2: y' = w v x' (tanh: v = 1 - y^2)."""
    v, sign, minus = y + 1, "-" if hyperbolic else "+", "-" if hyperbolic else ""
    return (
        Node(value, lambda s: scaled(w, f"z{v}*c{x} + r*{s[0]}"), (x,), (("x*", x, v),), v),
        Node(f"1.0 {sign} z{y}*z{y}", lambda s: f"{minus}(2.0*z{y}*c{y} + {s[0]})", (y,), (("", y, y),), y),
    )


def inverse_function(y: int, x: int, w: int, function: str) -> Node:
    """y = f(x) with w y' = x': w = 1 + x^2 for the arctangent, and so on."""
    return Node(f"{function}(z{x})", lambda s: f"(c{x} - r*{s[0]})/z{w}", (x, w), (("x*", y, w),))


def angle(y: int, b: int, a: int, w: int, atan2: str) -> Node:
    """y = atan2(b, a): w y' = a b' - b a' with w = a^2 + b^2."""
    return Node(
        f"{atan2}(z{b}, z{a})",
        lambda s: f"(z{a}*c{b} - z{b}*c{a} + r*({s[0]} - {s[1]} - {s[2]}))/z{w}",
        (a, b, w),
        (("x*", b, a), ("x*", a, b), ("x*", y, w)),
    )
