"""The array types of the package."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Divisors that may vanish are this at least.
TINY = float(np.finfo(float).tiny)

# Part of a size that is rounding at the end of a computation.
ROUNDING = 1e-9
