"""The optimum of a profile's own duration under the caps that it is held against."""

from __future__ import annotations

from models.laws import JerkLimited, Law, constant_acceleration
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.truss.checks import broken_caps
from studies.truss.config import TrussStudy
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import OPTIMUM, deployment_of
from studies.truss.search.motion_search import best_motion
from studies.truss.search.proofs import check_some_optimum
from studies.truss.search.question import Question


def optimum_of(study: TrussStudy, console: Console) -> tuple[Deployment | None, str]:
    """The optimum and how sure it is; none, and why, where there is none.

    The least peak acceleration has a closed form. It is the answer wherever its motion keeps all
    caps; else, and for other objectives, the problem is solved.
    """
    law = _closed_form(study)
    if law is not None:
        deployment = deployment_of(OPTIMUM, law, study)
        if not broken_caps(study, deployment.values):
            return deployment, "optimum: minimum peak angular acceleration, in closed form, global"

    try:
        best = best_motion(Question(study, console, check_some_optimum(study, console)))
    except StudyError as error:
        return None, f"the profile is compared with no optimum: {error}"
    return (
        best.deployment,
        f"optimum: least {', then '.join(study.objectives)}, {best.verdict.kind}",
    )


def _closed_form(study: TrussStudy) -> Law | None:
    """The law of least peak acceleration under a jerk cap alone; None for other questions."""
    opening = study.opening
    if study.objectives != ("peak-acceleration",) or opening.rate:
        return None
    duration, start, jerk = study.duration[1], opening.start, study.caps.jerk
    if jerk is None:
        acceleration = 4 * study.stroke / duration**2
        half = duration / 2
        return constant_acceleration((0.0, half, duration), (acceleration, -acceleration), start)
    if jerk * duration**3 < 32 * study.stroke:  # no motion is that smooth; the search says so
        return None
    return JerkLimited(duration, start, opening.end, jerk)
