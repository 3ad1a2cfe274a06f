"""Bulges of the links in B21: tied so that the first mode is that of a model that keeps them.

The cubic shape of a link neglects that its own mass bends it. In the first mode of the folded arm
that makes the frequency 2.7e-3 too high, a third of a period within the stage's 11 s. The bulge of
a link is therefore tied to its other shapes as it goes with them in the first modes of B32, at
several poses of a stage: no state is added, and no fast mode.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from models.arm.reduced import COORDINATES, ReducedArm
from models.arm.reduced_simulation import reduced_modes


def tied_to_first_modes(model: ReducedArm, poses: Sequence[tuple[float, float]]) -> ReducedArm:
    """B21 of the same arm and locks, its bulges tied by the first modes at some poses.

    The ties are the least squares over the poses, each mode of unit strain energy.

    Parameters
    ----------
    model : ReducedArm
        Of any variant.
    poses : sequence of (root, elbow)
        Joint angles [rad].
    """
    finer = dataclasses.replace(model, variant="B32")
    shapes = []
    for pose in poses:
        q = finer.at(*pose)
        _, vectors = reduced_modes(finer, q)
        first = vectors[:, 0]
        stiffness = finer.linear(q)[1].full()
        modes = dict(
            zip(finer.coordinates, first / np.sqrt(first @ stiffness @ first), strict=True)
        )
        shapes.append([modes.get(name, 0.0) for name in COORDINATES])

    # of each coordinate over the poses, (k,)
    shape = dict(zip(COORDINATES, np.array(shapes).T, strict=True))
    others = np.stack([shape["delta1"], shape["psi1"]], axis=1)
    big = np.linalg.lstsq(others, shape["beta1"], rcond=1e-6)[0]
    small = np.linalg.lstsq(shape["delta2"][:, None], shape["beta2"], rcond=1e-6)[0]
    return dataclasses.replace(
        model, variant="B21", ties=(float(big[0]), float(big[1]), float(small[0]))
    )
