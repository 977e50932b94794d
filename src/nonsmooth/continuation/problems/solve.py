"""Linear systems of shooting: dense where they are small; sparse, by one thread, where an orbit has many visits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["determinant", "solve"]

FloatArray = NDArray[np.float64]
LARGE = 64  # unknowns; beyond, the blocks of the visits fill a small part of the matrix


def solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """x with matrix x = right; LinAlgError where there is none."""
    if len(matrix) <= LARGE:
        return np.asarray(np.linalg.solve(matrix, right))
    return _Factored(matrix).solve(right)


class _Factored:
    """An LU factorisation: solutions, and the sign and the logarithm of the determinant."""

    def __init__(self, matrix: FloatArray) -> None:
        from scipy.sparse import csc_matrix
        from scipy.sparse.linalg import splu

        try:
            self._lu = splu(csc_matrix(matrix))
        except (RuntimeError, ValueError) as error:
            raise np.linalg.LinAlgError(str(error)) from None

    def solve(self, right: FloatArray) -> FloatArray:
        """x with matrix x = right."""
        return np.asarray(self._lu.solve(right))

    def determinant(self) -> tuple[float, float]:
        """Sign of the determinant and the logarithm of its size."""
        diagonal = self._lu.U.diagonal()
        sign = float(np.prod(np.sign(diagonal))) * _parity(self._lu.perm_r) * _parity(self._lu.perm_c)
        return sign, float(np.log(np.abs(diagonal)).sum())


def determinant(matrix: FloatArray) -> tuple[float, float]:
    """Sign of the determinant and the logarithm of its size."""
    if len(matrix) <= LARGE:
        sign, size = np.linalg.slogdet(matrix)
        return float(sign), float(size)
    return _Factored(matrix).determinant()


def _parity(permutation: NDArray[np.int32]) -> float:
    """1 for an even permutation, -1 for an odd one."""
    seen = np.zeros(len(permutation), dtype=bool)
    parity = 1.0
    for i in range(len(permutation)):
        if seen[i]:
            continue
        j, length = i, 0
        while not seen[j]:
            seen[j] = True
            j = int(permutation[j])
            length += 1
        if length % 2 == 0:
            parity = -parity
    return parity
