"""A front of the arm: the least of one quantity under each limit on another, torque drive.

Both ends are refined as a motion of `arm solve` is. A point between them starts from its neighbour,
on half the intervals and with twice the smoothness, which changes the least by a per cent at most,
and is aimed until the full model rests.

Symbols: L Lagrangian, w weight of the smoothness, S smoothness, T duration [s].
"""

from __future__ import annotations

import math
import time as clock
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from models.errors import ModelError
from ocp.analysis.sensitivity import slopes_by_multipliers
from ocp.arrays import Array
from studies.arm.config import TradeOffStudy, as_dictionary
from studies.arm.laws.unit_laws import baselines
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import RESIDUAL, StatedStage, problem
from studies.arm.optimal.phase import MARGIN
from studies.arm.optimal.refinement import aimed_at_rest, refine
from studies.arm.optimal.rounds import MISS, SAME
from studies.arm.optimal.solve import check_bending, check_caps, solve_again, solve_stage
from studies.arm.questions.baselines import replay_law
from studies.arm.replay.full_model import LockedMotion
from studies.arm.replay.loads import deflections
from studies.arm.report.quantities import Metric, table_rows
from studies.arm.search_limits import (
    FRONT_DURATIONS,
    FRONT_LAWS,
    FRONT_POINTS,
    JUST_ABOVE,
    LIGHTER,
    SHAPER,
)
from studies.arm.stage import ELBOW, Stage, TorqueCaps
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import provenance
from studies.common.result import Result
from studies.pareto.both_ways import Walked, both_ways
from studies.pareto.columns import FrontAxis, front_details, front_series, law_series
from studies.pareto.continuation import FrontPoint, NotFoundError, Way
from studies.pareto.verdict import front_checks, front_verdict
from studies.pareto.words import dominated_law, front_in_words

AXES = {
    "time": FrontAxis("time", "duration", "s"),
    "peak-torque": FrontAxis("peak-torque", "peak torque", "N m"),
    "deflection": FrontAxis("deflection", "peak deflection", "m"),
}
LAWS = ("Step5", "Bezier")
# in fixed units smoothness falls as T^-7, torque and deflection as T^-2; of a weight that is kept
# in the units of each duration, the one in fixed units grows as T^5
_WEIGHT_GROWS = 5.0


@dataclass(frozen=True, eq=False)
class ArmPoint:
    """What is kept of a point.

    Attributes
    ----------
    motion : as it was solved, from which neighbours start.
    replay : on the full model, with the torque that was added to it.
    aim : (2 n,), where a neighbour's is begun.
    """

    motion: OptimalMotion
    replay: LockedMotion
    aim: Array


class ArmFront:
    """A study's motions as points of a front; a `continuation.Subject`."""

    def __init__(self, study: TradeOffStudy, console: Console) -> None:
        self.study, self.console = study, console
        self.limited, self.least = study.limited, study.least
        self.residual = study.residual_energy or RESIDUAL
        self.lightest = math.inf  # weight of the smoothness that either end needs, once known

    def ends(self) -> tuple[FrontPoint, FrontPoint]:
        """Points at the lowest and at the highest limit.

        Raises
        ------
        StudyError
            If there is none, or nothing to trade between them.
        """
        low, high = self.study.range or self.limits()
        for limit in (low, high):
            stage, caps = self._at(limit)
            check_bending(stage)
            check_caps(stage, caps)
        try:
            left, right = self._end(low, "up"), self._end(high, "down")
        except NotFoundError as error:
            raise StudyError(
                f"no motion was found at an end of the front, between {low:.6g} and {high:.6g} "
                f"{AXES[self.limited].unit}: {error}; state another range",
                ExitCode.NOT_SOLVED,
            ) from error
        self.lightest = min(end.motion.motion.weight for end in (left, right))
        if left.y <= (1.0 + SAME) * right.y:
            raise StudyError(
                f"there is nothing to trade: {AXES[self.least].title} is {left.y:.4g} "
                f"{AXES[self.least].unit} at {low:.5g} {AXES[self.limited].unit} and {right.y:.4g} "
                f"at {high:.5g}, and a point is known to {SAME:.0%}; state another range"
            )
        return left, right

    def limits(self) -> tuple[float, float]:
        """Limits where nothing is stated: what a designer would look at first."""
        stage = self.study.slew
        if self.limited == "time":
            shortest, longest = FRONT_DURATIONS
            return shortest * stage.duration, longest * stage.duration

        # from little more than the least torque to that of the least of the other
        least, highest = (self._torque_of_the_least(name) for name in ("peak-torque", self.least))
        if highest <= JUST_ABOVE * least:
            raise StudyError(
                f"there is nothing to trade: the least {AXES[self.least].title} comes with "
                f"{highest:.5g} N m, and {least:.5g} N m is the least peak torque"
            )
        return JUST_ABOVE * least, highest

    def _torque_of_the_least(self, name: str) -> float:
        """Peak torque of the motion that is best in a quantity [N m]."""
        title = AXES[name].title
        self.console.progress(f"an end of the front: the least {title}")
        try:
            motion = self._refined(self.study.slew, TorqueCaps(), name)
        except NotFoundError as error:
            raise StudyError(
                f"the least {title} was not found: {error}; state a range", ExitCode.NOT_SOLVED
            ) from error
        return float(motion.peak_torque.max())

    def _at(self, limit: float) -> tuple[Stage, TorqueCaps]:
        """The stage and the caps under a limit."""
        stage = self.study.slew
        if self.limited == "time":
            return stage.lasting(limit), TorqueCaps()
        return stage, TorqueCaps(torque=(limit, limit))

    def _end(self, limit: float, way: Way) -> FrontPoint:
        """The point at an end: refined, and solved again on the mesh of its neighbours."""
        axis = AXES[self.limited]
        self.console.progress(f"an end of the front: {axis.title} {limit:.5g} {axis.unit}")
        return self._cold(limit, way)

    def _cold(self, limit: float, way: Way, *, afresh: bool = False) -> FrontPoint:
        """A point from a rigid arm's motion."""
        begin = clock.perf_counter()
        motion = self._refined(*self._at(limit), self.least)
        at_rest = np.zeros(2 * motion.stage.model.size)
        return self._point(limit, motion, at_rest, way, begin, coarser=True, afresh=afresh)

    def _refined(self, stage: Stage, caps: TorqueCaps, least: str) -> OptimalMotion:
        """The motion that `arm solve` would give."""
        try:
            motion = solve_stage(stage, caps=caps, objective=least, progress=self.console.live)
            found = refine(
                motion,
                residual=self.residual,
                say=self.console.progress,
                live=self.console.live,
            )
        except (StudyError, ModelError) as error:
            raise NotFoundError(str(error)) from error
        if not found.resolved:
            raise NotFoundError(
                f"the full model is left with {found.replay.residual_energy:.2e} J, "
                f"{self.residual:g} J are allowed"
                if not found.still
                else "less smoothness and a finer mesh still gain more than a per cent"
            )
        return found.motion

    def near(self, limit: float, before: FrontPoint, way: Way) -> FrontPoint:
        """The point at a limit, from the motion of a neighbour and its aim."""
        kept: ArmPoint = before.motion
        return self._point(limit, kept.motion, kept.aim, way, clock.perf_counter())

    def afresh(self, limit: float, before: FrontPoint, way: Way) -> FrontPoint:
        """The same, refined from a rigid arm's motion."""
        del before
        return self._cold(limit, way, afresh=True)

    def _point(
        self,
        limit: float,
        start: OptimalMotion,
        aim: Array,
        way: Way,
        begin: float,
        *,
        coarser: bool = False,
        afresh: bool = False,
    ) -> FrontPoint:
        """The point at a limit from a motion; `coarser` undoes the last halving of its mesh."""
        halves = 2 if coarser else 1
        stated = problem(*self._at(limit), self.least)
        weight, intervals = halves * start.weight, start.intervals // halves
        kept, torque = self._still(start, stated, weight, intervals, aim)
        # an end that needed more smoothness than the other one hands it on to its neighbours
        lighter = max(self.lightest, weight / LIGHTER[ELBOW in kept.motion.stage.moving])
        if lighter < weight:
            with suppress(NotFoundError):
                kept, torque = self._still(kept.motion, stated, lighter, intervals, kept.aim)

        motion, replayed = kept.motion, kept.replay
        values = {
            "time": motion.stage.duration,
            # a torque that leaks between the points of its mesh is a point with a little more of it
            "peak-torque": torque,
            "deflection": _deflection(replayed),
        }
        x, y = values[self.limited], values[self.least]
        seconds = clock.perf_counter() - begin
        self.console.progress(
            f"{AXES[self.limited].title} {x:.5g} {AXES[self.limited].unit}: "
            f"{AXES[self.least].title} {y:.5g} {AXES[self.least].unit}, left with "
            f"{replayed.residual_energy:.1e} J, {seconds:.1f} s"
        )
        return FrontPoint(limit, x, y, self._slope(motion), way, afresh, seconds, kept)

    def _still(
        self, start: OptimalMotion, stated: StatedStage, weight: float, intervals: int, aim: Array
    ) -> tuple[ArmPoint, float]:
        """The motion of a problem that leaves the full model still, and its peak torque [N m]."""
        try:
            motion = solve_again(
                start,
                weight=weight,
                aim=aim,
                intervals=intervals,
                stated=stated,
                progress=self.console.live,
            )
            found, next_aim = aimed_at_rest(
                motion, aim, residual=self.residual, live=self.console.live
            )
        except (StudyError, ModelError) as error:
            raise NotFoundError(str(error)) from error
        replayed = found.replay
        if not found.still or replayed.miss > MISS:
            raise NotFoundError(
                f"the full model is left with {replayed.residual_energy:.2e} J and "
                f"{replayed.miss:.1e} rad beside its angle"
            )
        return ArmPoint(motion, replayed, next_aim), float(found.motion.peak_torque.max())

    def unit_of(self, motion: OptimalMotion) -> float:
        """What one of the objective as it was solved is in the unit of what is least."""
        stated = motion.stated
        if self.least == "peak-torque":
            return 4.0 * float(stated.stage.torque_units[stated.stage.moving[0]])
        return max(float(q.scale or 1.0) for q in stated.arm.q if q.name.startswith("delta"))

    def _slope(self, motion: OptimalMotion) -> float:
        """Slope dy/dlimit by the multipliers, without the smoothness's share."""
        slopes, stage = slopes_by_multipliers(motion.solution), motion.stage
        if self.limited == "time":
            slope = slopes[f"{motion.arm.phase.name}: end"]
            weighted = motion.smoothness_share * motion.solution.objective  # w S
            slope += _WEIGHT_GROWS * weighted / stage.duration
        else:
            caps = [state.name for state in motion.arm.torque.values()]
            by_cap = [slopes[f"{name} upper"] - slopes[f"{name} lower"] for name in caps]
            slope = sum(by_cap) * (1.0 - MARGIN)
        return float(slope * (1.0 - motion.smoothness_share) * self.unit_of(motion))


def front(study: TradeOffStudy, console: Console) -> Result:
    """The front of two quantities of the arm.

    Raises
    ------
    StudyError
        If an end of the front has no motion.
    """
    subject = ArmFront(study, console)
    left, right = subject.ends()
    count = study.points or FRONT_POINTS
    walked = both_ways(subject, left, right, count, console.progress)
    return result_of(subject, walked, laws_beside(subject))


@dataclass(frozen=True)
class Law:
    """A law in one duration: where it is beside the front, and what it leaves [J]."""

    name: str
    duration: float
    place: tuple[float, float]
    residual: float


def laws_beside(subject: ArmFront) -> list[Law]:
    """The paper's laws on the full model, in several durations if the duration is traded."""
    stage, found = subject.study.slew, []
    durations = [stage.duration]
    if subject.limited == "time":
        low, high = subject.study.range or subject.limits()
        durations = np.linspace(low, high, FRONT_LAWS).tolist()
    for duration in durations:
        at = stage.lasting(duration)
        unit_laws = {law.name: law for law in baselines(duration, SHAPER / duration)}
        for name in LAWS:
            subject.console.live(f"{name} in {duration:.4g} s")
            replayed = replay_law(at, unit_laws[name], "torque", follow=False)
            values = {
                "time": duration,
                "peak-torque": _torque(replayed),
                "deflection": _deflection(replayed),
            }
            place = values[subject.limited], values[subject.least]
            found.append(Law(name, duration, place, replayed.residual_energy))
    return found


def result_of(subject: ArmFront, walked: Walked, laws: list[Law]) -> Result:
    """The result of a front, with the paper's laws beside it."""
    study, found, stopped = subject.study, walked.front, walked.stopped
    x, y = axes = AXES[subject.limited], AXES[subject.least]
    bounds, bound = _bounds(subject, found.points)
    chosen = found.points[len(found.points) // 2 if found.knee is None else found.knee]
    middle = "middle" if found.knee is None else "knee"
    ends = (f"least {x.title}", found.points[0]), (f"least {y.title}", found.points[-1])
    shown = {name: _metrics(point) for name, point in ((middle, chosen), *ends)}

    # beside the knee: the laws in the nearest of the durations that were looked at
    nearest = min(laws, key=lambda law: abs(law.duration - chosen.x)).duration
    beside = [law for law in laws if law.duration == nearest or subject.limited != "time"]
    alone = "in the time of the point" if subject.limited == "time" else "under the point's torque"
    return Result(
        kind="pareto-arm",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={
            **front_series(found, bounds, *axes),
            **law_series(
                {name: [law.place for law in laws if law.name == name] for name in LAWS}, *axes
            ),
        },
        table=table_rows(shown),
        verdict=front_verdict(found, stopped),
        checks=front_checks(found, y.title, np.full(len(found.points), np.nan)),
        remarks=(
            *front_in_words(found, *axes),
            *(
                dominated_law(found, law.name, law.place, axes)
                + f" It leaves {law.residual:.2g} J, and a point of the front {subject.residual:g} "
                "J at most."
                for law in beside
            ),
            *walked.remarks,
            "Each point was replayed on the full ANCF model. Both ends were refined until another "
            "halving of smoothness and mesh gained 1 % at most. The points have half that mesh. "
            "They have twice the smoothness of the end that needs less of it, where that leaves "
            "them still.",
            f"For the profile of a point, solve it alone {alone}: antenna-ocp arm solve.",
        ),
        details={
            **front_details(found, *axes, bound),
            "stage": {
                "duration": study.slew.duration,
                "start": study.slew.start,
                "end": study.slew.end,
            },
        },
        provenance=provenance(),
        interrupted=stopped,
    )


def _bounds(subject: ArmFront, points: tuple[FrontPoint, ...]) -> tuple[Array, str]:
    """What a rigid arm needs at least at each point, and the words for it."""
    if (subject.limited, subject.least) != ("time", "peak-torque"):
        return np.full(len(points), np.nan), ""
    stage = subject.study.slew
    turn = float(stage.inertia_turns[stage.moving[0]])
    return np.array([4.0 * turn / point.x**2 for point in points]), "least of a rigid arm"


def _metrics(point: FrontPoint) -> list[Metric]:
    """A point's quantities for the table."""
    kept: ArmPoint = point.motion
    motion, replayed = kept.motion, kept.replay
    share = 100 * motion.smoothness_share
    return [
        Metric("time", "duration", "s", motion.stage.duration),
        Metric("peak_torque", "peak torque", "N m", _torque(replayed)),
        Metric("deflection", "peak deflection", "m", _deflection(replayed)),
        Metric("residual_energy", "residual energy", "J", replayed.residual_energy),
        Metric("angle_miss", "angle miss at the lock", "rad", replayed.miss),
        Metric("smoothness_share", "share of smoothness in what was minimised", "%", share),
    ]


def _torque(replayed: LockedMotion) -> float:
    """Largest torque of the joint that turns, and not of the lock of the other [N m]."""
    return float(replayed.peak_torque[replayed.motion.stage.moving[0]])


def _deflection(replayed: LockedMotion) -> float:
    """Largest deflection of either link [m]."""
    return float(deflections(replayed).max())
