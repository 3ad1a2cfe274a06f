"""What fronts of the truss are held against: laws, bounds, and their axes."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from studies.common.comparison_table import TableRow
from studies.fronts.columns import FrontAxis
from studies.truss.checks import broken_caps, table_rows
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import lower_bounds
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import OBJECTIVES, QUANTITIES

DRAWN = 21  # durations at which a law is drawn, if the duration is traded; each takes a while


def axis_of(name: str) -> FrontAxis:
    """An objective as an axis."""
    return FrontAxis(name, QUANTITIES[name].title, QUANTITIES[name].unit)


def compared(
    truss: TrussStudy,
    traded: Sequence[str],
    motions: Sequence[Deployment],
    limits: Mapping[str, float] | None = None,
) -> tuple[tuple[TableRow, ...], dict[str, float]]:
    """Table of some motions and laws, and the proven bounds of the objectives that are traded.

    Parameters
    ----------
    limits : of objectives, that no motion attains.
    """
    minimised = [name for name in traded if name in OBJECTIVES]
    free = dataclasses.replace(truss, minimise=minimised)
    lowest = {**lower_bounds(free, None), **(limits or {})}
    bounds = {key: bound for key, bound in lowest.items() if key in minimised}
    return table_rows(free, motions, lowest), bounds


def broken_titles(truss: TrussStudy, law: Deployment, limited: str) -> tuple[str, ...]:
    """Titles of the caps that a law breaks, all but that on what is limited."""
    broken = broken_caps(truss, law.values)
    return tuple(QUANTITIES[key].title for key in broken if key != limited)
