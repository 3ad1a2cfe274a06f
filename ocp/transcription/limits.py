"""Limits of unknowns and rows, some of which depend on the constants of the problem."""

from __future__ import annotations

from typing import Any

import numpy as np

from ocp.arrays import Array, Integers
from ocp.problem.parameters import Parameters


class Limits:
    """Scaled lower and upper limits of a growing list of entries.

    A later statement on an entry replaces an earlier one, but for `narrow`.
    """

    def __init__(self, count: int = 0) -> None:
        self.count = count
        self._statements: list[tuple[Integers, Any, Any, float, bool]] = []

    def take(self, instances: int, limits: list[tuple[Any, Any, float]]) -> Integers:
        """Entries for rows ``(lower, upper, scale)`` repeated; ids of shape (instances, rows)."""
        size = instances * len(limits)
        ids = np.arange(self.count, self.count + size).reshape(instances, len(limits))
        self.count += size
        for j, (lower, upper, scale) in enumerate(limits):
            self.bound(ids[:, j], lower, upper, scale)
        return ids

    def take_equations(self, instances: int, rows: int) -> Integers:
        """Entries for scaled equations ``row = 0``; ids of shape (instances, rows)."""
        return self.take(instances, [(0.0, 0.0, 1.0)] * rows)

    def bound(self, ids: Any, lower: Any, upper: Any, scale: float) -> None:
        """Set (and override) the limits of some entries."""
        self._statements.append((np.asarray(ids).ravel(), lower, upper, scale, False))

    def narrow(self, ids: Any, lower: Any, upper: Any, scale: float) -> None:
        """Limits in addition to those set before."""
        self._statements.append((np.asarray(ids).ravel(), lower, upper, scale, True))

    def at(self, parameters: Parameters) -> tuple[Array, Array]:
        """Scaled lower and upper limits, shape (count,) each, at values of the constants."""
        lower, upper = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        for ids, low, high, scale, narrows in self._statements:
            least, largest = parameters.limit(low) / scale, parameters.limit(high) / scale
            lower[ids] = np.maximum(lower[ids], least) if narrows else least
            upper[ids] = np.minimum(upper[ids], largest) if narrows else largest
        return lower, upper
