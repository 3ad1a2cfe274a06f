"""What the peaks of a profile with exact rows are at least, whatever the curve between them does.

The curve that is drawn through the rows overshoots where the jerk switches, so that its own peaks
prove nothing. Divided differences do: they are means of a derivative. For the rope they are taken
of its lengths, and where a profile states its rates, of these as well. What a row states holds
there. For forces there are no such means; from angles alone they are estimated.

Symbols: l, length of the rope; floors are of the quantity, or of its negative where the least of
it is meant, so that none lies below.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.laws import AngularMotion, DerivedLaw, Piecewise
from models.truss import rope_length
from models.truss.kinematics import rope_speed
from ocp.arrays import Array
from studies.check.own_rows import rounding_of_rates
from studies.check.smoothing.means import noisy_peak, proven_peak
from studies.check.smoothing.noise import ROUNDING
from studies.check.smoothing.recovery import kept_rows
from studies.check.truss_profile import LEAST_ANGLE, TrussProfile
from studies.drive.motor import motor_speed
from studies.truss.config import DEPLOYED
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import QUANTITIES

SCATTER = 5.0  # standard deviations of what is no noise that matters, by which a value may be wrong
RATE_NAMES = ("speed", "acceleration", "jerk")
OF_THE_JERK = ("peak-jerk", "peak-rope-jerk")

Floors = dict[str, float]
Scattered = dict[str, tuple[Array, Array]]  # values of rows, and by how much each may be wrong


@dataclass(frozen=True, eq=False)
class AtRows(DerivedLaw):
    """A law that knows its motion at some instants only.

    Attributes
    ----------
    law : that gives all else.
    rows : the motion that it answers with, whatever the times.
    """

    rows: AngularMotion

    def motion(self, time: ArrayLike) -> AngularMotion:
        """The rows."""
        return self.rows


def sign(key: str) -> float:
    """-1 where the least of a quantity is meant."""
    return -1.0 if QUANTITIES[key].kind == "least" else 1.0


def proven_floors(found: TrussProfile, deployment: Deployment) -> Floors:
    """What is proven of the peaks of exact rows, by quantity."""
    time, angle, wrong = exact_rows(found)
    of_differences = _by_differences(time, angle, wrong, deployment)
    if not found.stated:
        return of_differences
    return _higher(of_differences, _at_rows(found, deployment))


def estimated_floors(found: TrussProfile, deployment: Deployment) -> Floors:
    """What the peaks are at least by the means of speed and acceleration about each row.

    No proof, but nothing of it is the curve's. Means over twice as many rows miss by four times as
    much where the motion is smooth. So the difference is taken off, and three rows in a row have to
    say the same, less what their digits leave open. An end that is taken as at rest says what
    holds the truss there.
    """
    time, angle, _ = exact_rows(found)
    near, wide = (_heights_by_means(k, found, deployment) for k in (1, 2))
    floors = {}
    for key, (values, _) in wide.items():
        inner, off = (part[1:-1] for part in near[key])
        sure = inner - np.abs(inner - values) - off
        floors[key] = float(np.lib.stride_tricks.sliding_window_view(sure, 3).min(axis=1).max())

    still = [place for place, rest in zip((0, -1), found.recovered.rest, strict=True) if rest == 2]
    if not still:
        return floors
    none = np.zeros(len(still))
    ends = AngularMotion(time[still], angle[still], none, none, none)
    heights = _heights(_deployed(found, deployment, ends), ends.time)
    return {key: max(floor, float(heights[key].max())) for key, floor in floors.items()}


def exact_rows(found: TrussProfile) -> tuple[Array, Array, Array]:
    """Times, angles, and by how much each angle may be wrong, (m,) each."""
    kept = kept_rows(found.angle.size)
    time, angle = found.measured.time[kept], found.angle[kept]
    by_noise = SCATTER * found.recovered.noise.deviation * np.abs(found.scale)
    return time, angle, np.maximum(ROUNDING * np.abs(angle), by_noise[kept]) + found.rounding[kept]


def _higher(*floors: Floors) -> Floors:
    """The highest floor of each quantity."""
    keys = dict.fromkeys(key for one in floors for key in one)
    return {key: max(one[key] for one in floors if key in one) for key in keys}


def floors_of_noise(found: TrussProfile, deployment: Deployment) -> Floors:
    """What the peaks of noisy rows are at least by means over windows, nearly certainly.

    The smoothed curve swings beside a jump, and its band knows nothing of that.
    """
    scatter = found.recovered.scatter
    assert scatter is not None
    length, steep = _lengths(found.angle, deployment)
    floors, none = {}, np.ones_like(steep)
    for order, name in enumerate(RATE_NAMES, start=1):
        for kind, values, size in (("", found.angle, none), ("rope-", length, steep)):
            floors[f"peak-{kind}{name}"] = noisy_peak(
                found.measured.time, values, size * scatter, size * found.rounding, order
            )
    return floors


def _lengths(angle: Array, deployment: Deployment) -> tuple[Array, Array]:
    """Lengths of the rope at angles, and by how much an angle changes each, (m,) [m, m/rad]."""
    truss, within = deployment.truss, ca.DM(np.clip(angle, LEAST_ANGLE, DEPLOYED))
    length = np.asarray(rope_length(truss, within)).ravel()
    return length, np.abs(np.asarray(rope_speed(truss, within, 1.0)).ravel())


def _by_differences(time: Array, angle: Array, wrong: Array, deployment: Deployment) -> Floors:
    """By divided differences of the angles, and of the rope's lengths that they make."""
    truss = deployment.truss
    length, steep = _lengths(angle, deployment)
    off = steep * wrong + ROUNDING * length

    floors = {}
    for order, name in enumerate(RATE_NAMES, start=1):
        floors[f"peak-{name}"] = proven_peak(time, angle, wrong, order)
        floors[f"peak-rope-{name}"] = proven_peak(time, length, off, order)
    if deployment.drive is not None and deployment.drive.drum_radius is not None:
        steps = np.maximum(np.abs(np.diff(length)) - off[1:] - off[:-1], 0.0) / np.diff(time)
        wound = float(rope_length(truss, truss.stowed_angle)) - length
        # the radius of the drum at that instant is one between those of both rows
        ends = [motor_speed(deployment.drive, steps, end) for end in (wound[:-1], wound[1:])]
        floors["peak-motor-speed"] = float(np.min(ends, axis=0).max())
    return floors


def _stated(found: TrussProfile) -> tuple[AngularMotion, AngularMotion]:
    """What the rows state: behind each of them, and before it."""
    law, time = found.recovered.law, found.measured.time
    return law.motion(time), law.motion(np.nextafter(time, 0.0))


def _digits(found: TrussProfile) -> dict[str, Array]:
    """By how much the digits of the rows leave open what they state."""
    measured = found.measured
    return {"angle": measured.rounding["angle"], **rounding_of_rates(measured)}


def _at_rows(found: TrussProfile, deployment: Deployment) -> Floors:
    """What the rows themselves state, less what their digits leave open."""

    def read(rows: AngularMotion) -> dict[str, Array]:
        return _heights(_deployed(found, deployment, rows), found.measured.time)

    halves = _digits(found)
    sides = [_with_scatter(read, rows, halves) for rows in _stated(found)]
    floors = _higher(
        *({key: float((x - off).max()) for key, (x, off) in side.items()} for side in sides)
    )
    # of rows that state no jerk it is the drawn curve's
    drawn = () if isinstance(found.recovered.law, Piecewise) else OF_THE_JERK
    return {key: floor for key, floor in floors.items() if key not in drawn and floor > -np.inf}


def _with_scatter(
    read: Callable[[AngularMotion], dict[str, Array]],
    rows: AngularMotion,
    halves: Mapping[str, Array],
) -> Scattered:
    """What is read of rows, and by how much what these may be wrong by changes it, (m,) each."""
    centre = read(rows)
    off = {key: ROUNDING * np.abs(values) for key, values in centre.items()}
    for name, half in halves.items():
        # backwards, where there is always room
        shifted = read(dataclasses.replace(rows, **{name: getattr(rows, name) - half}))
        off = {key: off[key] + _moved(centre[key], shifted[key]) for key in centre}
    return {key: (centre[key], off[key]) for key in centre}


def _moved(centre: Array, shifted: Array) -> Array:
    """By how much values change; not at all if they are not known."""
    known = np.isfinite(centre)
    return np.abs(np.subtract(shifted, centre, out=np.zeros_like(centre), where=known))


def _deployed(found: TrussProfile, deployment: Deployment, rows: AngularMotion) -> Deployment:
    """The truss in the motion of rows, within its reach."""
    within = dataclasses.replace(rows, angle=np.clip(rows.angle, LEAST_ANGLE, DEPLOYED))
    law = found.reachable(deployment.truss, AtRows(found.recovered.law, within))
    return dataclasses.replace(deployment, law=law)


def _heights(deployment: Deployment, time: Array) -> dict[str, Array]:
    """Histories at rows, high where the peak is; -inf where a quantity is not known."""
    return {
        key: np.nan_to_num(sign(key) * values, nan=-np.inf)
        for key, values in deployment.histories(time).items()
    }


def _heights_by_means(k: int, found: TrussProfile, deployment: Deployment) -> Scattered:
    """Heights at the inner rows by the parabola through the k-th rows before and behind each."""
    time, angle, wrong = exact_rows(found)
    at, left, right = slice(k, -k), slice(0, -2 * k), slice(2 * k, None)
    h, g = time[at] - time[left], time[right] - time[at]
    first, second = (angle[at] - angle[left]) / h, (angle[right] - angle[at]) / g
    turn = 2 * (second - first) / (h + g)
    speed = (first * g + second * h) / (h + g)
    rows = AngularMotion(time[at], angle[at], speed, turn, np.zeros_like(turn))

    off_first, off_second = (wrong[at] + wrong[left]) / h, (wrong[right] + wrong[at]) / g
    halves = {
        "angle": wrong[at],
        "speed": (off_first * g + off_second * h) / (h + g),
        "acceleration": 2 * (off_first + off_second) / (h + g),
    }

    def read(rows: AngularMotion) -> dict[str, Array]:
        heights = _heights(_deployed(found, deployment, rows), time[at])
        return {key: values for key, values in heights.items() if key not in OF_THE_JERK}

    return _with_scatter(read, rows, halves)
