"""Bounds of unknowns and rows, some of which depend on the constants of the problem."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import evaluate_limit
from ocp.problem.symbols import is_number

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Limits:
    """Scaled lower and upper limits of a growing list of entries."""

    def __init__(self, count: int = 0) -> None:
        self.count = count
        self._blocks: list[tuple[Integers, Any, Any, float, bool]] = []

    def take(self, instances: int, limits: list[tuple[Any, Any, float]]) -> Integers:
        """Entries for rows ``(lower, upper, scale)`` repeated; ids of shape (instances, rows)."""
        size = instances * len(limits)
        ids = np.arange(self.count, self.count + size).reshape(instances, len(limits))
        self.count += size
        for j, (lower, upper, scale) in enumerate(limits):
            self.bound(ids[:, j], lower, upper, scale)
        return ids

    def bound(self, ids: Integers, lower: Any, upper: Any, scale: float) -> None:
        """Set (and override) the limits of some entries."""
        self._blocks.append((np.asarray(ids).ravel(), lower, upper, scale, False))

    def narrow(self, ids: Integers, lower: Any, upper: Any, scale: float) -> None:
        """Limits in addition to those set before."""
        self._blocks.append((np.asarray(ids).ravel(), lower, upper, scale, True))

    @property
    def bounded(self) -> NDArray[np.bool_]:
        """Which entries may have a limit, (count,)."""
        found = np.zeros(self.count, dtype=bool)
        for ids, low, high, _, narrows in self._blocks:
            limited = not all(is_number(v) and math.isinf(v) for v in (low, high))
            found[ids] = (found[ids] | limited) if narrows else limited
        return found

    def evaluate(self, constants: Mapping[str, float]) -> tuple[Array, Array]:
        """Lower and upper limits, shape (count,) each, at values of the constants."""
        lower, upper = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        for ids, low, high, scale, narrows in self._blocks:
            a, b = _number(low, constants) / scale, _number(high, constants) / scale
            lower[ids] = np.maximum(lower[ids], a) if narrows else a
            upper[ids] = np.minimum(upper[ids], b) if narrows else b
        return lower, upper


def _number(value: Any, constants: Mapping[str, float]) -> float:
    return float(value) if is_number(value) else evaluate_limit(value, constants)
