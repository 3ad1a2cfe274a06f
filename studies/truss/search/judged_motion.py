"""From what several starts found to the best motion, step by step, and how sure it is.

Each step takes a motion and gives one that is no worse. Where the user stops one, the steps after
it are left out, and what was found until then is the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ocp import Audit, Interrupted, Optimum, Solution
from studies.common.exit_codes import StudyError
from studies.common.finished import mark
from studies.common.result import Criterion, Verdict
from studies.common.second_solve import second_solve
from studies.truss.motions.deployment import Deployment
from studies.truss.problem import Statement
from studies.truss.search.best_motion import BestMotion, NoMotionError, first_motion
from studies.truss.search.later_stages import in_order, later_stages
from studies.truss.search.proofs import PhasePlanes, ProvenBounds
from studies.truss.search.question import Question
from studies.truss.search.smoothness import (
    SHARE,
    at_a_light_price,
    price_in_words,
    share_is_all,
    share_of,
)
from studies.truss.search.verdict import (
    BOUND_MET,
    Basin,
    basins,
    cut_short_in_words,
    global_verdict,
    local_verdict,
    unattained_verdict,
)

STOPPED = "interrupted before a motion was found; the inputs are kept"


@dataclass(frozen=True, eq=False)
class Reached:
    """Where the steps have come to.

    Attributes
    ----------
    optimum : of the first objective.
    basins : distinct optima of the starts, best first.
    solution, deployment : of the last objective that was minimised.
    interrupted : whether the user has stopped a step.
    remarks : sentences that belong beside it.
    in_order : what the later objectives reached.
    second : what a second solve says.
    """

    optimum: Optimum
    basins: tuple[Basin, ...]
    solution: Solution
    deployment: Deployment
    interrupted: bool
    remarks: tuple[str, ...] = ()
    in_order: str = ""
    second: tuple[Criterion, ...] = ()


def judged_motion(question: Question, found: Audit, bounds: ProvenBounds) -> BestMotion:
    """The best of several starts, with its later objectives, and the verdict.

    Raises
    ------
    NoMotionError
        If the model takes none of the unverified answers for a motion.
    Interrupted
        If the user stopped it in such a case.
    """
    stopped = found.interrupted or bounds.interrupted
    optima, interrupted = _smoothed(question, found.optima, stopped)
    try:
        optimum, deployment = first_motion(optima, question.deployment)
    except NoMotionError as error:
        if interrupted:
            raise Interrupted(STOPPED) from error
        raise

    statement = question.statements.of[optimum.solution.problem]
    measured = _measured(question, optimum, deployment)
    distinct = basins(question.study, [measured if one is optimum else one for one in optima])
    reached = Reached(measured, distinct, optimum.solution, deployment, interrupted)
    if optimum.solution.verification.passed:
        reached = _with_later_objectives(question, statement, reached)
        reached = _confirmed(question, statement, optima, reached)

    solution = reached.optimum.solution
    open_ends = price_in_words(statement, solution), cut_short_in_words(solution)
    return BestMotion(
        deployment=reached.deployment,
        solution=reached.solution,
        trials=found.trials,
        basins=reached.basins,
        bounds=bounds.values,
        verdict=_verdict(question, found, bounds, reached),
        remarks=(*bounds.remarks, *reached.remarks, *filter(None, open_ends)),
        interrupted=reached.interrupted,
        second=reached.second,
    )


def _measured(question: Question, optimum: Optimum, deployment: Deployment) -> Optimum:
    """An optimum whose value is that of the table, which with an arm has another replay."""
    if question.study.arm is None:
        return optimum
    terms = question.study.minimise[0].items()
    references, values = question.weights, deployment.values
    return replace(optimum, value=sum(w / references[key] * values[key] for key, w in terms))


def _smoothed(
    question: Question, optima: Sequence[Optimum], stopped: bool
) -> tuple[list[Optimum], bool]:
    """The optima without what smoothness costs them, best first; whether the user has stopped."""
    found: list[Optimum] = []
    for optimum in optima:
        best = min((known.value for known in found), default=None)
        if not stopped and _may_be_lighter(question, optimum, best):
            optimum, stopped = _lighter(question, optimum)
        found.append(optimum)
    return sorted(found, key=lambda optimum: optimum.value), stopped


def _may_be_lighter(question: Question, optimum: Optimum, best: float | None) -> bool:
    """Whether a lower price of the roughness may make a better motion than the best known one."""
    if question.enough is not None or question.study.arm is not None:
        return False
    statement = question.statements.of[optimum.solution.problem]
    share = share_of(statement, optimum.solution)
    beaten = best is not None and optimum.value * (1 - share) > best
    light = share <= SHARE and share_is_all(statement)
    return optimum.solution.verification.passed and not light and not beaten


def _lighter(question: Question, optimum: Optimum) -> tuple[Optimum, bool]:
    """An optimum at a lower price of the roughness, and whether the user has stopped that."""
    solution, console = optimum.solution, question.console
    problem = solution.problem
    console.progress(f"{', '.join(optimum.starts)}: solving again with a smaller smoothness weight")
    lighter = question.kept.step(
        "a smaller smoothness weight",
        lambda: at_a_light_price(
            problem,
            question.statements.of[problem],
            solution,
            question.settings,
            question.some_left,
            console.live,
        ),
        problem,
        console.progress,
        begins_with=mark(solution),
    )
    value = question.statements.value(problem, lighter.solution)
    return replace(optimum, solution=lighter.solution, value=value), lighter.interrupted


def _with_later_objectives(question: Question, statement: Statement, reached: Reached) -> Reached:
    """Later objectives, each with the earlier ones held; never a loss."""
    if reached.interrupted or len(statement.stages) == 1:
        return reached
    found, remarks = later_stages(question, statement, reached.solution)
    return replace(
        reached,
        solution=found.solution,
        deployment=question.deployment(found.solution, reached.optimum.solution.problem),
        interrupted=found.interrupted,
        remarks=(*reached.remarks, *remarks),
        in_order=in_order(question.study, found),
    )


def _confirmed(
    question: Question,
    statement: Statement,
    optima: Sequence[Optimum],
    reached: Reached,
) -> Reached:
    """What a second solve says of a motion that will be printed, or the better one it leads to."""
    # with an arm it would take as long again: the arm is integrated another way
    if reached.interrupted or not question.confirms or question.study.arm is not None:
        return reached
    second = second_solve(
        reached.solution,
        question.settings,
        question.console,
        left=question.some_left(),
        kept=question.kept,
    )
    known = replace(reached, interrupted=second.interrupted, second=(second.check,))
    if second.solution is reached.solution:
        return known

    stated = reached.optimum.solution.problem
    better = replace(
        known,
        solution=second.solution,
        deployment=question.deployment(second.solution, stated),
    )
    if len(statement.stages) > 1:
        return better
    value = second.solution.value(statement.stages[0], replayed=True)
    optimum = replace(reached.optimum, solution=second.solution, value=value)
    distinct = basins(question.study, [optimum, *optima[1:]])
    return replace(better, optimum=optimum, basins=distinct)


def _verdict(question: Question, found: Audit, bounds: ProvenBounds, reached: Reached) -> Verdict:
    """How sure the motion is, and what the later objectives reached."""
    study, value, bound = question.study, reached.optimum.value, bounds.first(question.study)
    verification = reached.optimum.solution.verification

    if not verification.passed:
        stopped = ", then interrupted" if reached.interrupted else ""
        sentence = f"unverified: {'; '.join(verification.reasons)}{stopped}"
        verdict = Verdict("unverified", sentence)
    elif (unattained := _unattained(question.planes, reached)) is not None:
        verdict = unattained
    elif bound is not None and value <= bound * (1 + BOUND_MET):
        verdict = global_verdict(study, value, bound, reached.basins[0])
    else:
        late = question.left < 0.0
        verdict = local_verdict(study, found, value, bound, reached.basins, late=late)

    if not reached.in_order:
        return verdict
    return replace(verdict, sentence=f"{verdict.sentence}; {reached.in_order}")


def _unattained(planes: PhasePlanes, reached: Reached) -> Verdict | None:
    """The verdict on a motion whose force is at a limit that no motion attains."""
    study = planes.study
    if reached.interrupted or study.jerk_limited or study.arm is not None:
        return None
    least = {"peak-force": planes.least_force, "peak-motor-force": planes.least_pull}
    for key in (key for key in least if key in study.objectives):
        try:
            return unattained_verdict(reached.deployment.values[key], least[key]())
        except StudyError:  # there is no such bound
            continue
    return None
