"""A sample of generated mutants, spread over the rooms: ``python tests/mutants_sample.py [NUMBER] [--rooms ...]``.

A mutant is one operator, condition or constant changed, or one statement dropped. Messages, annotations and assertions
are left out, and what no answer depends on (``LOOKS``, ``NO_ANSWER``). Each room has a share by its lines. The seed is
the hash of the commit, so that a sample is fresh after each change and the same for who repeats it. The tests that run
a mutant's function are those that ``python -m pytest -p tests.costs --called out/called.json -n 0`` has seen, the
quickest first; without that file the tests of the room. No profile sees kernels: their tests are listed here. A mutant
is caught where a test fails, and hangs where one takes longer than ``--patience`` (unless given, the limit at which the
suite ends a test). Survivors are printed with their lines; the score by room is the table of the documentation.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "nonsmooth"  # the study has its mutants in mutants.toml
SWAPS: dict[type, type] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
DROPPED = (ast.Assign, ast.AugAssign, ast.Expr, ast.Continue, ast.Break)
SILENT = (ast.Raise, ast.JoinedStr, ast.Assert, ast.AnnAssign, ast.arguments, ast.Import, ast.ImportFrom)
LOOKS = {  # of a mark: how thick, large, pale, far from its neighbour; and which line a warning names
    *("alpha", "elinewidth", "fontsize", "labelpad", "linewidth", "linewidths", "lw", "markersize", "markeredgewidth"),
    *("columnspacing", "fill_alpha", "handlelength", "handletextpad", "line_alpha", "line_width", "ms"),
    *("hspace", "markerscale", "mutation_scale", "pad", "rasterized", "stacklevel", "width_ratios", "wspace", "zorder"),
}
NO_ANSWER = {"default_rng", "bar", "progress_bar"}  # a seed that stands there is one of many; bars of progress
FOR_CUDA = ["tests/diagrams/test_gpu.py", "tests/diagrams/test_gpu_series.py"]
FOR_KERNELS = ["tests/kernels", "tests/flow"]
FOR_KERNELS += [f"tests/diagrams/test_{one}.py" for one in ("sweep", "lyapunov", "chart_known_answers")]


@dataclass
class Mutant:
    path: Path
    line: int
    words: str
    text: str  # of the whole file
    function: str  # its name with those around it, as a code object has it; nothing outside functions


Place = tuple[ast.AST, str, ast.AST, ast.stmt | None, str]


def places(node: ast.AST, around: ast.stmt | None = None, function: str = "", inside: str = "") -> Iterator[Place]:
    """(node, field, what stands there instead, statement around it, name of the function) of each change."""
    if isinstance(node, ast.FunctionDef):
        function = inside + node.name
        inside = f"{function}.<locals>."
    elif isinstance(node, ast.ClassDef):
        inside += f"{node.name}."
    around = node if isinstance(node, ast.stmt) else around
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for i, child in enumerate(value) if isinstance(value, list) else [(-1, value)]:
            if not isinstance(child, ast.AST) or isinstance(child, SILENT) or _is_text(child):
                continue
            # strict= asserts lengths, total= is for the checker of types, progress= shows a bar.
            if isinstance(child, ast.keyword) and child.arg in LOOKS | {"strict", "total", "progress"}:
                continue
            if isinstance(child, ast.Call) and ast.unparse(child.func).rpartition(".")[2] in NO_ANSWER:
                continue
            where = name if i < 0 else f"{name}.{i}"
            if type(child) in SWAPS:
                yield node, where, SWAPS[type(child)](), around, function
            elif isinstance(child, ast.Constant) and type(child.value) in (int, float, bool):
                yield node, where, ast.Constant(_other(child.value)), around, function
            elif name == "test" and ast.unparse(child) != "TYPE_CHECKING":  # imports too early are no other program
                yield node, where, ast.UnaryOp(ast.Not(), child), around, function
            elif function and isinstance(child, DROPPED):
                yield node, where, ast.Pass(), around, function
            yield from places(child, around, function, inside)


def _other(value: float) -> float:
    """Another constant: one more, or twice a large one, because a limit of 1001 is that of 1000."""
    return not value if isinstance(value, bool) else 2 * value if abs(value) >= 10 else value + 1


def _is_text(node: ast.AST) -> bool:
    value = node.value if isinstance(node, ast.Expr) else node
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def mutants(path: Path) -> Iterator[Mutant]:
    """Every mutant of a file; lines that are not touched stay where they are."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    lines = text.splitlines(keepends=True)
    for node, where, new, around, function in places(tree):
        name, _, i = where.partition(".")
        old = getattr(node, name)[int(i)] if i else getattr(node, name)
        owner = old if isinstance(old, ast.stmt) else around
        if owner is None or isinstance(owner, SILENT):
            continue
        _put(node, name, i, new)
        changed = ast.unparse(new if owner is old else owner)
        if lines[owner.lineno - 1].lstrip().startswith("elif "):
            changed = "el" + changed  # unparsed, the rest of a chain begins one of its own
        _put(node, name, i, old)
        begin, end = owner.lineno, owner.end_lineno or owner.lineno
        margin = lines[begin - 1][: owner.col_offset]
        if margin.strip():
            continue  # behind a semicolon or a colon
        fresh = "".join(f"{margin}{line}\n" for line in changed.splitlines())
        words = "dropped" if owner is old else f"{type(old).__name__} -> {type(new).__name__} in"
        shown = " ".join(ast.unparse(old if owner is old else owner).split("\n")[0].split())
        whole = "".join([*lines[: begin - 1], fresh, *lines[end:]])
        yield Mutant(path, begin, f"{words}: {shown[:90]}", whole, function)


def _put(node: ast.AST, name: str, i: str, value: object) -> None:
    if i:
        getattr(node, name)[int(i)] = value
    else:
        setattr(node, name, value)


def room_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).parts
    return "top" if len(parts) == 1 else parts[0]


def sample(number: int, rooms: list[str], seed: str) -> list[Mutant]:
    """Those in these rooms of a sample of mutants, of which each room has its share by its lines, at least one."""
    files: dict[str, list[Path]] = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        files[room_of(path)].append(path)
    sizes = {room: sum(path.read_text("utf-8").count("\n") for path in paths) for room, paths in files.items()}
    rng, found = random.Random(seed), []
    for room, paths in files.items():
        for _ in range(max(1, round(number * sizes[room] / sum(sizes.values())))):
            lengths = [path.read_text("utf-8").count("\n") for path in paths]
            while not (every := list(mutants(rng.choices(paths, lengths)[0]))):
                pass
            found.append(rng.choice(every))
    return [one for one in found if not rooms or room_of(one.path) in rooms]


def tests_of(one: Mutant, called: dict, longest: float) -> list[str]:
    """The tests to run, the quickest first; as many as take no longer than ``longest`` seconds together."""
    file, room = str(one.path.relative_to(PACKAGE)), room_of(one.path)
    known = called.get("called", {})
    if one.function:
        seen = set(known.get(f"{file}:{one.function}", []))
    else:
        seen = {test for place, tests in known.items() if place.startswith(f"{file}:") for test in tests}
    if not seen:
        if room == "kernels":
            return FOR_CUDA if "cuda" in one.path.parts else FOR_KERNELS
        return [f"tests/{room}"] if (ROOT / "tests" / room).is_dir() else []
    chosen, left = [], longest
    for test in sorted(seen, key=lambda name: called["took"][name]):
        left -= called["took"][test]
        chosen.append(test)
        if left < 0:
            break
    return chosen


def outcome(one: Mutant, tests: list[str], sources: Path, patience: float) -> str:
    """Return "caught" where a test fails with the mutant, "hangs" where one takes longer, else "SURVIVES"."""
    place = sources / "nonsmooth" / one.path.relative_to(PACKAGE)
    original = place.read_text(encoding="utf-8")
    place.write_text(one.text, encoding="utf-8")
    done = pytest_of(tests, sources, "-x", "-o", f"faulthandler_timeout={patience}")
    place.write_text(original, encoding="utf-8")
    if done.returncode == 0:
        return "SURVIVES"
    return "hangs" if "Timeout (" in done.stderr else "caught"


def pytest_of(tests: list[str], sources: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run pytest on these tests with the package of a copy."""
    paths = os.pathsep.join(filter(None, [str(sources), os.environ.get("PYTHONPATH")]))
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as names:
        names.write("\n".join(tests))
        names.flush()
        return subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *words, f"@{names.name}"],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("number", type=int, nargs="?", default=300)
    parser.add_argument("--rooms", nargs="*", default=[], help="of the sample, those in these rooms")
    parser.add_argument("--seed", default="", help="instead of the hash of the commit")
    parser.add_argument("--called", default="out/called.json")
    parser.add_argument("--longest", type=float, default=120.0, help="seconds of tests for one mutant")
    parser.add_argument("--patience", type=float, default=1800.0, help="seconds of one test, behind which it hangs")
    options = parser.parse_args()
    head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    seed = options.seed or head
    file = ROOT / options.called
    called = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    score: dict[str, list[str]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        sources = Path(folder) / "src"
        shutil.copytree(ROOT / "src", sources, ignore=shutil.ignore_patterns("__pycache__"))
        drawn = [(one, tests_of(one, called, options.longest)) for one in sample(options.number, options.rooms, seed)]
        found = pytest_of(sorted({test for _, tests in drawn for test in tests}), sources, "--collect-only")
        if found.returncode != 0:  # a test that is no longer there would fail with every mutant
            raise SystemExit(f"{options.called} is of other tests:\n{found.stdout[-2000:]}{found.stderr[-2000:]}")
        for one, tests in drawn:
            begun = time.monotonic()
            end = outcome(one, tests, sources, options.patience) if tests else "SURVIVES"
            score[room_of(one.path)].append(end)
            place = f"{one.path.relative_to(PACKAGE)}:{one.line}"
            print(f"{end:8}  {place}  {one.words}  ({len(tests)} tests, {time.monotonic() - begun:.0f} s)", flush=True)
    print(f"\nseed {seed}\n\n| room | mutants | caught | hang |\n|---|---|---|---|")
    score["all"] = [end for ends in score.values() for end in ends]
    for room, ends in sorted(score.items(), key=lambda row: (row[0] == "all", row[0])):
        print(f"| `{room}` | {len(ends)} | {ends.count('caught')} | {ends.count('hangs')} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
