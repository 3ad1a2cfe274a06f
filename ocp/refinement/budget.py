"""Iterations and seconds that a solve may take."""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass, field

from ocp.nlp.solver import LEAST_SECONDS, NlpSolver


@dataclass(frozen=True)
class Budget:
    """Iterations and seconds of a whole solve; infinite where none were stated.

    The clock runs from the making of the budget. It counts everything but the closing
    verification, which is never cut short.

    Attributes
    ----------
    iterations : float
        Of all mesh iterations together.
    seconds : float
        Of all mesh iterations together [s].
    begin : float
        Reading of the clock when it was made [s].
    """

    iterations: float = math.inf
    seconds: float = math.inf
    begin: float = field(default_factory=clock.perf_counter)

    @property
    def elapsed(self) -> float:
        """Time since the budget was made [s]."""
        return clock.perf_counter() - self.begin

    def spent(self, iterations: int, ahead: float = 0.0) -> bool:
        """Whether nothing is left after that many iterations.

        Parameters
        ----------
        ahead : float
            What has to be done besides before the budget ends [s].
        """
        return iterations >= self.iterations or self.elapsed + ahead >= self.seconds

    def within(self, solver: NlpSolver, iterations: int) -> NlpSolver:
        """A solver that begins after that many iterations, cut to what is left."""
        if math.isinf(self.iterations) and math.isinf(self.seconds):
            return solver
        seconds = max(self.seconds - self.elapsed, LEAST_SECONDS)
        return solver.within(max(self.iterations - iterations, 0), seconds)

    def __str__(self) -> str:
        parts = []
        if math.isfinite(self.iterations):
            parts.append(f"{self.iterations} iterations")
        if math.isfinite(self.seconds):
            parts.append(f"{self.seconds:g} s")
        return " or ".join(parts)
