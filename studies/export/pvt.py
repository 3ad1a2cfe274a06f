"""Tables of position, velocity and time, between which the controller goes by a cubic polynomial.

Three forms: a plain one, the file of a Newport XPS, and the commands of a Galil controller. The
manuals are named in docs/reference/export-formats.md.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.common.headers import comments
from studies.drive.setpoints import SetPoints

GALIL_SEGMENTS = 255  # that the buffer of one axis holds
GALIL_SAMPLE = 1 / 1024  # [s] at the default setting of the sample period
GALIL_AXES = "ABCDEFGH"
_GALIL = re.compile(r"^PV([A-H])=(-?\d+),(-?\d+),(\d+)$")


def write_plain(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """Columns time, position, velocity; comments with # above."""
    lines, unit = comments(about), about["unit"]
    heads = [f"position{k} [{unit}],velocity{k} [{unit}/s]" for k in _numbers(axes)]
    lines.append(",".join(["time [s]", *heads]))
    for t, x, v in _rows(points):
        lines.append(",".join([_digits(t), *[f"{_digits(x)},{_digits(v)}"] * axes]))
    return "\n".join(lines) + "\n"


def read_plain(text: str, count: float | None) -> SetPoints:
    """Read what `write_plain` wrote; of several axes the first one."""
    lines = [line for line in text.splitlines() if not line.startswith("#")][1:]
    table = np.array([[float(cell) for cell in line.split(",")[:3]] for line in lines])
    return _points(table[:, 0], table[:, 1], table[:, 2], count)


def write_newport(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """Lines of a duration, and for each axis a displacement and the velocity at its end."""
    steps, moves = np.diff(points.times), np.diff(points.positions)
    lines = [
        ", ".join([_digits(dt), *[f"{_digits(dx)}, {_digits(v)}"] * axes])
        for dt, dx, v in zip(steps, moves, points.velocities[1:], strict=True)
    ]
    return "\n".join(lines) + "\n"


def read_newport(text: str, count: float | None) -> SetPoints:
    """Read what `write_newport` wrote, added up; of several axes the first one."""
    table = np.array([[float(cell) for cell in line.split(",")[:3]] for line in text.splitlines()])
    return _points(_summed(table[:, 0]), _summed(table[:, 1]), _led(table[:, 2]), count)


def write_galil(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """Commands PV of counts, counts a second and samples, and BT, which begins the motion.

    Raises
    ------
    StudyError
        If the times do not lie on the controller's samples.
    """
    samples = np.rint(points.times / GALIL_SAMPLE)
    if np.abs(samples * GALIL_SAMPLE - points.times).max() > 1e-9:
        raise StudyError("the times do not lie on samples of 1/1024 s, in which this format counts")

    moves = np.diff(points.counts)
    velocities = np.rint(points.velocities / (points.count or 1.0)).astype(np.int64)
    names = GALIL_AXES[:axes]
    lines = [
        f"PV{name}={move},{velocity},{int(span)}"
        for move, velocity, span in zip(moves, velocities[1:], np.diff(samples), strict=True)
        for name in names
    ]
    # a segment of no time ends the mode
    lines += [f"PV{name}=0,0,0" for name in names]
    return "\n".join([*lines, f"BT {names}"]) + "\n"


def read_galil(text: str, count: float | None) -> SetPoints:
    """Read what `write_galil` wrote; of several axes the first one.

    Raises
    ------
    StudyError
        If there is no count.
    """
    if count is None:
        raise StudyError("commands in counts need drive.counts to be read")
    rows = [match.groups() for line in text.splitlines() if (match := _GALIL.match(line))]
    table = np.array(
        [[int(cell) for cell in row[1:]] for row in rows if row[0] == "A" and row[3] != "0"]
    )
    times = GALIL_SAMPLE * _summed(table[:, 2])
    velocities = count * _led(table[:, 1])
    return _points(times, count * _summed(table[:, 0]), velocities, count, velocity_step=count)


def rounded_velocities(points: SetPoints) -> SetPoints:
    """The same with velocities in whole counts a second, as Galil's commands have them."""
    count = points.count or 1.0
    velocities = count * np.rint(points.velocities / count)
    return SetPoints(
        points.times, points.positions, velocities, points.accelerations, points.count, count
    )


def _numbers(axes: int) -> Sequence[str]:
    return [""] if axes == 1 else [f" {k + 1}" for k in range(axes)]


def _rows(points: SetPoints) -> list[tuple[float, float, float]]:
    columns = (points.times, points.positions, points.velocities)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _digits(value: float) -> str:
    """Fifteen digits: every count comes back, and rounding of the last bit does not show."""
    return f"{value + 0.0:.15g}"  # -0 is 0


def _summed(steps: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(steps, dtype=float)])


def _led(values: Array) -> Array:
    """With the rest before the first one."""
    return np.concatenate([[0.0], values.astype(float)])


def _points(
    times: Array,
    positions: Array,
    velocities: Array,
    count: float | None,
    velocity_step: float = 0.0,
) -> SetPoints:
    still = np.zeros_like(times)
    return SetPoints(times, positions, velocities, still, count, velocity_step)
