"""Sizes that are far more than a motion has, such as those of limits of plus and minus 1e6.

Tolerances are parts of sizes. A motion of a metre is nothing next to a size of 1e6 m, and so is
what it is off by. A solve takes sizes from the motion then (`ocp.refinement.mesh_solver`). Where it
could not, as on a mesh that is solved once, what was checked says nothing, and that is told. So it
is where such a size was stated, as in another unit: of a signal, or of the objective.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ocp.mesh.initial_guess import initial_guess
from ocp.optimality.iterate import Iterate
from ocp.problem.display import with_unit
from ocp.scaling.automatic import scales_of, variation_of_objective
from ocp.scaling.far_sizes import (
    ROOMY,
    far_below_limits,
    far_below_stated,
    of_the_motion,
    roomy,
    stated_roomy,
)
from ocp.scaling.scales import Scales


@dataclass(frozen=True)
class RoomySize:
    """A size that is far more than the motion has.

    Attributes
    ----------
    what, unit, reason : str
        What has this size: a signal or unknown in quotation marks, or the objective. The reason is
        where the size comes from, in words.
    size, of_motion : float
        What was taken, and what the motion says [unit].
    remedy : str
        In words.
    """

    what: str
    unit: str
    reason: str
    size: float
    of_motion: float
    remedy: str

    @property
    def sentence(self) -> str:
        """What is wrong, and the remedy."""
        taken, has = (with_unit(f"{v:.3g}", self.unit) for v in (self.size, self.of_motion))
        return (
            f"the size of {self.what} was taken to be {taken} ({self.reason}), and the motion "
            f"has {has}: what was found and checked is exact to parts of that size only; "
            f"{self.remedy}"
        )


def roomy_sizes(iterate: Iterate) -> Iterator[RoomySize]:
    """Sizes that are far more than the motion of an iterate has: of signals, unknowns, objective.

    That of the objective is looked at where a size was stated. Others follow what was found.
    """
    problem, scales = iterate.problem, iterate.scales
    motion = initial_guess(problem, iterate.parameters, iterate.trajectory)
    stated = far_below_stated(scales, motion)
    small = far_below_limits(scales, motion) | stated
    whole = scales.objective_is_stated
    if not (small or whole):
        return

    of_motion = scales_of(problem, motion, iterate.parameters, small)
    signals = (signal for own in problem.signals.values() for signal in own)
    units = {symbol.name: symbol.unit for symbol in (*signals, *problem.unknowns)}
    taken, found = scales.symbols, of_motion.symbols
    for name in (*stated_roomy(scales, of_motion), *roomy(scales, of_motion)):
        if of_the_motion(of_motion, name):
            kind = "signal" if name in scales.signals else "unknown"
            yield RoomySize(
                f"'{name}'",
                units[name],
                scales.reasons.get((kind, name), ""),
                taken[name],
                found[name],
                f"state a scale= of '{name}' that is nearer, or such limits",
            )
    if stated or whole:
        yield from _of_the_objective(iterate, of_motion)


def _of_the_objective(iterate: Iterate, of_motion: Scales) -> Iterator[RoomySize]:
    """The size of the objective, where it is far more than its value and its changes."""
    size = iterate.scales.objective
    moves = variation_of_objective(iterate.problem, of_motion, iterate.parameters)
    value = abs(iterate.objective)
    if size > ROOMY * max(value, moves) > 0.0:
        reason = iterate.scales.reasons.get(("objective", ""), "")
        remedy = "state a scale= of the problem that is nearer, or of its signals"
        # the optimum itself may be zero
        yield RoomySize("the objective", "1", reason, size, value or moves, remedy)
