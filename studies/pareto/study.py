"""A front of the truss from its configuration to its result.

Two walks, from either end of the front, and a look into the gaps that they leave. Whatever a point
comes from, its motion is evaluated between the points of its mesh, as every motion of the truss is.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ocp import ParetoFront
from studies.common.console import Console, at_work
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.result import Criterion, Result
from studies.common.stops import kept_anyway
from studies.fronts.found import front_found
from studies.fronts.result import front_result, named_points
from studies.fronts.words import dominated_law, open_end_in_words
from studies.pareto.config import POINTS, ParetoStudy, as_dictionary
from studies.pareto.laws import DRAWN, broken_titles, compared
from studies.pareto.motions import motion_series
from studies.pareto.truss import TrussFront
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import paper_laws_of


def check(study: ParetoStudy, console: Console) -> TrussFront:
    """Refuse a study that no motion meets; return the front that has looked into that.

    Raises
    ------
    StudyError
        With the nearest value that works.
    """
    subject = TrussFront(study, console)
    subject.check()
    return subject


def run(
    study: ParetoStudy,
    console: Console | None = None,
    *,
    checked: TrussFront | None = None,
    kept: FinishedSteps = NOTHING_KEPT,
) -> Result:
    """Find the front of two objectives of the truss.

    Parameters
    ----------
    study : ParetoStudy
        What is asked.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    checked : TrussFront, optional
        As `check` gives it, so that nothing is looked into twice.
    kept : FinishedSteps, optional
        Where finished points go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "pareto-truss"; its main axis is the objective that is limited.

    Raises
    ------
    StudyError
        If no motion meets the caps, an end of the front was not found, or there is nothing to
        trade.
    """
    with at_work(console) as told:
        subject = check(study, told) if checked is None else checked
        subject.kept = kept
        return result_of(subject)


def result_of(subject: TrussFront) -> Result:
    """The front of a subject as a result, whose printed motions are solved a second time.

    Raises
    ------
    StudyError
        If an end of the front has no motion, or the user stopped before there was a point.
    """
    pareto = subject.study.pareto
    found = front_found(subject, pareto.points or POINTS, coarse=pareto.coarse)
    front, second = _a_second_time(subject, found)
    return kept_anyway(lambda whole: _result(subject, front, second, whole), front.interrupted)


def _a_second_time(
    subject: TrussFront, front: ParetoFront
) -> tuple[ParetoFront, tuple[Criterion, ...]]:
    """The front with its ends and its knee as second solves leave them, and what these say."""
    points, checks = list(front.points), []
    middle = points.index(front.middle)
    places = {0: "one end", middle: "the middle", len(points) - 1: "the other end"}
    for place, words in places.items():
        if front.interrupted:
            break
        points[place], second = subject.confirmed(points[place], f"a second solve of {words}")
        checks.append(second.check)
        front = dataclasses.replace(front, interrupted=second.interrupted)
    return front.replaced(points), tuple(checks)


def _result(
    subject: TrussFront, front: ParetoFront, second: tuple[Criterion, ...], whole: bool
) -> Result:
    """The result; the whole one has the curves of the laws, and else their points."""
    study, open_ends = subject.study, subject.open_ends
    limits = {name: limit.value for name, limit in open_ends.items()}
    shown = {
        name: dataclasses.replace(point.motion.deployment, name=name, only=None)
        for name, point in named_points(front, subject.axes, tuple(open_ends)).items()
    }
    laws = paper_laws_of(subject.traded.truss, front.middle.motion.deployment.law.duration)
    traded = subject.traded.limited, subject.traded.least
    table, least = compared(study.truss, traded, [*shown.values(), *laws], limits)
    ends = zip(traded, tuple(shown.values())[1:], strict=True)

    return front_result(
        front,
        subject.axes,
        kind="pareto-truss",
        question=study.question,
        configuration=as_dictionary(study),
        bounds=np.array([subject.traded.bound(p.x) or np.nan for p in front.points]),
        laws=_places(subject, front, laws, whole),
        motions=motion_series(front.points),
        table=table,
        also_found=tuple(shown)[1:],
        least=least,
        checks=second,
        remarks=(
            *(
                open_end_in_words(limit.sentence, limit.value, end.values[name])
                for name, end in ends
                if (limit := open_ends.get(name)) is not None
            ),
            *(
                dominated_law(
                    front,
                    law.name,
                    _place(subject, law),
                    subject.axes,
                    broken_titles(subject.traded.truss, law, subject.traded.limited),
                )
                for law in laws
            ),
        ),
        details={
            "open_ends": limits,
            "solves": subject.solves,
            "iterations": sum(point.motion.solution.iterations for point in front.points),
        },
    )


def _place(subject: TrussFront, law: Deployment) -> tuple[float, float]:
    return law.values[subject.traded.limited], law.values[subject.traded.least]


def _places(
    subject: TrussFront, front: ParetoFront, laws: Sequence[Deployment], whole: bool
) -> dict[str, list[tuple[float, float]]]:
    """Where the paper's laws are: curves if the duration is traded and the whole is asked for."""
    durations = [law.law.duration for law in laws[:1]]  # none beside a motion under way
    if subject.traded.limited == "time" and whole:
        durations = np.linspace(front.points[0].x, front.points[-1].x, DRAWN).tolist()
    at = [paper_laws_of(subject.traded.truss, duration) for duration in durations]
    only = frozenset({subject.traded.limited, subject.traded.least})
    return {
        law.name: [_place(subject, dataclasses.replace(pair[k], only=only)) for pair in at]
        for k, law in enumerate(laws)
    }
