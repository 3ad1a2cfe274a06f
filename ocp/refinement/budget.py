"""What all mesh rounds of a solve may take together."""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass, field, replace

from ocp.nlp.ipopt import IpoptOptions
from ocp.settings import Settings


@dataclass(frozen=True)
class Budget:
    """Iterations and seconds of a whole solve; infinite where none were stated.

    The clock runs from the making of the budget.  It counts everything but the closing
    verification, which is never cut short.
    """

    iterations: float = math.inf
    seconds: float = math.inf
    begin: float = field(default_factory=clock.perf_counter)

    @classmethod
    def of(cls, settings: Settings) -> Budget:
        """The budget that the settings state, from now on."""
        return cls(settings.iterations or math.inf, settings.seconds or math.inf)

    def spent(self, iterations: int) -> bool:
        """Whether nothing is left after that many iterations."""
        return iterations >= self.iterations or clock.perf_counter() - self.begin >= self.seconds

    def within(self, options: IpoptOptions, iterations: int) -> IpoptOptions:
        """The options of a run that begins after that many iterations, cut to what is left."""
        if math.isinf(self.iterations) and math.isinf(self.seconds):
            return options
        seconds = max(self.begin + self.seconds - clock.perf_counter(), 1e-3)
        left = max(min(options.max_iterations, self.iterations - iterations), 0)
        return replace(options, max_iterations=int(left), seconds=min(options.seconds, seconds))

    def __str__(self) -> str:
        parts = [f"{self.iterations} iterations", f"{self.seconds:g} s"]
        stated = [math.isfinite(self.iterations), math.isfinite(self.seconds)]
        return " or ".join(part for part, given in zip(parts, stated, strict=True) if given)
