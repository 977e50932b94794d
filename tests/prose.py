"""Check of the project's prose, run by ``make check``: how docstrings begin, and which words they and the pages use.

A docstring begins with what it returns or does, not with a question word. The words below were this project's own for
things that the field has a term for; the term stands beside each. Code (between backticks) is left alone. The name of a
class means one thing: the sources, those of the studies included, define it once.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
QUESTIONS = ("What", "Where", "How", "Which", "Whether")
#: Pattern of a word to replace, and the term for it.
TERMS = {
    r"legs?": "segment",
    r"stretch(es)?": "segment; a part of a record is an interval",
    r"leaps?|leapt": "transition",
    r"settlers?": "attractor mapper",
    r"(comes?|came|coming) to rest": "reaches a steady state; of a body: stops",
    r"what parts|parts (the|these|two)|goes where": "separates; the basin boundary",
    r"nudg\w+|kicks?|kicked": "perturb, perturbation",
    r"can(not)? be had": "does not exist; was not found",
    r"looked for": "searched",
    r"landed|lands": "locate, converge",
    r"born": "appears, emanates",
    r"(is|are|was|were) worth": "accuracy, uncertainty",
    r"at the door": "before any computation",
    r"without a word": "silently; say what is counted or refused",
    r"tally|memo": "counters, accumulators",
    r"(?<!-)nets?": "transition table",
    r"guards?": "condition of a transition, indicator",
}
#: Places in which such a word is the right one, by file name: public keywords, ordinary English, other fields' terms.
ALLOWED: dict[str, tuple[str, ...]] = {
    "pages.py": ("tally",),  # a class of the report's style sheet
    "style.py": ("tally",),
    "maps.md": ("kicked",),  # the kicked rotor
    "what_each_procedure_needs.md": ("come to rest",),  # of a car
}


#: Logs, left as they were written, and the page for those who work on the code, which names what stands in it.
LOGS = ("decisions.md", "CHANGELOG.md", "CONTRIBUTING.md")


def words(text: str) -> str:
    """The text without code, formulas and links."""
    text = re.sub(r"^(```|~~~).*?^\1", " ", text, flags=re.S | re.M)
    text = re.sub(r":\w+:`[^`]*`|``.*?``|`[^`]*`|\$[^$]*\$|\]\([^)]*\)", " code ", text, flags=re.S)
    return re.sub(r"\s+", " ", text)


def beginning(docstring: str) -> str | None:
    """The complaint about how a docstring begins."""
    first = (docstring.split() or [""])[0].rstrip(",:.")
    return f"begins with {first!r}: name the result, or use an imperative" if first in QUESTIONS else None


def terms(text: str, allowed: tuple[str, ...] = ()) -> Iterator[str]:
    """The complaints about words."""
    plain = words(text)
    for pattern, term in TERMS.items():
        for found in re.finditer(rf"\b({pattern})\b", plain, re.IGNORECASE):
            if found[0].lower() not in allowed:
                around = plain[max(found.start() - 30, 0) : found.end() + 30]
                yield f"{found[0]!r} (... {around} ...): {term}"


def of_source(path: Path, words_too: bool = True, classes: dict[str, str] | None = None) -> Iterator[str]:
    """The complaints about a Python file: its docstrings, and (``words_too``) the sentences in its strings.

    ``classes``: the places of those, and of types with a name, that are defined so far, to which its own are added."""
    allowed, file = ALLOWED.get(path.name, ()), path.relative_to(ROOT)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        name = ""
        if isinstance(node, documented) and (text := ast.get_docstring(node)) and (complaint := beginning(text)):
            yield f"{file}:{getattr(node, 'lineno', 1)}: the docstring {complaint}"
        if isinstance(node, ast.Constant):
            if words_too and isinstance(node.value, str) and " " in node.value.strip():
                for complaint in terms(node.value, allowed):
                    yield f"{file}:{node.lineno}: {complaint}"
        elif isinstance(node, ast.ClassDef):
            name = node.name
        elif isinstance(node, ast.AnnAssign) and "TypeAlias" in ast.unparse(node.annotation):
            name = ast.unparse(node.target)
        if name and classes is not None:
            place = f"{file}:{node.lineno}"
            if (other := classes.setdefault(name, place)) != place:
                yield f"{place}: the class {name} is defined at {other} too: a class name means one thing"


def unmerged(text: str) -> bool:
    """True where both sides of a merge are left in a text."""
    return bool(re.search(r"^(<{7}|>{7}) ", text, re.MULTILINE))


def complaints() -> Iterator[str]:
    """All complaints, one a line."""
    classes: dict[str, str] = {}
    for sources in (ROOT / "src", ROOT / "studies"):
        for path in sorted(sources.rglob("*.py")):
            inside = "tests" not in path.relative_to(ROOT).parts
            yield from of_source(path, inside, classes if "src" in path.relative_to(ROOT).parts else None)
    for folder in ("benchmarks", "docs", "examples", "tests"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield from of_source(path, words_too=folder != "tests")  # the words are data there
    for path in [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]:
        text = path.read_text(encoding="utf-8")
        if unmerged(text):
            yield f"{path.relative_to(ROOT)}: both sides of a merge are left in it"
        if "_build" not in path.parts and path.name not in LOGS:
            for complaint in terms(text, ALLOWED.get(path.name, ())):
                yield f"{path.relative_to(ROOT)}: {complaint}"


if __name__ == "__main__":
    found = list(complaints())
    print("\n".join([*found, f"prose: {len(found)} complaints"]))
    sys.exit(bool(found))
