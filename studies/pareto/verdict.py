"""How sure a front is, and what it is held against."""

from __future__ import annotations

import numpy as np

from ocp.arrays import Array
from studies.common.result import Criterion, Verdict
from studies.pareto.envelope import Front

BELOW = 1e-6  # relative, by which a value may be below its bound


def front_verdict(front: Front, stopped: bool) -> Verdict:
    """Local: from both ends, or unverified where the user stopped it."""
    count = len(front.points)
    if stopped:
        return Verdict("unverified", f"unverified: stopped with {count} points of the front")
    return Verdict(
        "local",
        f"local: {count} verified points, each the best of walks from both ends of the front",
    )


def front_checks(front: Front, title: str, bounds: Array) -> tuple[Criterion, ...]:
    """That no point is below its bound; each point itself was held against all that it has to.

    Parameters
    ----------
    title : of what is least.
    bounds : (points,) proven, nan where there is none.
    """
    count = float(len(front.points))
    name = "points of the front whose motion meets all its checks"
    checks = [Criterion(name, "1", count, count, True)]

    values = np.array([p.y for p in front.points])
    known = np.isfinite(bounds)
    if known.any():
        below = float((1 - values[known] / bounds[known]).max())
        name = f"{title} below its bound"
        checks.append(Criterion(name, "of the bound", below, BELOW, below <= BELOW))
    return tuple(checks)
