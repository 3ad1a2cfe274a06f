"""What a search has found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from models.errors import ModelError
from ocp import Optimum, Solution, Trial
from studies.common.result import Criterion, Verdict
from studies.truss.motions.deployment import Deployment
from studies.truss.search.verdict import Basin


@dataclass(frozen=True, eq=False)
class BestMotion:
    """The best motion found.

    Attributes
    ----------
    deployment : the optimal law on its truss.
    solution : of the last stage.
    trials : all starts, those that failed among them.
    basins : optima found, best first.
    bounds : lower bounds by quantity.
    verdict : how sure the result is.
    remarks : sentences that belong beside it.
    interrupted : whether the user stopped the search.
    second : what a second solve says of it, where one was asked for.
    """

    deployment: Deployment
    solution: Solution
    trials: tuple[Trial, ...]
    basins: tuple[Basin, ...]
    bounds: Mapping[str, float]
    verdict: Verdict
    remarks: tuple[str, ...]
    interrupted: bool
    second: tuple[Criterion, ...] = ()


class NoMotionError(Exception):
    """The model takes an unverified answer of the solver for no motion."""


def first_motion(
    optima: Sequence[Optimum], moved: Callable[[Solution], Deployment]
) -> tuple[Optimum, Deployment]:
    """The best answer that is a motion: unverified ones may be none.

    Raises
    ------
    NoMotionError
        If none is one.
    """
    reasons = []
    for optimum in optima:
        try:
            deployment = moved(optimum.solution)
            deployment.values  # noqa: B018  # what the model refuses shows here
        except ModelError as error:
            reasons.append(str(error))
        else:
            return optimum, deployment
    raise NoMotionError(reasons[0])
