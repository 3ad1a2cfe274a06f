"""What a front of the truss trades: one study for each limit, and its problem with the limit."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from models.laws import Law
from ocp import Constant, Problem, Solution
from studies.common.exit_codes import StudyError
from studies.pareto.config import limited
from studies.truss.checks import criteria, judged
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.caps import cap_on
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import deployment_of, law_of
from studies.truss.motions.starts import start_from_law
from studies.truss.problem import Statement, state
from studies.truss.quantities import OBJECTIVES, QUANTITIES
from studies.truss.search.smoothness import first_price

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import LeastForce

# The smoothness of a front's motions is cheaper than that of a single optimum: where a cap presses
# a motion is rougher, and pays more of the same price.
PRICE = 0.1

LONGER = 1.01  # than the longest duration that is asked for, which a program leaves as room


@dataclass(frozen=True, eq=False)
class FrontProgram:
    """One statement for all limits of a walk."""

    statement: Statement
    problem: Problem
    limit: Constant


@dataclass(frozen=True, eq=False)
class Traded:
    """A study of the truss of which one objective is limited and another one is least.

    Attributes
    ----------
    truss : TrussStudy
        It minimises `least`.
    limited, least : str
        Keys of quantities.
    """

    truss: TrussStudy
    limited: str
    least: str

    @property
    def objectives(self) -> tuple[str, ...]:
        """Those of the two that a study can minimise."""
        return tuple(name for name in (self.limited, self.least) if name in OBJECTIVES)

    def minimising(self, name: str) -> TrussStudy:
        """The study with an objective of its own, and no limit."""
        return replace(self.truss, minimise=name)

    def at(self, limit: float) -> TrussStudy:
        """The study with a limit."""
        return limited(self.truss, self.limited, limit)

    @property
    def cap(self) -> float | None:
        """The most that the study itself allows of what is limited; None for no limit."""
        if self.limited == "time":
            return float(self.truss.duration[1])
        return cap_on(self.truss.caps, self.truss.drive, self.limited)

    def value(self, law: Law) -> float:
        """What is limited, of a law."""
        return self.deployment(law).values[self.limited]

    def deployment(self, law: Law) -> Deployment:
        """The motion of a law."""
        return deployment_of("front", law, self.truss)

    def program(self, law: Law, highest: float) -> FrontProgram:
        """The problem of a walk, with a motion to start from and its highest limit."""
        study, single = self.stated(highest), dict.fromkeys(OBJECTIVES, 1.0)
        limit = Constant("limit", QUANTITIES[self.limited].unit, highest)
        price = PRICE * first_price(study, 0, single, True)
        start = start_from_law("end of the front", law, study)
        # the rope's pull matters everywhere but in some slow motions: there it costs a few rows
        statement = state(study, start, single, True, price, limits={self.limited: limit})
        return FrontProgram(statement, statement.problem(), limit)

    def stated(self, highest: float) -> TrussStudy:
        """The study that a program states, with its highest limit.

        The longest duration lies above the highest limit on it: where both met in one number,
        neither would have a price of its own.
        """
        study = self.at(highest)
        if self.limited == "time":
            return replace(study, duration=(study.duration[0], LONGER * study.duration[1]))
        return study

    def held(
        self, program: FrontProgram, limit: float, solution: Solution
    ) -> tuple[Deployment, list[str]]:
        """The motion of a solution, and the checks that it fails."""
        study = self.at(limit)
        law = law_of(study, program.statement, solution)
        asked = judged(study) | {self.limited, self.least}
        deployment = replace(self.deployment(law), only=asked)
        # the limit is what was found: it is measured, not estimated
        measured = self.at(max(limit, deployment.values[self.limited]))
        held = criteria(measured, deployment)
        return deployment, [check.sentence for check in held if not check.passed]

    def bound(self, x: float) -> float | None:
        """What no motion with at most an x is below, in the objective that is least."""
        study = self.at(x)
        force = None
        if self.least in ("peak-force", "peak-motor-torque", "peak-factored-force"):
            force = self._least_force(x)
        return lower_bounds(study, force).get(self.least)

    def _least_force(self, x: float) -> LeastForce | None:
        """The phase-plane bound of the force; None where there is none."""
        duration = x if self.limited == "time" else self.truss.duration[1]
        try:
            return self._plane(duration)
        except StudyError:
            return None

    @functools.cached_property
    def _plane(self) -> Callable[[float], LeastForce]:
        """The phase plane of the truss, which all points share, and what it has found."""
        from studies.truss.motions.phase_plane import PhasePlane

        plane = PhasePlane(self.truss.truss, opening=self.truss.opening)
        return functools.cache(plane.least_force)
