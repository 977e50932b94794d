"""Linear systems of shooting: dense where they are small; sparse, by one thread, where an orbit has many visits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray

LARGE = 256  # unknowns; beyond, the zeros between the blocks of the visits cost more than lists of what is none
MANY = 100  # equations; beyond, all singular values take longer than the smallest


def solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """x with matrix x = right; LinAlgError where there is none."""
    return Factored(matrix).solve(right)


def shortest(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """The shortest x for which matrix x is nearest to right; LinAlgError where a number is not finite."""
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):  # LAPACK would print a message of its own
        raise np.linalg.LinAlgError("a number of the matrix or the right side is not finite")
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-7)[0])


def determinant(matrix: FloatArray) -> tuple[float, float]:
    """Sign of the determinant and the logarithm of its size."""
    try:
        return Factored(matrix).determinant()
    except np.linalg.LinAlgError:
        return 0.0, -np.inf


def null_vectors(matrix: FloatArray, tolerance: float) -> FloatArray:
    """Orthonormal vectors (k, n) that a matrix (m, n) takes to zero, up to a part of its largest singular value.

    Of a large matrix three at most, the last the nearest to zero: by inverse iteration on
    :math:`J^T J + \\delta^2`, as the least squares that it stands for, whose matrix is as sparse as J.
    """
    if len(matrix) <= MANY:
        _, values, right = np.linalg.svd(matrix)
        return np.asarray(right[int((values > tolerance * values[0]).sum()) :])
    from scipy.sparse import bmat, eye_array
    from scipy.sparse.linalg import splu

    m, n = matrix.shape
    small = tolerance * float(np.linalg.norm(matrix)) / np.sqrt(n)
    delta = 0.1 * small
    factored = splu(bmat([[delta * eye_array(m), matrix], [matrix.T, -delta * eye_array(n)]], format="csc"))
    found = np.random.default_rng(1).normal(size=(n, 3))
    for _ in range(4):
        found = np.linalg.qr(factored.solve(np.vstack([np.zeros((m, 3)), found]))[m:])[0]
    _, values, right = np.linalg.svd(matrix @ found)
    return np.asarray((found @ right.T).T[values < small])


class Factored:
    """An LU factorisation: solutions, and the sign and the logarithm of the determinant.

    Raises
    ------
    LinAlgError
        The matrix is singular.
    """

    def __init__(self, matrix: FloatArray) -> None:
        if len(matrix) > LARGE:
            from scipy.sparse import csc_matrix
            from scipy.sparse.linalg import splu

            try:
                self._sparse = splu(csc_matrix(matrix))
            except (RuntimeError, ValueError) as error:
                raise np.linalg.LinAlgError(str(error)) from None
            return
        from scipy.linalg.lapack import dgetrf

        self._sparse = None
        self._dense, self._exchanged, info = dgetrf(matrix)
        if info:
            raise np.linalg.LinAlgError("the matrix is singular")

    def solve(self, right: FloatArray) -> FloatArray:
        """x with matrix x = right."""
        if self._sparse is not None:
            return np.asarray(self._sparse.solve(right))
        from scipy.linalg.lapack import dgetrs

        return np.asarray(dgetrs(self._dense, self._exchanged, right)[0])

    def determinant(self) -> tuple[float, float]:
        """Sign of the determinant and the logarithm of its size."""
        if self._sparse is not None:
            diagonal = self._sparse.U.diagonal()
            parity = _parity(self._sparse.perm_r) * _parity(self._sparse.perm_c)
        else:
            diagonal = self._dense.diagonal()
            parity = _sign(self._exchanged != np.arange(len(diagonal)))
        return parity * _sign(diagonal < 0.0), float(np.log(np.abs(diagonal)).sum())


def _sign(odd: NDArray[np.bool_]) -> float:
    """-1 where an odd number of entries is true, else 1."""
    return -1.0 if np.count_nonzero(odd) % 2 else 1.0


def _parity(permutation: NDArray[np.int32]) -> float:
    """1 for an even permutation, -1 for an odd one: each cycle of n places is n - 1 exchanges."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(permutation)
    cycles = connected_components(csr_matrix((np.ones(n), permutation, np.arange(n + 1))))[0]
    return -1.0 if (n - cycles) % 2 else 1.0
