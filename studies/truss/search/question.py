"""What is asked of a search for the best motion, and what all its steps need."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, field
from functools import cached_property

from models.laws import Law
from ocp import Accuracy, Problem, Settings, Solution
from studies.common.console import Console
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.truss.checks import objective_sizes
from studies.truss.config import TrussStudy
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import deployment_of, law_of
from studies.truss.motions.starts import (
    PHASE_PLANE,
    StartingMotion,
    start_from_phase_plane,
    starting_motion,
)
from studies.truss.problem import needs_forces, settings_of, state
from studies.truss.quantities import OBJECTIVES
from studies.truss.search.from_starts import Statements
from studies.truss.search.proofs import PhasePlanes
from studies.truss.search.smoothness import first_price

SAME_BASIN = 1e-4  # relative: optima closer than this are one basin, solved to different meshes
SAME_WITH_ARM = 1e-3  # the same with an arm, whose optima are known to 5e-4
LEAST_LEFT = 0.1  # of the seconds, for what has to follow the starts


@dataclass(frozen=True, eq=False)
class Question:
    """A study whose best motion is asked for.

    Attributes
    ----------
    study : TrussStudy
    console : Console
        Where lines of progress go.
    checked : PhasePlanes, optional
        Of the study, with what was worked out before.
    neighbour : law, optional
        Motion of a like study, from which the first start begins.
    enough : float, optional
        A value of the first objective that ends the search. Then about the least value is all that
        is asked: without bounds, and at the first price of the roughness.
    accuracy : Accuracy, optional
        Of the motions; that of a result by default.
    rope_pulls : bool
        Whether the rope force is part of the problem even where objective and caps leave it out.
    confirms : bool
        Whether the motion is solved a second time, in another way, because it will be printed.
    kept : FinishedSteps
        Where finished steps go to, and come from.
    begin : float
        When the search began, by the monotonic clock [s].
    statements : Statements
        Of all problems that have been stated.
    """

    study: TrussStudy
    console: Console
    checked: PhasePlanes | None = None
    neighbour: Law | None = None
    enough: float | None = None
    accuracy: Accuracy | None = None
    rope_pulls: bool = False
    confirms: bool = False
    kept: FinishedSteps = NOTHING_KEPT
    begin: float = field(default_factory=clock.monotonic)
    statements: Statements = field(default_factory=Statements)

    @cached_property
    def planes(self) -> PhasePlanes:
        """The phase planes of the study."""
        return self.checked or PhasePlanes(self.study, self.console.progress)

    @cached_property
    def with_forces(self) -> bool:
        """Whether the rope force is part of the problem."""
        return self.rope_pulls or needs_forces(self.study)

    @property
    def same(self) -> float:
        """Relative distance of two optima within which they are one."""
        return SAME_BASIN if self.study.arm is None else SAME_WITH_ARM

    @property
    def left(self) -> float:
        """What is left of the seconds that the search may take, negative when they are over."""
        return self.study.solver.seconds - (clock.monotonic() - self.begin)

    def some_left(self) -> float:
        """The same, and a little where nothing is left."""
        return max(self.left, LEAST_LEFT * self.study.solver.seconds)

    @property
    def kind(self) -> str:
        """Name of the problem in files of finished starts."""
        return "forces" if self.with_forces else "motion"

    @cached_property
    def settings(self) -> Settings:
        """How the engine solves."""
        return settings_of(self.study, self.with_forces, self.accuracy)

    @cached_property
    def weights(self) -> dict[str, float]:
        """References by which to divide; single objectives keep their own units."""
        single = all(len(stage) == 1 for stage in self.study.minimise)
        return dict.fromkeys(OBJECTIVES, 1.0) if single else objective_sizes(self.study)

    def problem_from(self, start: StartingMotion) -> Problem:
        """The problem as it is stated for a motion to start from."""
        price = first_price(self.study, 0, self.weights, self.with_forces)
        statement = state(self.study, start, self.weights, self.with_forces, price)
        return self.statements.noted(statement.problem(), statement)

    def problem_from_start(self, name: str) -> Problem:
        """The same for one of the study's starts."""
        if name == PHASE_PLANE:
            motion = self.planes.least_force().motion
            return self.problem_from(start_from_phase_plane(motion, self.study))
        return self.problem_from(starting_motion(name, self.study))

    def deployment(self, solution: Solution, stated: Problem | None = None) -> Deployment:
        """The motion of a solution.

        Parameters
        ----------
        stated : Problem, optional
            The one that the solution's own problem was made from, if that is another one.
        """
        statement = self.statements.of[solution.problem if stated is None else stated]
        return deployment_of("optimal", law_of(self.study, statement, solution), self.study)
