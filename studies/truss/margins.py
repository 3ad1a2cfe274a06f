"""What the margins of a deployment add to a result.

The columns are those of the profile's rows. The least margins are looked for between them, too.
"""

from __future__ import annotations

import numpy as np

from ocp.arrays import Array
from studies.margin.travel import KINDS, Travel, criteria, records, sentences, series
from studies.truss.motions.deployment import Deployment, travel_at, travel_of
from studies.truss.parts import Parts

# Instants with the least margins, about each of which as many more are put, and how often. What is
# missed then is of second order in their distance, which is 1e-3 of that of the rows.
LEAST, FINER, ZOOMS = 5, 65, 2


def margins_of(deployment: Deployment) -> Parts:
    """What has to be met, what governs, and every number with its source; nothing without margins.

    Raises
    ------
    StudyError
        If a measured curve does not cover the travel.
    """
    travel = travel_of(deployment)
    if travel is None:
        return Parts()
    close = between_rows(deployment, travel)
    return Parts(
        arrays=series(travel),
        checks=tuple(criteria(close)),
        sentences=tuple(sentences(close)),
        details={"margins": records(close), "margin_numbers": travel.margin.sources()},
    )


def between_rows(deployment: Deployment, travel: Travel) -> Travel:
    """The margins along a travel and, where they are least, at instants between its rows."""
    # where the acceleration jumps, both of its values count
    close = travel_at(deployment, np.union1d(travel.time, np.nextafter(deployment.edges[1:], 0.0)))
    for _ in range(ZOOMS):
        worst = [case.by_margin(kind)[:LEAST] for case in close.cases for kind in KINDS]
        around = [_around(close.time, place) for place in np.unique(worst).tolist()]
        close = travel_at(deployment, np.unique(np.concatenate([close.time, *around])))
    return close


def _around(time: Array, place: int) -> Array:
    """Even instants from the one before a place to the one after it."""
    first, last = time[max(place - 1, 0)], time[min(place + 1, time.size - 1)]
    return np.linspace(first, last, FINER)
