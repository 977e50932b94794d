"""Arrays by name with what a file says of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["Group"]


class Group(dict[str, Any]):
    """Arrays by name: their units and attributes, the rate at which they were sampled, the run they belong to."""

    def __init__(
        self, members: Mapping[str, Any] | None = None, units: Mapping[str, str] | None = None,
        rate: float | None = None,
    ) -> None:  # fmt: skip
        super().__init__(members or {})
        self.units, self.rate, self.run = dict(units or {}), rate, ""
        self.attrs: dict[str, dict[str, str]] = {}
        self.notes: dict[str, str] = {}
