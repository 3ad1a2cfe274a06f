"""Where a motion crosses kinks of its dynamics and integrands, such as the face of a soft stop.

No polynomial follows a kink inside an interval: its errors fall slowly, and the costates beside it
are off. A breakpoint at the crossing makes both sides smooth.

Kinks count whose place depends on states, and may depend on time, too. Where a control crosses its
own kink it jumps or rests there, which is found elsewhere (`switch_detection`). Motions that stay
on a kink, or touch it without going through, have no crossing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.problem.kinks import crossable_kinks

# Of the phase: how far a breakpoint may be from its crossing. The Hamiltonian differs on its sides
# by the same part of what the kink changes over the phase. Before digits are asked for, a crossing
# is known less well.
NEAR = 1e-8
NEAR_WHILE_LOOSE = 1e-6

# Sections of an interval between which a change of sign is looked for, and then again within the
# section that has it, to rounding
_SECTIONS, _DIVISIONS = 8, 16

# A motion goes through a kink if the distance from it changes so fast that it would take no more
# than so many times the phase to go as far as it ever is from the kink.
_SLOW = 100.0

# Of an interval: how far on both sides of a crossing its speed is measured
_BESIDE = 1e-4

# Of the phase: a crossing this close to a step is that step.
_SAME = 1e-7

# Of the largest distance from a kink: a motion this far on the other side is there.
_BEYOND = 1e-5


@dataclass(frozen=True, eq=False, repr=False)
class KinkCrossings:
    """Where the motion of a phase goes through kinks.

    Attributes
    ----------
    places : (m,)
        Fractions of the phase, in order.
    surfaces : (m,)
        Numbers of the kinks, see `ocp.problem.kinks.crossable_kinks`.
    behind : (m,)
        The side of the kink behind the crossing, 1 or -1.
    off : (m,)
        Distances from the nearest breakpoint, as fractions of the phase.
    kinks : int
        How many kinks there are.
    left : (N,)
        Intervals of a mesh with given sides in which the motion is on another one.
    given : bool
        Whether the mesh gives sides at all.
    """

    places: Array
    surfaces: Integers
    behind: Integers
    off: Array
    kinks: int
    left: Flags
    given: bool = False

    @property
    def count(self) -> int:
        """How many crossings there are."""
        return self.places.size

    @property
    def farthest(self) -> float:
        """The largest of these distances; 0 where there is no crossing."""
        return float(self.off.max(initial=0.0))

    def each(self) -> Iterator[tuple[float, int, int]]:
        """Place, number of the kink and side behind of each crossing."""
        yield from zip(
            self.places.tolist(), self.surfaces.tolist(), self.behind.tolist(), strict=True
        )

    def none(self) -> KinkCrossings:
        """The same without crossings."""
        return self.some(np.zeros(self.count, dtype=bool))

    def some(self, wanted: Flags | Integers) -> KinkCrossings:
        """Some of them, by flags (m,) or by their numbers."""
        kept = self.places[wanted], self.surfaces[wanted], self.behind[wanted], self.off[wanted]
        return KinkCrossings(*kept, self.kinks, self.left, self.given)


def no_crossings(intervals: int, kinks: int = 0) -> KinkCrossings:
    """None in a mesh of so many intervals."""
    nothing = np.empty(0, dtype=np.int64)
    left = np.zeros(intervals, dtype=bool)
    return KinkCrossings(np.empty(0), nothing, nothing, np.empty(0), kinks, left)


def kink_crossings(
    trajectory: Trajectory, evaluator: Evaluator, name: str, sides: Integers | None = None
) -> KinkCrossings:
    """The crossings of the motion of a phase.

    Parameters
    ----------
    name : str
        Of the phase.
    sides : (N, k), optional
        Those that its mesh gave, see `PhaseMesh.sides`.
    """
    motion = trajectory.phase(name)
    # where expressions jump no side of a kink can be given
    surfaces = (
        ()
        if evaluator.problem.is_discontinuous
        else crossable_kinks(evaluator.problem, name).values
    )
    none = no_crossings(motion.intervals, len(surfaces))
    if not surfaces or not motion.end > motion.start:
        return none

    shares = np.linspace(0.0, 1.0, _SECTIONS + 1)
    everywhere = np.repeat(np.arange(motion.intervals), shares.size)
    found = evaluator.values(
        trajectory, name, surfaces, everywhere, np.tile(shares, motion.intervals)
    )
    if not np.isfinite(found).all():
        return none
    found = found.reshape(motion.intervals, shares.size, -1)
    farthest = np.abs(found).max(axis=(0, 1))
    left = none.left
    if sides is not None:
        left = (found * sides[:, None, :] < -_BEYOND * farthest).any(axis=(1, 2))

    # a change between two samples is enclosed by ever shorter sections
    k, section, number = np.nonzero((found[:, 1:] > 0) != (found[:, :-1] > 0))
    if not k.size:
        return replace(none, left=left, given=sides is not None)

    def at(tau: Array) -> Array:
        """The own surface of each crossing at local times, (m,) or (m, s)."""
        count = tau.size // k.size
        values = evaluator.values(trajectory, name, surfaces, np.repeat(k, count), tau.ravel())
        return values[np.arange(tau.size), np.repeat(number, count)].reshape(tau.shape)

    low, high = shares[section], shares[section + 1]
    above, each = found[k, section, number] > 0, np.arange(k.size)
    for _ in range(_DIVISIONS):
        ends = low[:, None] + shares * (high - low)[:, None]
        other = (at(ends[:, 1:]) > 0) != above[:, None]
        other[:, -1] = True
        first = np.argmax(other, axis=1)
        low, high = ends[each, first], ends[each, first + 1]

    # through the kink, and not along it
    before, after = np.maximum(low - _BESIDE, 0.0), np.minimum(high + _BESIDE, 1.0)
    width = np.diff(motion.fractions)[k]
    through = np.abs(at(after) - at(before)) * _SLOW >= farthest[number] * (after - before) * width

    places = motion.fractions[k] + 0.5 * (low + high) * width
    inside = (places > _SAME) & (places < 1.0 - _SAME)
    off = np.abs(places[:, None] - motion.fractions).min(axis=1)
    crossings = KinkCrossings(
        places, number, np.where(above, -1, 1), off, none.kinks, left, sides is not None
    )
    order = np.argsort(places, kind="stable")
    return crossings.some(order[(through & inside)[order]])
