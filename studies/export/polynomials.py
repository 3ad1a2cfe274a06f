"""A course as polynomial segments: of the angle exact, of other courses to a stated error.

A law of the angle with piecewise quadratic acceleration is a quartic on each piece, so its segments
are the law itself. Rope is a function of the angle that no polynomial equals. It is interpolated at
Chebyshev points, which include both ends, and pieces are halved until the error is small enough.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.laws import Law, Piecewise
from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.drive.course import Course

DEGREE = 7  # of a segment that approximates
ERROR = 1e-9  # [m of rope, or rad of a joint], unless another one is stated
MOST_HALVINGS = 30
CHECKS = 64  # points of a segment at which its error is looked at


@dataclass(frozen=True, eq=False)
class Segments:
    """Polynomials one after the other.

    Attributes
    ----------
    edges : times of their ends (m + 1,), from 0 [s].
    coefficients : of powers of the time since a segment's start, constant first, (m, n).
    unit : of the position.
    error : the largest difference from the course that was found; 0 where they are the course.
    """

    edges: Array
    coefficients: Array
    unit: str
    error: float

    def curve(self) -> Any:
        """The same as a SciPy piecewise polynomial."""
        from scipy.interpolate import PPoly

        return PPoly(self.coefficients.T[::-1], self.edges)


def exact_segments(law: Law) -> Segments:
    """The segments of a law that is a polynomial on each piece.

    Raises
    ------
    StudyError
        If the law is none.
    """
    if not isinstance(law, Piecewise):
        raise StudyError(
            "the angle of this result is not a polynomial between its switches, because its jerk "
            "is not capped; export its rope with --signal rope, or as a table"
        )
    starts = np.array(law.edges[:-1])
    motion = law.motion(starts)
    rates = np.array(law.rates)
    columns = [
        motion.angle,
        motion.speed,
        rates[:, 0] / 2,
        rates[:, 1] / 6,
        rates[:, 2] / 24,
    ]
    return Segments(np.array(law.edges), np.stack(columns, axis=1), "rad", 0.0)


def fitted_segments(course: Course, error: float = ERROR) -> Segments:
    """Segments that differ from a course by at most `error`, joined without a gap.

    Raises
    ------
    StudyError
        If the course is too rough for it.
    """
    nodes = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2
    # on a unit interval, so that the powers stay well scaled
    inverse = np.linalg.inv(np.vander(nodes, increasing=True))
    checks = np.linspace(0.0, 1.0, CHECKS)
    powers = np.vander(checks, DEGREE + 1, increasing=True)

    waiting = [(a, b, 0) for a, b in zip(course.switches, course.switches[1:], strict=False)]
    waiting.reverse()
    edges, rows, worst = [0.0], [], 0.0
    while waiting:
        a, b, halvings = waiting.pop()
        scaled = inverse @ course.derivatives(a + (b - a) * nodes)[0]
        miss = np.abs(powers @ scaled - course.derivatives(a + (b - a) * checks)[0]).max()
        # half of it is kept for what lies between the checks
        if miss > error / 2:
            if halvings == MOST_HALVINGS:
                raise StudyError(
                    f"polynomials of degree {DEGREE} miss the course by {miss:.3g} {course.unit} "
                    f"near {a:.6g} s; allow a larger error with --error"
                )
            middle = (a + b) / 2
            waiting += [(middle, b, halvings + 1), (a, middle, halvings + 1)]
            continue
        edges.append(b)
        rows.append(scaled / (b - a) ** np.arange(DEGREE + 1))
        worst = max(worst, float(miss))
    return Segments(np.array(edges), np.array(rows), course.unit, worst)


def write_segments(segments: Segments, about: Mapping[str, str]) -> str:
    """JSON: edges and coefficients, with what they mean."""
    content = {
        "about": dict(about),
        "meaning": "position = sum of coefficients[k][i] * (t - edges[k])^i "
        "for edges[k] <= t <= edges[k + 1]",
        "unit": segments.unit,
        "error": segments.error,
        "edges": segments.edges.tolist(),
        "coefficients": segments.coefficients.tolist(),
    }
    return json.dumps(content, indent=1) + "\n"


def read_segments(text: str) -> Segments:
    """Read what `write_segments` wrote."""
    content = json.loads(text)
    return Segments(
        np.array(content["edges"]),
        np.array(content["coefficients"]),
        content["unit"],
        content["error"],
    )
