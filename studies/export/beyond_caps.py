"""By how much a played table exceeds the caps of its study.

The motion keeps them, and a table between its points need not. What the drive states as a limit is
refused. A table beyond a cap is written, with a message and a first line that say so.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from models.truss import TrussParameters, bar_forces
from ocp.arrays import Array
from studies.drive.playback import (
    Playback,
    TrussPlayback,
    extremes_on_the_truss,
    motor_peaks,
)
from studies.drive.schema import Drive
from studies.margin.travel import need_kernel
from studies.truss.checks import ROWS, broken_caps, cap_of
from studies.truss.config import TrussStudy
from studies.truss.quantities import QUANTITIES

BEYOND = " beyond the cap of the study [1]"  # of a line of a record, behind the quantity
AT_ONCE = 100_000  # samples of a kernel's call: a playback has up to millions


def beyond_caps(
    output: Playback, replayed: TrussPlayback, drive: Drive, study: TrussStudy
) -> dict[str, float]:
    """Lines of a record: the excess of each cap that is broken, relative.

    It is nan where the interpolation leaves a capped quantity without a value between the points,
    or the drive says too little of its motor.

    Parameters
    ----------
    output : of the rope.
    replayed : at the same times.
    drive : whose motor hauls the rope in.
    """
    capped = [key for key in ROWS if cap_of(study, key) is not None]
    values = _values(output, replayed, drive, study, capped)
    broken = broken_caps(study, values)
    excess = {
        key: broken.get(key, math.nan)
        for key in capped
        if key in broken or math.isnan(values.get(key, math.nan))
    }
    return {f"{QUANTITIES[key].title}{BEYOND}": value for key, value in excess.items()}


def beyond_in_words(record: Mapping[str, Any]) -> dict[str, str]:
    """The caps that a record says to be broken, as the first line of a table; empty without any."""
    excess = {
        name.removesuffix(BEYOND): value
        for name, value in record.items()
        if name.endswith(BEYOND) and value > 0.0  # nan is no value, and no excess
    }
    words = ", ".join(f"{title} by {100 * value:.2g} %" for title, value in excess.items())
    return {"BEYOND CAPS OF THE STUDY": words} if words else {}


def _values(
    output: Playback,
    replayed: TrussPlayback,
    drive: Drive,
    study: TrussStudy,
    capped: list[str],
) -> Mapping[str, float]:
    extremes = extremes_on_the_truss(output, replayed)
    values = {key: value for key, (value, _) in extremes.items()}
    for order, name in enumerate(("speed", "acceleration", "jerk"), start=1):
        values[f"peak-rope-{name}"] = output.peak(order)[0]
    if drive.drum_radius is not None:
        of_the_motor = motor_peaks(output, replayed, drive)
        values |= {f"peak-motor-{name}": value for name, (value, _) in of_the_motor.items()}

    # these two take longer than all the rest together
    motion = (replayed.angle, np.maximum(replayed.speed, 0.0), replayed.acceleration)
    if "peak-bar-force" in capped:
        kernel = _bar_kernel(study.truss)
        values["peak-bar-force"] = _greatest(kernel, (*motion, replayed.force))
    if "peak-factored-force" in capped and study.margin is not None:
        values["peak-factored-force"] = _greatest(need_kernel(study.margin, study.truss), motion)
    return values


@functools.lru_cache(maxsize=8)
def _bar_kernel(truss: TrussParameters) -> ca.Function:
    """Angle, speed, acceleration and rope force to the forces in the bars."""
    symbols = [ca.SX.sym(name) for name in ("alpha", "omega", "acc", "force")]
    return ca.Function("bars", symbols, [ca.vertcat(*bar_forces(truss, *symbols))], {"cse": True})


def _greatest(kernel: ca.Function, rows: tuple[Array, ...]) -> float:
    """Greatest of all values of a kernel along rows (m,); nan where a row has no value."""
    greatest = -math.inf
    for first in range(0, rows[0].size, AT_ONCE):
        part = slice(first, first + AT_ONCE)
        values = kernel(*(row[None, part] for row in rows)).full()
        if not np.isfinite(values).all():
            return math.nan
        greatest = max(greatest, float(values.max()))
    return greatest
