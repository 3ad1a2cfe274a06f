"""What is to happen to each interval of a phase: whether it is cut, and which degree it gets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocp.arrays import Flags, Integers
from ocp.estimates.error_estimate import PhaseErrors
from ocp.mesh.mesh import PhaseMesh
from ocp.optimality.costate_errors import PARTS

# times the tolerance on the dynamics, beyond which an interval is cut in four and not in two
_FAR = 1e4
# Parts into which an interval is cut at once at most: what a coarse interval tells of its controls
# is not worth more.
_MOST_PARTS = 3
# Parts of an interval from which on its control is not smooth, but turns quickly or jumps. There a
# polynomial of a higher degree swings, and its swings exceed limits. Few points cannot tell.
_TURNS = 2.0
_TELLING_DEGREE = 4
# An interval that keeps this part of its width beside a new bracket still stands for itself.
WHOLE = 0.8
# of the phase: narrower intervals are not cut for their controls or constraints
_NARROWEST = 1e-7
# Of its end: narrower intervals are not cut for their dynamics either, because their breakpoints
# would be rounded. Stiff kinetics of hours begin within microseconds.
_ROUNDED = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Marks:
    """What is to happen to each interval of a mesh, (N,) each.

    Attributes
    ----------
    split : whether it is cut.
    parts : into how many it is cut then.
    forced : whether it is cut whatever the breakpoints do: for its dynamics, because it holds
        enough added points, because it is too long for a constraint, or because a breakpoint beside
        it has missed its switch.
    far : whether it is cut in four for its dynamics.
    at_end : whether it is cut for its control, near its end, in parts that get narrower.
    degrees : to which its degree is raised.
    """

    split: Flags
    parts: Integers
    forced: Flags
    far: Flags
    at_end: Flags
    degrees: Integers

    @classmethod
    def of(
        cls,
        mesh: PhaseMesh,
        errors: PhaseErrors,
        *,
        tolerance: float,
        highest: int,
        least_gain: float,
        missed: float,
        halve: bool,
        on_its_way: Flags,
    ) -> Marks:
        """Marks from the errors; degrees are not raised above `highest`.

        Their errors tell into how many parts intervals are to be cut, as if controls were smooth;
        with `halve` that is two. An interval that gains more than `missed` beside a breakpoint that
        came to rest holds a switch that the breakpoint has missed. Intervals at whose end a
        breakpoint is `on_its_way` (N,) are not cut, whatever their errors.
        """
        ratio = errors.dynamics / tolerance
        degrees = mesh.degrees.astype(float)

        # the error falls by about the degree with every point more
        wanted = np.ceil(degrees + np.log(np.maximum(ratio, 1.0)) / np.log(degrees + 1.0))
        turns = (errors.parts > _TURNS) & (mesh.degrees >= _TELLING_DEGREE)
        too_high = (wanted > highest) | turns
        inexact = (ratio > 1.0) & too_high
        forced = errors.crowded | errors.coarse
        forced |= (errors.gain >= least_gain) & (errors.gain > missed)
        raised = np.where((ratio > 1.0) & ~too_high, wanted, degrees).astype(np.int64)

        # a cut there would be one more place for the breakpoint to stop at
        inexact, forced = inexact & ~on_its_way, forced & ~on_its_way
        width = np.diff(mesh.breakpoints)
        wide, inexact = width > _NARROWEST, inexact & (width > _ROUNDED * mesh.breakpoints[1:])
        return cls(
            split=inexact | ((forced | (errors.gain >= least_gain)) & wide),
            parts=np.full(mesh.intervals, 2) if halve else _parts(errors, least_gain),
            forced=inexact | (forced & wide),
            far=inexact & (ratio > _FAR),
            at_end=~inexact & errors.at_end & (errors.gain >= least_gain),
            degrees=raised,
        )

    def refine(self, mesh: PhaseMesh, base: PhaseMesh, most_intervals: int) -> PhaseMesh:
        """Cut and raise the intervals of a mesh; those that a bracket replaced are left alone.

        The marks are those of `base`; `mesh` is the same with brackets around jumps.
        """
        if not (self.split.any() or np.any(self.degrees != base.degrees)):
            return mesh
        points, width = mesh.breakpoints, np.diff(mesh.breakpoints)
        middle = 0.5 * (points[:-1] + points[1:])
        parent = np.searchsorted(base.breakpoints, middle) - 1
        parent = np.clip(parent, 0, base.intervals - 1)

        old = np.isin(points, base.breakpoints, assume_unique=True)
        whole = width >= WHOLE * np.diff(base.breakpoints)[parent]
        untouched = (old[:-1] & old[1:]) | (whole & (old[:-1] | old[1:]))

        # beside a breakpoint that has not moved yet only what has to be cut
        split = self.split[parent] & untouched & ~(_beside_new(mesh, base) & ~self.forced[parent])
        if mesh.intervals + 3 * split.sum() > most_intervals:
            split[:] = False
        parts = np.where(self.far[parent], 4, self.parts[parent])

        shares = [
            PARTS[1:-1] if at_end else np.arange(1, count) / count
            for at_end, count in zip(self.at_end[parent], parts, strict=True)
        ]
        cuts = [points[k] + width[k] * shares[k] for k in np.flatnonzero(split)]
        refined = np.sort(np.concatenate([points, *cuts]))
        parents = np.searchsorted(points, refined[:-1], side="right") - 1
        degrees = np.where(untouched, self.degrees[parent], mesh.degrees)[parents]
        movable = tuple(int(np.searchsorted(refined, points[i])) for i in mesh.movable)
        return PhaseMesh(refined, degrees, movable)


def _beside_new(mesh: PhaseMesh, base: PhaseMesh) -> Flags:
    """Intervals of a mesh that begin or end at a movable breakpoint that `base` lacks, (N,)."""
    new = np.zeros(mesh.intervals + 1, dtype=bool)
    movable = list(mesh.movable)
    new[movable] = ~np.isin(mesh.breakpoints[movable], base.breakpoints, assume_unique=True)
    return new[:-1] | new[1:]


def _parts(errors: PhaseErrors, least_gain: float) -> Integers:
    """Into how many parts intervals are cut: until controls are smooth, and what is gained little.

    What other breakpoints gain along an arc falls with the cube of the width, and what finer
    controls gain elsewhere falls faster.
    """
    wanted = np.maximum(errors.parts, np.cbrt(errors.gain / least_gain))
    return np.clip(np.ceil(wanted), 2, _MOST_PARTS).astype(np.int64)
