"""All pictures of an identification, one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["pictures"]


def pictures(found: Any) -> Iterator[tuple[str, Axes]]:
    """The pictures of a parameter set's findings, each with a name for its file.

    Parameters
    ----------
    found : ParameterSet
        As ``identify`` returned it: a set that was read from a file has no data to draw.
    """
    from nonsmooth.plot import identification

    drawn: list[Any] = []
    for finding in found.findings:
        if not finding.plot or finding.data is None or any(finding.data is data for data in drawn):
            continue  # two findings of one fit share its picture
        drawn.append(finding.data)
        yield finding.name, getattr(identification, finding.plot)(finding)
        if finding.plot == "impulse_response":
            yield f"{finding.name}_history", identification.impulse_history(finding)
