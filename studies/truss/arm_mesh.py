"""Meshes for a ring on its arm, on which the solver follows all modes of the arm but the fastest.

A collocation damps a mode that swings more than once in an interval. The moment at the root then
has a part that only an integration of the arm shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.ring_on_arm import RingOnArm
from ocp import Accuracy, AdaptiveMesh
from ocp.arrays import Array
from ocp.mesh.mesh import ExtraPoints, Mesh, PhaseMesh
from ocp.refinement.solved_mesh import SolvedMesh
from studies.truss.config import DEPLOYED

_THIRD = 2  # of the four modes, by frequency; the last one adds less than 1e-4 of a moment


def period_to_follow(model: RingOnArm) -> float:
    """Period [s] of the arm's third mode, the shorter one of the stowed and the open ring."""
    ends = model.truss.stowed_angle, DEPLOYED
    return 1.0 / max(float(model.frequencies(angle)[_THIRD]) for angle in ends)


@dataclass(frozen=True, kw_only=True, repr=False)
class ArmMesh(AdaptiveMesh):
    """The default policy, with intervals of at most a length from the second mesh on.

    Attributes
    ----------
    longest : interval [s].
    """

    longest: float

    def next_mesh(self, solved: Sequence[SolvedMesh], accuracy: Accuracy) -> Mesh | None:
        """A better mesh, or None if the last one meets all tolerances and is as fine as stated."""
        last, following = solved[-1].iterate, super().next_mesh(solved, accuracy)
        mesh = following or last.mesh
        rows = zip(mesh.phases, mesh.extra, mesh.back_off, last.trajectory.phases, strict=True)
        cut = [
            _cut(phase, extra, back_off, self.longest / (at.end - at.start))
            for phase, extra, back_off, at in rows
        ]
        phases, extras, back_offs = zip(*cut, strict=True)
        finer = Mesh(phases, extras, back_offs)
        return following if finer.intervals == mesh.intervals else finer


def _cut(
    mesh: PhaseMesh,
    extra: Sequence[ExtraPoints],
    back_off: Mapping[int, Array],
    longest: float,
) -> tuple[PhaseMesh, tuple[ExtraPoints, ...], dict[int, Array]]:
    """A phase with equal parts of each interval that is longer than a fraction of the phase.

    Extra points and back-offs stay where they are.
    """
    old, widths = mesh.breakpoints, np.diff(mesh.breakpoints)
    counts = np.ceil(widths / longest * (1 - 1e-9)).astype(int)
    parents = np.repeat(np.arange(mesh.intervals), counts)
    part = np.arange(parents.size) - np.repeat(np.cumsum(counts) - counts, counts)
    points = np.append(old[parents] + widths[parents] * part / counts[parents], 1.0)

    def moved(each: ExtraPoints) -> ExtraPoints:
        places = old[each.intervals] + widths[each.intervals] * each.tau
        own = np.searchsorted(points, places, side="right") - 1
        tau = (places - points[own]) / np.diff(points)[own]
        return ExtraPoints(each.constraint, own, tau)

    cut = PhaseMesh(points, mesh.degrees[parents])
    return cut, tuple(map(moved, extra)), {number: by[parents] for number, by in back_off.items()}
