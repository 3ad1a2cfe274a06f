"""The truss that a law serves worst, of all in the ranges of the scatter: it is at a corner.

At an instant of the common motion the motor's force is Q/f. The generalised force Q is affine in
each stiffness, friction and density, and in the moment that sticks, which grows with its width. The
leverage f falls with the friction of the pulleys, and so does the share of a force at the far end.
So force and tension are monotone in every parameter while the others stay. What is monotone along
each axis of a box has its extremes at corners of the box: where a law keeps its limits at all
corners, it keeps them on every truss between them.

Where a joint sticks is no such parameter. There it is taken to stick, at each instant, where of all
places in the range this does most: the nearest for the force, the farthest for the tension.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array
from studies.robust.config import CORNER, VARIED, RobustTrussStudy
from studies.robust.replay import closer, forces, replay, times_of
from studies.truss.limits.tolerances import CAPS, OPTIMUM, TENSION
from studies.truss.motions.deployment import Deployment

PLACE = "stuck_angle_deg"


@dataclass(frozen=True)
class WorstTruss:
    """The worst that a law does to a truss in the ranges.

    Attributes
    ----------
    value : largest force of the motor or least tension [N].
    truss : what the truss has other than the study's.
    """

    value: float
    truss: dict[str, float]


def extremes(
    study: RobustTrussStudy, deployment: Deployment
) -> tuple[WorstTruss, WorstTruss] | None:
    """Largest force and least tension of a law in the ranges; None where there are none."""
    if not study.uncertainty.ranges:
        return None
    return _worst(study, deployment, 1.0), _worst(study, deployment, -1.0)


def with_corners(study: RobustTrussStudy, deployment: Deployment) -> RobustTrussStudy:
    """The study with those corners as scenarios at which a law does worse than in all scenarios.

    The same study if there are none: then the law serves all trusses in the ranges.
    """
    found = extremes(study, deployment)
    if found is None:
        return study
    caps = study.deployment.caps
    served = replay(deployment, np.array([study.values_of(s) for s in study.scenarios.values()]))
    # what is within the accuracy of an optimum is not worth a scenario more
    allowed = served.peak.max() * (1 + OPTIMUM)
    if caps.force is not None:
        allowed = min(allowed, caps.force * (1 + CAPS))

    new = []
    largest, least = found
    if largest.value > allowed:
        new.append(largest.truss)
    alone = replay(deployment, np.array([study.values_of(least.truss)]))
    if alone.least[0] < caps.least_tension - TENSION * alone.peak[0]:
        new.append(least.truss)
    corners = dict(study.corners)
    for truss in new:
        if truss not in corners.values():
            corners[f"{CORNER} {len(corners) + 1}"] = truss
    return study if len(corners) == len(study.corners) else replace(study, corners=corners)


def _worst(study: RobustTrussStudy, deployment: Deployment, sign: float) -> WorstTruss:
    """The largest force (sign 1) or the least tension (sign -1)."""
    corners = _corners(study, sign)
    values = np.array([study.values_of(corner) for corner in corners])
    time = np.tile(times_of(deployment), (len(corners), 1))
    rows = _worst_at(study, deployment, time, values, sign)
    # between the neighbours of each corner's own worst sample, as the draws are replayed
    finer = closer(time[0], rows.argmax(axis=1))
    close = _worst_at(study, deployment, finer, values, sign)

    corner = int(np.maximum(rows.max(axis=1), close.max(axis=1)).argmax())
    instant = float(finer[corner, close[corner].argmax()])
    truss = dict(corners[corner])
    if PLACE in truss:
        angle = np.degrees(deployment.law.motion(np.array([instant])).angle)
        truss[PLACE] = float(_places(study, angle, sign)[0])
    return WorstTruss(sign * float(max(rows[corner].max(), close[corner].max())), truss)


def _corners(study: RobustTrussStudy, sign: float) -> list[dict[str, float]]:
    """All corners of the ranges; where a joint sticks is left to each instant."""
    ranges = study.uncertainty.ranges
    # of corners that are equally bad the first is taken: elsewhere on the way, more friction and
    # stiffness mostly mean more force, and less of them less tension
    ends = []
    for word, (low, high) in ranges.items():
        both = (high, low) if sign > 0 else (low, high)
        ends.append((low,) if word == PLACE or low == high else both)
    return [dict(zip(ranges, corner, strict=True)) for corner in itertools.product(*ends)]


def _worst_at(
    study: RobustTrussStudy, deployment: Deployment, time: Array, values: Array, sign: float
) -> Array:
    """Forces, or tensions with their sign changed, at times (k, m) of k corners [N]."""
    along = np.repeat(values[:, None], time.shape[1], axis=1)
    if PLACE in study.uncertainty.ranges:
        angle = np.degrees(deployment.law.motion(time.ravel()).angle)
        along[..., list(VARIED).index(PLACE)] = _places(study, angle, sign).reshape(time.shape)
    force, far = forces(deployment, time, along)
    return force if sign > 0 else -np.minimum(force, far)


def _places(study: RobustTrussStudy, angle: Array, sign: float) -> Array:
    """Where in its range a joint sticks [deg] that does most at angles [deg]."""
    low, high = study.uncertainty.ranges[PLACE]
    if sign > 0:
        return np.clip(angle, low, high)
    return np.where(angle - low > high - angle, low, high)
