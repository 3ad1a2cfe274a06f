"""What the mechanism feels of the rounding of a table, through a rope that yields.

Rounded positions move the motor's end of the rope by some micrometres, e, behind the position loop.
Near the stowed angle the rope has hardly a lever, so that its end is as heavy as tonnes: a rope
that cannot stretch would pull and push with tens of newtons. A rope of the stiffness k makes a
low-pass of it. With the pull F at the motor, the tension c F that stretches the rope and the mass
m = dF / d(rope acceleration), the mechanism's end of the rope moves by d, and the pull changes by
m d'':

    m d'' = (k / c) (e - d)  less a small damping

Both m and c follow from the angle. So each piece of time has a natural frequency of its own.
"""

from __future__ import annotations

import numpy as np

from models.truss import TrussParameters, angle_from_rope_length, rope_length
from ocp.arrays import Array
from studies.drive.course import rope_slopes
from studies.drive.loop import followed_in_pieces
from studies.drive.playback import Playback, along
from studies.drive.schema import Drive

STEEL_ROPE = 6e5  # N: stiffness of a steel rope of 3 mm, 5 mm^2 at 120 GPa, times its length
DAMPING = 0.05  # of the truss on its rope: pulleys and joints rub
CUBIC = 0.125  # of the loop's time constant 1/w: a cubic over it has the acceleration to 1 %
MOST = 1_000_000  # pieces of time


def stiffness_of(drive: Drive, truss: TrussParameters) -> float:
    """Of one rope [N/m]: as stated, else that of a steel rope of 3 mm, stiffer than most."""
    return drive.rope_stiffness or STEEL_ROPE / float(rope_length(truss, truss.stowed_angle))


def felt(
    output: Playback, exact: Playback, times: Array, truss: TrussParameters, drive: Drive
) -> Array:
    """What the mechanism's end of the rope does because of rounding, (4, n) at `output.time`.

    Parameters
    ----------
    output, exact : the rope after the loop, of the rounded table and of the same without rounding.
    times : of the table (m,) [s].
    """
    edges = times
    if drive.natural_frequency is not None:  # behind a loop nothing is faster than the loop
        last = float(output.time[-1])
        pieces = int(min(np.ceil(last * drive.natural_frequency / CUBIC), MOST))
        edges = np.linspace(0.0, last, pieces + 1)
    rounding = output.at(edges)[:2] - exact.at(edges)[:2]

    frequency = _frequencies(exact, edges, truss, drive)
    rows = followed_in_pieces(_cubics(edges, *rounding), edges, frequency, DAMPING)
    return rows.derivatives(output.time)


def _cubics(edges: Array, values: Array, slopes: Array) -> Array:
    """Coefficients of the cubic through values and slopes, constant first, (4, pieces)."""
    from scipy.interpolate import CubicHermiteSpline

    coefficients: Array = CubicHermiteSpline(edges, values, slopes).c[::-1]
    return coefficients


def _frequencies(exact: Playback, edges: Array, truss: TrussParameters, drive: Drive) -> Array:
    """Natural frequency of the truss on its rope in each piece (pieces,) [rad/s]."""
    stowed = float(rope_length(truss, truss.stowed_angle))
    wound = exact.at((edges[1:] + edges[:-1]) / 2)[0]
    angle = angle_from_rope_length(truss, stowed - wound)
    row, (slope, _) = along(truss, angle), rope_slopes(truss, angle)
    ratio = 1.0 if drive.rope_yields == "at the motor" else row[5]
    frequency: Array = np.sqrt(stiffness_of(drive, truss) * -slope / (row[3] * ratio))
    return frequency
