"""The best motion as the beginning of further work, which ends where the user stops the search."""

from __future__ import annotations

from models.laws import Law
from ocp import Accuracy
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.truss.config import TrussStudy
from studies.truss.search.motion_search import best_motion
from studies.truss.search.question import Question

# The last digits of a flat optimum take ten times the seconds of all before, and further work is
# solved to its own accuracy.
ROUGH = Accuracy(objective=1e-4, path=1e-5)


def best_law(
    study: TrussStudy,
    console: Console,
    kept: FinishedSteps = NOTHING_KEPT,
    accuracy: Accuracy | None = ROUGH,
) -> Law:
    """The best motion of a study of the truss.

    Parameters
    ----------
    kept : FinishedSteps, optional
        Where finished steps go to, and come from.
    accuracy : Accuracy or None
        Of the motion: to 1e-4 of its objective by default, and with None that of a result.

    Raises
    ------
    KeyboardInterrupt
        If the user stopped the search: the best until then is no motion to go on from.
    StudyError
        If no motion was found.
    """

    def searched() -> Law:
        try:
            best = best_motion(Question(study, console, accuracy=accuracy, kept=kept))
        except StudyError as error:
            if error.exit_code is ExitCode.INTERRUPTED:
                raise KeyboardInterrupt from error
            raise
        if best.interrupted:
            raise KeyboardInterrupt
        return best.deployment.law

    return kept.step("law", searched, say=console.progress)
