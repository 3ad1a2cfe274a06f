"""Sizes that are far more than a motion has, such as those of limits of plus and minus 1e6.

Tolerances are parts of sizes. A motion of a metre is nothing next to a size of 1e6 m, and so is
what it is off by. A solve takes sizes from the motion then (`ocp.refinement.mesh_solver`). Where it
could not, as on a mesh that is solved once, what was checked says nothing, and that is told. So it
is where such a size was stated, as in another unit, of a state that is given an end value.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ocp.mesh.initial_guess import initial_guess
from ocp.optimality.iterate import Iterate
from ocp.problem.display import with_unit
from ocp.transcription.scaling import may_be_roomy, roomy, scales_of, stated_beyond


@dataclass(frozen=True)
class RoomySize:
    """A size of a signal that is far more than the motion has.

    Attributes
    ----------
    signal, unit, reason : str
        The reason is where the size comes from, in words.
    size, of_motion : float
        What was taken, and what the motion says [unit].
    """

    signal: str
    unit: str
    reason: str
    size: float
    of_motion: float

    @property
    def sentence(self) -> str:
        """What is wrong, and the remedy."""
        taken, has = (with_unit(f"{v:.3g}", self.unit) for v in (self.size, self.of_motion))
        return (
            f"the size of '{self.signal}' was taken to be {taken} ({self.reason}), and the motion "
            f"has {has}: what was found and checked is exact to parts of that size only; state "
            f"a scale= of '{self.signal}' that is nearer, or such limits"
        )


def roomy_sizes(iterate: Iterate) -> Iterator[RoomySize]:
    """Sizes of signals that are far more than the motion of an iterate has."""
    problem, scales = iterate.problem, iterate.scales
    motion = initial_guess(problem, iterate.parameters, iterate.trajectory)
    found = stated_beyond(scales, motion, problem, iterate.parameters)
    if may_be_roomy(scales, motion):
        of_motion = scales_of(problem, motion, iterate.parameters)
        found |= {name: of_motion.signals[name] for name in roomy(scales, of_motion)}

    units = {signal.name: signal.unit for own in problem.signals.values() for signal in own}
    for name, value in found.items():
        reason = scales.reasons.get(("signal", name), "")
        yield RoomySize(name, units[name], reason, scales.signals[name], value)
