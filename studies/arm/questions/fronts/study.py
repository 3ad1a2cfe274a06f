"""Two quantities of the arm against each other, from the study to the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ocp import FrontPoint, ParetoFront
from ocp.arrays import Array
from studies.arm.config import as_dictionary
from studies.arm.questions.fronts.laws import TimedLaw, laws_in, places_of
from studies.arm.questions.fronts.motions import motion_details, motion_series
from studies.arm.questions.fronts.point import AXES, ArmPoint
from studies.arm.questions.fronts.subject import ArmFront
from studies.arm.report.quantities import Metric, table_rows
from studies.arm.search_limits import FRONT_LAWS, FRONT_POINTS
from studies.arm.trade_off import RESIDUAL_ENERGY, TradeOffStudy
from studies.common.console import Console
from studies.common.finished import FinishedSteps
from studies.common.result import Result
from studies.common.stops import kept_anyway
from studies.fronts.found import front_found
from studies.fronts.result import PROVEN, front_result, named_points
from studies.fronts.words import dominated_law


def front(study: TradeOffStudy, console: Console, kept: FinishedSteps) -> Result:
    """The front of two quantities of the arm.

    Raises
    ------
    StudyError
        If an end of the front has no motion, or the user stopped before there was a point.
    """
    subject = ArmFront(study, console, kept)
    found = walked_front(subject)

    def result(whole: bool) -> Result:
        return result_of(subject, found, laws_beside(study, found, console, whole))

    return kept_anyway(result, found.interrupted)


def walked_front(subject: ArmFront) -> ParetoFront:
    """The front between its ends; the ends alone where nothing is traded between them."""
    study = subject.study
    found = front_found(subject, study.points or FRONT_POINTS, coarse=study.coarse)
    return replace(found, remarks=(*subject.remarks, *found.remarks))


def laws_beside(
    study: TradeOffStudy, found: ParetoFront, console: Console, whole: bool
) -> list[TimedLaw]:
    """The paper's laws in the durations along a front of it, or in the stage's.

    Parameters
    ----------
    whole : whether all of these durations are asked for, and else the middle one.
    """
    durations: Sequence[float] = [study.slew.duration]
    if study.limited == "time":
        durations = np.linspace(found.points[0].x, found.points[-1].x, FRONT_LAWS).tolist()
    middle = len(durations) // 2
    return laws_in(study.slew, durations if whole else durations[middle : middle + 1], console)


def result_of(subject: ArmFront, found: ParetoFront, laws: Sequence[TimedLaw]) -> Result:
    """The result of a front, with the paper's laws beside it."""
    study, stage = subject.study, subject.study.slew
    bounds, bound = _bounds(subject, found.points)
    shown = {name: _metrics(point) for name, point in named_points(found, subject.axes).items()}

    return front_result(
        found,
        subject.axes,
        kind="pareto-arm",
        question=study.question,
        configuration=as_dictionary(study),
        bounds=bounds,
        bound=bound,
        laws=places_of(laws, study.objectives, study.still),
        motions=motion_series(found.points),
        table=table_rows(shown),
        also_found=tuple(shown)[1:],
        remarks=(
            *(
                dominated_law(
                    found, law.name, law.place(study.objectives, study.still), subject.axes
                )
                + _left_words(study, law)
                for law in _nearest(laws, found.middle.motion)
            ),
            *_how_it_was_found(study, found.points),
        ),
        details={
            "known": subject.known,
            "solves": subject.nearby.count,
            "profiles": motion_details(found.points),
            "stage": {"duration": stage.duration, "start": stage.start, "end": stage.end},
        },
    )


def _nearest(laws: Sequence[TimedLaw], chosen: ArmPoint) -> list[TimedLaw]:
    """The laws in the duration that is nearest to a point's, of those that were looked at."""
    duration = chosen.values["time"]
    nearest = min((law.values["time"] for law in laws), key=lambda one: abs(one - duration))
    return [law for law in laws if law.values["time"] == nearest]


def _left_words(study: TradeOffStudy, law: TimedLaw) -> str:
    """What a law leaves, where that is none of the axes."""
    return "" if RESIDUAL_ENERGY in study.objectives else f" {law.left(study.still)}"


def _how_it_was_found(study: TradeOffStudy, points: Sequence[FrontPoint]) -> tuple[str, ...]:
    """How sure the points are, and where a profile comes from."""
    shares = [100 * point.motion.motion.smoothness_share for point in points]
    how = (
        "Each point was replayed on the full ANCF model. The motions at the ends were refined "
        "until another halving of the smoothness weight and of the intervals improved them by at "
        "most 1 %. The other points have intervals twice as long. Their smoothness weight is twice "
        "the smaller of those at the ends, or ten times it if the residual energy is too large "
        f"otherwise. The smoothness term is {min(shares):.2g} to {max(shares):.2g} % of the "
        "minimised sum."
    )
    if RESIDUAL_ENERGY not in study.objectives:
        return (how,)
    return (
        how,
        f"Up to {study.still:g} J the arm counts as at rest, so the limits begin there. The "
        "residual energy is kinetic and elastic, and includes that of a joint that still turns "
        "when it locks.",
    )


def _bounds(subject: ArmFront, points: Sequence[FrontPoint]) -> tuple[Array, str]:
    """What a rigid arm needs at least at each point, and the words for it."""
    if (subject.limited, subject.least) != ("time", "peak-torque"):
        return np.full(len(points), np.nan), PROVEN
    stage = subject.study.slew
    turn = float(stage.inertia_turns[stage.moving[0]])
    # it proves nothing of an arm whose links bend
    return np.array([4.0 * turn / point.x**2 for point in points]), "minimum of a rigid arm"


def _metrics(point: FrontPoint) -> list[Metric]:
    """A point's quantities for the table."""
    kept: ArmPoint = point.motion
    share = 100 * kept.motion.smoothness_share
    return [
        *(
            Metric(axis.key.replace("-", "_"), axis.title, axis.unit, kept.values[axis.key])
            for axis in AXES.values()
        ),
        Metric("angle_miss", "angle miss at the lock", "rad", kept.replay.miss),
        Metric("smoothness_share", "share of smoothness in the minimised sum", "%", share),
    ]
