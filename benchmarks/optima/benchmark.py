"""A problem whose optimum is known."""

from dataclasses import dataclass

from ocp import Problem


@dataclass(frozen=True, eq=False)
class Benchmark:
    """A stated problem and the optimum it is held against.

    Attributes
    ----------
    problem : with the guess from which it is to be solved.
    optimum : trusted value of the objective, in the problem's own sense and unit.
    tolerance : relative error allowed.
    source : where the problem and the optimum come from.
    """

    problem: Problem
    optimum: float
    tolerance: float
    source: str

    @property
    def name(self) -> str:
        """That of the problem."""
        return self.problem.name

    def error(self, value: float) -> float:
        """Relative error of `value` against the optimum, signed."""
        return (value - self.optimum) / abs(self.optimum)
