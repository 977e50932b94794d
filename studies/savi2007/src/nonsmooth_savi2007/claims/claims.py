"""The statements of the paper: the figures that decide each, and the functions that measure it on model and rig."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from nonsmooth_savi2007.claims import diagrams, model, parameters, portraits, response
from nonsmooth_savi2007.claims.verdicts import Data, Statement


class Claim(NamedTuple):
    """A statement: its id, the figures whose data it needs, and what turns them into rows of the report."""

    id: str
    figures: tuple[str, ...]
    rows: Callable[[Data], Iterator[Statement]]


CLAIMS = (
    Claim("M1", ("fig12",), model.m1),
    Claim("M2", ("fig12",), partial(model.in_regions, flow="exact")),
    Claim("M3", ("fig12",), partial(model.in_regions, flow="smoothed")),
    Claim("M4", ("eta",), model.m4),
    Claim("R1", ("table1",), parameters.r1),
    Claim("R2", ("table1",), parameters.r2),
    Claim("P1", ("fig04",), parameters.p1),
    Claim("P2", ("table1", "fig04"), parameters.p2),
    Claim("P3", ("fig05",), parameters.p3),
    Claim("P4", ("fig06",), parameters.p4),
    Claim("P5", ("fig07",), parameters.p5),
    Claim("P6", ("fig08",), parameters.p6),
    Claim("P7", ("fig08",), parameters.p7),
    Claim("P8", ("table1",), parameters.p8),
    Claim("F9a", ("fig09", "fig09_rig"), response.f9a),
    Claim("F9b", ("fig09", "fig09_rig"), response.f9b),
    Claim("F9c", ("fig09", "fig09_rig"), response.f9c),
    Claim("F10", ("fig10", "fig10_rig"), response.f10),
    Claim("F10", ("fig09", "fig09_rig", "fig10"), response.grazing_behind_both),
    Claim("F11", ("fig11", "fig11_rig"), diagrams.f11),
    Claim("F12", ("fig12", "fig12_rig"), portraits.f12),
    Claim("F13", ("fig13", "fig13_rig"), diagrams.f13),
    Claim("F13", ("basins13",), partial(diagrams.attractors, name="basins13")),
    Claim("F14", ("fig14", "fig14_rig"), portraits.f14),
    Claim("F15", ("fig15",), diagrams.f15),
    Claim("F16", ("fig16",), diagrams.f16),
    Claim("F17", ("fig17", "fig17_rig"), diagrams.f17),
    Claim("F17", ("fig17", "fig17_rig"), diagrams.f17_grazing),
    Claim("F17", ("basins17",), partial(diagrams.attractors, name="basins17")),
    Claim("F18", ("fig18", "fig18_rig"), portraits.f18),
    Claim("C1", ("fig09_rig", "fig10_rig", "fig11_rig", "fig16", "fig09", "fig10", "fig11", "fig15"), model.c1),
    Claim("C1", ("eta",), model.c1_other_systems),
)


def measure_claims(data: Data) -> tuple[Statement, ...]:
    """The rows of all claims whose figures are there, in the order of the paper."""
    return tuple(
        replace(row, id=claim.id)
        for claim in CLAIMS
        if all(name in data for name in claim.figures)
        for row in claim.rows(data)
    )
