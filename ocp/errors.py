"""What can go wrong, in the words of the user's problem."""


class OcpError(Exception):
    """Base of all errors of the toolkit: one sentence naming the thing, the value, the remedy."""


class StatementError(OcpError, ValueError):
    """The problem as stated cannot be transcribed."""


class StatementWarning(UserWarning):
    """A part of a statement has no effect; the problem is solved all the same."""


class FileError(OcpError, ValueError):
    """A file cannot be read or written, or holds no solution that this version reads."""


class SolveFailed(OcpError):
    """No solution was found.

    Attributes
    ----------
    iterate : object or None
        The last iterate, for inspection only; it is not a solution.
    """

    def __init__(self, message: str, iterate: object | None = None) -> None:
        super().__init__(message)
        self.iterate = iterate


class Infeasible(SolveFailed):
    """The solver found no point that meets all constraints."""


class Overdetermined(Infeasible):
    """More equations are stated than there are unknowns to meet them with."""


class IterationLimit(SolveFailed):
    """The budget of iterations or seconds ran out."""


class Unbounded(SolveFailed):
    """The objective ran away: nothing bounds it."""


class Collapsed(SolveFailed):
    """The motion shrinks to no time at all: nothing in the statement needs time."""


class NumericalTrouble(SolveFailed):
    """The solver broke off for reasons of its own, such as a step it could not compute."""


class BudgetSpent(IterationLimit):
    """The budget ran out before any mesh iteration was accurate enough to return.

    Attributes
    ----------
    iterate : object or None
        As of `Interrupted`.
    finished : object or None
        The best mesh iteration that the solver finished; not verified.
    refinement : object or None
        What was reached, an `ocp.refinement.refine.Refinement`.
    """

    def __init__(
        self,
        message: str,
        iterate: object | None = None,
        finished: object | None = None,
        refinement: object | None = None,
    ) -> None:
        super().__init__(message, iterate)
        self.finished, self.refinement = finished, refinement


class HomotopyStopped(SolveFailed):
    """A homotopy did not reach its value.

    Attributes
    ----------
    reached : float
        The last value that was solved for.
    solution : object
        Its solution, not replayed unless that value was asked for.
    steps : tuple
        All attempts on the way to the value that was not reached.
    """

    def __init__(
        self, message: str, reached: float, solution: object, steps: tuple[object, ...]
    ) -> None:
        super().__init__(message)
        self.reached, self.solution, self.steps = reached, solution, steps


class FamilyStopped(SolveFailed):
    """A member of a family was not found.

    Attributes
    ----------
    family : object
        The members before it, an `ocp.Family`.
    """

    def __init__(self, message: str, family: object, iterate: object | None = None) -> None:
        super().__init__(message, iterate)
        self.family = family


class InvalidNumber(SolveFailed):
    """An expression of the problem is NaN or infinite where the solver needs it."""


class Unverified(SolveFailed):
    """A solver's answer did not pass its verification."""


class Interrupted(OcpError):
    """The user stopped the solve, and nothing that it had reached is accurate to 1e-2.

    Attributes
    ----------
    iterate : object or None
        The best motion until then, as a `Solution` that is not verified; the last iterate if no
        mesh was solved.
    finished : object or None
        The best mesh iteration that the solver finished, whether it holds between its points or
        not.
    refinement : object or None
        What was reached, an `ocp.refinement.refine.Refinement`.
    """

    def __init__(
        self,
        message: str,
        iterate: object | None = None,
        finished: object | None = None,
        refinement: object | None = None,
    ) -> None:
        super().__init__(message)
        self.iterate, self.finished, self.refinement = iterate, finished, refinement
