"""A family of motions: one problem for many values of a constant, each warm from the one before.

Along a family the nonlinear program stays, and with it everything that was built for it. The
breakpoints move with the ends of the arcs, see `ocp.refinement.policies.moving_mesh`. A member then
costs little more than the iterations of its solver. Errors between the points, further refinement
and the replay cost several times as much, and wait until they are asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from ocp.algorithm import errors_of_statement, first_mesh, solve, solve_from
from ocp.analysis.saddles import lower_motion, may_be_saddle
from ocp.arrays import Array
from ocp.errors import FamilyStopped, Interrupted, SolveFailed, StatementError
from ocp.estimates.motion_errors import MotionErrors
from ocp.keywords import checked_keywords
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.nlp.solver import StartingPoint
from ocp.optimality.iterate import Iterate, iterate_of
from ocp.problem.checks_before_solve import check_before_solve
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress, shown
from ocp.refinement.mesh_solver import LOOSE, MeshSolver
from ocp.refinement.policies.moving_mesh import (
    KeptWhileGood,
    MovingMesh,
    movable_mesh,
    moving_mesh,
    price_of_widths,
)
from ocp.refinement.refine import refine
from ocp.refinement.solved_mesh import MeshIteration, iterations_of, record_of
from ocp.reformulate.form import Form
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.transcription.packing import trajectory_of
from ocp.transcription.transcribe import Transcription

# Of a signal's range, that merging intervals may cost: what it spoils is refined again at once.
_MERGED = 5e-4

# Times that the limits of all widths are set again for one member. Each time an interval may grow
# by a half: what takes more is far from its neighbour.
_RENEWALS = 4

# Of the states' sizes: what is off by more between its points is no motion of the problem
_NO_MOTION = 1e-3

# How a mesh that was merged is refined again
_MOVING = MovingMesh(5)


@dataclass(frozen=True, eq=False, repr=False)
class Member:
    """A motion of a family, as its mesh gives it: neither refined nor verified.

    Attributes
    ----------
    value : float
        Of the constant [its unit].
    objective : float
        As it was stated, minimised or maximised [unit of the objective].
    iterations : int
        Of the solver.
    alone : bool
        Whether it was refined on a mesh of its own: the first one, and any to which the mesh of the
        one before did not lead.
    iterate : Iterate
        The point of its nonlinear program, which neighbours share.
    """

    value: float
    objective: float
    iterations: int
    alone: bool
    iterate: Iterate = field(repr=False)

    def __repr__(self) -> str:
        return f"Member({self.value:.6g}: objective {self.objective:.8g})"

    @property
    def trajectory(self) -> Trajectory:
        """The motion of what is solved: of the field ``form`` of its `Family`."""
        return self.iterate.trajectory


@dataclass(frozen=True, eq=False, repr=False)
class Family:
    """Motions of one problem along the values of a constant.

    Attributes
    ----------
    problem : Problem
    constant : Constant
    form : Form
        What is solved in the problem's place.
    settings : Settings
        By which members are refined and verified.
    evaluator : Evaluator
        Of ``form.problem``.
    members : tuple of Member
        In the order of the values.
    """

    problem: Problem
    constant: Constant
    form: Form
    settings: Settings
    evaluator: Evaluator = field(repr=False)
    members: tuple[Member, ...]

    def __repr__(self) -> str:
        first, last = self.members[0], self.members[-1]
        return (
            f"Family of '{self.problem.name}': {len(self.members)} members, '{self.constant.name}' "
            f"{first.value:.6g} to {last.value:.6g} {self.constant.unit}, objectives "
            f"{first.objective:.8g} to {last.objective:.8g}"
        )

    @property
    def values(self) -> Array:
        """Of the constant, (n,) [its unit]."""
        return np.array([member.value for member in self.members])

    @property
    def objectives(self) -> Array:
        """Neither refined nor verified, (n,) [unit of the objective]."""
        return np.array([member.objective for member in self.members])

    @checked_keywords()
    def solution(self, number: int, *, progress: Progress | bool | None = None) -> Solution:
        """A member refined and verified, as `ocp.solve` does it.

        Parameters
        ----------
        number : int
            Of the member, from 0.
        progress : bool or callable, optional
            As of `ocp.solve`.

        Raises
        ------
        SolveFailed, Unverified, Interrupted
            As `ocp.solve`.
        """
        member = self.members[number]
        settings = replace(self.settings, refinement=KeptWhileGood(self.settings.refinement))
        parameters = member.iterate.parameters
        with shown(progress) as say:
            meshes = MeshSolver.of(
                self.form.problem,
                settings,
                parameters,
                say,
                evaluator=self.evaluator,
            )
            return solve_from(self.form, meshes, member.iterate, member.iterate.mesh)

    @checked_keywords()
    def solutions(self, *, progress: Progress | bool | None = None) -> tuple[Solution, ...]:
        """All members refined and verified; raises as `solution` does."""
        return tuple(self.solution(i, progress=progress) for i in range(len(self.members)))


@checked_keywords()
def family(
    problem: Problem,
    constant: Constant,
    values: Sequence[float],
    *,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    constants: Mapping[Constant, float] | None = None,
    progress: Progress | bool | None = None,
) -> Family:
    """Solve a problem for many neighbouring values of a constant.

    The first value is solved and refined. Every further one starts from the primal and dual
    variables of the one before, on few intervals whose breakpoints move, or on a mesh that stays if
    the settings say so. If this fails, or if an expression steps or changes for a short while at a
    time that no breakpoint marks, a member is refined on a mesh of its own: from the mesh of the
    one before, and from a fresh one if that fails too.

    Members are what their meshes give. `Family.solution` refines and verifies one of them,
    `Family.solutions` all.

    Parameters
    ----------
    problem : Problem
    constant : Constant
        The one that changes.
    values : sequence of numbers
        In an order in which neighbours are near each other [unit of the constant].
    settings : Settings, optional
        As of `ocp.solve`; their budget is that of each member.
    guess : Solution or Trajectory, optional
        As of `ocp.solve`, for the first value.
    constants : mapping of Constant to number, optional
        Values of other constants.
    progress : bool or callable, optional
        As of `ocp.solve`.

    Raises
    ------
    StatementError
        The statement contradicts itself, or there are no values.
    SolveFailed
        The first member was not found.
    FamilyStopped
        A later one was not, on a mesh of its own either; the error holds those before it.
    Interrupted
        The user stopped it.
    """
    places = [float(value) for value in values]
    if not places or not all(map(math.isfinite, places)):
        raise StatementError(
            f"the family in '{constant.name}' has the values {values!r}; give one number or more"
        )
    settings, others = settings or Settings(), dict(constants or {})
    unchecked = replace(settings, verify=False)
    first = _first_solution(problem, unchecked, guess, {**others, constant: places[0]}, progress)

    def family_of(members: Sequence[Member]) -> Family:
        known = first.form, settings, first.form_evaluator
        return Family(problem, constant, *known, tuple(members))

    with shown(progress) as say, errors_of_statement(first.form):
        walk = _Walk.of(first, constant, unchecked, others, say)
        members = [walk.first(first)]
        for value in places[1:]:
            try:
                members.append(walk.next(members[-1], value))
            except SolveFailed as error:
                raise _stopped(family_of(members), value, error) from error
            except KeyboardInterrupt as stop:
                raise walk.interrupted(value, members[-1].trajectory) from stop
    return family_of(members)


def _first_solution(
    problem: Problem,
    settings: Settings,
    guess: Solution | Trajectory | None,
    constants: Mapping[Constant, float],
    progress: Progress | bool | None,
) -> Solution:
    """The solution of the first member; digits are lost with its mesh, if that may change."""
    adapts, solver = settings.refinement.adapts, settings.solver
    return solve(
        problem,
        settings=replace(settings, solver=solver.loosened(LOOSE) if adapts else solver),
        guess=guess,
        constants=constants,
        progress=progress,
        partial=False,
    )


def _stopped(found: Family, value: float, error: SolveFailed) -> FamilyStopped:
    """The error of a family whose next member was not found."""
    constant, count = found.constant, len(found.members)
    return FamilyStopped(
        f"the family in '{constant.name}' stopped at {value:.6g} {constant.unit}: {error}; "
        f"error.family contains the {count} member{'s' * (count > 1)} found before",
        found,
        error.iterate,
    )


@dataclass(frozen=True, eq=False, repr=False)
class _Walk:
    """What all members have in common.

    Attributes
    ----------
    constant : Constant
        The one that changes.
    others : mapping of Constant to number
        Values of other constants.
    form : Form
        What is solved.
    base : MeshSolver
        At the first value.
    """

    constant: Constant
    others: Mapping[Constant, float]
    form: Form
    base: MeshSolver

    @classmethod
    def of(
        cls,
        first: Solution,
        constant: Constant,
        settings: Settings,
        others: Mapping[Constant, float],
        progress: Progress | None,
    ) -> _Walk:
        """A walk that begins at a solution."""
        form, evaluator = first.form, first.form_evaluator
        parameters = parameters_of(form.problem, first.trajectory.constants)
        base = MeshSolver.of(form.problem, settings, parameters, progress, evaluator=evaluator)
        return cls(constant, others, form, base)

    @property
    def breakpoints_move(self) -> bool:
        """Whether they do. They would pass over a jump of an expression, and gain by that."""
        return self.base.settings.refinement.adapts and not self.base.problem.discontinuities

    def first(self, solution: Solution) -> Member:
        """The first member, on the mesh that the others follow."""
        return self._followable(self.base, solution.kept_iterate, solution.iterations)

    def next(self, last: Member, value: float) -> Member:
        """The member after another one."""
        parameters = self.form.parameters({**self.others, self.constant: value})
        check_before_solve(self.base.problem, parameters)
        meshes = self.base.at(parameters)
        if self.base.settings.refinement.adapts and not self.breakpoints_move:
            return self._alone(meshes, last.trajectory, self._first_mesh())

        start, program, iterations = last.iterate, last.iterate.transcription, 0
        for _ in range(_RENEWALS):
            found = self._solved(meshes, program, start)
            if found is None:
                break
            iterations += found.iterations
            if found.alone or not self._held_back(found):
                if not found.alone and self._is_no_motion(found.iterate):
                    return self._alone(meshes, found.trajectory, self._first_mesh())
                return replace(found, iterations=iterations)
            # the limits of all widths are set again, from where the breakpoints are
            start = found.iterate
            mesh = moving_mesh(start, self.base.evaluator, _MERGED)
            program = meshes.first_program(start, mesh)
        return self._alone(meshes, last.trajectory, last.iterate.mesh)

    def _solved(self, meshes: MeshSolver, program: Transcription, start: Iterate) -> Member | None:
        """The member on a mesh, from a neighbour; None where there is none."""
        result = meshes.solve(program, start, meshes.settings.solver)
        motion = trajectory_of(program, result.x, meshes.parameters)
        if result.outcome == "interrupted":
            raise self.interrupted(self._value(meshes), motion)
        if result.outcome != "solved":
            return None

        iterate = iterate_of(program, result, motion)
        if not result.seems_least and may_be_saddle(meshes, program, StartingPoint.at(result)):
            # beyond a bifurcation a saddle may follow on a neighbour's minimum
            mesh_iterations = [record_of(program.mesh, result, None)]
            below = lower_motion(meshes, iterate, mesh_iterations)
            if below is not None:
                return self._alone(meshes, below, below.mesh, mesh_iterations)
            return self._member(meshes, iterate, iterations_of(mesh_iterations))
        return self._member(meshes, iterate, result.iterations)

    def _alone(
        self,
        meshes: MeshSolver,
        start: Iterate | Trajectory,
        mesh: Mesh,
        mesh_iterations: Sequence[MeshIteration] = (),
    ) -> Member:
        """A member refined on a mesh of its own, from a motion nearby as far as it leads."""
        found = refine(meshes, start, mesh, meshes.settings.accuracy, mesh_iterations)
        return self._followable(meshes, found.best.iterate, iterations_of(found.mesh_iterations))

    def _followable(self, meshes: MeshSolver, iterate: Iterate, iterations: int) -> Member:
        """A refined motion on few intervals that move, where these may move and that is found.

        It holds to the tolerances that were asked for.
        """
        settings = meshes.settings
        if self.breakpoints_move:
            moving = replace(meshes, settings=replace(settings, refinement=_MOVING))
            mesh = movable_mesh(iterate, meshes.evaluator, _MERGED)
            found = None
            with suppress(SolveFailed):
                found = refine(moving, iterate, mesh, settings.accuracy)
            if found is None or found.best.errors.dynamics > _NO_MOTION:
                found = refine(meshes, iterate, iterate.mesh, settings.accuracy)
            iterate, iterations = (
                found.best.iterate,
                iterations + iterations_of(found.mesh_iterations),
            )
        return replace(self._member(meshes, iterate, iterations), alone=True)

    def _member(self, meshes: MeshSolver, iterate: Iterate, iterations: int) -> Member:
        """The member of a motion on the mesh of its neighbour."""
        return Member(self._value(meshes), iterate.objective, iterations, False, iterate)

    def _value(self, meshes: MeshSolver) -> float:
        """Of the constant."""
        return meshes.parameters.values[self.constant.name]

    def _is_no_motion(self, iterate: Iterate) -> bool:
        """Whether the dynamics are far off between the points of a mesh that may change."""
        if not self.base.settings.refinement.adapts:
            return False
        evaluator, parameters = self.base.evaluator, iterate.parameters
        errors = MotionErrors(iterate.transcription, iterate.trajectory, evaluator, parameters)
        return errors.worst_dynamics > _NO_MOTION

    def _first_mesh(self) -> Mesh:
        """A mesh that knows nothing of a neighbour."""
        return first_mesh(self.base.problem, self.base.settings)

    def _held_back(self, member: Member) -> bool:
        """Whether breakpoints that all move would move further than their mesh lets them."""
        iterate = member.iterate
        free = all(len(phase.movable) == phase.intervals - 1 for phase in iterate.mesh.phases)
        if not (self.breakpoints_move and free):
            return False
        price = price_of_widths(iterate.transcription, iterate.row_multipliers)
        size = abs(iterate.objective) / iterate.scales.objective
        return price > self.base.settings.accuracy.objective * size

    def interrupted(self, value: float, motion: Trajectory) -> Interrupted:
        """The error of a walk that the user stopped on the way to a value."""
        name, unit = self.constant.name, self.constant.unit
        return Interrupted(
            f"the family of '{self.base.problem.name}' was stopped at '{name}' = {value:.6g} "
            f"{unit}",
            motion,
        )
