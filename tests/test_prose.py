"""The check of the prose sees what it is to see."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

spec = importlib.util.spec_from_file_location("prose", Path(__file__).with_name("prose.py"))
assert spec is not None and spec.loader is not None
prose = importlib.util.module_from_spec(spec)
spec.loader.exec_module(prose)


@pytest.mark.parametrize("first", ["What", "Where", "How", "Which", "Whether"])
def test_a_docstring_that_begins_with_a_question_word_is_named(first: str) -> None:
    assert prose.beginning(f"{first} becomes of it.") and not prose.beginning("Whatever comes.")


def test_words_of_the_list_are_named_with_their_term_and_code_is_left_alone() -> None:
    assert [text.split(":")[-1] for text in prose.terms("The leg is nudged.")] == [" segment", " perturb, perturbation"]
    assert not list(prose.terms("``leg`` and `leaps`, $leg$, :func:`leg`, legal, elegant"))
    assert not list(prose.terms("text\n```python\nleg = 3\n```\nand more"))
    assert not list(prose.terms("one leg", ("leg",)))


def test_strings_of_a_source_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prose, "ROOT", tmp_path)
    path = tmp_path / "a.py"
    path.write_text('def f():\n    """How it goes."""\n    return f"refused at the door: {f}"\nleg = "leg"\n')
    found = list(prose.of_source(path))
    assert len(found) == 2 and "a.py:1: the docstring begins with 'How'" in found[0] and "before any" in found[1]


def test_a_class_name_that_is_defined_twice_is_named_with_both_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def told() -> list[str]:
        known: dict[str, str] = {}
        return [one for path in (first, second) for one in prose.of_source(path, False, known)]

    monkeypatch.setattr(prose, "ROOT", tmp_path)
    first, second = tmp_path / "a.py", tmp_path / "b.py"
    first.write_text("class Row:\n    class _Cell: ...\n")
    second.write_text("class Rows: ...\n\n\ndef f():\n    class _Cell: ...\n")
    (one,) = told()
    assert one.startswith("b.py:5: ") and "_Cell is defined at a.py:2 too" in one
    second.write_text('Rows: TypeAlias = "list[Row]"\nRow: TypeAlias = "dict[str, int]"\n')
    assert [one.split(":")[:2] for one in told()] == [["b.py", "2"]]


def test_both_sides_of_a_merge_are_named() -> None:
    assert prose.unmerged("a\n<<<<<<< HEAD\nb\n") and not prose.unmerged("a\n=======\nb << c")
