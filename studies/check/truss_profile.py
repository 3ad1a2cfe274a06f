"""A profile of the truss: its angle from the columns there are, and the motion behind it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.laws import AngularMotion, DerivedLaw, Law
from models.truss import TrussParameters, angle_from_rope_length, one_way, rope_length
from models.truss.kinematics import rope_speed
from ocp.arrays import Array
from studies.check.own_rows import stated_law
from studies.check.reading.profile import SAME, MeasuredProfile
from studies.check.reading.table import refuse
from studies.check.smoothing.noise import NoiseEstimate, steepest_slopes
from studies.check.smoothing.recovery import SLOW, Recovered, recover
from studies.truss.config import DEPLOYED

BEYOND = 0.05  # of the rope's travel: lengths further outside are another rope's, or another unit's
LEAST_ANGLE = 0.01  # [rad], below which the model's rope hardly moves; noise may reach it
DIGITS = 0.5  # of the scatter: more of it by digits is no noise
FOLLOWS = 1.5  # times the scatter of the rows: by more a curve misses what these tell
FAR_BEYOND = 0.5  # [rad] past both ends: an angle of something else


@dataclass(frozen=True, eq=False)
class ReachableLaw(DerivedLaw):
    """A law with noise taken back to what the truss can do: at most open, the rope wound in.

    Attributes
    ----------
    law : any law.
    forwards : whether negative speeds count as none, as pulley friction needs.
    """

    forwards: bool

    def motion(self, time: ArrayLike) -> AngularMotion:
        """Motion at times (m,) in [0, T]."""
        motion = self.law.motion(time)
        angle = np.clip(motion.angle, LEAST_ANGLE, DEPLOYED)
        # at its stops the truss rests
        moves = angle == motion.angle
        speed = np.maximum(motion.speed, 0.0) if self.forwards else motion.speed
        return AngularMotion(
            time=motion.time,
            angle=angle,
            speed=np.where(moves, speed, 0.0),
            acceleration=np.where(moves, motion.acceleration, 0.0),
            jerk=np.where(moves, motion.jerk, 0.0),
        )


@dataclass(frozen=True, eq=False)
class TrussProfile:
    """A profile of the truss.

    Attributes
    ----------
    measured : the file's content.
    angle, scale : (m,) angles [rad], and the scatter of each over the noise.
    source : "angle" or "rope_length", of which the noise is.
    recovered : the motion behind it.
    stated : whether that is what the rates of the rows state.
    """

    measured: MeasuredProfile
    angle: Array
    scale: Array
    source: str
    recovered: Recovered
    stated: bool = False

    @cached_property
    def rounding(self) -> Array:
        """By how much the digits of values and times leave each angle open, (m,) [rad]."""
        of_values = np.abs(self.scale) * self.measured.rounding[self.source]
        # a time that is wrong is an angle that is
        slopes = steepest_slopes(self.measured.time, self.angle)
        return of_values + self.measured.rounding["time"] * slopes

    @cached_property
    def smooth(self) -> bool:
        """Whether the smoothed curve and its band tell what the rows do not.

        They do not where digits that were cut off are most of the scatter, as these are no noise
        that is independent from row to row, nor where the curve does not follow the rows, as where
        the acceleration jumps.
        """
        recovered = self.recovered
        if recovered.fit is None or recovered.scatter is None:
            return False
        cut = float(np.median(self.rounding / recovered.scatter))
        follows = recovered.fit.noise <= FOLLOWS * recovered.noise.deviation
        return cut < DIGITS and follows

    def reachable(self, truss: TrussParameters, law: Law | None = None) -> ReachableLaw:
        """The recovered law, or another one, as the model can take it."""
        return ReachableLaw(law or self.recovered.law, bool(one_way(truss)))


def recover_truss(measured: MeasuredProfile, truss: TrussParameters) -> TrussProfile:
    """The motion behind a profile of the truss.

    Raises
    ------
    StudyError
        If angles or lengths cannot be this truss's, or contradict each other.
    """
    values = measured.values
    from_rope = None
    if "rope_length" in values:
        from_rope = _angles_of(measured, values["rope_length"], truss)
    if "angle" not in values:
        assert from_rope is not None
        angle, scale, source = *from_rope, "rope_length"
    else:
        angle, scale, source = values["angle"], np.ones(measured.time.size), "angle"
        if from_rope is not None:
            _check_agreement(measured, angle, values["rope_length"], truss)

    _check_range(measured, angle)
    law = stated_law(measured)
    if law is not None:
        speed = np.abs(law.motion(measured.time - measured.time[0]).speed)
        # where it is not under way the checks of its ends say what it lacks of rest
        start = 0 if speed[0] > SLOW * speed.max() else 2
        exact = Recovered(law, NoiseEstimate(0.0, 0.0, False), (start, 2), None)
        return TrussProfile(measured, angle, scale, source, exact, stated=True)
    return TrussProfile(
        measured,
        angle,
        scale,
        source,
        recover(measured.time, angle, scale, measured.rounding["time"]),
    )


def _check_range(measured: MeasuredProfile, angle: Array) -> None:
    low, high = float(angle.min()), float(angle.max())
    if low < -FAR_BEYOND or high > DEPLOYED + FAR_BEYOND:
        refuse(
            measured.path,
            f"has angles from {math.degrees(low):.4g} to {math.degrees(high):.4g} deg, but the "
            "truss opens to 90 deg; correct the column or its unit",
        )
    if angle[-1] <= angle[0]:
        refuse(
            measured.path,
            f"ends at {math.degrees(angle[-1]):.4g} deg, not beyond its start at "
            f"{math.degrees(angle[0]):.4g} deg; give an opening, from stowed to deployed",
        )


def _lengths(truss: TrussParameters, angle: Array) -> Array:
    return np.asarray(rope_length(truss, ca.DM(angle))).ravel()


def _angles_of(
    measured: MeasuredProfile, length: Array, truss: TrussParameters
) -> tuple[Array, Array]:
    """Angles (m,) of rope lengths, and how much a metre of noise turns each [rad/m]."""
    longest, shortest = _lengths(truss, np.array([truss.stowed_angle, DEPLOYED]))
    travel = longest - shortest
    low, high = float(length.min()), float(length.max())
    if low < shortest - BEYOND * travel or high > longest + BEYOND * travel:
        _refuse_lengths(measured, (low, high), (shortest, longest))

    # noise may ask for more rope than there is folded: there the tangent goes on
    fold = truss.stowed_angle / 2
    reach = np.minimum(length, _lengths(truss, np.array([fold]))[0])
    angle = angle_from_rope_length(truss, reach)
    slope = -np.asarray(rope_speed(truss, ca.DM(angle), 1.0)).ravel()
    return angle - (length - reach) / slope, 1 / slope


def _refuse_lengths(
    measured: MeasuredProfile, found: tuple[float, float], rope: tuple[float, float]
) -> None:
    shortest, longest = rope
    travel, (low, high) = longest - shortest, found
    units = {"mm": 1e-3, "m": 1e3, "cm": 1e-2}  # what is in metres may be headed as millimetres
    like = next((u for u, f in units.items() if shortest * 0.9 < high * f < longest * 1.1), "")
    if like:
        hint = f"these look like {like}: write 'rope_length [{like}]'"
    elif abs(low) <= BEYOND * travel and 0.5 * travel < high <= (1.0 + BEYOND) * travel:
        hint = (
            "these look like lengths wound in, from 0 on: give the remaining rope length, "
            f"{longest:.6g} m minus the length wound in"
        )
    else:
        hint = (
            "give the length of one rope, and the truss to which it belongs, or correct the column"
        )
    refuse(
        measured.path,
        f"has rope lengths from {low:.6g} to {high:.6g} m, but the rope of this truss is "
        f"{longest:.6g} m long when stowed and {shortest:.6g} m when open; {hint}",
    )


def _check_agreement(
    measured: MeasuredProfile, angle: Array, length: Array, truss: TrussParameters
) -> None:
    """Refuse an angle and a rope length that belong to different motions."""
    expected = _lengths(truss, np.clip(angle, LEAST_ANGLE, DEPLOYED))
    miss, travel = np.abs(length - expected), float(np.ptp(expected)) or 1.0
    # noise of single rows is none of a contradiction
    if float(np.median(miss)) > SAME * travel:
        row = int(np.argmax(miss))
        refuse(
            measured.path,
            f"contradicts itself: at {measured.time[row]:.6g} s its angle of "
            f"{math.degrees(angle[row]):.4g} deg belongs to a rope of {expected[row]:.6g} m on "
            f"this truss, but its rope length is {length[row]:.6g} m; keep the right column, or "
            "give the parameters of the truss",
        )
