"""A table as its drive plays it: interpolated, followed by the loop, and replayed on the truss."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from models.truss import (
    TrussParameters,
    angle_from_rope_length,
    far_end_ratio,
    force_coefficients,
    kinetic_energy,
    mean_tension_ratio,
    reaction_force,
    rope_length,
)
from ocp.arrays import Array
from studies.drive.course import Course, rope_slopes, rope_third
from studies.drive.drum import Drum
from studies.drive.interpolation import (
    ERROR_CONSTANTS,
    AccelerationBound,
    acceleration_bound,
    interpolated,
    second_differences,
)
from studies.drive.loop import FINEST, Loop, followed
from studies.drive.motor import motor_speed, motor_torque, rotor_force, shares_of_the_curve
from studies.drive.schema import Drive
from studies.drive.setpoints import SetPoints

FEWEST = 20_000  # samples of a playback
LEAST_A_PIECE = 5  # samples of each segment, as far as memory goes: forces have peaks inside
MOST = 4_000_000  # samples: what fits into memory beside all histories
ANGLES = 2001  # of a spline along the angle
BEYOND = 0.05  # [rad] past 90 degrees, where an overshoot of the rope may lead
CLOSE = 1e-9  # of a segment: samples beside its ends, where a derivative jumps


@dataclass(frozen=True, eq=False)
class Playback:
    """What a drive makes of a table.

    Attributes
    ----------
    time : since the table's start (n,) [s], the settling of the loop included.
    motion : position, velocity, acceleration and jerk (4, n) of rope or joint; a derivative that
        the interpolation does not have is nan.
    raw : greatest second difference of the table.
    bound : of the acceleration by interpolation and rounding alone; None where it has none.
    most : what the acceleration in `motion` can at most be by proof; None where it has no bound.
    end : time of the table's last point [s].
    at : maps other times (m,) to the same motion, (4, m).
    """

    time: Array
    motion: Array
    raw: float
    bound: AccelerationBound | None
    most: float | None
    end: float
    at: Callable[[Array], Array]

    def peak(self, order: int) -> tuple[float, float]:
        """Greatest modulus of a derivative, and when it is taken; nan where there is none."""
        row = np.abs(self.motion[order])
        if not np.isfinite(row).all():
            return math.nan, math.nan
        k = int(np.argmax(row))
        return float(row[k]), float(self.time[k])


def played(course: Course, points: SetPoints, drive: Drive, kind: str | None = None) -> Playback:
    """What a drive makes of the table of a course.

    Parameters
    ----------
    kind : of interpolation, where the format says it and not the drive.
    """
    kind = kind or drive.interpolation
    curve = interpolated(points, kind)
    bound = acceleration_bound(course, points, kind)
    differences = np.abs(second_differences(points)) if points.times.size > 2 else np.zeros(1)
    raw, end = float(differences.max()), float(points.times[-1])
    loop = loop_of(drive)

    if loop is None:
        # between its points a straight line has no acceleration; at them it has no bound
        smooth = {"hold": 1, "linear": 2}.get(kind, 4)

        def of_the_curve(time: Array, count: int = 4) -> Array:
            rows = np.stack([curve(time, nu=order) for order in range(count)])
            rows[smooth:4] = np.nan
            return rows

        time, motion = _sampled(points.times, math.inf, lambda time: of_the_curve(time, 5))
        most = bound.total if bound is not None and smooth > 2 else None
        return Playback(time, motion, raw, bound, most, end, of_the_curve)

    output = followed(curve, loop, float(points.positions[-1]), bool(points.velocities[0]))
    finest = FINEST / loop.frequency
    time, motion = _sampled(output.edges, finest, lambda time: output.derivatives(time, 5))
    most = filtered_bound(course, points, kind, loop)
    return Playback(time, motion, raw, bound, most, end, output.derivatives)


def wound(played: Playback, drum: Drum) -> Playback:
    """The same with the motion of the rope, of a table that turns a drum.

    What is said of the table itself stays that of the drum's turn.
    """
    return dataclasses.replace(
        played,
        motion=drum.wound(played.motion),
        at=lambda time: drum.wound(played.at(time)),
    )


def at_common_times(first: Playback, second: Playback) -> tuple[Playback, Playback]:
    """Both at the times of either: what follows from the two is worked out sample by sample."""
    time = np.union1d(first.time, second.time)
    both = [dataclasses.replace(one, time=time, motion=one.at(time)) for one in (first, second)]
    return both[0], both[1]


def relieved(course: Course, points: SetPoints, drum: Drum | None = None) -> SetPoints:
    """The table less the stretch of the rope that is in it: what the mechanism gets of it.

    Parameters
    ----------
    drum : whose turn the table is; none if it is the rope's length.
    """
    if course.stretch is None:
        return points
    rows = np.zeros((4, points.times.size))
    rows[:3] = points.positions, points.velocities, points.accelerations
    rope = rows if drum is None else drum.wound(rows)
    rope = rope - course.stretch.derivatives(points.times)

    position, velocity, acceleration, _ = rope if drum is None else drum.turned(rope)
    return dataclasses.replace(
        points, positions=position, velocities=velocity, accelerations=acceleration
    )


def loop_of(drive: Drive) -> Loop | None:
    """The position loop, if the drive states a bandwidth."""
    frequency = drive.natural_frequency
    return None if frequency is None else Loop(frequency, drive.damping)


def filtered_bound(course: Course, points: SetPoints, kind: str, loop: Loop) -> float:
    """The most that the acceleration after the loop can be.

    What the course and its interpolation have is magnified by at most the loop's overshoot. What
    rounding adds is bounded twice, by the acceleration and by the position that it disturbs.
    """
    speed, peak, _ = course.peaks
    count = points.count or 0.0
    if kind == "hold":
        wrong = points.longest * speed + count / 2
        return loop.overshoot * peak + loop.curvature * wrong

    rounded = loop.curvature * ERROR_CONSTANTS[kind].position * count
    if kind == "linear":
        steps = np.diff(points.times)
        # impulses no closer than the shortest step, none of them larger than the longest's
        gain = loop.impulses(points.shortest) * float(steps.max() / steps.min())
        return gain * peak + rounded

    bound = acceleration_bound(course, points, kind)
    assert bound is not None  # of these interpolations there is always one
    return loop.overshoot * (bound.course + bound.interpolation) + min(
        rounded, loop.overshoot * bound.rounding
    )


def _sampled(
    edges: Array, finest: float, derivatives: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Times of a playback (n,), and position, speed, acceleration and jerk at them (4, n).

    They are times in all pieces, and those at which one of the four turns inside a piece. There
    its next derivative is zero. A straight line between the two samples beside that time and one
    step of Newton's method give it: exactly for a cubic, elsewhere far closer than a peak needs.

    Parameters
    ----------
    edges : between which the motion is smooth [s].
    finest : no samples farther apart than this, as far as memory goes [s].
    derivatives : maps times (m,) to the position and its first four derivatives, (5, m).
    """
    time, piece = _samples(edges, finest)
    rows = derivatives(time)

    together, turns = piece[1:] == piece[:-1], []
    for order in range(1, 5):
        row = rows[order]
        k = np.flatnonzero(together & (row[1:] * row[:-1] < 0.0))
        turn = time[k] + (time[k + 1] - time[k]) * row[k] / (row[k] - row[k + 1])
        if order < 4:  # of the fourth derivative there is no slope
            near = derivatives(turn)
            steep = near[order + 1] != 0.0
            turn[steep] -= near[order, steep] / near[order + 1, steep]
        turns.append(np.clip(turn, time[k], time[k + 1]))
    added = np.concatenate(turns)

    time = np.concatenate([time, added])
    sequence = np.argsort(time, kind="stable")
    motion = np.concatenate([rows[:4], derivatives(added)[:4]], axis=1)
    return time[sequence], motion[:, sequence]


def _samples(edges: Array, finest: float) -> tuple[Array, Any]:
    """Times inside all pieces, close to their ends too, and the piece of each."""
    steps = np.diff(edges)
    # of millions of segments the two ends and the turns between them have to do
    ends = max(2, min(LEAST_A_PIECE, MOST // steps.size))
    least = max(ends, math.ceil(FEWEST / steps.size))
    each = np.full(steps.size, least)
    if math.isfinite(finest):
        wanted = np.ceil(steps / finest).astype(int) + 1
        each = np.clip(wanted, least, max(least, MOST // steps.size))

    piece = np.repeat(np.arange(steps.size), each)
    behind = np.arange(piece.size) - np.repeat(np.cumsum(each) - each, each)
    inside = CLOSE + (1 - 2 * CLOSE) * behind / (each[piece] - 1)
    times: Array = edges[piece] + steps[piece] * inside
    return times, piece


@dataclass(frozen=True, eq=False)
class TrussPlayback:
    """The truss that a played rope moves.

    Attributes
    ----------
    angle, speed, acceleration, jerk : of the deployment angle (n,) [rad, rad/s, rad/s^2, rad/s^3].
    force, far_end : pull of the motor and of the rope's fixed end on each rope (n,) [N].
    mean_tension : of each rope along its length (n,) [N].
    power : of both motors, without their rotors (n,) [W].
    reaction : on the arm (n,) [N].
    energy : of motion (n,) [J].
    """

    angle: Array
    speed: Array
    acceleration: Array
    jerk: Array
    force: Array
    far_end: Array
    mean_tension: Array
    power: Array
    reaction: Array
    energy: Array


def on_the_truss(
    motion: Array, truss: TrussParameters, winding: Array | None = None
) -> TrussPlayback:
    """Replay a rope's motion (4, n) on the truss.

    The rope's length gives the angle, and its rates those of the angle. Where the rope pays out,
    the sense of its friction is kept: the model's force holds for a rope that is wound in.

    Parameters
    ----------
    winding : speed at which the motor winds (n,) [m/s], where it is not that of the motion: it
        winds in the stretch of its rope, too.

    Raises
    ------
    ModelError
        If the rope leaves the reach of the mechanism.
    """
    stowed = float(rope_length(truss, truss.stowed_angle))
    angle = angle_from_rope_length(truss, stowed - motion[0])
    slope, curvature = rope_slopes(truss, angle)

    speed = -motion[1] / slope
    acceleration = (-motion[2] - curvature * speed**2) / slope
    acceleration = np.where(np.isnan(motion[2]), np.nan, acceleration)
    bent = 3 * curvature * speed * acceleration + rope_third(truss, angle) * speed**3
    jerk = (-motion[3] - bent) / slope
    winding = motion[1] if winding is None else winding
    forwards = np.maximum(speed, 0.0)
    row = along(truss, angle)
    # (38); all terms but the viscous one are even in the speed
    force = row[0] + row[1] * forwards**2 + row[2] * forwards + row[3] * acceleration
    return TrussPlayback(
        angle=angle,
        speed=speed,
        acceleration=acceleration,
        jerk=jerk,
        force=force,
        far_end=force * row[4],
        mean_tension=force * row[5],
        power=2 * force * np.maximum(winding, 0.0),
        reaction=row[6] * speed**2 + row[7] * acceleration,
        energy=row[8] * speed**2,
    )


def along(truss: TrussParameters, angle: Array) -> Array:
    """The nine functions of the angle that make up forces and energy, (9, n).

    The first four are those of (38): the pull is row 0, plus row 1 times the speed squared, row 2
    times the speed and row 3 times the acceleration of the angle. Row 5 is the mean tension over
    the pull.
    """
    slack, taut = _splines(truss)
    rows: Array = np.where(angle < truss.net_angle, slack(angle).T, taut(angle).T)
    return rows


@functools.lru_cache(maxsize=8)
def _splines(truss: TrussParameters) -> tuple[Any, Any]:
    """These functions as cubic splines, below and above the angle at which the net becomes taut.

    A playback has up to millions of samples, and the friction of every pulley is in the functions.
    On `ANGLES` angles a spline misses them by 1e-10 of their size.
    """
    from scipy.interpolate import CubicSpline

    alpha = ca.SX.sym("alpha")
    terms = force_coefficients(truss, alpha)
    outputs = [
        *terms,
        far_end_ratio(truss, alpha),
        mean_tension_ratio(truss, alpha),
        reaction_force(truss, alpha, 1.0, 0.0),
        reaction_force(truss, alpha, 0.0, 1.0),
        kinetic_energy(truss, alpha, 1.0),
    ]
    kernel = ca.Function("along", [alpha], outputs, {"cse": True})

    def spline(low: float, high: float) -> Any:
        grid = np.linspace(low, high, ANGLES)
        return CubicSpline(grid, np.stack([row.full().ravel() for row in kernel(grid[None])], 1))

    edge = 1e-12  # the kink belongs to neither side
    net = truss.net_angle
    return spline(truss.stowed_angle / 2, net - edge), spline(net + edge, math.pi / 2 + BEYOND)


def extremes_on_the_truss(
    played: Playback, truss: TrussPlayback, drive: Drive
) -> Mapping[str, tuple[float, float]]:
    """Peaks on the truss, least tension and their times; nan where the motion has no derivative."""
    of_rotors = 2 * _rotor_force(played, drive) * np.maximum(played.motion[1], 0.0)
    least, when = _greatest(-np.minimum(truss.force, truss.far_end), played.time)
    rows = {
        "peak-acceleration": np.abs(truss.acceleration),
        "peak-speed": np.abs(truss.speed),
        "peak-jerk": np.abs(truss.jerk),
        "peak-far-end-tension": truss.far_end,
        "peak-force": truss.force,
        "peak-power": truss.power + of_rotors,
        "peak-reaction": np.abs(truss.reaction),
    }
    peaks = {name: _greatest(row, played.time) for name, row in rows.items()}
    return {**peaks, "least-tension": (-least, when)}


def _rotor_force(played: Playback, drive: Drive) -> Any:
    """What the rotor takes of the motor's force on its rope [N]: it moves as the drum does."""
    wound, speed, acceleration, _ = played.motion
    return rotor_force(drive, speed, acceleration, wound)


def _greatest(row: Array, time: Array) -> tuple[float, float]:
    if not np.isfinite(row).all():
        return math.nan, math.nan
    k = int(np.argmax(row))
    return float(row[k]), float(time[k])


def motor_peaks(
    played: Playback, truss: TrussPlayback, drive: Drive
) -> Mapping[str, tuple[float, float]]:
    """Greatest speed, torque and share of the curve of one motor, and their times.

    Of a motor with a rotor also the force on its rope, that of the rotor included.
    """
    wound, speed = played.motion[0], np.abs(played.motion[1])
    force = truss.force + _rotor_force(played, drive)
    torque = motor_torque(drive, force, wound)
    rows = {"speed": motor_speed(drive, speed, wound), "torque": torque}
    shares = shares_of_the_curve(drive, rows["speed"], torque)
    if shares:
        rows["load"] = np.max(shares, axis=0)
    if drive.motor_inertia > 0.0:
        rows |= {"force": np.abs(force), "torque": np.abs(torque)}
    return {name: _greatest(row, played.time) for name, row in rows.items()}
