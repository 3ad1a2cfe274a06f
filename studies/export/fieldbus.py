"""Cyclic set-points of a fieldbus drive: the target position in increments, one a cycle.

Object 607Ah of a drive of the profile CiA 402 in the mode "cyclic synchronous position" is a signed
number of 32 bits. The manual is named in docs/reference/export-formats.md.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.common.headers import comments
from studies.drive.setpoints import SetPoints

LARGEST = 2**31 - 1  # of a signed number of 32 bits


def write_ethercat(points: SetPoints, about: Mapping[str, str], axes: int) -> str:
    """A line a cycle with the target position in increments; comments with # above.

    Raises
    ------
    StudyError
        If there is nothing to count with, or a position needs more than 32 bits.
    """
    counts = points.counts
    largest = int(np.abs(counts).max())
    if largest > LARGEST:
        raise StudyError(
            f"the travel has {largest} counts, but a target position holds {LARGEST}; "
            "state fewer counts a turn"
        )
    lines = comments(about)
    cycle_us = 1e6 * float(points.times[1])
    lines += [f"# cycle_us = {cycle_us:.15g}", ",".join(["target_position_607A"] * axes)]
    lines += [",".join([str(target)] * axes) for target in counts.tolist()]
    return "\n".join(lines) + "\n"


def read_ethercat(text: str, count: float | None) -> SetPoints:
    """Read what `write_ethercat` wrote; of several axes the first one.

    Raises
    ------
    StudyError
        If there is no count.
    """
    if count is None:
        raise StudyError("targets in counts need drive.counts to be read")
    lines = text.splitlines()
    cycle = next(line for line in lines if line.startswith("# cycle_us = "))
    rows = [line for line in lines if not line.startswith("#")][1:]
    counts = np.array([int(row.split(",")[0]) for row in rows])

    times: Array = float(cycle.split("=")[1]) * 1e-6 * np.arange(counts.size, dtype=float)
    still = np.zeros_like(times)
    return SetPoints(times, count * counts, still, still, count)
