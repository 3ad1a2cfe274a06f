"""What an arm may differ in from the one a motion was made for.

Factors (x, y) of a spread turn into (big stiffness, small stiffness, tip mass) by the drive:
under torque drive the bending stiffness of each link is off on its own; under angle drive that of
both links together, and the tip mass.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.arm.replay.full_model import Drive
from studies.arm.replay.reduced_model import Factors

WIDTH = 0.1


@dataclass(frozen=True)
class Spread:
    """Factors from 1 - WIDTH to 1 + WIDTH on two axes.

    Attributes
    ----------
    drive : Drive
    axes : what the two factors are on.
    design : (x, y) of the copies that a motion is made for, none of them on a grid.
    """

    drive: Drive
    axes: tuple[str, str]
    design: tuple[tuple[float, float], ...]

    def factors(self, x: float, y: float) -> Factors:
        """(Big stiffness, small stiffness, tip mass) of a point."""
        return (x, y, 1.0) if self.drive == "torque" else (x, x, y)

    def drawn(self, draws: int, seed: int) -> list[Factors]:
        """Points drawn evenly from the square."""
        generator = np.random.default_rng(seed)
        points = generator.uniform(1.0 - WIDTH, 1.0 + WIDTH, (draws, 2))
        return [self.factors(float(x), float(y)) for x, y in points]

    def grid(self, points: int) -> list[Factors]:
        """All points of a square grid with that many a side."""
        side = np.linspace(1.0 - WIDTH, 1.0 + WIDTH, points)
        return [self.factors(float(x), float(y)) for x in side for y in side]


# stiffness turns the fast mode's phase much: many copies, along the diagonal
_STIFFNESSES = (0.902, 0.941, 0.981, 1.019, 1.059, 1.098)
# stiff with a light tip, or soft with a heavy one: the frequency is off most
_OFF_NOMINAL = (-0.098, -0.045, 0.045, 0.098)

SPREADS: dict[Drive, Spread] = {
    "torque": Spread(
        drive="torque",
        axes=("big stiffness", "small stiffness"),
        design=tuple((k, k) for k in _STIFFNESSES),
    ),
    "angle": Spread(
        drive="angle",
        axes=("stiffness", "tip mass"),
        design=tuple((1.0 + d, 1.0 - d) for d in _OFF_NOMINAL),
    ),
}
