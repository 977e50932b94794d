"""Edges of the cells around the values of an axis."""

from __future__ import annotations

import numpy as np

__all__ = ["cell_edges"]


def cell_edges(values: np.ndarray) -> np.ndarray:
    """Edges (n + 1,) of the cells around rising values (n,): the middles between them. One value has a cell too."""
    if len(values) == 1:
        half = 0.5 * max(abs(float(values[0])), 1e-3)
        return np.array([values[0] - half, values[0] + half])
    middles = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middles[0]], middles, [2 * values[-1] - middles[-1]]])
