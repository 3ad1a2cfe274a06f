"""The array types of the models."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Real numbers, of any shape."""
Places: TypeAlias = NDArray[np.intp]
"""Whole numbers that index another array."""
