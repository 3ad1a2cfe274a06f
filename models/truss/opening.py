"""Between which angles the ring moves, and how fast it turns at first.

That is the motion's, and not the mechanism's: a ring that stalled half-open goes on from there, one
that tipped off its latches is under way already, and a test may end before the ring is open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from models.errors import require
from models.truss.parameters import TrussParameters


@dataclass(frozen=True)
class Opening:
    """A motion of the ring that comes to rest at its end.

    Attributes
    ----------
    start, end : angles between a vertical bar and its cross-bars [rad]; 90 deg is open.
    rate : angular speed at the start [rad/s].

    Raises
    ------
    ModelError
        If the angles do not rise within (0, 90] deg, or the rate is negative or not finite.
    """

    start: float
    end: float = math.pi / 2
    rate: float = 0.0

    def __post_init__(self) -> None:
        require(
            0 < self.start < self.end <= math.pi / 2,
            f"the ring moves from {math.degrees(self.start):g} to {math.degrees(self.end):g} deg; "
            "give angles that rise, above 0 and up to 90 deg.",
        )
        require(
            0 <= self.rate < math.inf,
            f"the ring starts at {math.degrees(self.rate):g} deg/s; give a finite rate from 0 on.",
        )

    @property
    def stroke(self) -> float:
        """D [rad]."""
        return self.end - self.start


def whole_opening(parameters: TrussParameters) -> Opening:
    """From rest where the ring is stowed to rest where it is open."""
    return Opening(parameters.stowed_angle)
