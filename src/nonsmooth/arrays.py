"""Types of arrays, for annotations: ``FloatArray``, ``IntArray``, ``BoolArray`` and ``ComplexArray``, each NumPy's
``NDArray`` of its numbers.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["BoolArray", "ComplexArray", "FloatArray", "IntArray"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]
