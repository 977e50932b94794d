"""Expressions of scalar code as text for LLVM (``scalar``): numbers, entries of arrays, functions."""

from __future__ import annotations

import ast
import builtins
import math
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from nonsmooth.kernels.compile import lanes

REAL, WHOLE, YES, FOUR = "double", "i64", "i1", f"<{lanes.FOUR} x double>"
_OPERATIONS: dict[type, tuple[str, str]] = {
    ast.Add: ("fadd", "add"),
    ast.Sub: ("fsub", "sub"),
    ast.Mult: ("fmul", "mul"),
}
_RELATIONS: dict[type, tuple[str, str]] = {
    ast.Lt: ("olt", "slt"),
    ast.LtE: ("ole", "sle"),
    ast.Gt: ("ogt", "sgt"),
    ast.GtE: ("oge", "sge"),
    ast.Eq: ("oeq", "eq"),
    ast.NotEq: ("une", "ne"),
}
#: Functions of ``math`` that LLVM knows, and those of the C library.
_KNOWN = {"sqrt": "sqrt", "fabs": "fabs", "floor": "floor", "ceil": "ceil", "exp": "exp", "log": "log"}
_LIBRARY = {
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
    *("sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
}


class Value(NamedTuple):
    """A number in LLVM's text."""

    text: str
    kind: str

    @property
    def words(self) -> list[str]:
        """The words that stand for it in a call."""
        return [f"{self.kind} {self.text}"]


class Array(NamedTuple):
    """The address of an array's numbers, their kind, and its shape."""

    address: str
    kind: str
    shape: tuple[str, ...]

    @property
    def words(self) -> list[str]:
        """The words that stand for it in a call."""
        return [f"ptr {self.address}", *(f"i64 {width}" for width in self.shape)]


def _number(value: float | int) -> str:
    """A number as LLVM reads it."""
    if isinstance(value, int):
        return str(int(value))
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


class Module(ABC):
    """Functions, arrays and declarations of one text for LLVM."""

    def __init__(self) -> None:
        self.parts: dict[Any, str] = {}
        self.called: dict[Any, tuple[str, str]] = {}  # function -> its name and the kind that it returns

    def global_array(self, name: str, values: Any) -> Array:
        kind = WHOLE if values.dtype.kind == "i" else REAL
        numbers = ", ".join(f"{kind} {_number(one)}" for one in values.tolist())
        self.parts[name] = f"@{name} = internal constant [{len(values)} x {kind}] [{numbers}]"
        return Array(f"@{name}", kind, (str(len(values)),))

    def declared(self, name: str, count: int) -> str:
        self.parts[name] = f"declare double @{name}({', '.join([REAL] * count)}) nounwind willreturn memory(none)"
        return f"@{name}"

    @abstractmethod
    def inner(self, function: Any, given: list[Value | Array]) -> tuple[str, str]:
        """The name of a function with arguments of these kinds, and the kind that it returns."""


class ScalarCode:
    """Lines of a function's text. Names are places of memory, which LLVM turns into values."""

    module: Module
    function: Any
    known: dict[str, Value | Array]  # a Value: the place of a name, and the kind that it holds

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.places: list[str] = []
        self.count = 0

    def _say(self, line: str) -> None:
        self.lines.append(line)

    def _new(self, line: str, kind: str) -> Value:
        self.count += 1
        self._say(f"%v{self.count} = {line}")
        return Value(f"%v{self.count}", kind)

    def _label(self, name: str) -> None:
        self._say(f"br label %{name}")
        self.lines.append(f"{name}:")

    def _named(self, *names: str) -> list[str]:
        self.count += 1
        return [f"{name}{self.count}" for name in names]

    def _refuse(self, node: ast.AST) -> NoReturn:
        raise NotImplementedError(f"{self.function.__name__}: no machine code is made of `{ast.unparse(node)}`")

    def _store(self, name: str, value: Value) -> None:
        place = self.known.get(name)
        if place is None:
            place = self.known[name] = Value(f"%{name}.place", value.kind)
            self.places.append(f"{place.text} = alloca {value.kind}")
        assert isinstance(place, Value)
        self._say(f"store {place.kind} {self._as(value, place.kind)}, ptr {place.text}")

    def _keep(self, name: str, node: ast.expr) -> None:
        self._store(name, self._value(node))

    def _choose(self, test: ast.expr, *ways: Callable[[], object]) -> None:
        """Go the first way where the test holds, else the second."""
        yes, no, end = self._named("yes", "no", "end")
        self._say(f"br i1 {self._truth(test)}, label %{yes}, label %{no}")
        for label, way in zip((yes, no), ways, strict=True):
            self.lines.append(f"{label}:")
            way()
            self._say(f"br label %{end}")
        self.lines.append(f"{end}:")

    def _value(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(value=bool() as yes):
                return Value(str(int(yes)), YES)
            case ast.Constant(value=int() | float() as number):
                return Value(_number(number), WHOLE if isinstance(number, int) else REAL)
            case ast.Name(id=name):
                return self._read(name, node)
            case ast.Subscript():
                array, place = self._entry(node)
                return self._new(f"load {array.kind}, ptr {place}", array.kind)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                value = self._value(inner)
                if value.kind == REAL:
                    return self._new(f"fneg double {value.text}", REAL)
                return self._new(f"sub i64 0, {self._as(value, WHOLE)}", WHOLE)
            case ast.UnaryOp(op=ast.Not(), operand=inner):
                return self._new(f"xor i1 {self._truth(inner)}, true", YES)
            case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=int() as times)):
                return self._whole_power(self._value(left), times)
            case ast.BinOp(left=left, op=op, right=right):
                return self._operation(op, self._value(left), self._value(right), node)
            case ast.Compare(left=left, ops=[relation], comparators=[right]):
                return self._comparison(relation, self._value(left), self._value(right))
            case ast.BoolOp(op=op, values=values):
                found = self._truth(values[0])
                for one in values[1:]:
                    word = "and" if isinstance(op, ast.And) else "or"
                    found = self._new(f"{word} i1 {found}, {self._truth(one)}", YES).text
                return Value(found, YES)
            case ast.IfExp(test=test, body=body, orelse=other):
                name = f"chosen.{node.lineno}.{node.col_offset}"
                self._choose(test, *(partial(self._keep, name, one) for one in (body, other)))
                return self._read(name, node)
            case ast.Call():
                called = self._call(node)
                return called if called is not None else self._refuse(node)
        self._refuse(node)

    def _read(self, name: str, node: ast.AST) -> Value:
        place = self.known.get(name)
        if isinstance(place, Value):
            return self._new(f"load {place.kind}, ptr {place.text}", place.kind)
        number = self.function.__globals__.get(name)
        if place is None and isinstance(number, int | float):
            return Value(_number(number), WHOLE if isinstance(number, int) else REAL)
        self._refuse(node)

    def _entry(self, node: ast.Subscript) -> tuple[Array, str]:
        """An array, and the address of one of its numbers."""
        array = self._array(node.value)
        at = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        places = [self._as(self._value(one), WHOLE) for one in at]
        if len(places) != len(array.shape):
            self._refuse(node)
        place = places[0]
        for width, more in zip(array.shape[1:], places[1:], strict=True):
            row = self._new(f"mul nsw i64 {place}, {width}", WHOLE)
            place = self._new(f"add nsw i64 {row.text}, {more}", WHOLE).text
        return array, self._new(f"getelementptr inbounds {array.kind}, ptr {array.address}, i64 {place}", "ptr").text

    def _array(self, node: ast.expr) -> Array:
        if isinstance(node, ast.Name):
            found = self.known.get(node.id)
            if found is None and isinstance(values := self.function.__globals__.get(node.id), np.ndarray):
                return self.module.global_array(node.id, values)
            if isinstance(found, Array):
                return found
        self._refuse(node)

    def _as(self, value: Value, kind: str) -> str:
        """The value as another kind of number."""
        if value.kind == kind:
            return value.text
        if kind == REAL and value.kind == WHOLE:
            if value.text.lstrip("-").isdigit():
                return _number(float(value.text))
            return self._new(f"sitofp i64 {value.text} to double", REAL).text
        if kind == REAL and value.kind == YES:
            return self._new(f"uitofp i1 {value.text} to double", REAL).text
        if kind == WHOLE and value.kind == YES:
            return self._new(f"zext i1 {value.text} to i64", WHOLE).text
        raise NotImplementedError(f"{self.function.__name__}: {value.kind} as {kind}")

    def _truth(self, node: ast.expr) -> str:
        value = self._value(node)
        if value.kind == YES:
            return value.text
        zero = Value("0", WHOLE)
        return self._comparison(ast.NotEq(), value, zero).text

    def _operation(self, op: ast.operator, left: Value, right: Value, node: ast.AST) -> Value:
        real = REAL in (left.kind, right.kind) or isinstance(op, ast.Div | ast.Pow)
        kind = REAL if real else WHOLE
        a, b = self._as(left, kind), self._as(right, kind)
        if type(op) in _OPERATIONS:
            word = f"{_OPERATIONS[type(op)][0]} contract" if real else f"{_OPERATIONS[type(op)][1]} nsw"
            return self._new(f"{word} {kind} {a}, {b}", kind)
        if isinstance(op, ast.Div):
            return self._new(f"fdiv contract double {a}, {b}", REAL)
        if isinstance(op, ast.Pow):
            return self._function("llvm.pow.f64", [Value(a, REAL), Value(b, REAL)])
        if isinstance(op, ast.Mod) and real:
            return self._remainder(a, b)
        if isinstance(op, ast.BitAnd) and not real:
            return self._new(f"and i64 {a}, {b}", WHOLE)
        self._refuse(node)

    def _remainder(self, a: str, b: str) -> Value:
        """a % b, which has the sign of b."""
        left = self._new(f"frem double {a}, {b}", REAL).text
        signs = [self._new(f"fcmp olt double {one}, {_number(0.0)}", YES).text for one in (left, b)]
        apart = self._new(f"xor i1 {signs[0]}, {signs[1]}", YES).text
        some = self._new(f"fcmp une double {left}, {_number(0.0)}", YES).text
        moved = self._new(f"fadd double {left}, {b}", REAL).text
        other = self._new(f"select i1 {apart}, double {moved}, double {left}", REAL)
        zero = self._function("llvm.copysign.f64", [Value(_number(0.0), REAL), Value(b, REAL)])
        return self._new(f"select i1 {some}, double {other.text}, double {zero.text}", REAL)

    def _whole_power(self, base: Value, times: int) -> Value:
        """A power by repeated squares, as Numba takes it."""
        if base.kind != REAL:
            base = Value(self._as(base, REAL), REAL)
        found, square, left = None, base, abs(times)
        while left:
            if left & 1:
                found = square if found is None else self._times(found, square)
            left >>= 1
            square = self._times(square, square) if left else square
        one = Value(_number(1.0), REAL)
        if found is None:
            return one
        return found if times > 0 else self._new(f"fdiv contract double {one.text}, {found.text}", REAL)

    def _times(self, a: Value, b: Value) -> Value:
        return self._new(f"fmul contract double {a.text}, {b.text}", REAL)

    def _comparison(self, relation: ast.cmpop, left: Value, right: Value) -> Value:
        real = REAL in (left.kind, right.kind)
        kind = REAL if real else WHOLE
        if type(relation) not in _RELATIONS:
            raise NotImplementedError(f"{self.function.__name__}: {type(relation).__name__}")
        word = f"fcmp {_RELATIONS[type(relation)][0]}" if real else f"icmp {_RELATIONS[type(relation)][1]}"
        return self._new(f"{word} {kind} {self._as(left, kind)}, {self._as(right, kind)}", YES)

    def _call(self, node: ast.Call) -> Value | None:
        assert isinstance(node.func, ast.Name)
        name = node.func.id
        function = self.function.__globals__.get(name, getattr(builtins, name, None))
        if function is lanes.store:
            array, place, vector = self._array(node.args[0]), self._value(node.args[1]), self._value(node.args[2])
            self._say(f"store {FOUR} {vector.text}, ptr {self._lane(array, place)}, align 8")
            return None
        if function is lanes.load:
            array, place = self._array(node.args[0]), self._value(node.args[1])
            return self._new(f"load {FOUR}, ptr {self._lane(array, place)}, align 8", FOUR)
        if callable(function) and (hasattr(function, "py_func") or hasattr(function, "__code__")):
            given: list[Value | Array] = []
            for one in node.args:
                named = isinstance(one, ast.Name) and isinstance(self.known.get(one.id), Array)
                given.append(self._array(one) if named else self._value(one))
            return self._inner(function, given)
        values = [self._value(one) for one in node.args]
        if function is lanes.times:
            return self._scaled(values[0], values[1])
        if function is lanes.plus:
            more = self._scaled(values[1], values[2])
            return self._new(f"fadd contract {FOUR} {values[0].text}, {more.text}", FOUR)
        if function is float:
            return Value(self._as(values[0], REAL), REAL)
        if function is int:
            return self._new(f"fptosi double {values[0].text} to i64", WHOLE) if values[0].kind == REAL else values[0]
        if function in (min, max):
            found = values[0]
            for other in values[1:]:  # Python's: the first that no other is beyond
                beyond = self._comparison(ast.Lt() if function is min else ast.Gt(), other, found)
                kind = REAL if REAL in (other.kind, found.kind) else WHOLE
                a, b = self._as(other, kind), self._as(found, kind)
                found = self._new(f"select i1 {beyond.text}, {kind} {a}, {kind} {b}", kind)
            return found
        if function is abs:
            return self._function("llvm.fabs.f64", values)
        known = getattr(function, "__name__", "") if function is getattr(math, name, None) else ""
        if known in _KNOWN:
            return self._function(f"llvm.{_KNOWN[known]}.f64", values)
        if known in _LIBRARY:
            return self._function(known, values)
        self._refuse(node)

    def _function(self, name: str, values: list[Value]) -> Value:
        given = ", ".join(f"double {self._as(one, REAL)}" for one in values)
        return self._new(f"call double {self.module.declared(name, len(values))}({given})", REAL)

    def _inner(self, function: Any, given: list[Value | Array]) -> Value | None:
        name, returned = self.module.inner(function, given)
        words = [word for one in given for word in one.words]
        call = f"call {returned} @{name}({', '.join(words)})"
        if returned == "void":
            self._say(call)
            return None
        return self._new(call, returned)

    def _lane(self, array: Array, place: Value) -> str:
        return self._new(f"getelementptr inbounds double, ptr {array.address}, i64 {place.text}", "ptr").text

    def _scaled(self, number: Value, vector: Value) -> Value:
        """A vector times a number."""
        one = self._new(f"insertelement {FOUR} poison, double {self._as(number, REAL)}, i32 0", FOUR).text
        many = self._new(f"shufflevector {FOUR} {one}, {FOUR} poison, <{lanes.FOUR} x i32> zeroinitializer", FOUR).text
        return self._new(f"fmul contract {FOUR} {many}, {vector.text}", FOUR)
