"""Section points counted into the bins of a histogram, so that they need not be stored."""

from numba import types

from nonsmooth.kernels.compile.cache import kernel

_i, _f, _i4 = types.int64, types.float64, types.int32
_f2, _f3, _i1 = _f[:, ::1], _f[:, :, ::1], _i[::1]


@kernel(types.void(_f3, _i, _f2, _i4[:, ::1], _i1))
def count(section, row, edges, counts, outside):
    """Add the points section[row] to ``counts`` (state, bin); those beyond the edges (state, bin + 1), and NaN, to
    ``outside`` (state).

    A bin holds its lower edge and not its upper one, the last bin both: the rule of ``numpy.histogram``."""
    bins = counts.shape[1]
    for j in range(edges.shape[0]):
        low, high = edges[j, 0], edges[j, bins]
        per_unit = bins / (high - low)
        for k in range(section.shape[1]):
            x = section[row, k, j]
            if not (low <= x <= high):
                outside[j] += 1
                continue
            b = int((x - low) * per_unit)
            if b > bins - 1:
                b = bins - 1
            if x < edges[j, b]:
                b -= 1
            elif b < bins - 1 and x >= edges[j, b + 1]:
                b += 1
            counts[j, b] += 1
