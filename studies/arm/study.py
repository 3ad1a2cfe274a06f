"""The questions to the arm, from their configurations to their results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from models.errors import ModelError
from studies.arm.config import (
    ArmStudy,
    BaselinesStudy,
    LeastDurationStudy,
    RobustStudy,
    SequenceStudy,
    StageStudy,
)
from studies.arm.optimal.solve import check_bending
from studies.arm.questions.baselines import compare_baselines
from studies.arm.questions.fronts.study import front
from studies.arm.questions.least_duration import find_least_durations
from studies.arm.questions.one_motion import check_study, solve_motion
from studies.arm.questions.robust.comparison import find_robust
from studies.arm.questions.sequence.study import (
    check_pace,
    check_sequence,
    find_sequence,
    stated_case,
)
from studies.arm.trade_off import TradeOffStudy
from studies.common.console import Console, at_work
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.result import Result

AnyArmStudy = (
    ArmStudy | BaselinesStudy | LeastDurationStudy | SequenceStudy | TradeOffStudy | RobustStudy
)

# a further question is a configuration and the function that answers it
_ANSWERS: Mapping[type[Any], Callable[[Any, Console, FinishedSteps], Result]] = {
    ArmStudy: solve_motion,
    SequenceStudy: find_sequence,
    TradeOffStudy: front,
    BaselinesStudy: compare_baselines,
    LeastDurationStudy: find_least_durations,
    RobustStudy: find_robust,
}


def check(study: AnyArmStudy, console: Console | None = None) -> None:
    """Refuse a study that cannot be met, before any work.

    Raises
    ------
    StudyError
        With the remedy.
    """
    if isinstance(study, ArmStudy):
        check_study(study)
    elif isinstance(study, StageStudy):
        check_bending(study.slew)
    elif isinstance(study, SequenceStudy):
        case = stated_case(study)
        check_pace(study, case)
        for stage in (case.first, case.second):
            check_bending(stage)
        check_sequence(study, case)


def run(
    study: AnyArmStudy, console: Console | None = None, kept: FinishedSteps = NOTHING_KEPT
) -> Result:
    """Answer a question to the arm.

    Parameters
    ----------
    study : ArmStudy or one of the other questions
        `ArmStudy` (one motion), `BaselinesStudy`, `LeastDurationStudy`, `SequenceStudy`,
        `TradeOffStudy` and `RobustStudy` of `studies.arm`.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    kept : FinishedSteps, optional
        Where finished steps go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "arm", "arm-baselines", "arm-least-duration", "arm-sequence", "pareto-arm" or
        "robust".

    Raises
    ------
    StudyError
        If the study cannot be met or no motion is found.
    """
    check(study)
    try:
        with at_work(console) as told:
            return _ANSWERS[type(study)](study, told, kept)
    except ModelError as error:  # such as a step that diverges
        raise StudyError(str(error), ExitCode.NOT_SOLVED) from error
