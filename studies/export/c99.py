"""Polynomial segments as C99: a table and Horner's form, without allocation or library calls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.common.headers import cell, comments
from studies.drive.course import Course
from studies.export.polynomials import Segments
from studies.export.templates import compiled

_DIGITS = {"double": 17, "float": 9}  # with which each number comes back
_SUFFIX = {"double": "", "float": "f"}
CHECKS = 100_001  # times at which the code is held against its course: its rounding is noise


def write_source(segments: Segments, about: Mapping[str, str], real: str) -> str:
    """One C file, whose prototype stands at its start.

    Parameters
    ----------
    real : "double" or "float".
    """
    return compiled("_c99.j2").render(
        header=lambda opening: "\n".join(comments(about, opening)),
        segments=segments.edges.size - 1,
        terms=segments.coefficients.shape[1],
        real=real,
        unit=cell(segments.unit),
        edges=[_literal(edge, real) for edge in segments.edges.tolist()],
        coefficients=[
            [_literal(value, real) for value in row] for row in segments.coefficients.tolist()
        ],
        zero=_literal(0.0, real),
        two=_literal(2.0, real),
    )


def in_float(segments: Segments, time: Array) -> Array:
    """Position, velocity and acceleration as the code with `float` computes them, (3, m).

    Numbers, times and each operation are rounded to 24 bits in the order of the code.
    """
    single = np.float32
    edges, coefficients = _as_written(segments.edges), _as_written(segments.coefficients)
    at = np.clip(time.astype(single), edges[0], edges[-1])
    piece = np.searchsorted(edges[1:-1], at, side="right")

    dt = at - edges[piece]
    x, v, a = (np.zeros(at.size, single) for _ in range(3))
    for column in coefficients.T[::-1]:
        a = a * dt + single(2.0) * v
        v = v * dt + x
        x = x * dt + column[piece]
    return np.stack([x, v, a]).astype(float)


def _as_written(values: Array) -> Any:
    """The numbers of type float that a compiler reads out of the literals."""
    texts = [_literal(value, "float").rstrip("f") for value in values.ravel().tolist()]
    return np.array(texts).astype(np.float32).reshape(values.shape)


def float_course(segments: Segments, course: Course) -> Course:
    """The course that the code with `float` gives, with the jerk of the polynomials."""
    jerk = segments.curve().derivative(3)
    return Course(
        course.signal,
        course.unit,
        course.duration,
        course.switches,
        lambda time: np.concatenate([in_float(segments, time), jerk(time)[None]]),
        course.note,
    )


def float_error(segments: Segments, course: Course) -> float:
    """The largest difference of the code with `float` from a course, its rounded times included."""
    time = np.linspace(0.0, course.duration, CHECKS)
    return float(np.abs(in_float(segments, time)[0] - course.derivatives(time)[0]).max())


def _literal(value: float, real: str) -> str:
    """A number of C of that type, which comes back as it was."""
    text = f"{value:.{_DIGITS[real]}g}"
    if not any(mark in text for mark in ".e"):
        text += ".0"
    return text + _SUFFIX[real]
