"""What a solve returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import numpy as np

from ocp.arrays import ROUNDING, Array, Integers
from ocp.errors import StatementError
from ocp.estimates.motion_errors import dense_peak
from ocp.keywords import checked_methods
from ocp.later import lazy_fields
from ocp.mesh.dense_integral import dense_integral
from ocp.mesh.mesh import Mesh, distinct
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory, Trajectory
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import Multipliers
from ocp.problem.functionals import Integral, Peak
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem, named
from ocp.problem.symbols import resolve, scalar
from ocp.problem.vectors import Vector
from ocp.refinement.solved_mesh import Ending, MeshIteration
from ocp.reformulate.form import Form
from ocp.verification.simulation import SimulatedMotion
from ocp.verification.verify import Verification

if TYPE_CHECKING:
    from pathlib import Path

    from ocp.analysis.scaling_report import ScalingReport
    from ocp.analysis.sensitivity import Sided
    from ocp.solution.plot import Figure

Kept = TypeVar("Kept")
# Samples of a phase at which a peak is looked for that the problem does not state
_SAMPLES = 4000


@checked_methods("value", "sample", "costate", "table", "to_csv", "plot")
@lazy_fields("replayed", "replay", "verification", "verdict", "multipliers", "iterate")
@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """A verified trajectory of the problem as it was stated, and how it came about.

    Multipliers are worked out when they are first read, and so are replay, verification and verdict
    of an answer on a fixed mesh, which does not depend on them.

    Attributes
    ----------
    problem : Problem
    objective : float
        Value of what was minimised or maximised [unit of the objective].
    trajectory, replayed : Trajectory
        The solution and its independent replay.  With ``verify=False`` there is none: `replayed`
        is the solution then, and `replay` has no phases.
    replay : SimulatedMotion
        The replay with its own errors.
    verification : Verification
        What the replay and the evaluation between the points found.
    mesh : Mesh
        The last one.
    mesh_iterations : tuple of MeshIteration
        What each mesh iteration took and found.
    verdict : str
        "global: bound met", "local: ..." or "unverified", in words.
    evaluator : Evaluator
        Of expressions of the problem.
    form : Form
        What was solved in the problem's place: ``form.problem`` is the problem itself where nothing
        was reformulated.
    form_evaluator : Evaluator
        Of expressions of ``form.problem``.
    seconds : float
        That the solve took [s].
    multipliers : Multipliers or None
        Of dynamics (costates), bounds, links and peaks of ``form.problem``, in the units of the
        statement.
    iterate : Iterate or None
        The point of the nonlinear program of ``form.problem``, for proofs and warm starts.
    ending : str
        Why the refinement ended: "tolerances" (all are met, or the mesh is fixed), "standstill"
        (no finer mesh improved it), "mesh iterations" (their limit), "failure" (of a finer mesh),
        "cost" (further meshes would take much time for a small improvement), "budget" or
        "interrupted" (by the user). The last three return the best motion until then.
    """

    problem: Problem
    objective: float
    trajectory: Trajectory
    replayed: Trajectory
    replay: SimulatedMotion
    verification: Verification
    mesh: Mesh
    mesh_iterations: tuple[MeshIteration, ...]
    verdict: str
    multipliers: Multipliers | None
    evaluator: Evaluator
    form: Form
    form_evaluator: Evaluator
    seconds: float = 0.0
    iterate: Iterate | None = None
    ending: Ending = "tolerances"

    def __repr__(self) -> str:
        from ocp.solution.tables import summary

        return summary(self)

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Solution cannot be pickled or copied; write ocp.save(solution, path), and "
            "ocp.load(path) to read it"
        )

    @property
    def breakpoints(self) -> Array:
        """Times of the mesh, all phases, shape (n,) [s]."""
        return distinct(np.concatenate([p.breakpoints for p in self.trajectory.phases]))

    @property
    def accuracy(self) -> float:
        """What objective, dynamics, limits and replay are accurate to, relative to their sizes.

        Of a scheme that gives no estimate of a finer mesh, as the verdict then says, the objective
        counts with its change since the mesh before, which may be far less than its error.
        """
        return self.verification.accuracy

    @property
    def interrupted(self) -> bool:
        """Whether the user stopped the solve, and this is the best motion until then."""
        return self.ending == "interrupted"

    @property
    def iterations(self) -> int:
        """Iterations of the solver over all mesh iterations."""
        return sum(entry.iterations for entry in self.mesh_iterations)

    def value(self, expression: Any, *, replayed: bool = False) -> float:
        """One number: an expression of functionals, unknowns and constants, or its name.

        Peaks and integrals are evaluated densely, between the points too.

        Parameters
        ----------
        expression : SX or str
            In the unit of the statement.
        replayed : bool
            Evaluate along the independent replay.

        Raises
        ------
        StatementError
            When the expression varies in time, or no such name is known.
        """
        source = self._source(replayed)
        expression = named(self.problem, expression)
        symbols = resolve(scalar(expression, "an expression"), "an expression")
        # the mesh was not made for what the problem does not state
        found: dict[Any, float] = {}
        of_problem, solved = set(self.problem.functionals), set(self.form.problem.functionals)
        for f in symbols:
            stated = f in of_problem
            if isinstance(f, Peak):
                samples = 0 if stated else _SAMPLES
                found[f] = dense_peak(self.evaluator, source, f, samples)
            elif isinstance(f, Integral) and f not in solved:
                found[f] = dense_integral(self.evaluator, source, f)
        return self.evaluator.number(source, expression, found)

    def sample(
        self,
        expression: Any,
        times: Any,
        phase: Phase | str | None = None,
        *,
        replayed: bool = False,
    ) -> Array:
        """Expressions of signals at times [s].

        Parameters
        ----------
        expression : expression or name, or list of these, or a vector of signals
            ``x_t, v_t = solution.sample([x, v], times)`` samples several at once.
        times : array of any shape
            [s].  An instant shared by two phases belongs to the later one, unless `phase` says
            otherwise.
        phase : Phase or str, optional
            The one that is meant, or its name.
        replayed : bool
            Take the states from the independent replay.

        Returns
        -------
        Array
            Shape of `times`; with a list or a vector, one such array for each entry.

        Raises
        ------
        StatementError
            When a time lies outside the motion, or no such name is known.
        """
        source, many = self._source(replayed), isinstance(expression, (list, tuple, Vector))
        expressions = list(expression) if many else [expression]

        def values(motion: PhaseTrajectory, intervals: Integers, tau: Array) -> Array:
            wanted = [named(self.problem, e, motion.name) for e in expressions]
            return self.evaluator.values(source, motion.name, wanted, intervals, tau)

        sampled = _sampled(source, times, _phase_name(phase), len(expressions), values)
        missing = np.isnan(sampled).any(axis=0)
        if missing.any():
            first, last = source.phases[0].start, source.phases[-1].end
            outside = np.asarray(times, dtype=float)[missing][0]
            if not first <= outside <= last:
                raise StatementError(f"{outside} s lies outside the motion ({first} to {last} s)")
        return sampled if many else np.asarray(sampled[0])

    def costate(self, state: Any, times: Any, phase: Phase | str | None = None) -> Array:
        """The costate of a state (or running integral) [unit of the objective / unit of the state].

        In the sign of `ocp.optimality.multipliers`: the change of the optimum, as it is minimised,
        per unit added to the state.  An instant shared by two phases belongs to the later one,
        unless `phase` says otherwise.

        Parameters
        ----------
        state : State or str
            It, or its name.
        times : array of any shape
            [s].
        phase : Phase or str, optional
            The one that is meant, or its name.

        Returns
        -------
        Array
            Shape of `times`.

        Raises
        ------
        StatementError
            When the state has no costate there.
        """
        name = state if isinstance(state, str) else state.name
        costates = {c.name: c for c in self.kept_multipliers.costates if name in c.names}

        def values(motion: PhaseTrajectory, intervals: Integers, tau: Array) -> Array:
            if motion.name not in costates:
                return np.full((intervals.size, 1), np.nan)
            own = costates[motion.name]
            return own.local(intervals, tau)[:, [own.names.index(name)]]

        sampled = _sampled(self.trajectory, times, _phase_name(phase), 1, values)[0]
        if np.isnan(sampled).any():
            missing = np.asarray(times, dtype=float)[np.isnan(sampled)][0]
            raise StatementError(f"'{name}' has no costate at {missing} s")
        return np.asarray(sampled)

    def _source(self, replayed: bool) -> Trajectory:
        """The solution or its replay; StatementError if that was not asked for."""
        if replayed and not self.replay.phases:
            raise StatementError(
                "this solution was made with verify=False and has no replay; solve with verify=True"
            )
        return self.replayed if replayed else self.trajectory

    def table(self, times: Any = None) -> dict[str, Array]:
        """Columns by name: time [s] and all signals; ``pandas.DataFrame`` takes it as it is.

        Parameters
        ----------
        times : array, optional
            [s].  By default several in each interval, its ends included.
        """
        from ocp.solution.tables import table

        return table(self, times)

    def to_csv(self, path: str | Path, times: Any = None) -> None:
        """Write the table of all signals, with units, below lines of comments (#).

        Raises
        ------
        FileError
            When the folder is missing, or the file cannot be written.
        """
        from ocp.solution.tables import write_csv

        write_csv(self, path, times)

    def plot(self) -> Figure:
        """A figure of states, controls, path constraints and costates with bounds and mesh."""
        from ocp.solution.plot import plot

        return plot(self)

    @property
    def scaling(self) -> ScalingReport:
        """The sizes by which the solve divided, and why; prints as a table."""
        from ocp.analysis.scaling_report import report_of

        return report_of(self.form.problem, self.kept_iterate.scales)

    def sensitivities(self) -> dict[str, float]:
        """Change of the optimum per unit of every named number, see `ocp.analysis.sensitivity`.

        Warns
        -----
        ActiveSetWarning
            Where the optimum has a kink; the number is then nan.
        """
        from ocp.analysis.sensitivity import sensitivities

        return sensitivities(self)

    def one_sided_sensitivities(self) -> Mapping[str, Sided]:
        """The same for a decrease and for an increase of the number.

        See `ocp.analysis.sensitivity`.
        """
        from ocp.analysis.sensitivity import one_sided_sensitivities

        return one_sided_sensitivities(self)

    @property
    def kept_iterate(self) -> Iterate:
        """The point of the program; StatementError if the solution was made without."""
        return _kept(self.iterate)

    @property
    def kept_multipliers(self) -> Multipliers:
        """The multipliers; StatementError if the solution was made without."""
        return _kept(self.multipliers)


def _phase_name(phase: Phase | str | None) -> str | None:
    return phase.name if isinstance(phase, Phase) else phase


def _sampled(
    trajectory: Trajectory,
    times: Any,
    phase: str | None,
    count: int,
    values: Callable[[PhaseTrajectory, Integers, Array], Array],
) -> Array:
    """Values (count, *shape of times), nan outside the phases.

    Parameters
    ----------
    phase : the only one to look at; all of them if None.
    values : of a phase's trajectory, intervals and local times: (m, count).
    """
    t = np.asarray(times, dtype=float)
    flat = t.ravel()
    result = np.full((count, flat.size), np.nan)
    for motion in trajectory.phases if phase is None else [trajectory.phase(phase)]:
        slack = ROUNDING * (1.0 + abs(motion.end - motion.start))
        here = (flat >= motion.start - slack) & (flat <= motion.end + slack)
        if here.any():
            intervals, tau = motion.locate(np.clip(flat[here], motion.start, motion.end))
            result[:, here] = values(motion, intervals, tau).T
    return result.reshape(count, *t.shape)


def _kept(what: Kept | None) -> Kept:
    if what is None:
        raise StatementError("this solution was made without its multipliers; solve again")
    return what
