"""What `ocp.solve` asks of a solver of nonlinear programs.

A solver of one's own is an object with these five methods, handed over as
``Settings(solver=...)``. `ocp.nlp.ipopt.Ipopt` is the one that comes with the package.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from ocp.arrays import Array
from ocp.nlp.result import NlpResult
from ocp.transcription.kernels import Program
from ocp.transcription.transcribe import ProgramLimits

Listener = Callable[[int, float, Array, Array], bool]
"""Called at every iteration with its number, the scaled objective, unknowns and rows.

Returns whether the solver is to stop.
"""


class PrimalDualPoint(Protocol):
    """A point of a program, scaled, with its multipliers: see `NlpResult`."""

    @property
    def x(self) -> Array: ...

    @property
    def bound_multipliers(self) -> Array: ...

    @property
    def row_multipliers(self) -> Array: ...


@dataclass(frozen=True, eq=False, repr=False)
class StartingPoint:
    """Where a solver starts.

    Attributes
    ----------
    x : (n,)
        Scaled unknowns.
    multipliers : (bounds (n,), rows (m,)) or None
        Of the bounds of the unknowns and of the rows, scaled, in CasADi's sign,
        ``L = f + lam^T g``; None where they are not known.
    """

    x: Array
    multipliers: tuple[Array, Array] | None = None

    @classmethod
    def at(cls, answer: PrimalDualPoint) -> StartingPoint:
        """The point of an answer of the same program, with its multipliers."""
        return cls(answer.x, (answer.bound_multipliers, answer.row_multipliers))


@runtime_checkable
class NlpSolver(Protocol):
    """A solver of nonlinear programs, with its options."""

    def solve(
        self,
        program: Program,
        start: StartingPoint,
        limits: ProgramLimits,
        parameters: Array,
        listener: Listener | None = None,
    ) -> NlpResult:
        """Minimise the program's objective within its limits.

        Never raises for a failed solve: the outcome tells.

        Parameters
        ----------
        program : Program
            Its functions of ``(x, p)``: objective, rows, and their first and second derivatives.
        start : StartingPoint
            Where to start, with multipliers or without.
        limits : ProgramLimits
            Lower and upper limits of the unknowns (n,) and of the rows (m,).
        parameters : (n_p,)
            Values of the problem's constants.
        listener : callable, optional
            Called at every iteration, see `Listener`.
        """
        ...

    def within(self, iterations: float, seconds: float) -> NlpSolver:
        """The same solver that stops after so many iterations or seconds."""
        ...

    def loosened(self, tolerance: float) -> NlpSolver:
        """The same solver for a mesh that is about to be replaced; itself if that gains nothing."""
        ...

    def within_gap(self, gap: float) -> NlpSolver:
        """The same solver, ending at most this far above the least scaled objective."""
        ...

    def alternatives(self, *, warm: bool) -> Sequence[NlpSolver]:
        """Other options to try in order where these failed, from a start `warm` or not."""
        ...
