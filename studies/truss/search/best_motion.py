"""What a search has found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ocp import Solution, Trial
from studies.common.result import Verdict
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
    """

    deployment: Deployment
    solution: Solution
    trials: tuple[Trial, ...]
    basins: tuple[Basin, ...]
    bounds: Mapping[str, float]
    verdict: Verdict
    remarks: tuple[str, ...]
    interrupted: bool
