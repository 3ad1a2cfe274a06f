"""Two or three quantities of the arm against each other, from the study to the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ocp.analysis.front.both_ways import Walked, both_ways
from ocp.analysis.front.continuation import FrontPoint
from ocp.arrays import Array
from studies.arm.config import as_dictionary
from studies.arm.optimal.rounds import SAME
from studies.arm.questions.fronts.laws import TimedLaw, laws_in, places_of
from studies.arm.questions.fronts.motions import motion_details, motion_series
from studies.arm.questions.fronts.point import AXES, ArmPoint
from studies.arm.questions.fronts.subject import ArmFront
from studies.arm.questions.fronts.surface import ArmSurface, ends_alone
from studies.arm.report.quantities import Metric, table_rows
from studies.arm.search_limits import FRONT_COARSE_POINTS, FRONT_LAWS, FRONT_POINTS
from studies.arm.stage import Stage
from studies.arm.trade_off import RESIDUAL_ENERGY, TradeOffStudy
from studies.common.console import Console
from studies.common.folder import provenance
from studies.common.result import Result
from studies.common.stops import kept
from studies.pareto.columns import front_details, front_series, law_series
from studies.pareto.surface.columns import surface_details, surface_law_series, surface_series
from studies.pareto.surface.shape import middle_of, named_points
from studies.pareto.surface.walk import Stack, SurfaceWalk
from studies.pareto.surface.words import (
    SurfaceAxes,
    dominated_in_words,
    surface_in_words,
    surface_verdict,
)
from studies.pareto.verdict import checks_of_points, front_verdict
from studies.pareto.words import dominated_law, front_in_words, nothing_to_trade


def front(study: TradeOffStudy, console: Console) -> Result:
    """The front of two quantities of the arm, or the surface of three.

    Raises
    ------
    StudyError
        If an end of the front, or all slices of the surface, have no motion.
    """
    if study.sliced is not None:
        stack = SurfaceWalk(ArmSurface(study, console), console).run()

        def surface(whole: bool) -> Result:
            laws = laws_beside(study, stack.surface.limits, console, whole)
            return surface_result(study, stack, laws)

        return kept(surface, stack.stopped)

    subject = ArmFront(study, console)
    walked = walked_front(subject)

    def of_two(whole: bool) -> Result:
        laws = laws_beside(study, _span(walked), console, whole)
        return front_result(subject, walked, laws)

    return kept(of_two, walked.stopped)


def walked_front(subject: ArmFront) -> Walked:
    """The front between its ends; the ends alone where nothing is traded between them."""
    left, right = subject.ends()
    axes = AXES[subject.limited], AXES[subject.least]
    alike = nothing_to_trade(left, right, axes, SAME)
    if alike is not None:
        return ends_alone(left, right, alike)
    study = subject.study
    count = study.points or FRONT_POINTS
    if study.coarse:
        count = min(count, FRONT_COARSE_POINTS)
    walked = both_ways(subject, left, right, count, subject.console.progress)
    return replace(walked, remarks=(*subject.remarks, *walked.remarks))


def _span(walked: Walked) -> tuple[float, float]:
    """The least and the highest value of what is limited."""
    points = walked.front.points
    return points[0].x, points[-1].x


def laws_beside(
    study: TradeOffStudy, limits: Sequence[float], console: Console, whole: bool
) -> list[TimedLaw]:
    """The paper's laws in the durations of slices, along a front of it, or in the stage's.

    Parameters
    ----------
    limits : of the slices, or the ends of a front.
    whole : whether all of these durations are asked for, and else the middle one.
    """
    durations: Sequence[float] = [study.slew.duration]
    if study.sliced == "time":
        durations = limits
    elif study.limited == "time":
        durations = np.linspace(limits[0], limits[-1], FRONT_LAWS).tolist()
    middle = len(durations) // 2
    return laws_in(study.slew, durations if whole else durations[middle : middle + 1], console)


def front_result(subject: ArmFront, walked: Walked, laws: Sequence[TimedLaw]) -> Result:
    """The result of a front, with the paper's laws beside it."""
    study, found = subject.study, walked.front
    x, y = axes = AXES[subject.limited], AXES[subject.least]
    bounds, bound = _bounds(subject, found.points)
    chosen = found.points[len(found.points) // 2 if found.knee is None else found.knee]
    middle = "middle" if found.knee is None else "knee"
    ends = (f"least {x.title}", found.points[0]), (f"least {y.title}", found.points[-1])
    shown = {name: _metrics(point) for name, point in ((middle, chosen), *ends)}

    return Result(
        kind="pareto-arm",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={
            **front_series(found, bounds, *axes),
            **law_series(places_of(laws, study.objectives, study.still), *axes),
            **motion_series(found.points),
        },
        table=table_rows(shown),
        also_found=tuple(name for name, _ in ends),
        verdict=front_verdict(found, walked.stopped),
        # a bound of a rigid arm proves nothing of one whose links bend
        checks=checks_of_points(
            "front", [p.y for p in found.points], y.title, np.full(len(found.points), np.nan)
        ),
        remarks=(
            *walked.remarks,
            *front_in_words(found, *axes),
            *(
                dominated_law(found, law.name, law.place(study.objectives, study.still), axes)
                + _left_words(study, law)
                for law in _nearest(study, laws, chosen.motion)
            ),
            *_how_it_was_found(study, found.points),
        ),
        details={
            **front_details(found, *axes, bound),
            "known": SAME,
            "solves": subject.solves,
            "profiles": motion_details(found.points),
            "stage": _stage_details(study.slew),
        },
        provenance=provenance(),
    )


def surface_result(study: TradeOffStudy, stack: Stack, laws: Sequence[TimedLaw]) -> Result:
    """The result of a surface, with the paper's laws beside it."""
    surface, chosen = stack.surface, middle_of(stack.surface)
    axes = SurfaceAxes(*(AXES[name] for name in study.objectives))
    named = named_points(surface, chosen, study.objectives)
    points = [point.point for point in surface.points]
    nothing = np.full(len(points), np.nan)

    return Result(
        kind="pareto-arm",
        question=study.question,
        configuration=as_dictionary(study),
        arrays={
            **surface_series(surface, nothing, axes),
            **surface_law_series(places_of(laws, study.objectives, study.still), axes),
            **motion_series(points),
        },
        table=table_rows({name: _metrics(point.point) for name, point in named.items()}),
        also_found=tuple(named)[1:],
        verdict=surface_verdict(stack),
        checks=checks_of_points("surface", [p.y for p in points], axes.y.title, nothing),
        remarks=(
            *surface_in_words(stack, axes),
            *(
                dominated_in_words(
                    surface, law.name, law.place(study.objectives, study.still), axes
                )
                + _left_words(study, law)
                for law in _nearest(study, laws, chosen.point.motion)
            ),
            *stack.remarks,
            *_how_it_was_found(study, points),
        ),
        details={
            **surface_details(stack, axes, ""),
            "solves": sum(one.subject.solves for one in stack.slices),
            "profiles": motion_details(points),
            "stage": _stage_details(study.slew),
        },
        provenance=provenance(),
    )


def _nearest(study: TradeOffStudy, laws: Sequence[TimedLaw], chosen: ArmPoint) -> list[TimedLaw]:
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
        "Each point was replayed on the full ANCF model. A motion from which points start was "
        "refined until another halving of smoothness and mesh gained 1 % at most. The points have "
        "half that mesh. They have twice the smoothness of the end that needs less of it, where "
        "that leaves them still, else ten times as much: of what was minimised it is "
        f"{min(shares):.2g} to {max(shares):.2g} %."
    )
    if RESIDUAL_ENERGY not in study.objectives:
        return (how,)
    return (
        how,
        f"Up to {study.still:g} J the arm counts as still, so that its limits begin there. The "
        "energy is kinetic and elastic, and that of a joint that still turns when it locks belongs "
        "to it.",
    )


def _stage_details(stage: Stage) -> dict[str, Any]:
    return {"duration": stage.duration, "start": stage.start, "end": stage.end}


def _bounds(subject: ArmFront, points: Sequence[FrontPoint]) -> tuple[Array, str]:
    """What a rigid arm needs at least at each point, and the words for it."""
    if (subject.limited, subject.least) != ("time", "peak-torque"):
        return np.full(len(points), np.nan), ""
    stage = subject.study.slew
    turn = float(stage.inertia_turns[stage.moving[0]])
    return np.array([4.0 * turn / point.x**2 for point in points]), "least of a rigid arm"


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
        Metric("smoothness_share", "share of smoothness in what was minimised", "%", share),
    ]
