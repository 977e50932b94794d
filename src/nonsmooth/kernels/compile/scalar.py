"""Text for LLVM of scalar functions in a small part of Python, from their syntax trees.

The part is what ``system.codegen`` writes: numbers, entries of arrays, ``if``, loops over ``range``, functions of
``math`` and of ``lanes``, and calls of functions written alike, those of ``circular`` among them. Products and sums may
be contracted, as in kernels.

Leans on the order in which Numba passes a function's arguments, an array's seven words among them; checked with 0.62
and 0.68.
"""

from __future__ import annotations

import ast
import re
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from llvmlite.binding import get_process_triple

from nonsmooth.kernels.compile.expressions import REAL, WHOLE, YES, Array, Module, ScalarCode, Value

_CODES = {"i8": WHOLE, "int64": WHOLE, "f8": REAL, "float64": REAL}


@lru_cache(maxsize=4)
def _functions_of(path: str, stamp: int) -> dict[str, ast.FunctionDef]:
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}


def _tree_of(function: Any) -> ast.FunctionDef:
    path = function.__code__.co_filename
    return _functions_of(path, Path(path).stat().st_mtime_ns)[function.__name__]


def kinds_of(signature: str) -> list[tuple[str, int]]:
    """Kind and number of dimensions (0: a number) of each argument of a signature."""
    given = re.findall(r"(\w+)(\[[^]]*\])?", signature.partition("(")[2])
    return [(_CODES[number], rest.count(",") + 1 if rest else 0) for number, rest in given]


class _Text(Module):
    """The text of a callback with all functions that it calls."""

    def inner(self, function: Any, given: list[Value | Array], inlined: bool = False) -> tuple[str, str]:
        """The name of a function with arguments of these kinds, and the kind that it returns."""
        plain = getattr(function, "py_func", function)
        if plain not in self.called:
            body = _Function(self, plain, given)
            name = plain.__name__
            head = ", ".join(f"{kind} %{word}" for kind, word in body.words)
            inlined = inlined or getattr(function, "targetoptions", {}).get("forceinline", False)
            always = " alwaysinline" if inlined else ""
            self.called[plain] = name, body.returned
            self.parts[plain] = (
                f"define linkonce_odr {body.returned} @{name}({head}){always} nounwind {{\n{body.text}}}"
            )
        return self.called[plain]


class _Function(ScalarCode):
    """The text of one function for arguments of some kinds."""

    def __init__(self, module: _Text, function: Any, given: list[Value | Array]) -> None:
        self.module, self.function, self.tree = module, function, _tree_of(function)
        super().__init__()
        self.known, self.words, self.returned = {}, list[tuple[str, str]](), "void"
        self.ends: list[str] = []  # of the loops around
        for argument, one in zip(self.tree.args.args, given, strict=True):
            name = argument.arg
            if isinstance(one, Array):
                shape = tuple(f"%{name}.{i}" for i in range(len(one.shape)))
                self.known[name] = Array(f"%{name}", one.kind, shape)
                self.words += [("ptr", name), *((WHOLE, word[1:]) for word in shape)]
            else:
                self.words.append((one.kind, name))
                self._store(name, Value(f"%{name}", one.kind))
        self._block(self.tree.body)
        self._say("ret void" if self.returned == "void" else "unreachable")
        self.text = "".join(f"  {line}\n" for line in [*self.places, *self.lines])

    def _block(self, nodes: list[ast.stmt]) -> None:
        for node in nodes:
            self._statement(node)

    def _statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self._keep(name, value)
            case ast.AugAssign(target=target, op=op, value=value):
                self._statement(ast.Assign([target], ast.BinOp(target, op, value)))
            case ast.Assign(targets=[ast.Subscript() as entry], value=value):
                array, place = self._entry(entry)
                self._say(f"store {array.kind} {self._as(self._value(value), array.kind)}, ptr {place}")
            case ast.If(test=test, body=body, orelse=other):
                self._choose(test, *(partial(self._block, part) for part in (body, other)))
            case ast.For(target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=given), body=body):
                self._loop(name, given, body)
            case ast.Break():
                self._say(f"br label %{self.ends[-1]}")
                self.lines.append(f"{self._named('behind')[0]}:")
            case ast.Return(value=ast.expr() as value):
                self.returned = REAL
                self._say(f"ret double {self._as(self._value(value), REAL)}")
                self.lines.append(f"{self._named('behind')[0]}:")
            case ast.Expr(value=ast.Call() as call):
                self._call(call)
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                pass
            case _:
                self._refuse(node)

    def _loop(self, name: str, given: list[ast.expr], body: list[ast.stmt]) -> None:
        zero, one = Value("0", WHOLE), Value("1", WHOLE)
        numbers = [*[zero][: len(given) == 1], *map(self._value, given), one][:3]
        if any(one.kind != WHOLE for one in numbers) or not numbers[2].text.isdigit():
            self._refuse(given[0])
        test, inside, onward, end = self._named("test", "inside", "onward", "end")
        counter = f"%{onward}.place"
        self.places.append(f"{counter} = alloca i64")
        self._say(f"store i64 {numbers[0].text}, ptr {counter}")
        self._label(test)
        now = self._new(f"load i64, ptr {counter}", WHOLE)
        more = self._new(f"icmp slt i64 {now.text}, {numbers[1].text}", YES)
        self._say(f"br i1 {more.text}, label %{inside}, label %{end}")
        self.lines.append(f"{inside}:")
        self._store(name, now)
        self.ends.append(end)
        self._block(body)
        self.ends.pop()
        after = self._new(f"add nsw i64 {now.text}, {numbers[2].text}", WHOLE)
        self._say(f"store i64 {after.text}, ptr {counter}")
        self._say(f"br label %{test}")
        self.lines.append(f"{end}:")


def text_of(function: Any, signature: str) -> str:
    """The text of a callback, called as Numba calls a function of this signature: the places of the result and of an
    exception first, and of each array its owner, parent, size, size of a number, address, shape and strides."""
    module, head, given = _Text(), ["ptr %result", "ptr %exception"], list[Value | Array]()
    for i, (kind, dims) in enumerate(kinds_of(signature)):
        if dims:
            shape = [f"i64 %a{i}.{k}" for k in range(dims)]
            strides = [f"i64 %a{i}.{k}.stride" for k in range(dims)]
            owners = [f"ptr %a{i}.owner", f"ptr %a{i}.parent", f"i64 %a{i}.size", f"i64 %a{i}.item"]
            head += [*owners, f"ptr %a{i}", *shape, *strides]
            given.append(Array(f"%a{i}", kind, tuple(one[4:] for one in shape)))
        else:
            head.append(f"{kind} %a{i}")
            given.append(Value(f"%a{i}", kind))
    name, returned = module.inner(function, given, inlined=True)
    words = [word for one in given for word in one.words]
    call = f"call {returned} @{name}({', '.join(words)})"
    lines = [call] if returned == "void" else [f"%found = {call}", f"store {returned} %found, ptr %result"]
    body = "".join(f"  {line}\n" for line in [*lines, "ret i32 0"])
    entry = f"define i32 @{name}_entry({', '.join(head)}) nounwind {{\n{body}}}"
    return "\n".join([f'target triple = "{get_process_triple()}"', *module.parts.values(), entry]) + "\n"
