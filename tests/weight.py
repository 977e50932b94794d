#!/usr/bin/env python3
"""Weight of the source by room: files, classes, functions, lines, and tokens of code (no docstring, comment or layout).

Tokens cannot be saved by longer lines or shorter words; what a reader must take in is counted, whatever its form:
scripts of pages too, and text of generated code. Usage: python tests/weight.py [checkout] [another to compare with], or
python tests/weight.py --check: each room against its budget in tests/budgets.toml. A budget falls with the room, and
rises only with a paragraph in docs/decisions.md that says what users got for it.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
import tomllib
from collections import Counter, defaultdict
from pathlib import Path

LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
DEFINITIONS = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


SLACK = 60  # tokens by which a room may be over: a mend needs no new budget


def weigh(text: str, generates: bool) -> Counter[str]:
    """Return the counts of one file of Python; of one that ``generates`` code its texts count by their words."""
    nodes = [*ast.walk(ast.parse(text))]
    quoted: set[int] = set()  # lines of docstrings
    hidden = 0  # tokens of code that stands in texts
    for node in nodes:
        if isinstance(node, DEFINITIONS) and node.body and isinstance(node.body[0], ast.Expr):
            value = node.body[0].value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                quoted.update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    for node in nodes if generates else ():
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.lineno not in quoted:
            hidden += words_of(node.value)
    tokens = [
        one
        for one in tokenize.generate_tokens(io.StringIO(text).readline)
        if one.type not in LAYOUT and one.start[0] not in quoted
    ]
    return Counter(
        files=1,
        lines=text.count("\n"),
        tokens=len(tokens) + hidden,
        functions=sum(isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) for node in nodes),
        classes=sum(isinstance(node, ast.ClassDef) for node in nodes),
        doc=len(quoted),
    )


def words_of(text: str) -> int:
    """Return the number of names, numbers and signs in a text."""
    return len(re.findall(r"\w+|[^\w\s]", text))


def rooms(root: Path) -> dict[str, Counter[str]]:
    """Return the counts of each room of the packages under ``src`` folders."""
    found: dict[str, Counter[str]] = defaultdict(Counter)
    for source in sorted(root.glob("**/src/*/")):
        if any(part.startswith(".") or part in ("build", "node_modules") for part in source.relative_to(root).parts):
            continue
        for path in sorted(source.rglob("*.py")):
            parts = path.relative_to(source).parts
            name = parts[0] if len(parts) > 1 else "(top)"
            found[f"{source.name}/{name}"].update(weigh(path.read_text(encoding="utf-8"), "codegen" in parts))
        for path in sorted(source.rglob("*.js")):
            text = re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
            room = path.relative_to(source).parts[0]
            found[f"{source.name}/{room}"].update(files=1, lines=text.count("\n"), tokens=words_of(text))
    return found


def over_budget(root: Path) -> list[str]:
    """Return a sentence for each room that is heavier than its budget, or has none."""
    budgets = tomllib.loads((root / "tests" / "budgets.toml").read_text(encoding="utf-8"))["tokens"]
    found = []
    for name, counts in sorted(rooms(root).items()):
        room = name.removeprefix("nonsmooth/")
        if room not in budgets:
            found.append(f"{room}: {counts['tokens']} tokens, and no budget in tests/budgets.toml")
        elif counts["tokens"] > budgets[room] + SLACK:
            found.append(
                f"{room}: {counts['tokens']} tokens, its budget is {budgets[room]}: take something out, or raise it "
                "with a paragraph in docs/decisions.md that says what users got"
            )
    return found


def main() -> int:
    if sys.argv[1:] == ["--check"]:
        found = over_budget(Path())
        print("\n".join(found) or "weight: every room is within its budget")
        return 1 if found else 0
    first, *second = [rooms(Path(argument)) for argument in sys.argv[1:] or ["."]]
    keys = ("files", "classes", "functions", "lines", "doc", "tokens")
    print(f"{'room':34s}" + "".join(f"{key:>10s}" for key in keys) + ("    tokens there" if second else ""))
    total: Counter[str] = Counter()
    other: Counter[str] = Counter()
    for name, one in sorted(first.items(), key=lambda item: -item[1]["tokens"]):
        total.update(one)
        beside = second[0].get(name, Counter()) if second else Counter()
        other.update(beside)
        there = f"{beside['tokens']:16d}" if second else ""
        print(f"{name:34s}" + "".join(f"{one[key]:10d}" for key in keys) + there)
    print(f"{'all':34s}" + "".join(f"{total[key]:10d}" for key in keys) + (f"{other['tokens']:16d}" if second else ""))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
