"""Where a front of the truss begins and ends: its lowest and its highest limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from models.laws import Law
from studies.common.exit_codes import StudyError
from studies.pareto.traded import Traded
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import least_jerk, path_of_angle
from studies.truss.limits.feasibility import Unattained
from studies.truss.quantities import QUANTITIES

# The first limit is above the least by the first of these parts at which a motion is found: at the
# least itself there is no room for anything, and near it little.
ABOVE_THE_LEAST = (2e-3, 1e-2, 5e-2)
# Times the least limit, where a front ends whose other end is open, unless a range is stated. At 20
# times no motion of 140 s was found in 300 s, at 4 times within 5 s.
FAR = 4.0

# Finds the best motion of a study.
Found = Callable[[TrussStudy], Law]


class FrontEnd(NamedTuple):
    """An end of a front.

    Attributes
    ----------
    limits : to try, one after the other until a motion is found.
    law : of a motion near it.
    """

    limits: tuple[float, ...]
    law: Law


def both_ends(
    traded: Traded,
    stated: Sequence[float] | None,
    open_ends: Mapping[str, Unattained],
    found: Found,
) -> tuple[FrontEnd, FrontEnd]:
    """The ends at the lowest and at the highest limit.

    Parameters
    ----------
    stated : lowest and highest limit that the user states; None for all that there is.
    open_ends : least values that no motion attains, by objective.
    found : finds the best motion of a study.

    Raises
    ------
    StudyError
        If there is nothing to trade.
    """
    if stated is not None:
        low, high = (FrontEnd((limit,), found(traded.at(limit))) for limit in stated)
        return low, high

    least, slow = _least_limit(traded, open_ends, found)
    lows = tuple(least * (1 + part) for part in ABOVE_THE_LEAST)
    high_limit, law = _highest_limit(traded, lows[-1], open_ends, found)
    if high_limit <= lows[0]:
        limited = QUANTITIES[traded.limited]
        raise StudyError(
            "there is no trade-off: the same motion has the minimum "
            f"{QUANTITIES[traded.least].title} and the minimum {limited.title}, {least:.6g} "
            f"{limited.unit}"
        )
    return FrontEnd(lows, slow), FrontEnd((high_limit,), law)


def _highest_limit(
    traded: Traded, low: float, open_ends: Mapping[str, Unattained], found: Found
) -> tuple[float, Law]:
    """The limit at which the other objective is least, and its motion."""
    stated = traded.cap
    if traded.least in open_ends:
        # the nearer to a limit that no motion attains, the longer motions take to find
        high = FAR * low if stated is None else min(FAR * low, stated)
        return high, found(traded.at(high))
    law = found(traded.truss)
    high = stated or traded.value(law)
    if not math.isfinite(high):  # the jerk of an acceleration that steps
        raise StudyError(
            f"the motion with the minimum {QUANTITIES[traded.least].title} has no finite "
            f"{QUANTITIES[traded.limited].title}: give --range, e.g. {low:.4g}..{FAR * low:.4g}"
        )
    return high, law


def _least_limit(
    traded: Traded, open_ends: Mapping[str, Unattained], found: Found
) -> tuple[float, Law]:
    """The least of what is limited, and a motion near it."""
    if traded.limited == "peak-jerk":
        least = least_jerk(path_of_angle(traded.truss), traded.truss.duration[1])
        return least, found(traded.at(least * (1 + ABOVE_THE_LEAST[0])))
    if traded.limited in open_ends:
        least = open_ends[traded.limited].value
        return least, found(traded.at(least * (1 + ABOVE_THE_LEAST[-1])))
    law = found(traded.minimising(traded.limited))
    return traded.value(law), law
