"""A search for motions of the ring with a cap on jerk, by linear programs in a row.

The jerk is constant on each of N equal intervals, so angle, rate and acceleration at any time are
linear in it. What must be small, such as a force, is linearised by all three at four times an
interval, and the largest of it is made least within a trust region: first on a few intervals, then
on twice as many. So what is found is a motion that exists, and is the least only near by and for so
many intervals. It shares no code with the engine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import linprog

from tests.models.drive_twin import Array, rope_force

Course = tuple[Array, Array, Array]  # alpha [rad], rate [rad/s], acceleration [rad/s^2]

MESHES = (30, 60, 120)  # intervals
TIMES = 4  # of an interval, at which the rows of a program stand
DENSE = 8001  # times of a motion at which what is found is evaluated
PROGRAMS = 60  # at most; about twenty are needed
FIRST_REGION = 0.05  # [rad], how far an angle may move in the first program
FINER_REGION = 0.005  # [rad], the same on a finer mesh, whose start is near the answer
LAST_REGION = 1e-6  # [rad]: a gain that needs so small a step is one of rounding
DIFFERENCE = 1e-6  # of central differences: 1e-6 N of error in forces of 40 N
PUSH_COST = 20.0  # of a newton by which a rope would have to push


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions of a truss in a duration [s], on N intervals, of no more than jerk/duration^3."""

    parameters: Any
    duration: float
    jerk: float
    intervals: int
    times: Array = field(init=False)

    def __post_init__(self) -> None:
        times = np.linspace(0.0, 1.0, self.intervals * TIMES + 1)
        object.__setattr__(self, "times", times)

    def maps(self, times: Array) -> list[Array]:
        """What a jerk makes of angle, rate and acceleration, in units of the duration."""
        edges = np.linspace(0.0, 1.0, self.intervals + 1)
        since = np.maximum(times[:, None] - edges, 0.0)
        powers = [since**3 / 6, since**2 / 2, since]
        return [power[:, :-1] - power[:, 1:] for power in powers]

    def course(self, jerk: Array, times: Array | None = None) -> Course:
        """Angle, rate and acceleration of a motion from rest at the stowed angle."""
        way, rate, bend = (m @ jerk for m in self.maps(self.times if times is None else times))
        start = self.parameters.stowed_angle
        return start + way, rate / self.duration, bend / self.duration**2

    def ends(self) -> tuple[Array, Array]:
        """Rows and right-hand sides of a jerk that arrives at rest at 90 deg."""
        rows = np.vstack(self.maps(np.array([1.0])))
        return rows, np.array([np.pi / 2 - self.parameters.stowed_angle, 0.0, 0.0])


def gentle(motions: Motions) -> Array:
    """Jerk (N,) of the motion of least peak acceleration."""
    _, rate, bend = motions.maps(motions.times)
    one, none = np.ones((motions.times.size, 1)), np.zeros((motions.times.size, 1))
    rows = np.block([[bend, -one], [-bend, -one], [-rate, none]])
    ends, way = motions.ends()
    return linprog(
        np.r_[np.zeros(motions.intervals), 1.0],
        A_ub=rows,
        b_ub=np.zeros(len(rows)),
        A_eq=np.hstack([ends, np.zeros((3, 1))]),
        b_eq=way,
        bounds=[(-motions.jerk, motions.jerk)] * motions.intervals + [(0, None)],
    ).x[:-1]


@dataclass(frozen=True, eq=False)
class Question:
    """What must be small: `values` makes arrays of one unit from angle, rate and acceleration.

    Besides, rates are not negative, and ropes only pull.
    """

    motions: Motions
    values: Callable[..., list[Array]]

    def all_values(self, course: Course) -> list[Array]:
        """What must be small, and last by how much the rope would have to push [N]."""
        return [*self.values(*course), -rope_force(self.motions.parameters, *course)]

    def merit(self, jerk: Array) -> float:
        """The largest value, and a cost if the rope would have to push."""
        *wanted, push = self.all_values(self.motions.course(jerk))
        return max(v.max() for v in wanted) + PUSH_COST * max(0.0, push.max())

    def slopes(self, course: Course) -> list[Array]:
        """Derivatives of all values by the jerk, by central differences."""
        motions, maps = self.motions, self.motions.maps(self.motions.times)
        slopes = [
            np.zeros((motions.times.size, motions.intervals)) for _ in self.all_values(course)
        ]
        for k in range(3):
            sides = []
            for step in (DIFFERENCE, -DIFFERENCE):
                moved = list(course)
                moved[k] = course[k] + step
                sides.append(self.all_values((moved[0], moved[1], moved[2])))
            for slope, up, down in zip(slopes, *sides, strict=True):
                by = (up - down) / (2 * DIFFERENCE * motions.duration**k)
                slope += by[:, None] * maps[k]
        return slopes

    def program(self, jerk: Array) -> Callable[[float], tuple[Array, float] | None]:
        """Linear program around a motion: step of the jerk and peak, by the trust region [rad]."""
        motions, course = self.motions, self.motions.course(jerk)
        angle, rate, _ = motions.maps(motions.times)
        now, none = self.all_values(course), np.zeros((motions.times.size, 1))
        # A value stands below the peak; the pull, the rate and the trust region know none.
        slopes = [*self.slopes(course), -rate, angle, -angle]
        peaks = [none - 1.0] * (len(now) - 1) + [none] * 4
        rows = np.block([[slope, peak] for slope, peak in zip(slopes, peaks, strict=True)])
        ends, way = motions.ends()

        def solved(region: float) -> tuple[Array, float] | None:
            room = np.full(2 * len(angle), region)
            answer = linprog(
                np.r_[np.zeros(motions.intervals), 1.0],
                A_ub=rows,
                b_ub=np.concatenate([*(-v for v in now), rate @ jerk, room]),
                A_eq=np.hstack([ends, np.zeros((3, 1))]),
                b_eq=way - ends @ jerk,
                bounds=[(-motions.jerk - j, motions.jerk - j) for j in jerk] + [(None, None)],
            )
            return None if answer.x is None else (answer.x[:-1], answer.x[-1])

        return solved

    def improved(self, jerk: Array, region: float) -> Array:
        """Jerk (N,) that no step improves any more."""
        best = self.merit(jerk)
        for _ in range(PROGRAMS):
            program = self.program(jerk)
            while region > LAST_REGION:
                answer = program(region)
                found = np.inf if answer is None else self.merit(jerk + answer[0])
                if answer is not None and found < best - 1e-9 * abs(best):
                    break
                region /= 4
            else:
                return jerk
            region *= 2 if best - found > 0.7 * (best - answer[1]) else 1
            jerk, best = jerk + answer[0], found
        return jerk


def least_peak(
    parameters: Any, duration: float, cap: float, values: Callable[..., list[Array]]
) -> tuple[Course, float]:
    """Motion at dense times whose largest value is the least that was found, and that value."""
    jerk, region = gentle(Motions(parameters, duration, cap, MESHES[0])), FIRST_REGION
    for intervals in MESHES:
        motions = Motions(parameters, duration, cap, intervals)
        jerk = np.repeat(jerk, intervals // jerk.size)
        jerk, region = Question(motions, values).improved(jerk, region), FINER_REGION
    course = motions.course(jerk, np.linspace(0.0, 1.0, DENSE))
    return course, float(max(v.max() for v in values(*course)))
