"""Sums over many states in vector instructions, as long as they come: products of rows, diagonals, terms of series.

Beside ``lanes``, whose sums are as long as a few states need; ``plain`` holds the same sums as loops.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from nonsmooth.kernels.compile.lanes import CONTRACT, LANES, LONGEST, WIDEST, Array, choose, scaled

__all__ = ["add_products", "dot", "plain", "sizes", "spread", "sum_terms"]


def _dot(total: Any, row: Any, at: Any, w: Any, n: Any) -> Any:
    """total + sum_j row[at + j] w[j] for j < n."""
    for j in range(n):
        total += row[at + j] * w[j]
    return total


def _spread(total: Any, row: Any, at: Any, w: Any, about: Any, n: Any) -> Any:
    """total + sum_j row[at + j] |w[j] - about[2 + j]| for j < n."""
    for j in range(n):
        total += row[at + j] * abs(w[j] - about[2 + j])
    return total


def _sizes(total: Any, row: Any, at: Any, w: Any, n: Any) -> Any:
    """total + sum_j |row[at + j] w[j]| for j < n."""
    for j in range(n):
        total += abs(row[at + j] * w[j])
    return total


def _add_products(rows: Any, k: Any, bands: Any, mode: Any, d: Any, offset: Any, first: Any, last: Any) -> None:
    """rows[k, r] += bands[mode, d, r] rows[k - 1, r + offset] for first <= r < last."""
    for r in range(first, last):
        rows[k, r] += bands[mode, d, r] * rows[k - 1, r + offset]


def _sum_terms(out: Any, rows: Any, first: Any, last: Any, x: Any, sized: Any, m: Any) -> None:
    """out[j] = sum_k x^(k - first) / (k - first)! rows[k, j] for first <= k <= last and j < m; ``sized``: of |rows|."""
    for j in range(m):
        total = abs(rows[last, j]) if sized else rows[last, j]
        for k in range(last - 1, first - 1, -1):
            total = total * x / (k + 1 - first) + (abs(rows[k, j]) if sized else rows[k, j])
        out[j] = total


plain = SimpleNamespace(dot=_dot, sizes=_sizes, spread=_spread, add_products=_add_products, sum_terms=_sum_terms)


def _size(builder: Any, value: Any) -> Any:
    """|value| of a number or a vector: without its sign's bit."""
    bits: Any = ir.IntType(64)
    mask: Any = 2**63 - 1
    if isinstance(value.type, ir.VectorType):
        bits, mask = ir.VectorType(bits, value.type.count), [mask] * value.type.count
    return builder.bitcast(builder.and_(builder.bitcast(value, bits), ir.Constant(bits, mask)), value.type)


def _fold(builder: Any, total: Any, term: Callable[[Any, Any], Any], n: int) -> Any:
    """``total`` and term(vector, j) for all j < n: in the widest vectors that fit, added up in halves at the end."""

    def add(a: Any, b: Any) -> Any:
        return builder.fadd(a, b, flags=CONTRACT)

    width, at, parts = WIDEST, 0, None
    while width > 1:
        vector = ir.VectorType(ir.DoubleType(), width)
        count = (n - at) // width
        if count:
            parts = term(vector, at) if parts is None else add(parts, term(vector, at))
            at += width
        if count > LONGEST:
            whole = ir.IntType(64)
            place = cgutils.alloca_once_value(builder, parts)
            ends = (ir.Constant(whole, k) for k in (at, at + (count - 1) * width, width))
            with cgutils.for_range_slice(builder, *ends, intp=whole) as (j, _):
                builder.store(add(builder.load(place), term(vector, j)), place)
            parts = builder.load(place)
            at += (count - 1) * width
        elif count > 1:
            for _ in range(count - 1):
                parts = add(parts, term(vector, at))
                at += width
        if parts is not None:
            lane, nothing = ir.IntType(32), ir.Constant(vector, ir.Undefined)
            low, high = (
                ir.Constant(ir.VectorType(lane, width // 2), list(range(begin, begin + width // 2)))
                for begin in (0, width // 2)
            )
            parts = add(builder.shuffle_vector(parts, nothing, low), builder.shuffle_vector(parts, nothing, high))
        width //= 2
    if parts is not None:
        total = add(total, builder.extract_element(parts, ir.Constant(ir.IntType(32), 0)))
    for j in range(at, n):
        total = add(total, term(None, j))
    return total


def _products(total: Any, row: Any, w: Any, n: Any, whole: bool) -> Any:
    """Signature and code of ``total`` and the products of two rows, or (not ``whole``) their sizes."""
    signature = types.float64(types.float64, row, types.int64, w, n)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        total_, row_, at_, w_ = arguments[:4]
        source, weights = Array(context, builder, row, row_), Array(context, builder, w, w_)

        def term(vector: Any, j: Any) -> Any:
            place = builder.add(at_, j if isinstance(j, ir.Value) else ir.Constant(at_.type, j))
            product = builder.fmul(source.get(vector, place), weights.get(vector, j), flags=CONTRACT)
            return product if whole else _size(builder, product)

        return _fold(builder, total_, term, n.literal_value)

    return signature, generate


@intrinsic(prefer_literal=True)
def _dot_in_lanes(typing: Any, total: Any, row: Any, at: Any, w: Any, n: Any) -> Any:
    return _products(total, row, w, n, True)


@intrinsic(prefer_literal=True)
def _sizes_in_lanes(typing: Any, total: Any, row: Any, at: Any, w: Any, n: Any) -> Any:
    return _products(total, row, w, n, False)


@intrinsic(prefer_literal=True)
def _spread_in_lanes(typing: Any, total: Any, row: Any, at: Any, w: Any, about: Any, n: Any) -> Any:
    signature = types.float64(types.float64, row, types.int64, w, about, n)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        total_, row_, at_, w_, about_ = arguments[:5]
        source, weights = Array(context, builder, row, row_), Array(context, builder, w, w_)
        middle = Array(context, builder, about, about_)

        def term(vector: Any, j: Any) -> Any:
            j = j if isinstance(j, ir.Value) else ir.Constant(at_.type, j)
            there = middle.get(vector, builder.add(j, ir.Constant(at_.type, 2)))
            apart = builder.fsub(weights.get(vector, j), there)
            return builder.fmul(source.get(vector, builder.add(at_, j)), _size(builder, apart), flags=CONTRACT)

        return _fold(builder, total_, term, n.literal_value)

    return signature, generate


@intrinsic
def _add_products_in_lanes(
    typing: Any, rows: Any, k: Any, bands: Any, mode: Any, d: Any, offset: Any, first: Any, last: Any
) -> Any:  # fmt: skip
    whole = types.int64
    signature = types.void(rows, whole, bands, whole, whole, whole, whole, whole)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows_, k_, bands_, mode_, d_, offset_, first_, last_ = arguments
        values, factors = Array(context, builder, rows, rows_), Array(context, builder, bands, bands_)
        index = ir.IntType(64)
        before = builder.sub(k_, ir.Constant(index, 1))
        size = builder.sub(last_, first_)
        middle = builder.add(first_, builder.and_(size, ir.Constant(index, -LANES)))
        for begin, end, width in ((first_, middle, LANES), (middle, last_, 1)):
            vector = ir.VectorType(ir.DoubleType(), width) if width > 1 else None
            step = ir.Constant(index, width)
            with cgutils.for_range_slice(builder, begin, end, step, intp=index) as (r, _):
                product = builder.fmul(
                    factors.get(vector, mode_, d_, r), values.get(vector, before, builder.add(r, offset_)),
                    flags=CONTRACT,
                )  # fmt: skip
                total = builder.fadd(values.get(vector, k_, r), product, flags=CONTRACT)
                if vector is None:
                    values.put(total, k_, r)
                else:
                    values.store(total, k_, r)
        return context.get_dummy_value()

    return signature, generate


@intrinsic(prefer_literal=True)
def _sum_terms_in_lanes(
    typing: Any, out: Any, rows: Any, first: Any, last: Any, x: Any, sized: Any, m: Any
) -> Any:  # fmt: skip
    signature = types.void(out, rows, first, last, types.float64, sized, m)
    begin, end, whole, width = first.literal_value, last.literal_value, m.literal_value, sized.literal_value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, source = Array(context, builder, out, arguments[0]), Array(context, builder, rows, arguments[1])
        x_ = arguments[4]

        def term(vector: Any, k: int, at: int) -> Any:
            value = source.get(vector, k, at)
            return _size(builder, value) if width else value

        factors = [
            builder.fmul(x_, ir.Constant(ir.DoubleType(), 1.0 / (k + 1 - begin)), flags=CONTRACT)
            for k in range(begin, end)
        ]
        at = 0
        while at < whole:
            lanes = next(size for size in (WIDEST, LANES, 1) if at + size <= whole)
            vector = ir.VectorType(ir.DoubleType(), lanes) if lanes > 1 else None
            total = term(vector, end, at)
            for k in range(end - 1, begin - 1, -1):
                factor = factors[k - begin]
                times_x = scaled(builder, total, factor) if lanes > 1 else builder.fmul(total, factor, flags=CONTRACT)
                total = builder.fadd(times_x, term(vector, k, at), flags=CONTRACT)
            if vector is None:
                target.put(total, at)
            else:
                target.store(total, at)
            at += lanes
        return context.get_dummy_value()

    return signature, generate


dot, sizes, spread = choose(_dot_in_lanes, _dot), choose(_sizes_in_lanes, _sizes), choose(_spread_in_lanes, _spread)
add_products = choose(_add_products_in_lanes, _add_products)
sum_terms = choose(_sum_terms_in_lanes, _sum_terms)
