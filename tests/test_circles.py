"""Circles of imports, type imports and imports inside functions counted: run this file as a script to list them all."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

SOURCE = Path(__file__).parent.parent / "src"

#: Rooms whose modules form no circle.
WITHOUT = ("nonsmooth.continuation",)


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """A node and all statements in it; nothing is imported in an expression."""
    yield node
    for part in ("body", "orelse", "handlers", "finalbody", "cases"):
        inner = getattr(node, part, None)
        for one in inner if isinstance(inner, list) else ():
            yield from statements(one)


@cache
def imports(source: Path) -> dict[str, set[str]]:
    """The modules of a package that each of its modules imports, wherever the import stands."""
    files = {".".join(path.relative_to(source).with_suffix("").parts): path for path in source.rglob("*.py")}
    files = {name.removesuffix(".__init__"): path for name, path in files.items()}
    graph: dict[str, set[str]] = {}
    for name, path in files.items():
        graph[name] = set()
        for node in statements(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                graph[name].update(one.name for one in node.names)
            elif isinstance(node, ast.ImportFrom):
                assert not node.level, f"{path}: imports are absolute here"
                for one in node.names:
                    inner = f"{node.module}.{one.name}"
                    graph[name].add(inner if inner in files else str(node.module))
        graph[name] &= files.keys() - {name}
    return graph


def circle(graph: dict[str, set[str]], room: str = "") -> list[str]:
    """One circle within a room; empty where there is none."""
    within = {
        name: {to for to in found if to.startswith(room)} for name, found in graph.items() if name.startswith(room)
    }
    try:
        TopologicalSorter(within).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_rooms_without_circles() -> None:
    graph = imports(SOURCE)
    for room in WITHOUT:
        assert sum(name.startswith(room) for name in graph) > 5, room
        assert circle(graph, room) == []


def test_rooms_import_downward_type_imports_too() -> None:
    """The layers of import-linter, which leaves type imports out: one of them makes a circle as well."""
    text = (SOURCE.parent / "pyproject.toml").read_text(encoding="utf-8")
    layers = tomllib.loads(text)["tool"]["importlinter"]["contracts"][0]["layers"]
    rank = {room.strip(): i for i, row in enumerate(layers) for room in row.split("|")}
    graph = imports(SOURCE)
    rooms = {name: name.split(".")[1] for name in graph if "." in name}
    pairs = [(name, other) for name in rooms for other in graph[name] & rooms.keys() if rooms[name] != rooms[other]]
    assert len(pairs) > 500
    assert [pair for pair in pairs if rank[rooms[pair[0]]] >= rank[rooms[pair[1]]]] == []


def test_a_circle_is_found(tmp_path: Path) -> None:
    """a imports b for types only, b imports a inside a function; c imports both."""
    (tmp_path / "p").mkdir()
    for name, text in {
        "__init__": "",
        "a": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from p.b import B\n",
        "b": "def f():\n    from p import a\n",
        "c": "import p.a\nimport p.b\n",
    }.items():
        (tmp_path / "p" / f"{name}.py").write_text(text, encoding="utf-8")
    assert set(circle(imports(tmp_path))) == {"p.a", "p.b"}


if __name__ == "__main__":
    whole = imports(SOURCE)
    while found := circle(whole):
        print(" -> ".join(found))
        whole[found[1]].discard(found[0])
        whole[found[0]].discard(found[1])
