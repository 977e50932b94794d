"""Marks of finished chunks, each with a hash of its own, and the log of those begun."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from nonsmooth.results.content import sealed


def marks_of(path: Path) -> Iterator[dict[str, Any]]:
    """The marks of a store's finished chunks."""
    for file in sorted((path / "run").glob("*.json")):
        mark = mark_in(file)
        if mark is not None:
            yield mark


def started(log: Path) -> list[int]:
    """The chunks that were begun, in their order; a line that was cut short or altered is passed over."""
    found = []
    for line in log.read_text(encoding="utf-8", errors="replace").splitlines():
        with suppress(ValueError, KeyError, TypeError):
            found.append(int(json.loads(line)["chunk"]))
    return found


def mark_in(file: Path) -> dict[str, Any] | None:
    """A mark; None where there is none, or it was cut short or altered."""
    try:
        mark = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return mark if sealed(mark) else None
