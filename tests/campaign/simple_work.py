"""A work whose results are known: the square of each place, chunk by chunk."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nonsmooth.campaign.work import ColumnType


@dataclass(frozen=True)
class Squares:
    size: int = 100
    step: int = 7
    name: str = "squares"
    seconds: float = 0.0
    fails_at: int = -1
    device: str = "cpu"

    def columns(self) -> dict[str, ColumnType]:
        return {"square": ColumnType("f8"), "pair": ColumnType("i4", (2,))}

    def n_chunks(self) -> int:
        return -(-self.size // self.step)

    def bounds(self, chunk: int) -> tuple[int, int]:
        return chunk * self.step, min((chunk + 1) * self.step, self.size)

    def load(self) -> None:
        pass

    def compute(self, chunk: int) -> dict[str, Any]:
        if chunk == self.fails_at:
            raise RuntimeError(f"chunk {chunk}")
        time.sleep(self.seconds)
        place = np.arange(*self.bounds(chunk))
        return {"square": place.astype(float) ** 2, "pair": np.column_stack([place, -place]).astype("i4")}

    def describe(self) -> Mapping[str, Any]:
        return {"verb": "squares", "system": self.name, "options": {"size": self.size}}


@dataclass(frozen=True)
class Zeros(Squares):
    """Every other chunk holds nothing but zeros."""

    def compute(self, chunk: int) -> dict[str, Any]:
        return {name: values * (chunk % 2) for name, values in super().compute(chunk).items()}


def right(columns: Mapping[str, Any], work: Squares) -> bool:
    place = np.arange(work.size)
    return bool((columns["square"] == place**2.0).all() and (columns["pair"] == np.column_stack([place, -place])).all())


def hashes(path: Path) -> dict[str, str]:
    """Hash of every file of a store's results."""
    return {
        str(file.relative_to(path)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted((path / "results").rglob("*"))
        if file.is_file()
    }
