"""The statements of the paper that need no rig: the figures that decide each, and the function that measures it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nonsmooth.studies.savi2007 import claims_diagrams as diagrams
from nonsmooth.studies.savi2007 import claims_model as model
from nonsmooth.studies.savi2007 import claims_response as response
from nonsmooth.studies.savi2007.rows import Data, Row

__all__ = ["CLAIMS", "Claim", "Row", "measure_claims"]


@dataclass(frozen=True)
class Claim:
    """A statement: its id, the figures whose data it needs, and what turns them into rows of the report."""

    id: str
    figures: tuple[str, ...]
    measure: Callable[[Data], list[Row]]


CLAIMS = (
    Claim("M1", ("fig12",), model.m1),
    Claim("M2", ("fig12",), model.m2),
    Claim("M3", ("fig12",), model.m3),
    Claim("M4", ("eta",), model.m4),
    Claim("F9a", ("fig09",), response.f9a),
    Claim("F9b", ("fig09",), response.f9b),
    Claim("F9c", ("fig09",), response.f9c),
    Claim("F10", ("fig10",), response.f10),
    Claim("F10", ("fig09", "fig10"), response.grazing_behind_both),
    Claim("F11", ("fig11",), diagrams.f11),
    Claim("F12", ("fig12",), diagrams.f12),
    Claim("F13", ("fig13",), diagrams.f13),
    Claim("F14", ("fig14",), diagrams.f14),
    Claim("F15", ("fig15",), diagrams.f15),
    Claim("F17", ("fig17",), diagrams.f17),
    Claim("F17", ("fig17",), diagrams.f17_grazing),
    Claim("F18", ("fig18",), diagrams.f18),
    Claim("C1", ("fig09", "fig10", "fig11", "fig15"), model.c1),
    Claim("C1", ("eta",), model.c1_other_systems),
)


def measure_claims(data: Data) -> tuple[Row, ...]:
    """The rows of all claims whose figures are there, in the order of the paper."""
    return tuple(row for claim in CLAIMS if all(name in data for name in claim.figures) for row in claim.measure(data))
