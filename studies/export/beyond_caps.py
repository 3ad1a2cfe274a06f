"""By how much a played table exceeds the caps of its study.

The motion keeps them, and a table between its points need not. What the drive states as a limit is
refused. A table beyond a cap is written, with a message and a first line that say so.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.truss import TrussParameters, buckling_shares, extreme_bar_forces
from ocp.arrays import Array
from studies.common.console import above
from studies.drive.playback import (
    Playback,
    TrussPlayback,
    extremes_on_the_truss,
    motor_peaks,
)
from studies.drive.schema import Drive
from studies.margin.available import standstill_kernel
from studies.margin.travel import need_kernel
from studies.truss.checks import broken_caps, cap_of
from studies.truss.config import TrussStudy
from studies.truss.quantities import QUANTITIES, Quantity

FIRST_LINE = "BEYOND CAPS OF THE STUDY"  # of a table that exceeds one
AT_ONCE = 100_000  # samples of a kernel's call: a playback has up to millions


@dataclass(frozen=True)
class BeyondCap:
    """A cap of the study that a played table exceeds, or of which its playback says nothing.

    Attributes
    ----------
    key : of the quantity.
    value, cap : played, and allowed; the value is nan where the interpolation leaves the quantity
        without a value between the points, or the drive says too little of its motor.
    """

    key: str
    value: float
    cap: float

    @property
    def quantity(self) -> Quantity:
        """What the cap is on."""
        return QUANTITIES[self.key]

    @property
    def excess(self) -> float:
        """Relative to the cap; of a tension that is short of 0 N it is infinite."""
        if self.quantity.kind != "least":
            return self.value / self.cap - 1.0
        short = self.cap - self.value
        return short / self.cap if self.cap > 0.0 else short * math.inf

    @property
    def line(self) -> tuple[str, float]:
        """Name and value in a record: relative, but of a tension the newtons that are missing."""
        if self.quantity.kind == "least":
            return f"{self.quantity.title} short of the cap of the study [N]", self.cap - self.value
        return f"{self.quantity.title} beyond the cap of the study [1]", self.excess

    @property
    def words(self) -> str:
        """The quantity, its value and its cap."""
        found = f"{self.quantity.title} {self.value:.4g} {self.quantity.unit}"
        if self.quantity.kind != "least":
            return f"{found} ({above(self.excess)} the cap of {self.cap:.4g})"
        if self.value <= 0.0:
            return f"{found} (a slack rope; the cap is {self.cap:.4g})"
        return f"{found} ({100 * self.excess:.0f} % short of the cap of {self.cap:.4g})"


def beyond_caps(
    output: Playback, replayed: TrussPlayback, drive: Drive, study: TrussStudy
) -> tuple[BeyondCap, ...]:
    """The caps that are broken, and those of whose quantities nothing is known.

    Parameters
    ----------
    output : of the rope.
    replayed : at the same times.
    drive : whose motor winds the rope in.
    """
    capped = [key for key in QUANTITIES if cap_of(study, key) is not None]
    values = _values(output, replayed, drive, study, capped)
    broken = broken_caps(study, values)
    found = []
    for key in capped:
        value, cap = values.get(key, math.nan), cap_of(study, key)
        if cap is not None and (key in broken or math.isnan(value)):
            found.append(BeyondCap(key, value, cap))
    return tuple(found)


def certain(beyond: Sequence[BeyondCap]) -> list[BeyondCap]:
    """The caps that are broken, without those of whose quantities nothing is known."""
    return [one for one in beyond if not math.isnan(one.value)]


def beyond_in_words(beyond: Sequence[BeyondCap]) -> dict[str, str]:
    """The caps that are broken for certain, as the first line of a table; empty without any."""
    words = "; ".join(one.words for one in certain(beyond))
    return {FIRST_LINE: words} if words else {}


def _values(
    output: Playback,
    replayed: TrussPlayback,
    drive: Drive,
    study: TrussStudy,
    capped: list[str],
) -> Mapping[str, float]:
    extremes = extremes_on_the_truss(output, replayed, drive)
    values = {key: value for key, (value, _) in extremes.items()}
    for order, name in enumerate(("speed", "acceleration", "jerk"), start=1):
        values[f"peak-rope-{name}"] = output.peak(order)[0]
    if drive.drum_radius is not None:
        of_the_motor = motor_peaks(output, replayed, drive)
        values |= {f"peak-motor-{name}": value for name, (value, _) in of_the_motor.items()}

    # these two take longer than all the rest together
    motion = (replayed.angle, np.maximum(replayed.speed, 0.0), replayed.acceleration)
    for key, formula in (("peak-bar-force", _forces), ("peak-buckling-load", _shares)):
        if key in capped:
            kernel = _bar_kernel(study.truss, formula)
            values[key] = _greatest(kernel, (*motion, replayed.force))
    if "peak-factored-force" in capped and study.margin is not None:
        kernel = need_kernel(study.margin, study.truss, drive, study.opening)
        values["peak-factored-force"] = _greatest(kernel, motion)
    if "peak-stall-force" in capped and study.margin is not None:
        at_standstill = standstill_kernel(study.margin, drive, study.truss, study.opening)
        if at_standstill is not None:
            values["peak-stall-force"] = _greatest(at_standstill, motion)
    return values


@functools.lru_cache(maxsize=8)
def _bar_kernel(truss: TrussParameters, formula: Callable[..., Any]) -> ca.Function:
    """Angle, speed, acceleration and rope force to what a formula gives."""
    symbols = [ca.SX.sym(name) for name in ("alpha", "omega", "acc", "force")]
    return ca.Function("bars", symbols, [formula(truss, *symbols)], {"cse": True})


def _forces(*state: Any) -> Any:
    return ca.fabs(ca.vertcat(*extreme_bar_forces(*state).values()))


def _shares(*state: Any) -> Any:
    return ca.vertcat(*buckling_shares(*state).values())


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
