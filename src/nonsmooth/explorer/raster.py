"""Section points of a diagram as an image: one pixel per column, so that no pattern comes from rounding."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d

from nonsmooth.arrays import FloatArray

#: A cloud: points (columns, n), a colour "#RRGGBB", and the height of a dot in pixels.
Layer = tuple[FloatArray, str, int]
_ALPHA = np.array([0, 150, 205, 255], dtype=np.uint32)  # of 0, 1, 2 and more points in a pixel


def drawn(layers: list[Layer], low: float, high: float, height: int) -> Any:
    """Return an RGBA image (height, columns), rows from below, of point clouds laid over each other.

    A darker pixel holds more points: in chaos the image is the density.
    """
    columns = layers[0][0].shape[0] if layers else 1
    image = np.zeros((height, columns), dtype=np.uint32)
    if not high > low:
        return image
    for points, color, size in layers:
        rows = np.floor((points - low) / (high - low) * height)
        there = np.isfinite(rows) & (rows > -size) & (rows < height)
        column = np.broadcast_to(np.arange(columns)[:, None], points.shape)[there]
        counts = np.bincount(
            rows[there].astype(np.int64).clip(0) * columns + column, minlength=height * columns
        ).reshape(height, columns)
        thick = maximum_filter1d(counts, size, axis=0, mode="constant")
        red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
        shade = _ALPHA[np.minimum(thick, 3)] << 24 | np.uint32(blue << 16 | green << 8 | red)
        image = np.where(thick > 0, shade, image)
    return image.astype(np.uint32)
