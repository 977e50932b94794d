"""Masses on a line and what joins them, as a sketch draws them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

GROUND = -1


@dataclass(frozen=True)
class Link:
    """A spring, a contact, ... between two masses, or the ground and a mass: ``left`` and ``right`` by their numbers.

    ``gap`` is the room of a contact at rest (``gap_at`` that of a stop that moves, by the time), ``words`` its label;
    ``half`` the half width of a play; ``damped`` an elastic contact with a damper; ``pulls`` a contact that closes when
    its masses part."""

    kind: str
    left: int
    right: int
    label: str = ""
    gap: float = 0.0
    words: str = ""
    half: float = 0.0
    damped: bool = False
    pulls: bool = False
    gap_at: Callable[[float], float] | None = None


@dataclass
class Scheme:
    """Masses in order along the line, by their coordinates and speeds, with their labels; links; loads by mass."""

    pairs: list[tuple[str, str]]
    masses: list[str]
    links: list[Link] = field(default_factory=list)
    forces: dict[int, str] = field(default_factory=dict)
    base: str = ""
    others: list[str] = field(default_factory=list)
