"""Parallel projection of points in space to a picture, and the depth at which they lie."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.common.scene.moving_picture import MovingPicture


@dataclass(frozen=True)
class View:
    """From where one looks: turned about the vertical, then from above [deg]."""

    azimuth: float = 30.0
    elevation: float = 28.0

    @classmethod
    def flat(cls) -> View:
        """Straight onto the plane x, y."""
        return cls(0.0, 90.0)


@dataclass(frozen=True, eq=False)
class PictureFrame:
    """Room that a motion needs in a picture, and the middle of it (2,), all in [m]."""

    width: float
    height: float
    middle: Array


def project(points: Array, view: View) -> Array:
    """Right, up and towards the eye (p, 3) of points (p, 3) [m]."""
    turn, rise = math.radians(view.azimuth), math.radians(view.elevation)
    x, y, z = points.T
    right = x * math.cos(turn) - y * math.sin(turn)
    back = x * math.sin(turn) + y * math.cos(turn)
    up = back * math.sin(rise) + z * math.cos(rise)
    near = -back * math.cos(rise) + z * math.sin(rise)
    return np.stack([right, up, near], axis=1)


def outline(picture: MovingPicture, view: View, instants: int = 9) -> PictureFrame:
    """The frame that holds the picture at all times."""
    places = np.linspace(picture.parameter[0], picture.parameter[-1], instants)
    used = np.unique(np.concatenate([strand.pairs.ravel() for strand in picture.strands]))
    corners = []
    for value in places:
        points = project(picture.points(float(value)), view)
        origin = points[picture.centre] if picture.centre >= 0 else np.zeros(3)
        flat = (points[used] - origin)[:, :2]
        corners += [flat.min(axis=0), flat.max(axis=0)]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    if picture.centre >= 0:  # as much to either side
        reach = np.maximum(np.abs(low), np.abs(high))
        low, high = -reach, reach
    width, height = high - low
    return PictureFrame(float(max(width, 1e-9)), float(max(height, 1e-9)), (low + high) / 2)
