"""What the margins of a deployment add to a result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from studies.common.result import Criterion, Series
from studies.margin.travel import criteria, records, sentences, series
from studies.truss.motions.deployment import Deployment, travel_of


@dataclass(frozen=True, eq=False)
class MarginParts:
    """Parts of a result; all are empty where no margins are asked for.

    Attributes
    ----------
    arrays : columns beside the profile, along its own rows.
    checks, sentences : what has to be met, and what governs.
    details : tables of the least margins, and of every number with its source.
    """

    arrays: Mapping[str, Series] = field(default_factory=dict)
    checks: tuple[Criterion, ...] = ()
    sentences: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)


def margins_of(deployment: Deployment) -> MarginParts:
    """The parts that the margins of a deployment are.

    Raises
    ------
    StudyError
        If a measured curve does not cover the travel.
    """
    travel = travel_of(deployment)
    if travel is None:
        return MarginParts()
    return MarginParts(
        arrays=series(travel),
        checks=tuple(criteria(travel)),
        sentences=tuple(sentences(travel)),
        details={"margins": records(travel), "margin_numbers": travel.margin.sources()},
    )
