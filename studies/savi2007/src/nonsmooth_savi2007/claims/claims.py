"""The statements of the paper: the figures that decide each, and the functions that measure it on model and rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nonsmooth_savi2007.claims import diagrams, model, parameters, response, rig
from nonsmooth_savi2007.claims.verdicts import Cell, Data, Statement


@dataclass(frozen=True)
class Claim:
    """A statement: its id, the figures whose data it needs, and what turns them into rows of the report.

    ``rig``, where given, has a cell of the virtual rig for each of the rows, in their order; else the rows hold it.
    """

    id: str
    figures: tuple[str, ...]
    measure: Callable[[Data], list[Statement]]
    rig: Callable[[Data], list[Cell]] | None = None

    def rows(self, data: Data) -> list[Statement]:
        """The rows with what the rig says."""
        rows = self.measure(data)
        if self.rig is None:
            return rows
        return [row.measured(cell) for row, cell in zip(rows, self.rig(data), strict=True)]


def _model(n: int) -> Callable[[Data], list[Cell]]:
    return lambda data: rig.of_the_model(n)


CLAIMS = (
    Claim("M1", ("fig12",), model.m1, _model(1)),
    Claim("M2", ("fig12",), model.m2, _model(1)),
    Claim("M3", ("fig12",), model.m3, _model(1)),
    Claim("M4", ("eta",), model.m4, _model(3)),
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
    Claim("F9a", ("fig09", "fig09_rig"), response.f9a, response.f9a_rig),
    Claim("F9b", ("fig09", "fig09_rig"), response.f9b, response.f9b_rig),
    Claim("F9c", ("fig09", "fig09_rig"), response.f9c, response.f9c_rig),
    Claim("F10", ("fig10", "fig10_rig"), response.f10, response.f10_rig),
    Claim("F10", ("fig09", "fig09_rig", "fig10"), response.grazing_behind_both, response.grazing_behind_both_rig),
    Claim("F11", ("fig11", "fig11_rig"), diagrams.f11, rig.f11),
    Claim("F12", ("fig12", "fig12_rig"), diagrams.f12, rig.f12),
    Claim("F13", ("fig13", "fig13_rig"), diagrams.f13, rig.f13),
    Claim("F13", ("basins13",), diagrams.f13_basins, _model(1)),
    Claim("F14", ("fig14", "fig14_rig"), diagrams.f14, rig.f14),
    Claim("F15", ("fig15",), diagrams.f15, rig.f15),
    Claim("F16", ("fig16",), rig.f16),
    Claim("F17", ("fig17", "fig17_rig"), diagrams.f17, rig.f17),
    Claim("F17", ("fig17", "fig17_rig"), diagrams.f17_grazing, rig.f17_grazing),
    Claim("F17", ("basins17",), diagrams.f17_basins, _model(1)),
    Claim("F18", ("fig18", "fig18_rig"), diagrams.f18, rig.f18),
    Claim("C1", ("fig09_rig", "fig10_rig", "fig11_rig", "fig16", "fig09", "fig10", "fig11", "fig15"), model.c1, rig.c1),
    Claim("C1", ("eta",), model.c1_other_systems, _model(1)),
)


def measure_claims(data: Data) -> tuple[Statement, ...]:
    """The rows of all claims whose figures are there, in the order of the paper."""
    return tuple(row for claim in CLAIMS if all(name in data for name in claim.figures) for row in claim.rows(data))
