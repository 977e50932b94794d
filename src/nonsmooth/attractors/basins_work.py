"""Starts at one parameter point, or at many, as chunks of work."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from nonsmooth.attractors.settled import Settled
from nonsmooth.attractors.settler import Settler
from nonsmooth.campaign.work import CHUNK, ColumnType
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.kernels.hybrid import codes


@dataclass(frozen=True)
class StartsWork:
    """Starts (S, n), the same at each of the parameter points (P, n_parameters); places are (point, start)."""

    settler: Settler
    points: FloatArray
    starts: FloatArray
    chunk: int = CHUNK
    described: Mapping[str, Any] = field(default_factory=dict)

    @property
    def device(self) -> str:
        return self.settler.device

    def columns(self) -> dict[str, ColumnType]:
        n = self.starts.shape[1]
        kinds = {"period_number": "i8", "status": "i8", "mode": "i8"}
        wide = {"maximum": (n,), "minimum": (n,), "last": (self.settler.width,), "mode": np.shape(self.settler.told(0))}
        unknown = {"status": codes.INTERRUPTED}
        return {
            item.name: ColumnType(kinds.get(item.name, "f8"), wide.get(item.name, ()), unknown.get(item.name, 0))
            for item in fields(Settled)
        }

    def n_chunks(self) -> int:
        return -(-len(self.points) * len(self.starts) // self.chunk)

    def bounds(self, chunk: int) -> tuple[int, int]:
        return chunk * self.chunk, min((chunk + 1) * self.chunk, len(self.points) * len(self.starts))

    def describe(self) -> dict[str, Any]:
        return dict(self.described)

    def load(self) -> None:
        self.settler.load()

    def compute(self, chunk: int) -> dict[str, Any]:
        place = np.arange(*self.bounds(chunk))
        rows, which = np.divmod(place, len(self.starts))
        first = int(rows[0])
        found = self.settler.run(
            self.points[first : int(rows[-1]) + 1], rows - first, self.starts[which], begin=self.settler.section_phase
        )
        found.mode = self.settler.told(found.mode)
        return {item.name: getattr(found, item.name) for item in fields(Settled)}

    def settled(self, columns: Mapping[str, Any]) -> Settled:
        """The columns as runs."""
        return Settled(**{**columns, "mode": self.settler.retold(columns["mode"])})
