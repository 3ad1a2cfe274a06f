"""A trade-off of the truss from its configuration to its result.

Two walks, from either end of the front, and a look into the gaps that they leave. Whatever a point
comes from, its motion is evaluated between the points of its mesh, as every motion of the truss is.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ocp.analysis.front.both_ways import Walked, both_ways
from ocp.analysis.front.continuation import FrontPoint, NotFoundError
from ocp.analysis.front.envelope import Front, alone
from studies.common.comparison_table import costs_elsewhere
from studies.common.console import Console, at_work
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import provenance
from studies.common.result import Criterion, Result
from studies.common.stops import kept
from studies.pareto.columns import front_details, front_series, law_series
from studies.pareto.config import ParetoStudy, configuration_of
from studies.pareto.keys import FRONT
from studies.pareto.laws import DRAWN, axis_of, broken_titles, compared, laws_in
from studies.pareto.motions import motion_series
from studies.pareto.truss import TrussFront
from studies.pareto.verdict import checks_of_points, front_verdict
from studies.pareto.words import dominated_law, front_in_words, open_end_in_words
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import QUANTITIES

COARSE_POINTS = 6


def run(
    study: ParetoStudy,
    console: Console | None = None,
    *,
    checked: Callable[[], Result] | None = None,
) -> Result:
    """Find the front of two objectives of the truss, or the surface of three.

    Parameters
    ----------
    study : ParetoStudy
        What is asked.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    checked : callable, optional
        As `check` gives it, so that nothing is looked into twice.

    Returns
    -------
    Result
        Of the kind "pareto-truss"; its main axis is the objective that is limited, or the number
        of a point on the surface.

    Raises
    ------
    StudyError
        If no motion meets the caps, an objective has no minimiser, or there is nothing to trade.
    """
    with at_work(console) as told:
        return (checked or check(study, told))()


def check(study: ParetoStudy, console: Console) -> Callable[[], Result]:
    """Refuse a study that cannot be met; return what gives its result.

    Raises
    ------
    StudyError
        If no motion meets the caps, an objective has no minimiser, or there is nothing to trade.
    """
    refuse, solve = asked_of(study, console)
    refuse()
    return solve


def asked_of(
    study: ParetoStudy, console: Console
) -> tuple[Callable[[], None], Callable[[], Result]]:
    """What refuses a study that cannot be met, and what gives its result."""
    if study.pareto.sliced is not None:
        from studies.pareto.surface.study import result_of as surface_result
        from studies.pareto.surface.truss import TrussSurface
        from studies.pareto.surface.walk import SurfaceWalk

        sliced = TrussSurface(study, console)
        return sliced.check, lambda: surface_result(sliced, SurfaceWalk(sliced, console).run())
    subject = TrussFront(study, console)
    return subject.check, lambda: result_of(subject, front_found(subject))


def front_found(subject: TrussFront) -> Walked:
    """The front between the ends that the study states, or that there are.

    Raises
    ------
    StudyError
        If an end of the front has no motion, or the user stopped before there was a point.
    """
    pareto = subject.study.pareto
    found: list[FrontPoint] = []
    try:
        (lows, slow), (high, free) = subject.ends()
        found.append(subject.first(subject.program(slow, high), lows, "up"))
        found.append(subject.first(subject.program(free, high), (high,), "down"))
    except NotFoundError as error:
        raise StudyError(
            f"no motion was found at an end of the front, between {lows[0]:.6g} and {high:.6g}: "
            f"{error}; state a smaller pareto.range",
            ExitCode.NOT_SOLVED,
        ) from error
    except KeyboardInterrupt as stop:
        if not found:
            raise StudyError(
                "stopped before a point of the front was found; the inputs are kept",
                ExitCode.INTERRUPTED,
            ) from stop
        return Walked(alone(found[0]), (), stopped=True)

    left, right = found
    wanted = pareto.points or FRONT
    count = min(wanted, COARSE_POINTS) if pareto.coarse else wanted
    return both_ways(subject, left, right, count, subject.console.progress)


def result_of(subject: TrussFront, walked: Walked) -> Result:
    """The result that a front gives, whose printed motions are solved a second time."""
    walked, second = _a_second_time(subject, walked)
    return kept(lambda whole: _result(subject, walked, second, whole), walked.stopped)


def _a_second_time(subject: TrussFront, walked: Walked) -> tuple[Walked, tuple[Criterion, ...]]:
    """The front with its ends and its knee as second solves leave them, and what these say."""
    points, checks = list(walked.front.points), []
    places = {0: "one end", _chosen(walked.front): "the middle", len(points) - 1: "the other end"}
    for place, words in places.items():
        if walked.stopped:
            break
        points[place], second = subject.confirmed(points[place], f"a second solve of {words}")
        checks.append(second.check)
        walked = dataclasses.replace(walked, stopped=second.interrupted)
    front = dataclasses.replace(walked.front, points=tuple(points))
    return dataclasses.replace(walked, front=front), tuple(checks)


def _chosen(front: Front) -> int:
    """The point whose motion is shown: the knee, or the one in the middle."""
    return len(front.points) // 2 if front.knee is None else front.knee


def _result(
    subject: TrussFront, walked: Walked, second: tuple[Criterion, ...], whole: bool
) -> Result:
    """The result; the whole one has the curves of the laws, and else their points."""
    study, front = subject.study, walked.front
    axes = axis_of(subject.limited), axis_of(subject.least)
    bounds = np.array([subject.bound(p.x) or np.nan for p in front.points])
    chosen = front.points[_chosen(front)]
    laws = laws_in(subject.truss, chosen.motion.deployment.law.duration)
    motion = _named(chosen, "knee" if front.knee is not None else "middle")
    traded, open_ends = (subject.limited, subject.least), subject.open_ends
    ends = [
        _named(point, f"{'near ' * (name in open_ends)}least {_short(name)}")
        for point, name in zip((front.points[0], front.points[-1]), traded, strict=True)
    ]
    limits = {name: limit.value for name, limit in open_ends.items()}
    table, proven = compared(study.truss, traded, [motion, *ends, *laws], limits)
    also_found = tuple(end.name for end in ends)

    return Result(
        kind="pareto-truss",
        question=study.question,
        configuration=configuration_of(study),
        arrays={
            **front_series(front, bounds, *axes),
            **law_series(_places(subject, front, laws, whole), *axes),
            **motion_series(front.points),
        },
        table=table,
        also_found=also_found,
        costs_elsewhere=costs_elsewhere(table, also_found),
        bounds=proven,
        verdict=front_verdict(front, walked.stopped),
        checks=(
            *checks_of_points(
                "front", [p.y for p in front.points], QUANTITIES[subject.least].title, bounds
            ),
            *second,
        ),
        remarks=(
            *front_in_words(front, *axes),
            *(
                open_end_in_words(limit.sentence, limit.value, end.values[name])
                for end, name in zip(ends, traded, strict=True)
                if (limit := open_ends.get(name)) is not None
            ),
            *(
                dominated_law(
                    front,
                    law.name,
                    _place(subject, law),
                    axes,
                    broken_titles(subject.truss, law, (subject.limited,)),
                )
                for law in laws
            ),
            *walked.remarks,
        ),
        details={
            **front_details(front, *axes),
            "open_ends": limits,
            "solves": subject.solves,
            "iterations": sum(point.motion.solution.iterations for point in front.points),
        },
        provenance=provenance(),
    )


def _place(subject: TrussFront, law: Deployment) -> tuple[float, float]:
    return law.values[subject.limited], law.values[subject.least]


def _places(
    subject: TrussFront, front: Front, laws: Sequence[Deployment], whole: bool
) -> dict[str, list[tuple[float, float]]]:
    """Where the paper's laws are: curves if the duration is traded and the whole is asked for."""
    durations = [laws[0].law.duration]
    if subject.limited == "time" and whole:
        durations = np.linspace(front.points[0].x, front.points[-1].x, DRAWN).tolist()
    at = [laws_in(subject.truss, duration) for duration in durations]
    only = frozenset(subject.traded)
    return {
        law.name: [_place(subject, dataclasses.replace(pair[k], only=only)) for pair in at]
        for k, law in enumerate(laws)
    }


def _short(name: str) -> str:
    return name.removeprefix("peak-")


def _named(point: FrontPoint, name: str) -> Deployment:
    deployment: Deployment = dataclasses.replace(point.motion.deployment, name=name, only=None)
    return deployment
