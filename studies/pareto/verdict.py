"""How sure a front is, and what it is held against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp.analysis.front.envelope import Front
from ocp.arrays import Array
from studies.common.result import Criterion, Verdict

BELOW = 1e-6  # relative, by which a value may be below its bound


def front_verdict(front: Front, stopped: bool) -> Verdict:
    """Local: from both ends, or unverified where the user stopped it."""
    count = len(front.points)
    if stopped:
        words = f"{count} point{'s' * (count != 1)} of the front"
        return Verdict("unverified", f"unverified: stopped with {words}")
    return Verdict(
        "local",
        f"local: {count} verified points, each the best of walks from both ends of the front",
    )


def checks_of_points(
    of: str, values: Sequence[float], title: str, bounds: Array
) -> tuple[Criterion, ...]:
    """That no point is below its bound; each point itself was held against all that it has to.

    Parameters
    ----------
    of : "front" or "surface".
    values : (points,) of what is least.
    title : of what is least.
    bounds : (points,) proven, nan where there is none.
    """
    count = float(len(values))
    name = f"points of the {of} whose motion meets all its checks"
    checks = [Criterion(name, "1", count, count, True)]

    known = np.isfinite(bounds)
    if known.any():
        below = float((1 - np.asarray(values)[known] / bounds[known]).max())
        name = f"{title} below its bound"
        checks.append(Criterion(name, "of the bound", below, BELOW, below <= BELOW))
    return tuple(checks)
