"""The best point of a run that no longer comes nearer to the optimum.

Near a degenerate optimum an interior-point method can meet the optimality conditions to seven
digits and then wander for hundreds of iterations in search of the last three.  The objective stands
still meanwhile.  The point that it came by is the answer, and what follows is not waited for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array
from ocp.transcription.kernels import Program, nonzero_places
from ocp.transcription.transcribe import ProgramLimits

# A point is near the optimum from this multiple of the solver's tolerance on, but never beyond the
# second number, which is what a certificate accepts as the violation of a row.
_NEAR_FACTOR = 1e2
_NEAR = 1e-8

# iterations without a better point that end a run, and what a better one improves: the error by a
# half, or the objective by more than this part
_PATIENCE = 15
_BETTER = 0.5
_FLAT = 1e-8

# Numbers that points may take up until they are judged.
_WAITING = 10**6

# A run has diverged where rows are missed by so many of their sizes, or of the start's violation,
# for so many iterations in a row.
_LOST = 1e4
_LOST_FOR = 20

# So much counts beside a violation. Stationarity may lack as much as IPOPT's own tolerance on it
# lets it; the sum of all complementary products estimates what the objective may still gain.
_STATIONARITY = 0.01
_GAP = 0.003
_SMALLEST = 1e-300  # of an objective: at zero nothing but a gap of zero is near

# IPOPT's own scaling of its error by large multipliers (Waechter and Biegler 2006, eq. 6)
_LARGE_MULTIPLIERS = 100.0


@dataclass(frozen=True, eq=False, repr=False)
class NearPoint:
    """An iterate that meets the optimality conditions nearly.

    Attributes
    ----------
    number : of its iteration.
    error : of the optimality conditions; of the rows alone until it is judged.
    x, rows, bound_multipliers, row_multipliers : arrays of the program.
    objective : scaled.
    """

    number: int
    error: float
    objective: float
    x: Array
    rows: Array
    bound_multipliers: Array
    row_multipliers: Array


class Standstill:
    """Watches the iterates of one run, and keeps the best of those near the optimum.

    Parameters
    ----------
    tolerance : float
        Of the solver.
    """

    def __init__(
        self, program: Program, limits: ProgramLimits, parameters: Array, tolerance: float
    ) -> None:
        self._program, self._parameters = program, parameters
        self._lower = np.concatenate([limits.columns[0], limits.rows[0]])
        self._upper = np.concatenate([limits.columns[1], limits.rows[1]])
        self._near = max(tolerance, min(_NEAR_FACTOR * tolerance, _NEAR))
        self._best: NearPoint | None = None
        self._waiting: list[NearPoint] = []
        self._stationarity: _Stationarity | None = None

    @property
    def best(self) -> NearPoint | None:
        """The best point near the optimum so far, if there is one."""
        self._judge()
        return self._best

    def seen(
        self,
        number: int,
        objective: float,
        violation: float,
        x: Array,
        rows: Array,
        bound_multipliers: Array,
        row_multipliers: Array,
    ) -> bool:
        """Take note of an iterate; whether the run has stood still for long enough.

        The arrays are copied where they are kept. Errors cost as much as the solver's own
        functions. They are worked out only once the run may be ended by one of its points.

        Parameters
        ----------
        violation : float
            The largest of the rows, see `ProgramLimits.violation`. Unknowns keep to their limits.
        """
        if violation <= self._near:
            kept = (values.copy() for values in (x, rows, bound_multipliers, row_multipliers))
            self._waiting.append(NearPoint(number, max(violation, 0.0), objective, *kept))

        oldest = self._best or next(iter(self._waiting), None)
        old_enough = oldest is not None and number >= oldest.number + _PATIENCE
        if old_enough or len(self._waiting) * (x.size + rows.size) > _WAITING:
            self._judge()
        return self._best is not None and number >= self._best.number + _PATIENCE

    def _judge(self) -> None:
        """Find the best of the points that wait."""
        for point in self._waiting:
            error = max(point.error, self._error(point))
            if error <= self._near and self._is_better(error, point.objective):
                self._best = replace(point, error=error)
        self._waiting.clear()

    def _is_better(self, error: float, objective: float) -> bool:
        if self._best is None:
            return True
        gained = self._best.objective - objective
        return error < _BETTER * self._best.error or gained > _FLAT * abs(objective)

    def _error(self, point: NearPoint) -> float:
        """Larger of dual infeasibility and a part of the duality gap."""
        on_columns, on_rows = point.bound_multipliers, point.row_multipliers
        if self._stationarity is None:
            self._stationarity = _Stationarity(self._program, self._parameters)
        stationarity = self._stationarity(point.x, on_rows) + on_columns

        # a positive multiplier belongs to the upper limit, a negative one to the lower
        values = np.concatenate([point.x, point.rows])
        multipliers = np.concatenate([on_columns, on_rows])
        slack = np.where(multipliers > 0, self._upper - values, values - self._lower)
        products = np.abs(multipliers) * np.where(np.isfinite(slack), np.abs(slack), 1.0)

        mean = float(np.abs(multipliers).mean())
        size = max(_LARGE_MULTIPLIERS, mean) / _LARGE_MULTIPLIERS
        dual = float(np.abs(stationarity).max()) / size
        # a part of the objective, however small its scale makes it: after a warm start from a
        # neighbour, the start itself meets all else
        gap = _GAP * float(products.sum()) / max(abs(point.objective), _SMALLEST)
        return max(_STATIONARITY * dual, gap)


class _Stationarity:
    """Gradient of ``f + lam^T g`` by the unknowns at given constants.

    CasADi's buffers are read and written in place. Matrices made of arrays would take ten times as
    long as the functions of a small program.
    """

    def __init__(self, program: Program, parameters: Array) -> None:
        functions = (program.objective_gradient, program.constraint_jacobian)
        self._rows, self._columns = nonzero_places(functions[1].sparsity_out(1))
        self._x, self._p = np.empty(program.variables), np.array(parameters, dtype=float)
        self._results = [np.zeros(function.nnz_out(1)) for function in functions]
        self._evaluate = []
        for function, result in zip(functions, self._results, strict=True):
            buffer, evaluate = function.buffer()
            for number, argument in enumerate((self._x, self._p)):
                buffer.set_arg(number, argument.data)
            buffer.set_res(1, result.data)
            self._evaluate.append((buffer, evaluate))

    def __call__(self, x: Array, multipliers: Array) -> Array:
        """At unknowns (n,) and multipliers of the rows (m,)."""
        self._x[:] = x
        for _, evaluate in self._evaluate:
            evaluate()
        gradient, jacobian = self._results
        weighted = jacobian * multipliers[self._rows]
        total = gradient + np.bincount(self._columns, weighted, self._x.size)
        return np.asarray(total)


class Divergence:
    """Watches the violation of the rows, which are scaled to the size of one.

    With the adaptive barrier a run can leave all motions behind and wander for a thousand
    iterations where the constraints are missed by millions of their sizes.
    """

    def __init__(self) -> None:
        self._far, self._first = 0, 0.0

    def seen(self, violation: float) -> bool:
        """Take note of the violation of an iterate; whether the run has diverged for long."""
        self._first = self._first or max(violation, 0.0)
        beyond = violation > _LOST * max(1.0, self._first)
        self._far = self._far + 1 if beyond else 0
        return self._far >= _LOST_FOR
